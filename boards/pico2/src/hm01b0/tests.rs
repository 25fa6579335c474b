use super::*;
use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::{
    delay::NoopDelay,
    i2c::{Mock, Transaction},
};

fn identify(id: u16) -> Transaction {
    Transaction::write_read(ADDRESS, vec![0, 0], id.to_be_bytes().to_vec())
}

fn start(expected: &[Transaction], config: &Config) -> Result<(), Error<ErrorKind>> {
    let mut bus = Mock::new(expected);
    let result = Hm01b0::new(bus.clone()).start(config, &mut NoopDelay::new());
    bus.done();
    result
}

/// A start that goes well, as the datasheet's registers tell it.
fn good_start() -> Vec<Transaction> {
    let mut expected = vec![
        identify(MODEL_ID),
        Transaction::write(ADDRESS, vec![0x01, 0x03, 1]),
    ];
    for mode in [0xFF, 0] {
        expected.push(Transaction::write_read(
            ADDRESS,
            vec![0x01, 0x00],
            vec![mode],
        ));
    }
    for (register, value) in [
        (0x1000_u16, &[0x43][..]),
        (0x1003, &[8]),
        (0x1008, &[0]),
        (0x2100, &[0]),
        (0x2150, &[0]),
        (0x0383, &[1]),
        (0x0387, &[1]),
        (0x0390, &[0]),
        (0x3010, &[1]),
        (0x0205, &[0]),
        (0x3059, &[0x02]),
        (0x3060, &[0b1001]),
        (0x3068, &[0]),
        (0x020E, &[1, 0]),
        (0x0340, &[1, 4]),
        (0x0342, &[1, 0xA4]),
        (0x0202, &[0, 8]),
        (0x0104, &[1]),
        (0x0100, &[1]),
    ] {
        expected.push(Transaction::write(
            ADDRESS,
            [&register.to_be_bytes(), value].concat(),
        ));
    }
    expected
}

#[test]
fn starts_and_streams_last() {
    assert_eq!(start(&good_start(), &Config::QVGA_8BIT), Ok(()));
}

#[test]
fn another_camera_is_not_written_to() {
    assert_eq!(
        start(&[identify(0x0356)], &Config::QVGA_8BIT),
        Err(Error::WrongModel(0x0356))
    );
}

#[test]
fn bus_error_at_any_byte_of_the_start_is_told() {
    let error = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    let good = good_start();
    for n in 0..good.len() {
        let mut expected = good[..=n].to_vec();
        expected[n] = expected[n].clone().with_error(error);
        assert_eq!(
            start(&expected, &Config::QVGA_8BIT),
            Err(Error::Bus(error)),
            "transaction {n}"
        );
    }
}

#[test]
fn camera_stuck_in_reset_is_told() {
    let mut expected = good_start()[..2].to_vec();
    for _ in 0..RESET_TRIES {
        expected.push(Transaction::write_read(
            ADDRESS,
            vec![0x01, 0x00],
            vec![0xFF],
        ));
    }
    assert_eq!(
        start(&expected, &Config::QVGA_8BIT),
        Err(Error::StuckInReset)
    );
}

#[test]
fn bad_configurations_send_nothing() {
    let good = Config::QVGA_8BIT;
    for (config, error) in [
        (
            Config {
                mclk_hz: 60_000_000,
                ..good
            },
            ConfigError::MclkHz(60_000_000),
        ),
        (
            Config {
                line_length_px: 375,
                ..good
            },
            ConfigError::LineLength(375),
        ),
        (
            Config {
                frame_length_lines: 259,
                ..good
            },
            ConfigError::FrameLength(259),
        ),
        (
            Config {
                exposure_lines: 259,
                ..good
            },
            ConfigError::Exposure(259),
        ),
        (
            Config {
                analog_gain_log2: 4,
                ..good
            },
            ConfigError::AnalogGain(4),
        ),
    ] {
        assert_eq!(start(&[], &config), Err(Error::Config(error)));
    }
}

#[test]
fn line_times() {
    assert_eq!(Config::QVGA_8BIT.line_time_ps(), 67_200_000);
    assert_eq!(Config::QVGA_4BIT.line_time_ps(), 67_200_000);
    assert_eq!(Config::QVGA_1BIT.line_time_ps(), 125_333_333);
}
