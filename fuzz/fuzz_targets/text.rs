//! `wire::text`: any bytes, and any sentence under a right checksum.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone::wire::{Message, text};

fn encoded(message: &Message) -> Vec<u8> {
    let mut line = [0; text::MAX_LINE];
    text::encode_to_slice(message, &mut line)
        .expect("what was decoded can be encoded")
        .to_vec()
}

fuzz_target!(|data: &[u8]| {
    let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
    for &byte in data {
        if let Some(Ok(message)) = decoder.push(byte) {
            encoded(&message);
        }
    }
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(data);
    let Ok(body) = core::str::from_utf8(data) else { return };
    let line = format!("${body}*{sum:08X}\r\n");
    if let Ok(message) = text::decode_line(&line) {
        // A line with more digits than an f32 has comes back with fewer, but means the same.
        let again = encoded(&message);
        let again = core::str::from_utf8(&again).expect("plain text");
        assert_eq!(text::decode_line(again), Ok(message));
    }
});
