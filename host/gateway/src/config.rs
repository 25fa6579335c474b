//! The gateway's configuration: read, and checked as a whole.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::error::GatewayError;
use super::mqtt::packet::is_topic;
use super::spool::record::MAX_NAME;
use rowtone_report::alarms::Book;
use rowtone_report::zone::ZoneLimits;
use rowtone_serial::port::PortName;

/// What to read and where to send it.
#[derive(Clone, Debug)]
pub struct Config {
    /// Where to send it.
    pub broker: Broker,
    /// What a message looks like.
    pub payload: Payload,
    /// Where reports wait on disk.
    pub spool: Spool,
    /// What to read.
    pub boards: Vec<Board>,
}

/// An MQTT broker.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Broker {
    /// Name or address.
    pub host: String,
    /// Port; 1883, or 8883 with TLS, where none is given.
    pub port: Option<u16>,
    /// Name of this gateway at the broker, unlike that of any other client.
    pub client_id: String,
    /// User, where the broker wants one.
    pub user: Option<String>,
    /// The user's password.
    pub password: Option<String>,
    /// File with the password alone, so that it need not stand in the configuration.
    pub password_file: Option<PathBuf>,
    /// TLS, with the authorities whose certificates are trusted (PEM).
    pub tls_ca: Option<PathBuf>,
}

/// What a message looks like.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, tag = "format", rename_all = "lowercase")]
pub enum Payload {
    /// A JSON object a report, to `TOPIC/BOARD/report`.
    Json {
        /// First part of the topic.
        topic: String,
        /// The broker keeps the last report of each board for whoever subscribes later.
        #[serde(default)]
        retain: bool,
        /// First part of the topics under which Home Assistant looks for devices, as a rule `homeassistant`.
        discovery: Option<String>,
    },
    /// Sparkplug B, to `spBv1.0/GROUP/DDATA/NODE/BOARD`.
    Sparkplug {
        /// Group id.
        group: String,
        /// Edge node id.
        node: String,
    },
}

/// Where reports wait on disk.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spool {
    /// A directory for this gateway alone.
    pub dir: PathBuf,
    /// Most space to take, MB; the oldest reports go when there is more.
    #[serde(default = "usual_max_mb")]
    pub max_mb: u32,
}

fn usual_max_mb() -> u32 {
    1000
}

/// One board on a serial line.
#[derive(Clone, Debug)]
pub struct Board {
    /// Its name in topics.
    pub name: String,
    /// Where it is.
    pub port: PortName,
    /// It is called silent when no report comes for so long, s.
    pub silent_s: u32,
    /// Where the zones of its machine begin: its reports then have one.
    pub zone_limits: Option<ZoneLimits>,
    /// The alarms that its reports are judged by.
    pub alarms: Option<Book>,
}

/// Longer than any usual hop.
const SILENT_S: u32 = 30;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    broker: Broker,
    payload: Spanned<Payload>,
    spool: Spanned<Spool>,
    board: Spanned<Vec<BoardEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardEntry {
    name: Spanned<String>,
    port: Spanned<String>,
    silent_s: Option<Spanned<u32>>,
    machine: Option<Spanned<String>>,
    zone_limits: Option<Spanned<String>>,
    alarms: Option<Spanned<PathBuf>>,
}

impl BoardEntry {
    /// Where its machine's zones begin; an error has the place in the text, the key, and why.
    fn zone_limits(&self) -> Result<Option<ZoneLimits>, (usize, &'static str, String)> {
        let (limits, (key, at)) = match (&self.machine, &self.zone_limits) {
            (None, None) => return Ok(None),
            (Some(_), Some(limits)) => {
                let why = "give this or board.machine, not both".to_owned();
                return Err((limits.span().start, "board.zone_limits", why));
            }
            (Some(name), None) => (
                ZoneLimits::of_machine(name.get_ref()),
                ("board.machine", name.span().start),
            ),
            (None, Some(limits)) => (
                limits.get_ref().parse(),
                ("board.zone_limits", limits.span().start),
            ),
        };
        limits.map(Some).map_err(|why| (at, key, why))
    }
}

impl Config {
    /// Reads the file.
    ///
    /// # Errors
    /// One line that names the file, the line and the key.
    pub fn read(path: &Path) -> Result<Self, GatewayError> {
        let named = || path.to_path_buf();
        let text = std::fs::read_to_string(path)
            .map_err(|why| GatewayError::Unreadable { path: named(), why })?;
        Self::parse(&text).map_err(|why| GatewayError::Config { path: named(), why })
    }

    /// Reads the file's text; an error starts with the number of the line.
    fn parse(text: &str) -> Result<Self, String> {
        let line = |at: usize| {
            text.as_bytes()[..at.min(text.len())]
                .iter()
                .filter(|&&b| b == b'\n')
                .count()
                + 1
        };
        let file: File = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(text.len(), |span| span.start);
            let message = match error.message() {
                "missing field `board`" => "name at least one board, as [[board]]",
                message => message,
            };
            format!("{}: {}{message}", line(at), key_before(text, at))
        })?;
        let wrong = |at: usize, key: &str, why: &str| Err(format!("{}: {key}: {why}", line(at)));

        let at = file.payload.span().start;
        let plain = |part: &str| is_topic(part) && !part.starts_with('$');
        match file.payload.get_ref() {
            Payload::Json { topic, .. } if !plain(topic) => {
                return wrong(
                    at,
                    "payload.topic",
                    "give a topic without #, + and line ends, that does not start with $",
                );
            }
            Payload::Json {
                discovery: Some(prefix),
                ..
            } if !plain(prefix) => {
                return wrong(
                    at,
                    "payload.discovery",
                    "give the first part of a topic without #, +, as \"homeassistant\"",
                );
            }
            Payload::Sparkplug { group, node }
                if !plain(group) || !plain(node) || group.contains('/') || node.contains('/') =>
            {
                return wrong(
                    at,
                    "payload.group, payload.node",
                    "give names without #, +, / and line ends, that do not start with $",
                );
            }
            _ => {}
        }
        if !is_topic(&file.broker.client_id) {
            let at = text.find("client_id").unwrap_or(0);
            return wrong(
                at,
                "broker.client_id",
                "give a name without #, + and line ends: it becomes part of a topic",
            );
        }
        if file.spool.get_ref().max_mb == 0 {
            return wrong(file.spool.span().start, "spool.max_mb", "give at least 1");
        }
        if file.broker.password.is_some() && file.broker.password_file.is_some() {
            let at = text.find("password_file").unwrap_or(0);
            return wrong(
                at,
                "broker.password_file",
                "give this or broker.password, not both",
            );
        }
        if file.board.get_ref().is_empty() {
            return wrong(file.board.span().start, "board", "name at least one");
        }
        let (mut names, mut ports) = (BTreeSet::new(), BTreeSet::new());
        let mut boards = vec![];
        for entry in file.board.into_inner() {
            let zone_limits = match entry.zone_limits() {
                Ok(limits) => limits,
                Err((at, key, why)) => return wrong(at, key, &why),
            };
            let alarms = match &entry.alarms {
                Some(path) if matches!(file.payload.get_ref(), Payload::Sparkplug { .. }) => {
                    let why = "alarms are told with format = \"json\" only";
                    return wrong(path.span().start, "board.alarms", why);
                }
                Some(path) => match Book::read(path.get_ref()) {
                    Ok(book) => Some(book),
                    Err(e) => return wrong(path.span().start, "board.alarms", &e.to_string()),
                },
                None => None,
            };
            if let Some(silent_s) = entry.silent_s.as_ref().filter(|s| *s.get_ref() == 0) {
                let at = silent_s.span().start;
                return wrong(at, "board.silent_s", "give at least 1");
            }
            let silent_s = entry.silent_s.map_or(SILENT_S, Spanned::into_inner);
            let (name_at, port_at) = (entry.name.span().start, entry.port.span().start);
            let (name, port) = (entry.name.into_inner(), entry.port.into_inner());
            if !plain(&name) || name.contains(|c: char| c == '/' || c.is_whitespace()) {
                return wrong(
                    name_at,
                    "board.name",
                    "give a name without #, +, / and spaces, that does not start with $",
                );
            }
            if name.len() > MAX_NAME {
                let why = format!("give a name of {MAX_NAME} bytes at most");
                return wrong(name_at, "board.name", &why);
            }
            if !names.insert(name.clone()) {
                return wrong(name_at, "board.name", &format!("{name} is there twice"));
            }
            let port: PortName = match port.parse() {
                Ok(port) => port,
                Err(why) => return wrong(port_at, "board.port", &why),
            };
            if !ports.insert(port.path.clone()) {
                return wrong(
                    port_at,
                    "board.port",
                    &format!("{} is there twice", port.path),
                );
            }
            boards.push(Board {
                name,
                port,
                silent_s,
                zone_limits,
                alarms,
            });
        }
        let config = Self {
            broker: file.broker,
            payload: file.payload.into_inner(),
            spool: file.spool.into_inner(),
            boards,
        };
        match config.topics_are_short() {
            true => Ok(config),
            false => wrong(at, "payload", "too long: a topic has 65535 bytes at most"),
        }
    }

    /// Whether every topic that will be made is one.
    fn topics_are_short(&self) -> bool {
        let longest = "x".repeat(MAX_NAME);
        let client_id = &self.broker.client_id;
        match &self.payload {
            Payload::Json {
                topic, discovery, ..
            } => {
                // A device has both names in its own, with up to eight letters for one.
                let device = format!("rowtone-{}-{}", client_id.repeat(8), longest.repeat(8));
                let prefix = discovery.as_deref().unwrap_or("x");
                is_topic(&format!("{topic}/{longest}/alarm/acknowledge"))
                    && is_topic(&format!("{prefix}/device/{device}/config"))
                    && is_topic(&format!("{topic}/gateway/{client_id}/state"))
            }
            Payload::Sparkplug { group, node } => {
                is_topic(&format!("spBv1.0/{group}/DDEATH/{node}/{longest}"))
            }
        }
    }
}

/// The key on whose line the fault is, where it is plain to see.
fn key_before(text: &str, at: usize) -> String {
    let start = text[..at.min(text.len())]
        .rfind('\n')
        .map_or(0, |end| end + 1);
    let line = text[start..].lines().next().unwrap_or("");
    match line.split_once('=') {
        Some((key, _)) => format!("{}: ", key.trim()),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: &str = r#"
[broker]
host = "localhost"
client_id = "hall-2"

[payload]
format = "json"
topic = "plant/vibration"

[spool]
dir = "/var/lib/rowtone"

[[board]]
name = "press-3"
port = "/dev/ttyUSB0:921600"

[[board]]
name = "press-4"
port = "/dev/ttyUSB1"
"#;

    #[test]
    fn the_usual_file() {
        let config = Config::parse(RIGHT).unwrap();
        assert_eq!(config.boards[0].port.baud, 921_600);
        assert_eq!((config.boards.len(), config.spool.max_mb), (2, 1000));
        assert_eq!(config.boards[1].silent_s, 30);
        let more = "name = \"press-4\"\nsilent_s = 120\nmachine = \"iso10816-1:class2\"";
        let config = Config::parse(&RIGHT.replace("name = \"press-4\"", more)).unwrap();
        assert_eq!(config.boards[1].silent_s, 120);
        assert_eq!(config.boards[1].zone_limits.map(|z| z.zone(3.0)), Some('C'));
    }

    #[test]
    fn a_fault_names_its_line_and_key() {
        for (from, to, why) in [
            ("host =", "hots =", "3: hots: "),
            ("\"localhost\"", "7", "3: host: "),
            ("format = \"json\"", "format = \"xml\"", "xml"),
            (
                "topic = \"plant/vibration\"",
                "topic = \"#\"",
                "6: payload.topic: ",
            ),
            ("plant/vibration", "$SYS/x", "6: payload.topic: "),
            ("plant/vibration", "a\\nb", "6: payload.topic: "),
            (
                "plant/vibration",
                &"x".repeat(65_500),
                "6: payload: too long",
            ),
            ("hall-2", "hall#2", "4: broker.client_id: "),
            ("hall-2", "", "4: broker.client_id: "),
            ("press-4", "press\\n4", "18: board.name: "),
            ("press-4", &"x".repeat(65), "18: board.name: "),
            (
                "press-4",
                "press-3",
                "18: board.name: press-3 is there twice",
            ),
            (
                "ttyUSB1",
                "ttyUSB0",
                "19: board.port: /dev/ttyUSB0 is there twice",
            ),
            ("ttyUSB1", "ttyUSB1:0", "19: board.port: "),
            (
                "name = \"press-4\"",
                "name = \"press-4\"\nsilent_s = 0",
                "19: board.silent_s: give at least 1",
            ),
            (
                "name = \"press-4\"",
                "name = \"press-4\"\nmachine = \"toaster\"",
                "19: board.machine: want one of iso20816-3:group1:rigid",
            ),
            (
                "name = \"press-4\"",
                "name = \"press-4\"\nalarms = \"/nowhere/a.toml\"",
                "19: board.alarms: /nowhere/a.toml: cannot be read: ",
            ),
            (
                "name = \"press-4\"",
                "machine = \"iso10816-1:class2\"\nzone_limits = \"1,2,3\"\nname = \"press-4\"",
                "19: board.zone_limits: give this or board.machine",
            ),
            (
                "topic = \"plant/vibration\"",
                "topic = \"plant/vibration\"\ndiscovery = \"#\"",
                "6: payload.discovery: ",
            ),
            (
                "dir = \"/var/lib/rowtone\"",
                "dir = \"x\"\nmax_mb = 0",
                "10: spool.max_mb: ",
            ),
            ("[spool]", "[spool", "10: "),
        ] {
            let error = Config::parse(&RIGHT.replace(from, to)).unwrap_err();
            assert!(error.contains(why), "{to}: {error}");
        }
    }
}
