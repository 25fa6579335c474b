//! Reports as server-sent events (HTML Standard, 9.2), for as long as somebody listens.

use std::time::{Duration, Instant};

use crate::http::connection::{Broken, Connection};
use crate::http::request::Head;
use crate::reports::News;
use crate::site::Site;

/// A listener gets the state so often, which also shows whether it is still there.
const EVERY: Duration = Duration::from_secs(1);
/// Old reports that a new listener gets.
const OLD: usize = 300;

/// Whether a request wants events and not a list.
pub(crate) fn are_wanted(head: &Head) -> bool {
    let takes = head.field("accept").unwrap_or_default();
    head.path == "/api/reports"
        && head.query("after").is_none()
        && !takes.contains("application/json")
}

/// Sends `report`, `state` and `restart` events until the listener has gone or there is to be no more.
pub(crate) fn serve(site: &Site, head: &Head, to: &mut Connection) -> Result<(), Broken> {
    to.begin_events()?;
    // "EPOCH-ID" of the last event that a listener had before its connection broke.
    let last = head.field("last-event-id").and_then(|text| {
        let (epoch, id) = text.split_once('-')?;
        Some((epoch.parse().ok()?, id.parse().ok()?))
    });
    let (now, _) = site.live.reports.position();
    let (mut epoch, mut id) = match last {
        Some((epoch, id)) if epoch == now => (epoch, id),
        _ => (now, 0),
    };
    let mut most = OLD;
    // However often reports come, the state comes too.
    let mut due = Instant::now();
    loop {
        let left = due.saturating_duration_since(Instant::now());
        if left.is_zero() {
            to.write(format!("event: state\ndata: {}\n\n", site.state()).as_bytes())?;
            due = Instant::now() + EVERY;
            continue;
        }
        let text = match site.live.reports.wait(epoch, id, most, left) {
            News::Reports(entries) => {
                let mut text = String::new();
                for entry in &entries {
                    text += &format!(
                        "event: report\nid: {epoch}-{}\ndata: {}\n\n",
                        entry.id, entry.json
                    );
                    id = entry.id;
                }
                most = usize::MAX;
                text
            }
            News::Restarted(now) => {
                epoch = now;
                format!("event: restart\nid: {epoch}-{id}\ndata: {{}}\n\n")
            }
            News::Nothing => continue,
            News::Closed => return Ok(()),
        };
        to.write(text.as_bytes())?;
    }
}
