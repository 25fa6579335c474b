//! `rowtone_clip`: any bytes as a Y4M stream, behind a right header and without one, and as frame times.
#![no_main]

use rowtone_clip::pts;
use rowtone_clip::y4m::{Next, Reader};
use libfuzzer_sys::fuzz_target;

/// Reads until the end, and checks that what is called a frame is one.
fn read(bytes: &[u8]) {
    let Ok(mut reader) = Reader::open(bytes, "clip") else { return };
    let marker = b"FRAME\n".len();
    let planes = reader.stride() - marker;
    assert!(reader.header_bytes() <= bytes.len());
    let (mut buffer, mut frames) = (vec![], 0);
    while let Ok(next) = reader.read_frame(&mut buffer) {
        match next {
            Next::Frame { luma } => {
                assert!(luma >= marker && buffer.len() >= luma + planes);
                assert!(buffer.starts_with(b"FRAME"));
                frames += 1;
            }
            Next::Truncated { have, need } => {
                assert!(have < need);
                break;
            }
            Next::End => break,
        }
    }
    // Every frame stands in the file.
    assert!(reader.header_bytes() + frames * reader.stride() <= bytes.len());
}

fuzz_target!(|data: &[u8]| {
    read(data);
    read(&[&b"YUV4MPEG2 W3 H2 F60:1 Cmono\nFRAME\n"[..], data].concat());
    if let Ok(text) = core::str::from_utf8(data)
        && let Ok(times) = pts::parse(text)
    {
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(pts::period_ns(&times).is_some(), times.len() > 1);
    }
});
