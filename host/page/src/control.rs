//! What can be changed from the page, and by whom.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use rowtone::link::settings::{Key, Limits, Settings};
use serde_json::{Map, Value, json};

use crate::password::{Hash, PasswordError};

/// Whoever measures, as the page sees it: settings that can be read, and changed where they can be.
pub trait Control: Send + Sync {
    /// The settings in use.
    fn settings(&self) -> Settings;
    /// What the picture and the memory allow.
    fn limits(&self) -> Limits;
    /// The settings that can be changed.
    fn keys(&self) -> &[Key];
    /// Reports come as something happens; a recording's come when it is read.
    fn is_live(&self) -> bool;
    /// Uses these from now on, which [`Settings::check`] has passed, and keeps them where it can.
    ///
    /// # Errors
    /// Why they cannot be used, in a sentence without a stop; nothing was changed then.
    fn change(&self, settings: Settings) -> Result<(), String>;
}

/// What can be changed of a board on the page; how reports are written is the line's.
pub const BOARD_KEYS: [Key; 8] = [
    Key::Roi,
    Key::UmPerPx,
    Key::Window,
    Key::Hop,
    Key::MaxPeaks,
    Key::FalseAlarm,
    Key::MinHz,
    Key::MaxHz,
];

/// Why a change was refused: the setting's name where one is at fault, and the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The setting.
    pub key: Option<String>,
    /// A sentence without a stop.
    pub why: String,
}

/// The settings as an object: the names of the wire's `set`, numbers, and `null` for none.
pub fn to_json(settings: &Settings) -> Map<String, Value> {
    let number = |value: f32| {
        // As it was written, not as the nearest float of twice the length.
        value
            .to_string()
            .parse::<f64>()
            .map_or(Value::Null, Value::from)
    };
    let maybe = |value: Option<f32>| value.map_or(Value::Null, number);
    let roi = settings.roi.map(|r| json!([r.x, r.y, r.width, r.height]));
    let pairs = [
        ("window", number(settings.window_s)),
        ("hop", number(settings.hop_s)),
        ("max-peaks", settings.max_peaks.into()),
        ("false-alarm", number(settings.false_alarm)),
        ("um-per-px", maybe(settings.um_per_px)),
        ("roi", roi.unwrap_or_default()),
        ("min-hz", maybe(settings.min_hz)),
        ("max-hz", maybe(settings.max_hz)),
    ];
    pairs
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

/// The settings that an object of some of them leads to, checked as a whole.
///
/// # Errors
/// [`Refused`], and then nothing was changed.
pub fn changed(control: &dyn Control, wanted: &Map<String, Value>) -> Result<Settings, Refused> {
    let mut settings = control.settings();
    for (name, value) in wanted {
        let refuse = |why: String| Refused {
            key: Some(name.clone()),
            why,
        };
        let key =
            Key::from_name(name).ok_or_else(|| refuse(format!("there is no setting {name}")))?;
        if !control.keys().contains(&key) {
            return Err(refuse(format!("{name} cannot be changed here")));
        }
        let text = as_text(value)
            .ok_or_else(|| refuse(format!("{name}: give a number, a text or null")))?;
        key.set(&mut settings, &text)
            .map_err(|error| refuse(format!("{name}: {text} is not {error}")))?;
    }
    settings.check(&control.limits()).map_err(|error| {
        let why = error.to_string();
        // The core's sentence begins with the setting's name.
        let key = why
            .split(' ')
            .next()
            .filter(|word| Key::from_name(word).is_some());
        Refused {
            key: key.map(str::to_owned),
            why,
        }
    })?;
    Ok(settings)
}

/// A value as the wire's `set` has it.
fn as_text(value: &Value) -> Option<String> {
    match value {
        Value::Null => Some("none".to_owned()),
        Value::Number(number) => Some(number.to_string()),
        Value::String(text) if text.len() < 64 => Some(text.clone()),
        Value::Array(list) if list.len() <= 4 => {
            let numbers: Option<Vec<String>> = list
                .iter()
                .map(|v| v.as_u64().map(|v| v.to_string()))
                .collect();
            numbers.map(|numbers| numbers.join(","))
        }
        _ => None,
    }
}

/// Who may change something.
#[derive(Debug)]
pub enum Access {
    /// Whoever sits at this machine: there is no password.
    Open,
    /// Whoever knows the password; the first one to set it where there is none yet.
    Password(Keeper),
}

/// The password's hash, and where it is kept.
#[derive(Debug, Default)]
pub struct Keeper {
    file: Option<PathBuf>,
    /// It is written in the configuration and cannot be changed over the page.
    fixed: bool,
    hash: Mutex<Option<Hash>>,
}

impl Keeper {
    /// The password of the configuration.
    pub fn fixed(hash: Hash) -> Self {
        Self {
            file: None,
            fixed: true,
            hash: Mutex::new(Some(hash)),
        }
    }

    /// A password whose hash is kept in a file, which need not be there; in memory alone where no file is named.
    ///
    /// # Errors
    /// [`PasswordError::Hash`] where the file is there and holds something else.
    pub fn open(file: Option<PathBuf>) -> Result<Self, PasswordError> {
        let text = file
            .as_deref()
            .and_then(|path| std::fs::read_to_string(path).ok());
        Ok(Self {
            file,
            fixed: false,
            hash: Mutex::new(text.map(|text| text.parse()).transpose()?),
        })
    }

    fn hash(&self) -> std::sync::MutexGuard<'_, Option<Hash>> {
        self.hash.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether there is one.
    pub fn is_set(&self) -> bool {
        self.hash().is_some()
    }

    /// Whether this is the password. One is checked at a time, so that many askers do not take the processor.
    pub fn is(&self, password: &str) -> bool {
        self.hash()
            .as_ref()
            .is_some_and(|hash| hash.is_of(password))
    }

    /// Sets a new one and keeps its hash; the caller has checked the old one.
    ///
    /// # Errors
    /// Why not, in a sentence without a stop.
    pub fn set(&self, password: &str) -> Result<(), String> {
        if self.fixed {
            return Err("the password stands in the configuration: change it there".to_owned());
        }
        let new = Hash::of(password).map_err(|e| e.to_string())?;
        let mut hash = self.hash();
        if let Some(path) = &self.file {
            keep(path, &new)
                .map_err(|e| format!("{}: the password cannot be kept: {e}", path.display()))?;
        }
        *hash = Some(new);
        Ok(())
    }
}

/// Whole or not at all, and for nobody else to read.
fn keep(path: &std::path::Path, hash: &Hash) -> std::io::Result<()> {
    use std::io::Write;
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        std::fs::create_dir_all(folder)?;
    }
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&beside)?;
    writeln!(file, "{hash}")?;
    file.sync_all()?;
    std::fs::rename(&beside, path)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use rowtone::link::settings::Region;

    /// Keeps what it is told in memory.
    pub(crate) struct Desk(pub(crate) Mutex<Settings>);

    impl Default for Desk {
        fn default() -> Self {
            Self(Mutex::new(Settings::default()))
        }
    }

    impl Control for Desk {
        fn settings(&self) -> Settings {
            *self.0.lock().unwrap()
        }
        fn limits(&self) -> Limits {
            Limits {
                width: 320,
                height: 240,
                min_width: 16,
                max_window_s: 60.0,
            }
        }
        fn keys(&self) -> &[Key] {
            &[Key::Window, Key::Hop, Key::Roi, Key::UmPerPx]
        }
        fn is_live(&self) -> bool {
            true
        }
        fn change(&self, settings: Settings) -> Result<(), String> {
            *self.0.lock().unwrap() = settings;
            Ok(())
        }
    }

    fn change(text: &str) -> Result<Settings, Refused> {
        let object: Map<String, Value> = serde_json::from_str(text).unwrap();
        changed(&Desk::default(), &object)
    }

    #[test]
    fn changes_are_checked_as_a_whole() {
        let settings =
            change(r#"{"window":0.4,"hop":0.2,"roi":[1,2,30,40],"um-per-px":12.5}"#).unwrap();
        let roi = Region {
            x: 1,
            y: 2,
            width: 30,
            height: 40,
        };
        assert_eq!(
            (settings.window_s, settings.roi, settings.um_per_px),
            (0.4, Some(roi), Some(12.5))
        );
        assert_eq!(to_json(&settings)["window"], json!(0.4));
        assert_eq!(change(r#"{"um-per-px":null}"#).unwrap().um_per_px, None);
    }

    #[test]
    fn a_wrong_setting_is_refused_with_its_name_and_reason() {
        for (text, key, why) in [
            (r#"{"window":99}"#, Some("window"), "give 0.05 to 60"),
            (
                r#"{"roi":[0,0,9999,9]}"#,
                Some("roi"),
                "keep it inside 320x240 px",
            ),
            (r#"{"roi":[0,-1,20,9]}"#, Some("roi"), "give a number"),
            (
                r#"{"window":"wide"}"#,
                Some("window"),
                "a number of seconds",
            ),
            (r#"{"window":{}}"#, Some("window"), "give a number"),
            (r#"{"wire":"text"}"#, Some("wire"), "cannot be changed here"),
            (r#"{"colour":1}"#, Some("colour"), "no setting"),
        ] {
            let refused = change(text).expect_err(text);
            assert_eq!(refused.key.as_deref(), key, "{text}");
            assert!(refused.why.contains(why), "{}", refused.why);
        }
    }

    #[test]
    fn a_password_is_kept_hashed_and_read_again() {
        let path = std::env::temp_dir().join(format!("rowtone-page-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let keeper = Keeper::open(Some(path.clone())).unwrap();
        assert!(!keeper.is_set() && !keeper.is("anything"));
        assert!(keeper.set("short").is_err());
        keeper.set("long enough").unwrap();
        let again = Keeper::open(Some(path.clone())).unwrap();
        assert!(again.is("long enough") && !again.is("long enouhg"));
        assert!(!std::fs::read_to_string(&path).unwrap().contains("enough"));
        std::fs::write(&path, "long enough").unwrap();
        assert_eq!(
            Keeper::open(Some(path.clone())).err(),
            Some(PasswordError::Hash)
        );
        std::fs::remove_file(&path).unwrap();
        let fixed = Keeper::fixed(
            "pbkdf2-sha256$1$00000000000000000000000000000000$"
                .to_owned()
                .parse()
                .unwrap_or_else(|_| Hash::of("12345678").unwrap()),
        );
        assert!(fixed.set("another one").is_err());
    }
}
