//! Looks at every part and says what to do about each.

mod permissions;

use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::time::{Duration, Instant};

use rowtone::tracker::Stage;

use crate::capture::{CameraError, Source};
use crate::clock::FrameClock;
use crate::config::Config;
use crate::lines::Lines;
use crate::memory::Memory;
use crate::setup::Setup;

/// How long the camera is watched at most.
const WATCH: Duration = Duration::from_secs(20);

/// What was found out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// One line a part: `ok`, `look` or `BAD`, and what to do.
    pub text: String,
    /// Something must be done before anything can be measured.
    pub bad: bool,
}

impl Findings {
    fn ok(&mut self, what: &str) {
        let _ = writeln!(self.text, "ok    {what}");
    }

    fn look(&mut self, what: &str) {
        let _ = writeln!(self.text, "look  {what}");
    }

    fn bad(&mut self, what: &str) {
        let _ = writeln!(self.text, "BAD   {what}");
        self.bad = true;
    }
}

/// Looks at the serial port, then at the camera for a few seconds.
pub fn examine(config: &Config, camera: Result<Box<dyn Source>, CameraError>) -> Findings {
    let mut findings = Findings::default();
    port(config, &mut findings);
    permissions::console(config, &mut findings);
    permissions::camera(&mut findings);
    permissions::priority(config, &mut findings);
    match camera {
        Ok(mut source) => watch(source.as_mut(), config, &mut findings),
        Err(e) => findings.bad(&format!("camera: {e}")),
    }
    findings
}

fn port(config: &Config, findings: &mut Findings) {
    let port = &config.output.port;
    if port == "-" || port == crate::uart::TEXT {
        return findings.ok("output: standard output");
    }
    match OpenOptions::new().read(true).write(true).open(port) {
        Ok(_) => findings.ok(&format!("output: {port} can be opened, {} baud", config.output.baud)),
        Err(e) if e.kind() == std::io::ErrorKind::PermissionDenied => findings.bad(&format!(
            "output: {port} may not be opened: add the user to the group dialout (`sudo usermod -aG dialout $USER`)"
        )),
        Err(e) => findings.bad(&format!(
            "output: {port}: {e}: enable the UART (`sudo raspi-config`, Interface, Serial: login shell no, hardware \
             yes) or give output.port"
        )),
    }
}

fn watch(source: &mut dyn Source, config: &Config, findings: &mut Findings) {
    let facts = source.facts().clone();
    findings.ok(&format!(
        "camera: {}, {}x{}, {} bit",
        facts.id,
        facts.shape.width,
        facts.shape.height,
        facts.shape.format.bits()
    ));
    let setup = match Setup::new(&facts, config, &config.settings) {
        Ok(setup) => setup,
        Err(e) => return findings.bad(&format!("setup: {e}")),
    };
    for remark in &setup.remarks {
        if remark.contains("table") {
            findings.look(remark);
        } else {
            findings.ok(remark);
        }
    }
    let mut memory = Memory::new(&setup);
    let clock = FrameClock::new(config.camera.replay, facts.frame_period_ns);
    let (tracker, storage) = memory.lend();
    let mut lines = match Lines::new(&setup, clock, tracker, storage.collected) {
        Ok(lines) => lines,
        Err(e) => return findings.bad(&format!("setup: {e}")),
    };
    let began = Instant::now();
    let enough = 2 * u64::from(config.camera.learn_frames) + 30;
    while lines.clock().counts().good < enough && began.elapsed() < WATCH {
        let patience = Duration::from_secs_f64(config.service.silence_s);
        if let Err(e) = source.next(patience, &mut |frame| lines.frame(&frame, &mut |_| {})) {
            findings.bad(&format!("frames: {e}"));
            break;
        }
    }
    frames(&mut lines, began.elapsed(), findings);
    light(&lines, config, findings);
    texture(&lines, findings);
}

fn frames(lines: &mut Lines<'_>, took: Duration, findings: &mut Findings) {
    let counts = lines.clock().counts();
    let text = format!(
        "frames: {} in {:.1} s, {} lost, {} late, {} corrupt",
        counts.good,
        took.as_secs_f64(),
        counts.lost,
        counts.late,
        counts.corrupt
    );
    if counts.good == 0 {
        findings.bad(&text);
    } else if counts.lost + counts.late + counts.corrupt > counts.good / 50 {
        findings.look(&format!(
            "{text}: close other programs, lower camera.frame_rate_hz"
        ));
    } else {
        findings.ok(&text);
    }
}

fn light(lines: &Lines<'_>, config: &Config, findings: &mut Findings) {
    let light = lines.light();
    let text = format!(
        "light: mean {:.0} %, {:.1} % of the pixels saturated, exposure {} us, gain {}",
        100.0 * light.mean,
        100.0 * light.saturated,
        config.exposure_us(),
        config.camera.gain
    );
    if light.saturated > 0.1 {
        findings.look(&format!(
            "{text}: too bright: lower camera.gain or the light"
        ));
    } else if light.is_bad() {
        findings.look(&format!(
            "{text}: too dark: more light, a higher camera.gain, a wider aperture"
        ));
    } else {
        findings.ok(&text);
    }
}

fn texture(lines: &Lines<'_>, findings: &mut Findings) {
    if lines.tracker().stage() != Stage::Tracking {
        return findings.look("texture: too few frames came to learn the picture");
    }
    let mut sd_px: Vec<f32> = lines
        .tracker()
        .tables()
        .iter()
        .map(|table| table.information_per_px2())
        .filter(|&information| information > 0.0)
        .map(|information| information.sqrt().recip())
        .collect();
    let all = lines.tracker().tables().len();
    sd_px.sort_by(f32::total_cmp);
    let Some(&median) = sd_px.get(sd_px.len() / 2) else {
        return findings
            .bad("texture: no row has any across: focus, or look at a part with upright edges");
    };
    let text = format!(
        "texture: {} of {all} rows can be measured, {median:.3} px a row",
        sd_px.len()
    );
    if sd_px.len() * 2 < all || median > 0.3 {
        findings.look(&format!(
            "{text}: focus better, or look at a part with upright edges"
        ));
    } else {
        findings.ok(&text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::simulated::{Scene, Simulated};

    fn findings(config: &str, camera: Result<Box<dyn Source>, CameraError>) -> Findings {
        examine(&Config::parse(config, "f").unwrap(), camera)
    }

    #[test]
    fn a_good_set_up_is_all_ok() {
        let scene = Scene {
            paced: false,
            height: 60,
            ..Scene::default()
        };
        let camera: Box<dyn Source> = Box::new(Simulated::new(scene));
        let config =
            "[output]\nport = \"-\"\n[camera]\nlearn_frames = 10\n[service]\nrealtime_priority = 0";
        let found = findings(config, Ok(camera));
        assert!(!found.bad, "{}", found.text);
        assert_eq!(
            found.text.matches("ok ").count(),
            found.text.lines().count(),
            "{}",
            found.text
        );
        assert!(found.text.contains("60 of 60 rows"), "{}", found.text);
    }

    #[test]
    fn lines_for_people_need_no_serial_port() {
        let config = format!("[output]\nport = \"{}\"", crate::uart::TEXT);
        let missing = CameraError::Missing {
            wanted: None,
            found: Vec::new(),
        };
        let found = findings(&config, Err(missing));
        let first = found.text.lines().next();
        assert!(
            first.is_some_and(|line| line.contains("ok") && line.contains("standard output")),
            "{}",
            found.text
        );
    }

    #[test]
    fn what_is_missing_is_said_with_what_to_do() {
        let missing = CameraError::Missing {
            wanted: None,
            found: Vec::new(),
        };
        let found = findings("[output]\nport = \"/dev/nonexistent\"", Err(missing));
        assert!(found.bad);
        assert!(found.text.contains("raspi-config"), "{}", found.text);
        assert!(found.text.contains("ribbon cable"), "{}", found.text);
    }
}
