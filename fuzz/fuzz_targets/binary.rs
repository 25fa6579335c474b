//! `wire::binary`: any bytes, and any content under a right checksum.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone::wire::{Message, binary};

fn decoded(bytes: &[u8]) -> Vec<Message> {
    let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
    bytes.iter().filter_map(|&byte| decoder.push(byte)?.ok()).collect()
}

fuzz_target!(|data: &[u8]| {
    decoded(data);
    let mut frame = [&[binary::FORMAT], data].concat();
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&frame);
    frame.extend(sum.to_le_bytes());
    let mut stuffed = vec![0; cobs::max_encoding_length(frame.len())];
    let used = cobs::encode(&frame, &mut stuffed);
    stuffed.truncate(used);
    stuffed.push(0);
    for message in decoded(&stuffed) {
        let mut buffer = [0; binary::MAX_FRAME];
        let again = binary::encode_to_slice(&message, &mut buffer).expect("what was decoded can be encoded");
        assert_eq!(decoded(again), [message]);
    }
});
