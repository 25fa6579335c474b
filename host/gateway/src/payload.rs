//! A report as a JSON message.

use super::spool::record::Entry;
use super::watch::Standing;
use rowtone_report::json;
use rowtone_report::zone::ZoneLimits;

/// The object that `rowtone analyze` writes, with whose it is, its session, and when it came.
pub(super) fn json(entry: &Entry, limits: Option<&ZoneLimits>) -> Vec<u8> {
    let object = json::zoned(&entry.report, limits);
    let rest = object.strip_prefix('{').unwrap_or(&object);
    // Any string serialises.
    let board = serde_json::to_string(&entry.board).unwrap_or_default();
    format!(
        r#"{{"board":{board},"session":{},"received_unix_ms":{},{rest}"#,
        entry.session, entry.unix_ms
    )
    .into_bytes()
}

/// Whether a board speaks, since when, and why not.
pub(super) fn standing(board: &str, standing: &Standing) -> Vec<u8> {
    let object = serde_json::json!({
        "board": board,
        "state": standing.state.name(),
        "since_unix_ms": standing.since_unix_ms,
        "why": standing.why,
    });
    object.to_string().into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_one_object() {
        let report = rowtone_report::example(None);
        let entry = Entry {
            unix_ms: 5,
            board: "a\"b".to_owned(),
            session: 9,
            report,
        };
        let object: serde_json::Value = serde_json::from_slice(&json(&entry, None)).unwrap();
        assert!(object.get("zone").is_none());
        assert_eq!(
            (&object["board"], &object["session"], &object["seq"]),
            (&"a\"b".into(), &9.into(), &3.into())
        );
        let (limits, report) = ("1,2,3".parse().ok(), rowtone_report::example(Some(100.0)));
        let entry = Entry { report, ..entry };
        let object: serde_json::Value =
            serde_json::from_slice(&json(&entry, limits.as_ref())).unwrap();
        assert_eq!(object["zone"], "D");
    }
}
