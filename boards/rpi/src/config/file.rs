//! The file as it is written, and its way into a checked [`Config`].

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use rowtone::alarm::Level;
use rowtone::link::settings::{Key, Region};
use rowtone::report::MAX_PEAKS;
use rowtone::wire::Format;
use serde::Deserialize;
use toml::Spanned;

use super::{Config, ConfigError, ContactConfig, Replay, StreamWish};

type Maybe<T> = Option<Spanned<T>>;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct File {
    camera: Camera,
    measure: Measure,
    output: Output,
    service: Service,
    page: Page,
    alarms: Alarms,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Camera {
    id: Option<String>,
    mode: Maybe<String>,
    stream: Maybe<String>,
    full_depth: Maybe<bool>,
    frame_rate_hz: Maybe<f64>,
    two_frame_rates: Maybe<bool>,
    exposure_us: Maybe<u32>,
    gain: Maybe<f64>,
    focus_dioptres: Maybe<f64>,
    roi: Maybe<[u16; 4]>,
    line_time_us: Maybe<f64>,
    calibration: Option<PathBuf>,
    learn_frames: Maybe<u16>,
    take_every: Maybe<u32>,
    frame_period_us: Maybe<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Measure {
    window_s: Maybe<f64>,
    hop_s: Maybe<f64>,
    max_peaks: Maybe<u8>,
    false_alarm: Maybe<f64>,
    min_hz: Maybe<f64>,
    max_hz: Maybe<f64>,
    um_per_px: Maybe<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Output {
    port: Option<String>,
    baud: Maybe<u32>,
    wire: Maybe<String>,
    unit: Maybe<u8>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Service {
    realtime_priority: Maybe<u8>,
    silence_s: Maybe<f64>,
    state: Option<PathBuf>,
    trend: Option<PathBuf>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Page {
    listen: Maybe<String>,
    password: Maybe<String>,
    names: Vec<String>,
    clip_mib: Maybe<u32>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Alarms {
    rules: Option<PathBuf>,
    gpio_chip: Option<PathBuf>,
    gpio_line: Maybe<u32>,
    gpio_at: Maybe<String>,
    gpio_fail_safe: Maybe<bool>,
}

/// Turns places in the text into errors.
struct Reader<'a> {
    text: &'a str,
    name: &'a str,
}

impl Reader<'_> {
    fn error(&self, at: Option<usize>, what: String) -> ConfigError {
        let before = at.and_then(|at| self.text.get(..at));
        ConfigError {
            file: self.name.to_owned(),
            line: before.map(|text| 1 + text.matches('\n').count()),
            what,
        }
    }

    /// The value, where it is given and lies within the range.
    fn number<T: Copy + PartialOrd + Display>(
        &self,
        key: &str,
        value: &Maybe<T>,
        range: RangeInclusive<T>,
    ) -> Result<Option<T>, ConfigError> {
        let Some(value) = value else { return Ok(None) };
        let number = *value.get_ref();
        if range.contains(&number) {
            return Ok(Some(number));
        }
        let (low, high) = (range.start(), range.end());
        let what = format!("{key} is {number}: give {low} to {high}");
        Err(self.error(Some(value.span().start), what))
    }

    /// One of these words.
    fn word<T: Copy>(
        &self,
        key: &str,
        value: &Maybe<String>,
        words: &[(&str, T)],
    ) -> Result<Option<T>, ConfigError> {
        let Some(value) = value else { return Ok(None) };
        if let Some((_, meant)) = words.iter().find(|(word, _)| word == value.get_ref()) {
            return Ok(Some(*meant));
        }
        let known: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let what = format!(
            "{key} is {:?}: give {}",
            value.get_ref(),
            known.join(" or ")
        );
        Err(self.error(Some(value.span().start), what))
    }
}

pub(super) fn read(text: &str, name: &str) -> Result<Config, ConfigError> {
    let reader = Reader { text, name };
    let file: File = toml::from_str(text).map_err(|e| {
        let what = e.message().lines().collect::<Vec<_>>().join(" ");
        reader.error(e.span().map(|s| s.start), what)
    })?;
    let mut config = Config::defaults();
    reader.camera(&file.camera, &mut config)?;
    reader.measure(&file.measure, &mut config)?;
    reader.output(&file.output, &mut config)?;
    let service = &file.service;
    if let Some(priority) = reader.number(
        "service.realtime_priority",
        &service.realtime_priority,
        0..=99,
    )? {
        config.service.realtime_priority = (priority > 0).then_some(priority);
    }
    let silence = reader.number("service.silence_s", &service.silence_s, 0.1..=3600.0)?;
    config.service.silence_s = silence.unwrap_or(config.service.silence_s);
    if let Some(state) = &service.state {
        config.service.state.clone_from(state);
    }
    let trend = service.trend.as_ref();
    config.service.trend = trend.filter(|dir| !dir.as_os_str().is_empty()).cloned();
    reader.page(&file.page, &mut config)?;
    reader.alarms(&file.alarms, &mut config)?;
    config.given = given(&file);
    Ok(config)
}

/// The settings that the file names.
fn given(file: &File) -> Vec<Key> {
    let File {
        camera,
        measure,
        output,
        ..
    } = file;
    let named = [
        (Key::Roi, camera.roi.is_some()),
        (Key::Window, measure.window_s.is_some()),
        (Key::Hop, measure.hop_s.is_some()),
        (Key::MaxPeaks, measure.max_peaks.is_some()),
        (Key::FalseAlarm, measure.false_alarm.is_some()),
        (Key::MinHz, measure.min_hz.is_some()),
        (Key::MaxHz, measure.max_hz.is_some()),
        (Key::UmPerPx, measure.um_per_px.is_some()),
        (Key::Wire, output.wire.is_some()),
        (Key::Unit, output.unit.is_some()),
    ];
    named
        .into_iter()
        .filter_map(|(key, is_named)| is_named.then_some(key))
        .collect()
}

impl Reader<'_> {
    fn alarms(&self, file: &Alarms, config: &mut Config) -> Result<(), ConfigError> {
        config.alarms.rules.clone_from(&file.rules);
        let line = self.number("alarms.gpio_line", &file.gpio_line, 0..=1023)?;
        let levels = [Level::Warning, Level::Trip].map(|level| (level.name(), level));
        let at = self.word("alarms.gpio_at", &file.gpio_at, &levels)?;
        let Some(line) = line else { return Ok(()) };
        if file.rules.is_none() {
            let place = file.gpio_line.as_ref().map(|v| v.span().start);
            let what = "alarms.gpio_line needs alarms.rules beside it";
            return Err(self.error(place, what.to_owned()));
        }
        let usual = || PathBuf::from("/dev/gpiochip0");
        config.alarms.contact = Some(ContactConfig {
            chip: file.gpio_chip.clone().unwrap_or_else(usual),
            line,
            at: at.unwrap_or(Level::Trip),
            fail_safe: file.gpio_fail_safe.as_ref().is_some_and(|v| *v.get_ref()),
        });
        Ok(())
    }

    fn page(&self, file: &Page, config: &mut Config) -> Result<(), ConfigError> {
        let page = &mut config.page;
        if let Some(listen) = &file.listen {
            page.listen = match listen.get_ref().as_str() {
                "off" => None,
                text => Some(text.parse().map_err(|_| {
                    let what = format!(
                        "page.listen is {text:?}: give an address and port as 0.0.0.0:7357, or off"
                    );
                    self.error(Some(listen.span().start), what)
                })?),
            };
        }
        if let Some(password) = file.password.as_ref().filter(|p| !p.get_ref().is_empty()) {
            let hash = password.get_ref().parse();
            page.password = Some(hash.map_err(|e| {
                let what = format!("page.password: {e}: make it with `rowtone-rpi password`");
                self.error(Some(password.span().start), what)
            })?);
        }
        page.names.clone_from(&file.names);
        let mib = self.number("page.clip_mib", &file.clip_mib, 0..=4096)?;
        page.clip_bytes = mib.map_or(page.clip_bytes, |mib| (mib as usize) << 20);
        Ok(())
    }

    fn camera(&self, file: &Camera, config: &mut Config) -> Result<(), ConfigError> {
        let camera = &mut config.camera;
        camera.id.clone_from(&file.id);
        camera.calibration.clone_from(&file.calibration);
        if let Some(mode) = &file.mode {
            let wish = mode.get_ref().parse();
            camera.mode =
                wish.map_err(|what| self.error(Some(mode.span().start), format!("camera.{what}")))?;
        }
        let streams = [("raw", StreamWish::Raw), ("luma", StreamWish::Luma)];
        camera.stream = self
            .word("camera.stream", &file.stream, &streams)?
            .unwrap_or_default();
        camera.frame_rate_hz =
            self.number("camera.frame_rate_hz", &file.frame_rate_hz, 1.0..=2000.0)?;
        let switch = |value: &Maybe<bool>| value.as_ref().is_some_and(|v| *v.get_ref());
        camera.full_depth = switch(&file.full_depth);
        camera.two_frame_rates = switch(&file.two_frame_rates);
        camera.exposure_us = self.number("camera.exposure_us", &file.exposure_us, 1..=1_000_000)?;
        let gain = self.number("camera.gain", &file.gain, 1.0..=64.0)?;
        camera.gain = gain.map_or(camera.gain, |gain| gain as f32);
        let focus = self.number("camera.focus_dioptres", &file.focus_dioptres, 0.0..=32.0)?;
        camera.focus_dioptres = focus.map(|dioptres| dioptres as f32);
        let line = self.number("camera.line_time_us", &file.line_time_us, 0.1..=4000.0)?;
        camera.line_time_s = line.map(|us| us * 1e-6);
        let learn = self.number("camera.learn_frames", &file.learn_frames, 1..=1000)?;
        camera.learn_frames = learn.unwrap_or(camera.learn_frames);
        let every = self.number("camera.take_every", &file.take_every, 1..=1000)?;
        let period = self.number("camera.frame_period_us", &file.frame_period_us, 100.0..=1e7)?;
        camera.replay = match (every, period) {
            (None, None) => None,
            (every, Some(us)) => Some(Replay {
                take_every: every.unwrap_or(1),
                frame_period_ns: (us * 1000.0) as i64,
            }),
            (Some(_), None) => {
                let at = file.take_every.as_ref().map(|v| v.span().start);
                let what = "camera.take_every needs camera.frame_period_us beside it";
                return Err(self.error(at, what.to_owned()));
            }
        };
        if let Some(roi) = &file.roi {
            let [x, y, width, height] = *roi.get_ref();
            if width < 16
                || height < 1
                || x.checked_add(width).is_none()
                || y.checked_add(height).is_none()
            {
                let what = "camera.roi: give [x, y, width, height] with a width of 16 px or more";
                return Err(self.error(Some(roi.span().start), what.to_owned()));
            }
            config.settings.roi = Some(Region {
                x,
                y,
                width,
                height,
            });
        }
        Ok(())
    }

    fn measure(&self, file: &Measure, config: &mut Config) -> Result<(), ConfigError> {
        let settings = &mut config.settings;
        if let Some(window) = self.number("measure.window_s", &file.window_s, 0.05..=60.0)? {
            settings.window_s = window as f32;
            settings.hop_s = settings.hop_s.min(settings.window_s);
        }
        let most = f64::from(settings.window_s);
        if let Some(hop) = self.number("measure.hop_s", &file.hop_s, 0.01..=most)? {
            settings.hop_s = hop as f32;
        }
        let peaks = self.number("measure.max_peaks", &file.max_peaks, 1..=MAX_PEAKS as u8)?;
        settings.max_peaks = peaks.unwrap_or(settings.max_peaks);
        let alarm = self.number("measure.false_alarm", &file.false_alarm, 1e-9..=0.5)?;
        settings.false_alarm = alarm.map_or(settings.false_alarm, |v| v as f32);
        let real = |v: Option<f64>| v.map(|v| v as f32);
        settings.max_hz = real(self.number("measure.max_hz", &file.max_hz, 0.1..=100_000.0)?);
        let below = f64::from(settings.max_hz.unwrap_or(100_000.0)) * 0.999;
        settings.min_hz = real(self.number("measure.min_hz", &file.min_hz, 0.001..=below)?);
        let scale = self.number("measure.um_per_px", &file.um_per_px, 0.001..=100_000.0)?;
        settings.um_per_px = real(scale);
        Ok(())
    }

    fn output(&self, file: &Output, config: &mut Config) -> Result<(), ConfigError> {
        if let Some(port) = &file.port {
            config.output.port.clone_from(port);
        }
        let baud = self.number("output.baud", &file.baud, 300..=4_000_000)?;
        config.output.baud = baud.unwrap_or(config.output.baud);
        let wires = Format::ALL.map(|wire| (wire.name(), wire));
        let wire = self.word("output.wire", &file.wire, &wires)?;
        config.settings.wire = wire.unwrap_or(config.settings.wire);
        let unit = self.number("output.unit", &file.unit, 1..=247)?;
        config.settings.unit = unit.unwrap_or(config.settings.unit);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Wish;

    fn refused(text: &str) -> String {
        read(text, "f.toml").unwrap_err().to_string()
    }

    #[test]
    fn a_contact_needs_rules_and_has_a_usual_chip() {
        let text = "[alarms]\nrules = \"/etc/a.toml\"\ngpio_line = 17\ngpio_at = \"warning\"\ngpio_fail_safe = true";
        let alarms = read(text, "f.toml").unwrap().alarms;
        assert_eq!(alarms.rules, Some("/etc/a.toml".into()));
        let contact = ContactConfig {
            chip: "/dev/gpiochip0".into(),
            line: 17,
            at: Level::Warning,
            fail_safe: true,
        };
        assert_eq!(alarms.contact, Some(contact));
        assert_eq!(
            refused("[alarms]\n\ngpio_line = 17"),
            "f.toml:3: alarms.gpio_line needs alarms.rules beside it"
        );
        assert_eq!(
            refused("[alarms]\nrules = \"a\"\ngpio_at = \"normal\""),
            "f.toml:3: alarms.gpio_at is \"normal\": give warning or trip"
        );
    }

    #[test]
    fn a_trend_is_kept_where_it_is_asked_for() {
        let config = read("[service]\ntrend = \"/var/lib/t\"", "f.toml").unwrap();
        assert_eq!(config.service.trend, Some("/var/lib/t".into()));
    }

    #[test]
    fn nothing_is_needed() {
        assert_eq!(read("", "f.toml").unwrap(), Config::defaults());
    }

    #[test]
    fn the_file_that_is_installed_is_good_with_and_without_its_comments() {
        let text = include_str!("../../debian/rowtone-rpi.toml");
        assert_eq!(read(text, "f.toml").unwrap(), Config::defaults());
        // `# key = value   # comment` becomes `key = value   # comment`.
        let bare: String = text
            .lines()
            .map(|line| match line.strip_prefix("# ") {
                Some(rest)
                    if rest
                        .split_once(" = ")
                        .is_some_and(|(key, _)| !key.contains(' ')) =>
                {
                    format!("{rest}\n")
                }
                _ => format!("{line}\n"),
            })
            .collect();
        let config = read(&bare, "f.toml").unwrap();
        assert_eq!(config.camera.id.as_deref(), Some("imx477"));
        assert_eq!(config.settings.max_hz, Some(1000.0));
        assert_eq!(config.output, Config::defaults().output);
        assert_eq!(config.page, Config::defaults().page);
        assert_eq!(config.service, Config::defaults().service);
    }

    #[test]
    fn errors_name_line_and_key() {
        let hop = refused("[measure]\n\nwindow_s = 0.5\nhop_s = 0.8\n");
        assert_eq!(hop, "f.toml:4: measure.hop_s is 0.8: give 0.01 to 0.5");
        let unknown = refused("[camera]\nshutter = 3\n");
        assert!(
            unknown.starts_with("f.toml:2: unknown field `shutter`"),
            "{unknown}"
        );
        let wire = refused("[output]\nwire = \"morse\"");
        assert_eq!(
            wire,
            "f.toml:2: output.wire is \"morse\": give text or binary or modbus"
        );
        let kind = refused("[output]\n# a comment\nbaud = \"fast\"");
        assert!(kind.starts_with("f.toml:3: "), "{kind}");
        let mode = refused("[camera]\nmode = \"big\"");
        assert!(mode.starts_with("f.toml:2: camera.mode"), "{mode}");
        assert!(refused("[camera]\ntake_every = 4").contains("frame_period_us"));
        assert!(refused("[camera]\nroi = [0, 0, 8, 8]").contains("camera.roi"));
        assert!(refused("[camera\n").starts_with("f.toml:1: "));
        assert!(refused("[measure]\nmin_hz = nan").starts_with("f.toml:2: measure.min_hz is NaN"));
    }

    #[test]
    fn the_file_has_the_last_word_on_what_it_names() {
        let config = read("[measure]\nwindow_s = 0.5\n[output]\nwire = \"text\"", "f").unwrap();
        let saved = rowtone::link::settings::Settings {
            window_s: 2.0,
            hop_s: 1.0,
            um_per_px: Some(7.0),
            wire: Format::Modbus,
            ..Default::default()
        };
        let (settings, said) = config.with_saved(saved);
        assert_eq!((settings.window_s, settings.wire), (0.5, Format::Text));
        assert_eq!((settings.hop_s, settings.um_per_px), (0.5, Some(7.0)));
        let said = said.join("\n");
        for line in [
            "window is 0.5, as the file says, and not 2, as was saved",
            "wire is text, as the file says, and not modbus, as was saved",
            "um-per-px is 7, as was saved; the file does not name it",
        ] {
            assert!(said.lines().any(|said| said == line), "{said}");
        }
    }

    #[test]
    fn the_page_is_where_the_file_says() {
        let page = |text: &str| read(&format!("[page]\n{text}"), "f").map(|config| config.page);
        assert_eq!(page("listen = \"off\"").unwrap().listen, None);
        let listen = page("listen = \"127.0.0.1:80\"").unwrap().listen;
        assert_eq!(listen, Some(([127, 0, 0, 1], 80).into()));
        let error = page("listen = \"7357\"").unwrap_err().to_string();
        assert!(error.starts_with("f:2: page.listen is \"7357\""), "{error}");
        let error = page("password = \"open sesame\"").unwrap_err().to_string();
        assert!(error.contains("`rowtone-rpi password`"), "{error}");
    }

    #[test]
    fn exposure_follows_the_highest_frequency() {
        assert_eq!(read("", "f").unwrap().exposure_us(), 250);
        assert_eq!(
            read("[measure]\nmax_hz = 500.0", "f")
                .unwrap()
                .exposure_us(),
            500
        );
        let given = read("[camera]\nexposure_us = 77\nmode = \"1332x990\"", "f").unwrap();
        assert_eq!(given.exposure_us(), 77);
        assert_eq!(
            given.camera.mode,
            Wish::Size {
                width: 1332,
                height: 990
            }
        );
    }
}
