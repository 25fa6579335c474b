//! What the operating system lets the program do, and who else uses the serial port.

use std::fs::{self, OpenOptions};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::Findings;
use crate::config::Config;
use crate::system;

/// Devices of cameras that libcamera opens.
const CAMERA_DEVICES: [(&str, &str); 4] = [
    ("/dev", "media"),
    ("/dev", "video"),
    ("/dev", "v4l-subdev"),
    ("/dev/dma_heap", ""),
];

/// Looks at the camera's devices.
pub(super) fn camera(findings: &mut Findings) {
    let refused: Vec<_> = CAMERA_DEVICES
        .iter()
        .flat_map(|(folder, prefix)| devices(Path::new(folder), prefix))
        .filter(|device| is_denied(device))
        .collect();
    // Of the dma-heaps a program needs one, and only root has the others.
    let (heaps, cameras): (Vec<_>, Vec<_>) = refused
        .iter()
        .partition(|device| device.starts_with("/dev/dma_heap"));
    let all_heaps = devices(Path::new("/dev/dma_heap"), "").count();
    let names = |devices: &[&PathBuf]| {
        let names: Vec<_> = devices.iter().map(|d| d.display().to_string()).collect();
        names.join(", ")
    };
    let group =
        "add the user to the group video (`sudo usermod -aG video $USER`, then log in anew)";
    if !cameras.is_empty() {
        findings.bad(&format!(
            "permissions: {} may not be opened: {group}",
            names(&cameras)
        ));
    } else if all_heaps > 0 && heaps.len() == all_heaps {
        findings.bad(&format!(
            "permissions: no memory for frames, {} may not be opened: {group}",
            names(&heaps)
        ));
    } else {
        findings.ok("permissions: no camera device is closed to this user");
    }
}

/// Looks at the priority of the line thread. Changes that of the thread it looks with, so it takes a new one.
pub(super) fn priority(config: &Config, findings: &mut Findings) {
    let Some(priority) = config.service.realtime_priority else {
        return findings.ok("priority: real time is not asked for");
    };
    let tried = std::thread::spawn(move || system::set_realtime_priority(priority)).join();
    match tried {
        Ok(Ok(())) => findings.ok(&format!("priority: lines are taken at real-time priority {priority}")),
        _ => findings.look(
            "priority: real time is not allowed: start it as the service, or `ulimit -r 50`; frames may be lost on a busy \
             machine",
        ),
    }
}

/// The kernel's console on the serial port would mix its text into the reports.
pub(super) fn console(config: &Config, findings: &mut Findings) {
    let arguments = fs::read_to_string("/proc/cmdline").unwrap_or_default();
    if let Some(console) = console_on(&arguments, &config.output.port) {
        findings.bad(&format!(
            "output: {console} is the kernel's console: `sudo raspi-config`, Interface, Serial: login shell no, hardware \
             yes; then restart"
        ));
    }
}

/// The console in the kernel's arguments that is this port.
fn console_on<'a>(arguments: &'a str, port: &str) -> Option<&'a str> {
    let wanted = real_name(Path::new(port));
    arguments
        .split_whitespace()
        .filter_map(|word| word.strip_prefix("console="))
        .filter_map(|value| value.split(',').next())
        .find(|name| real_name(&Path::new("/dev").join(name)) == wanted)
}

/// What a link such as /dev/serial0 stands for.
fn real_name(device: &Path) -> PathBuf {
    fs::canonicalize(device).unwrap_or_else(|_| device.to_owned())
}

fn devices(folder: &Path, prefix: &str) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(move |entry| {
            let name = entry.file_name();
            name.to_str().is_some_and(|name| name.starts_with(prefix))
        })
        .map(|entry| entry.path())
}

fn is_denied(device: &Path) -> bool {
    let opened = OpenOptions::new().read(true).write(true).open(device);
    opened.is_err_and(|e| e.kind() == ErrorKind::PermissionDenied)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_console_on_our_port_is_found() {
        let arguments = "console=serial0,115200 console=tty1 root=PARTUUID=1234 rootwait";
        assert_eq!(console_on(arguments, "/dev/serial0"), Some("serial0"));
        assert_eq!(console_on(arguments, "/dev/ttyUSB0"), None);
        assert_eq!(console_on("quiet", "/dev/serial0"), None);
    }

    #[test]
    fn a_link_is_followed() {
        let link = std::env::temp_dir().join(format!("rowtone-link-{}", std::process::id()));
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        let found = console_on("console=null", link.to_str().unwrap());
        fs::remove_file(&link).unwrap();
        assert_eq!(found, Some("null"));
    }
}
