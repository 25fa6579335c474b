//! What a configuration says of files and devices, checked on the computer where it is to run.

use std::path::{Path, PathBuf};

use super::broker::Address;
use super::config::Config;
use super::error::GatewayError;

/// Checks what [`Config::read`] cannot see in the text: that the files it names are there, that no
/// device is named twice, and who reads the password.
///
/// # Errors
/// One line that names the key and the file.
pub fn check(config: &Config, path: &Path) -> Result<(), GatewayError> {
    Address::new(&config.broker)?;
    twins(config)?;
    match open_secret(config, path) {
        Some(why) => Err(GatewayError::OpenSecret(why)),
        None => Ok(()),
    }
}

/// Two boards whose ports are one and the same device, by a link or by its number.
///
/// # Errors
/// One line that names both.
pub(super) fn twins(config: &Config) -> Result<(), GatewayError> {
    let mut seen: Vec<(PathBuf, Option<u64>, &str)> = vec![];
    for board in &config.boards {
        let given = PathBuf::from(&board.port.path);
        // One that is not there yet can still be compared by name.
        let real = std::fs::canonicalize(&given).unwrap_or(given);
        let number = device_number(&real);
        let same = |one: &&(PathBuf, Option<u64>, &str)| {
            one.0 == real || (number.is_some() && one.1 == number)
        };
        if let Some((_, _, other)) = seen.iter().find(same) {
            return Err(GatewayError::Twins {
                port: board.port.path.clone(),
                boards: [board.name.clone(), (*other).to_owned()],
                device: real,
            });
        }
        seen.push((real, number, &board.name));
    }
    Ok(())
}

/// Why the password is no secret, where it stands in a file that everybody on this computer can read;
/// `path` is the configuration's own.
pub fn open_secret(config: &Config, path: &Path) -> Option<String> {
    let (key, file) = match (&config.broker.password_file, &config.broker.password) {
        (Some(file), _) => ("broker.password_file", file.as_path()),
        (None, Some(_)) => ("broker.password", path),
        (None, None) => return None,
    };
    everybody_reads(file).then(|| {
        format!(
            "{key}: {}: everybody on this computer can read it; chmod o-r",
            file.display()
        )
    })
}

#[cfg(unix)]
fn everybody_reads(file: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(file).is_ok_and(|meta| meta.is_file() && meta.mode() & 0o004 != 0)
}

#[cfg(not(unix))]
fn everybody_reads(_: &Path) -> bool {
    false
}

#[cfg(unix)]
fn device_number(path: &Path) -> Option<u64> {
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    let meta = std::fs::metadata(path).ok()?;
    meta.file_type().is_char_device().then(|| meta.rdev())
}

#[cfg(not(unix))]
fn device_number(_: &Path) -> Option<u64> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn config(
        dir: &Path,
        broker: &str,
        ports: [&str; 2],
    ) -> Result<(Config, PathBuf), GatewayError> {
        let path = dir.join("gateway.toml");
        let [a, b] = ports;
        let text = format!(
            "[broker]\nhost = \"h\"\nclient_id = \"c\"\n{broker}\n[payload]\nformat = \"json\"\n\
             topic = \"t\"\n[spool]\ndir = \"s\"\n[[board]]\nname = \"a\"\nport = \"{a}\"\n\
             [[board]]\nname = \"b\"\nport = \"{b}\"\n"
        );
        std::fs::write(&path, text).unwrap();
        let mode = std::fs::Permissions::from_mode(0o600);
        std::fs::set_permissions(&path, mode).unwrap();
        Config::read(&path).map(|config| (config, path))
    }

    #[test]
    fn what_the_text_does_not_show() {
        let dir = std::env::temp_dir().join(format!("rowtone-files-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        let link = dir.join("by-id");
        symlink("/dev/null", &link).unwrap();
        let link = link.to_str().unwrap();
        let password = dir.join("password");
        let file = |key: &str| format!("{key} = \"{}\"", password.display());
        let two = ["/dev/null", "/dev/zero"];
        let check = |broker: &str, ports| {
            let (config, path) = config(&dir, broker, ports).unwrap();
            check(&config, &path).map_err(|why| why.to_string())
        };
        assert_eq!(check("", two), Ok(()));
        let error = check("", ["/dev/null", link]).unwrap_err();
        assert!(
            error.contains("b and a are one and the same device"),
            "{error}"
        );
        let error = check(&file("password_file"), two).unwrap_err();
        assert!(error.starts_with("broker.password_file: "), "{error}");
        let error = check(&file("tls_ca"), two).unwrap_err();
        assert!(error.starts_with("broker.tls_ca: "), "{error}");
        std::fs::write(&password, "secret\n").unwrap();
        for (mode, right) in [(0o600, true), (0o640, true), (0o644, false)] {
            let mode = std::fs::Permissions::from_mode(mode);
            std::fs::set_permissions(&password, mode).unwrap();
            assert_eq!(check(&file("password_file"), two).is_ok(), right);
        }
        std::fs::remove_dir_all(dir).unwrap();
    }
}
