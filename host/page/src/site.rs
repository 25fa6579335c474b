//! Which address gives what.

use std::net::IpAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

use crate::control::{self, Access, Control, Keeper};
use crate::guard::{self, Allowance, Names, Rates};
use crate::http::reply::Reply;
use crate::http::request::{Head, Method};
use crate::live::Live;
use crate::picture::{Aim, Grey};
use crate::reports::Entry;
use crate::{clip, csv, metrics, shapes, state};

/// The page, all of it: one file that needs nothing else.
pub const PAGE: &str = concat!(
    include_str!("../web/head.html"),
    include_str!("../web/page.css"),
    include_str!("../web/body.html"),
    include_str!("../web/numbers.js"),
    include_str!("../web/charts.js"),
    include_str!("../web/trend.js"),
    include_str!("../web/picture.js"),
    include_str!("../web/shapes.js"),
    include_str!("../web/settings.js"),
    include_str!("../web/main.js"),
    include_str!("../web/tail.html"),
);
/// Each address may ask so often: several pages with pictures, and what a program polls.
const REQUESTS: Allowance = Allowance {
    burst: 300.0,
    per_s: 100.0,
};
/// And guess at the password so often.
const GUESSES: Allowance = Allowance {
    burst: 5.0,
    per_s: 0.1,
};
/// A picture is encoded no more often than this, however many look.
const PICTURE_EVERY: Duration = Duration::from_millis(80);
/// Reports given at once.
const AT_ONCE: usize = 600;

/// A page and all that it shows.
pub struct Site {
    /// What is measured.
    pub live: Arc<Live>,
    control: Arc<dyn Control>,
    access: Access,
    names: Names,
    requests: Rates,
    guesses: Rates,
    picture: Mutex<Option<Shown>>,
    shapes: shapes::Latest,
    refused: AtomicU64,
}

/// A picture as it was last made.
#[derive(Clone)]
struct Shown {
    number: u64,
    at: Instant,
    jpeg: Arc<[u8]>,
    aim: Arc<Aim>,
}

impl Site {
    /// A page of what `live` holds, with the settings of `control`.
    pub fn new(live: Arc<Live>, control: Arc<dyn Control>, access: Access, names: Names) -> Self {
        Self {
            live,
            control,
            access,
            names,
            requests: Rates::new(REQUESTS),
            guesses: Rates::new(GUESSES),
            picture: Mutex::new(None),
            shapes: shapes::Latest::default(),
            refused: AtomicU64::new(0),
        }
    }

    /// Whether a request is to be answered at all; the answer that says why not.
    ///
    /// # Errors
    /// That answer.
    pub fn admit(&self, head: &Head, from: IpAddr) -> Result<(), Reply> {
        let refuse = |reply: Reply| {
            self.refused.fetch_add(1, Ordering::Relaxed);
            Err(reply)
        };
        if !self.requests.take(from, Instant::now()) {
            return refuse(
                Reply::refusal(429, "too many requests: ask less often").with("Retry-After: 1"),
            );
        }
        let host = head.field("host").unwrap_or_default();
        // A request of HTTP/1.0 may have none, and then no browser sent it.
        if !(self.names.know(host) || host.is_empty() && !head.keep_alive) {
            return refuse(Reply::refusal(
                403,
                format!(
                    "{host:?} is no name of this device: use its address or NAME.local, or give it this name in its configuration"
                ),
            ));
        }
        Ok(())
    }

    /// Answers a request that was admitted; events are the server's.
    pub fn answer(&self, head: &Head, body: &[u8], from: IpAddr, viewers: usize) -> Reply {
        let reply = match head.method {
            Method::Get | Method::Head => self.read(head, viewers),
            Method::Put => self.change(head, body, from).unwrap_or_else(|reply| reply),
            Method::Other => Reply::refusal(405, "only GET, HEAD and PUT are answered")
                .with("Allow: GET, HEAD, PUT"),
        };
        if reply.status >= 400 && reply.status != 503 {
            self.refused.fetch_add(1, Ordering::Relaxed);
        }
        reply
    }

    fn read(&self, head: &Head, viewers: usize) -> Reply {
        match head.path.as_str() {
            "/" | "/index.html" => Reply::new(200, "text/html; charset=utf-8", PAGE),
            "/api/report" => self.last_report(),
            "/api/reports" => self.reports(head),
            "/api/reports.csv" => csv_reply(&self.live.reports.after(0, usize::MAX)),
            "/api/state" => Reply::json(self.state().to_string()),
            "/api/motion" => {
                let curve = self.live.motion.last(state::CURVE_FRAMES);
                Reply::json(serde_json::to_vec(&curve).unwrap_or_default())
            }
            "/api/picture.jpg" => match self.shown() {
                Some(shown) => Reply::new(200, "image/jpeg", shown.jpeg.to_vec()),
                None => Reply::refusal(
                    503,
                    "there is no picture yet, or none at all over a serial line",
                )
                .with("Retry-After: 1"),
            },
            "/api/shapes" => match self.shapes.get(&self.live) {
                Ok(text) => Reply::json(text.to_string()),
                Err(why) => Reply::refusal(503, why).with("Retry-After: 2"),
            },
            "/api/settings" => Reply::json(self.settings().to_string()),
            "/api/clip.y4m" => self.clip(),
            "/api/clip.json" => {
                let settings = Value::Object(control::to_json(&self.control.settings()));
                Reply::json(clip::json(&self.live, settings).to_string())
                    .with("Content-Disposition: attachment; filename=rowtone.json")
            }
            "/metrics" => {
                let refused = self.refused.load(Ordering::Relaxed);
                let text = metrics::text(&self.live, viewers, refused, Instant::now());
                Reply::new(200, metrics::CONTENT_TYPE, text)
            }
            "/favicon.ico" => Reply::new(200, "image/svg+xml", ICON),
            _ => Reply::refusal(404, "there is nothing of this name; / is the page"),
        }
    }

    fn last_report(&self) -> Reply {
        match self.live.reports.last() {
            Some(entry) => Reply::json(entry.json.clone()),
            None => {
                let (_, why) = self.live.phase();
                let why = if why.is_empty() {
                    "no report yet: the first one comes after a window".to_owned()
                } else {
                    why
                };
                Reply::refusal(503, why).with("Retry-After: 1")
            }
        }
    }

    /// Reports after the one that `after` names, for a page that is given no events.
    fn reports(&self, head: &Head) -> Reply {
        let after = head
            .query("after")
            .map_or(Some(0), |text| text.parse().ok());
        let Some(after) = after else {
            return Reply::refusal(400, "after: give the id of a report");
        };
        let (epoch, newest) = self.live.reports.position();
        let entries = self.live.reports.after(after, AT_ONCE);
        let list: Vec<&str> = entries.iter().map(|entry| entry.json.as_str()).collect();
        let newest = entries.last().map_or(newest, |entry| entry.id);
        Reply::json(format!(
            "{{\"epoch\":{epoch},\"id\":{newest},\"reports\":[{}]}}",
            list.join(",")
        ))
    }

    /// State, advice, light and focus, counters: what changes from second to second.
    pub fn state(&self) -> Value {
        let shown = self.shown();
        let aim = shown.as_ref().map(|shown| &*shown.aim);
        let refused = self.refused.load(Ordering::Relaxed);
        state::json(&self.live, aim, self.control.is_live(), refused)
    }

    /// The newest picture, made once for all who look.
    fn shown(&self) -> Option<Shown> {
        self.live.frames.want();
        let mut last = self.picture.lock().unwrap_or_else(PoisonError::into_inner);
        let (kept, _) = self.live.frames.counts();
        if let Some(shown) = &*last
            && (shown.number == kept || shown.at.elapsed() < PICTURE_EVERY)
        {
            return Some(shown.clone());
        }
        let shot = self.live.frames.newest()?;
        let grey = Grey::of(&shot);
        let aim = Aim::of(&grey, self.part());
        let shown = Shown {
            number: shot.number,
            at: Instant::now(),
            jpeg: grey.jpeg().ok()?.into(),
            aim: Arc::new(aim),
        };
        *last = Some(shown.clone());
        Some(shown)
    }

    /// The part that is measured, px of the camera.
    fn part(&self) -> [usize; 4] {
        let all = || {
            let [width, height] = self.live.about().picture.unwrap_or_default();
            [0, 0, width, height]
        };
        let roi = self.control.settings().roi;
        let roi = roi.map(|r| [r.x, r.y, r.width, r.height].map(usize::from));
        self.live.about().part.or(roi).unwrap_or_else(all)
    }

    fn settings(&self) -> Value {
        let limits = self.control.limits();
        let keys: Vec<&str> = self.control.keys().iter().map(|key| key.name()).collect();
        let password = match &self.access {
            Access::Open => "none",
            Access::Password(keeper) if keeper.is_set() => "asked",
            Access::Password(_) => "unset",
        };
        json!({
            "settings": control::to_json(&self.control.settings()),
            "changeable": keys,
            "password": password,
            "limits": {
                "width": limits.width,
                "height": limits.height,
                "min_width": limits.min_width,
                "max_window_s": limits.max_window_s,
            },
        })
    }

    fn clip(&self) -> Reply {
        match clip::y4m(&self.live) {
            Some(bytes) => Reply::new(200, "video/x-yuv4mpeg", bytes)
                .with("Content-Disposition: attachment; filename=rowtone.y4m"),
            None => Reply::refusal(
                503,
                "there are no pictures yet, or none at all over a serial line",
            )
            .with("Retry-After: 1"),
        }
    }

    /// Settings or the password.
    fn change(&self, head: &Head, body: &[u8], from: IpAddr) -> Result<Reply, Reply> {
        if !guard::is_from_here(head) {
            return Err(Reply::refusal(
                403,
                "changes are taken from this device's own page, or from a program",
            ));
        }
        let kind = head.field("content-type").unwrap_or_default();
        if !kind
            .split(';')
            .next()
            .is_some_and(|kind| kind.trim().eq_ignore_ascii_case("application/json"))
        {
            return Err(Reply::refusal(
                415,
                "send JSON, with Content-Type: application/json",
            ));
        }
        let wanted: Map<String, Value> = serde_json::from_slice(body)
            .map_err(|e| Reply::refusal(400, format!("not a JSON object: {e}")))?;
        match head.path.as_str() {
            "/api/settings" => {
                self.authorize(head, from)?;
                self.change_settings(&wanted)
            }
            "/api/password" => self.change_password(head, &wanted, from),
            _ => Err(Reply::refusal(
                404,
                "only /api/settings and /api/password can be changed",
            )),
        }
    }

    /// Whether the request knows the password, where there is one.
    fn authorize(&self, head: &Head, from: IpAddr) -> Result<(), Reply> {
        let Access::Password(keeper) = &self.access else {
            return Ok(());
        };
        // A scheme of our own, so that no browser asks and remembers.
        let ask = |why: &str| {
            Reply::refusal(401, why).with("WWW-Authenticate: X-Basic realm=\"rowtone\"")
        };
        if !keeper.is_set() {
            return Err(ask(
                "set a password first: whoever changes something is to know it",
            ));
        }
        let password =
            guard::password(head).ok_or_else(|| ask("changing something asks for the password"))?;
        self.guess(keeper, &password, from, ask("this is not the password"))
    }

    fn guess(
        &self,
        keeper: &Keeper,
        password: &str,
        from: IpAddr,
        wrong: Reply,
    ) -> Result<(), Reply> {
        // Whoever made too many wrong guesses has not even the right one looked at.
        if !self.guesses.take(from, Instant::now()) {
            return Err(
                Reply::refusal(429, "too many wrong passwords: wait").with("Retry-After: 10")
            );
        }
        if !keeper.is(password) {
            return Err(wrong);
        }
        self.guesses.give_back(from);
        Ok(())
    }

    fn change_settings(&self, wanted: &Map<String, Value>) -> Result<Reply, Reply> {
        let settings = control::changed(&*self.control, wanted).map_err(|refused| {
            let body = json!({ "error": refused.why, "key": refused.key }).to_string();
            Reply::new(422, "application/json", body)
        })?;
        self.control
            .change(settings)
            .map_err(|why| Reply::refusal(422, why))?;
        Ok(Reply::json(self.settings().to_string()))
    }

    fn change_password(
        &self,
        head: &Head,
        wanted: &Map<String, Value>,
        from: IpAddr,
    ) -> Result<Reply, Reply> {
        let Access::Password(keeper) = &self.access else {
            return Err(Reply::refusal(422, "no password is asked for here"));
        };
        if keeper.is_set() {
            self.authorize(head, from)?;
        }
        let new = wanted.get("password").and_then(Value::as_str);
        let new = new.ok_or_else(|| Reply::refusal(422, "give {\"password\": \"…\"}"))?;
        keeper.set(new).map_err(|why| Reply::refusal(422, why))?;
        Ok(Reply::json(self.settings().to_string()))
    }
}

fn csv_reply(entries: &[Arc<Entry>]) -> Reply {
    Reply::new(200, "text/csv; charset=utf-8", csv::text(entries))
        .with("Content-Disposition: attachment; filename=rowtone.csv")
}

/// A tone in a square.
const ICON: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="6" fill="#14532d"/><path d="M4 16c3-12 6-12 9 0s6 12 9 0 4-8 6-4" fill="none" stroke="#fff" stroke-width="2.6"/></svg>"##;
