//! `rowtone_gateway`: any bytes as a file of the spool, any record under a right checksum, and any bytes from a broker.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone_gateway::mqtt::packet::{Decoder, MAX_MESSAGE, Packet};
use rowtone_gateway::spool::record::{Record, pieces};

/// Records come back as they are written.
fn again(record: &Record) {
    let bytes = record.to_bytes().expect("what was read can be written");
    let all: Vec<_> = pieces(&bytes).collect();
    assert_eq!(all, [(bytes.len(), Some(record.clone()))]);
}

/// The same packets, however the bytes come in parts.
fn packets(bytes: &[u8], step: usize) -> (Vec<Packet>, bool) {
    let (mut decoder, mut packets) = (Decoder::default(), vec![]);
    for part in bytes.chunks(step) {
        decoder.push(part);
        loop {
            match decoder.take() {
                Ok(Some(packet)) => packets.push(packet),
                Ok(None) => break,
                Err(_) => return (packets, false),
            }
        }
    }
    (packets, true)
}

// First byte: which; then the bytes.
fuzz_target!(|data: &[u8]| {
    let Some((&kind, data)) = data.split_first() else { return };
    match kind % 3 {
        0 => {
            let mut before = 0;
            for (end, record) in pieces(data) {
                assert!(end > before && end <= data.len() + 1);
                before = end;
                if let Some(record) = record {
                    again(&record);
                }
            }
        }
        1 => {
            let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(data);
            let line = [data, format!(" {sum:08X}").as_bytes()].concat();
            if let Some(record) = Record::from_line(&line)
                && !record.entry.board.is_empty()
                && !record.entry.board.contains(char::is_whitespace)
            {
                again(&record);
            }
        }
        _ => {
            let whole = packets(data, data.len().max(1));
            assert_eq!(packets(data, 1), whole);
            assert_eq!(packets(data, 7), whole);
            for packet in whole.0 {
                match packet {
                    Packet::Message(m, _) => assert!(m.payload.len() <= MAX_MESSAGE),
                    Packet::Oversized(length, _) => assert!(length > MAX_MESSAGE),
                    _ => {}
                }
            }
        }
    }
});
