//! A report as a JSON message.

use super::spool::record::Entry;
use rowtone_report::json;

/// The object that `rowtone analyze` writes, with whose it is, its session, and when it came.
pub(super) fn json(entry: &Entry) -> Vec<u8> {
    let object = json::report(&entry.report);
    let rest = object.strip_prefix('{').unwrap_or(&object);
    // Any string serialises.
    let board = serde_json::to_string(&entry.board).unwrap_or_default();
    format!(
        r#"{{"board":{board},"session":{},"received_unix_ms":{},{rest}"#,
        entry.session, entry.unix_ms
    )
    .into_bytes()
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
        let object: serde_json::Value = serde_json::from_slice(&json(&entry)).unwrap();
        assert_eq!(
            (&object["board"], &object["session"], &object["seq"]),
            (&"a\"b".into(), &9.into(), &3.into())
        );
    }
}
