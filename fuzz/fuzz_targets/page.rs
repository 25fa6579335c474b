//! `rowtone_page`: any bytes as a request, and any text as settings to change.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone_page::guard;
use rowtone_page::http::request::{MAX_BODY, MAX_HEAD, parse};
use rowtone_page::password::Hash;

fuzz_target!(|data: &[u8]| {
    let Ok(Some((head, length))) = parse(data) else { return };
    assert!(length <= MAX_HEAD.min(data.len()) && head.content_length <= MAX_BODY);
    assert!(head.path.starts_with('/'));
    // Shorter it is none yet, longer it is the same.
    assert_eq!(parse(&data[..length - 1]), Ok(None));
    assert_eq!(parse(&data[..length]), Ok(Some((head.clone(), length))));
    guard::is_from_here(&head);
    guard::password(&head);
    if let Some(host) = head.field("host") {
        guard::Names::default().know(host);
        let _ = host.parse::<Hash>();
    }
});
