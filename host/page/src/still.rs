//! The page as one file that asks for nothing: what was measured stands in it.

use rowtone::link::settings::Settings;
use serde_json::{Value, json};

use crate::control;
use crate::live::Live;
use crate::picture::{Aim, Grey};
use crate::site::PAGE;
use crate::state;

/// Where what was measured goes in the page.
const PLACE: &str = "/*still*/null/*still*/";
/// Most reports of a file, the newest.
const MOST: usize = 600;

/// The page of what was measured with these settings.
pub fn page(live: &Live, settings: &Settings) -> String {
    let reports = live.reports.after(0, MOST);
    // Each is a JSON object already.
    let reports: Vec<Value> = reports
        .iter()
        .filter_map(|entry| serde_json::from_str(&entry.json).ok())
        .collect();
    let grey = live.frames.newest().map(|shot| Grey::of(&shot));
    let about = live.about();
    let aim = grey.as_ref().map(|grey| {
        let [width, height] = about.picture.unwrap_or_default();
        Aim::of(grey, about.part.unwrap_or([0, 0, width, height]))
    });
    let picture = grey.and_then(|grey| grey.jpeg().ok());
    let all = json!({
        "reports": reports,
        "motion": live.motion.last(state::CURVE_FRAMES),
        "picture": picture.map(|jpeg| format!("data:image/jpeg;base64,{}", base64(&jpeg))),
        "settings": control::to_json(settings),
        "state": state::json(live, aim.as_ref(), false, 0),
    });
    // Inside a script nothing may look like the end of one, whatever the recording is called.
    let text = all.to_string().replace('<', "\\u003c");
    PAGE.replace(PLACE, &text)
}

/// RFC 4648, 4, with padding.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let byte = |k: usize| u32::from(three.get(k).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let six = (bits >> (18 - 6 * k)) & 63;
            text.push(if k <= three.len() {
                char::from(ALPHABET[six as usize])
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::About;

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, 10.
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn what_was_measured_stands_in_it_and_cannot_end_the_script() {
        assert_eq!(PAGE.matches(PLACE).count(), 1);
        let live = Live::default();
        live.describe(About {
            name: "</script><b>".to_owned(),
            ..About::default()
        });
        let report = rowtone_report::example(None);
        live.report(&report, rowtone_report::json::report(&report));
        let page = page(&live, &Settings::default());
        assert_eq!(page.matches("</script>").count(), 1, "the page's own");
        let from = page.find("const STILL = ").unwrap() + 14;
        let end = page[from..].find(";\n").unwrap();
        let all: Value = serde_json::from_str(&page[from..from + end]).unwrap();
        assert_eq!(all["reports"][0]["seq"], 3);
        assert_eq!(all["state"]["about"]["name"], "</script><b>");
        // What is served is less than 200 KiB.
        assert!(PAGE.len() < 200 << 10);
    }
}
