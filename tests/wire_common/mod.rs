//! Random messages, and a line that harms them; for the tests of every wire.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program uses its part of this"
)]

pub mod console;

use proptest::{collection, option, prelude::*, sample};
use rowtone::report::{MAX_PEAKS, Peak, Report, Warnings};
use rowtone::wire::{MAX_VALUE, Message, REPLY_LEN, Reply, SettingsOrigin, Status};
use rowtone_chance::{Chance, XorShiftStar};

/// Any number that may go over a wire, small, large and ordinary ones alike.
pub fn real() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<f32>().prop_filter("in range", |x| x.abs() < MAX_VALUE),
        -1000.0_f32..1000.0,
        Just(0.0),
        Just(9_999_999.0),
        Just(-9_999_999.0),
    ]
}

prop_compose! {
    fn peak()(
        hz in real(), hz_sd in real(), amplitude_px in real(), amplitude_px_sd in real(),
        snr_db in real(), ambiguous in any::<bool>(), track in any::<u16>(),
        harmonic in option::of(any::<u8>()),
    ) -> Peak {
        Peak { hz, hz_sd, amplitude_px, amplitude_px_sd, snr_db, ambiguous, track, harmonic, motion: None }
    }
}

prop_compose! {
    pub fn report()(
        (seq, time_ms, lines) in any::<(u32, u64, u32)>(),
        (window_s, fps, noise_px) in (real(), real(), real()),
        (lost_frames, warnings) in any::<(u16, u16)>(),
        peaks in collection::vec(peak(), 0..=MAX_PEAKS),
        um_per_px in option::of(real()), velocity_mm_s_rms in option::of(real()),
    ) -> Report {
        Report {
            seq, time_ms, window_s, fps, lines, lost_frames, noise_px,
            peaks: peaks.into_iter().collect(),
            warnings: Warnings::from(warnings), um_per_px, velocity_mm_s_rms,
            line_time_us_fit: None,
        noise_floor: Default::default(),
        other_px_rms: 0.0,
        broad_band: None,
        }
    }
}

prop_compose! {
    fn status()(
        version in any::<[u16; 3]>(),
        (session, uptime_ms, next_seq) in any::<(u32, u64, u32)>(),
        oldest_seq in any::<Option<u32>>(),
        (dropped_reports, refused_commands) in any::<(u32, u32)>(),
        settings in sample::select(vec![
            SettingsOrigin::Defaults, SettingsOrigin::Saved,
            SettingsOrigin::Corrupt, SettingsOrigin::Changed, SettingsOrigin::Previous,
        ]),
    ) -> Status {
        Status {
            version, session, uptime_ms, next_seq, oldest_seq,
            dropped_reports, refused_commands, settings,
        }
    }
}

prop_compose! {
    fn reply()(ok in any::<bool>(), text in collection::vec(b' '..=b'~', 0..=REPLY_LEN)) -> Reply {
        let text: String = text.into_iter().map(char::from).filter(|c| !"$*".contains(*c)).collect();
        Reply { ok, text: text.as_str().try_into().unwrap() }
    }
}

/// Any message that can be encoded.
pub fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        3 => (any::<u32>(), report()).prop_map(|(session, report)| Message::Report { session, report }),
        1 => status().prop_map(Message::Status),
        1 => reply().prop_map(Message::Reply),
    ]
}

/// A report as a board in a plant sends it.
pub fn ordinary_report(seq: u32) -> Report {
    let peak = |hz: f32, amplitude_px: f32, track| Peak {
        hz,
        hz_sd: 0.0004,
        amplitude_px,
        amplitude_px_sd: 0.0002,
        snr_db: 61.2,
        ambiguous: false,
        track,
        harmonic: None,
        motion: None,
    };
    Report {
        seq,
        time_ms: 1000 * (u64::from(seq) + 1),
        window_s: 1.0,
        fps: 60.0,
        lines: 18_000,
        lost_frames: 0,
        noise_px: 0.0131,
        peaks: [
            peak(49.2003, 0.3998, 1),
            peak(98.4, 0.1012, 2),
            peak(147.61, 0.0497, 3),
        ]
        .into_iter()
        .collect(),
        warnings: Warnings::NONE,
        um_per_px: Some(50.0),
        velocity_mm_s_rms: Some(4.4512),
        line_time_us_fit: None,
        noise_floor: Default::default(),
        other_px_rms: 0.0,
        broad_band: None,
    }
}

/// Sends bytes over a line on which a byte in `1/rate` is harmed: a bit turned over, the byte
/// dropped, sent twice, or replaced by any other. Says whether anything happened.
pub fn harm(dice: &mut XorShiftStar, sent: &[u8], rate: f64, received: &mut Vec<u8>) -> bool {
    let mut harmed = false;
    for &byte in sent {
        if !dice.happens(rate) {
            received.push(byte);
            continue;
        }
        harmed = true;
        match dice.below(4) {
            0 => received.push(byte ^ 1 << dice.below(8)),
            1 => {}
            2 => received.extend([byte, byte]),
            _ => received.push(byte.wrapping_add(1 + dice.below(255) as u8)),
        }
    }
    harmed
}
