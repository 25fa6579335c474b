//! Telling systemd that the program is ready, alive, or stopping (sd_notify(3)): one datagram each.

use std::ffi::{OsStr, OsString};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

/// Says things to systemd, or to nobody where it does not listen.
#[derive(Debug, Default)]
pub struct Notifier {
    to: Option<(UnixDatagram, SocketAddr)>,
}

impl Notifier {
    /// As the environment says (`NOTIFY_SOCKET`).
    pub fn from_environment() -> Self {
        std::env::var_os("NOTIFY_SOCKET").map_or_else(Self::default, |name| Self::to(&name))
    }

    /// To a socket of this name; one that starts with @ is abstract.
    pub fn to(name: &OsStr) -> Self {
        let address = match name.as_bytes() {
            [b'@', rest @ ..] => SocketAddr::from_abstract_name(rest),
            _ => SocketAddr::from_pathname(OsString::from(name)),
        };
        let to = UnixDatagram::unbound().ok().zip(address.ok());
        Self { to }
    }

    /// Says it; nobody listening is no error.
    pub fn say(&self, what: &str) {
        if let Some((socket, address)) = &self.to {
            let _ = socket.send_to_addr(what.as_bytes(), address);
        }
    }

    /// How often systemd wants to hear `WATCHDOG=1`: half of what it waits.
    pub fn watchdog() -> Option<Duration> {
        let us: u64 = std::env::var("WATCHDOG_USEC").ok()?.parse().ok()?;
        (us > 0).then(|| Duration::from_micros(us / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_arrives() {
        let name = format!("rowtone-notify-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).unwrap();
        let systemd = UnixDatagram::bind_addr(&address).unwrap();
        Notifier::to(OsStr::new(&format!("@{name}"))).say("READY=1");
        let mut heard = [0; 32];
        let n = systemd.recv(&mut heard).unwrap();
        assert_eq!(&heard[..n], b"READY=1");
    }

    #[test]
    fn nobody_listening_is_no_error() {
        Notifier::default().say("READY=1");
        Notifier::to(OsStr::new("/nonexistent/socket")).say("READY=1");
    }
}
