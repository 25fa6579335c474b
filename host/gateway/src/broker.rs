//! How to reach the broker, checked once, and what to say when it cannot be.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use rustls::pki_types::{CertificateDer, pem::PemObject};

use super::error::GatewayError;
use super::mqtt::connection::{self, Client, Endpoint, KEEP_ALIVE_S, Loss};
use super::mqtt::packet::{self, Hello, MAX_STRING, Message};
use super::{Input, config::Broker};

/// Checked once at the start: how to reach the broker.
#[derive(Clone)]
pub(super) struct Address {
    broker: Broker,
    password: Option<String>,
    endpoint: Endpoint,
}

impl Address {
    /// Reads the password and the certificates.
    ///
    /// # Errors
    /// One line that names the key and the file.
    pub(super) fn new(broker: &Broker) -> Result<Self, GatewayError> {
        let unreadable = |key, path: &Path, why: String| GatewayError::File {
            key,
            path: path.to_path_buf(),
            why,
        };
        let password = match &broker.password_file {
            None => broker.password.clone(),
            Some(path) => {
                let text = fs::read_to_string(path)
                    .map_err(|error| unreadable("broker.password_file", path, error.to_string()))?;
                let text = text.trim_end_matches(['\r', '\n']);
                if text.len() > MAX_STRING {
                    let why = format!("longer than {MAX_STRING} bytes");
                    return Err(unreadable("broker.password_file", path, why));
                }
                Some(text.to_owned())
            }
        };
        let tls = match &broker.tls_ca {
            None => None,
            Some(path) => {
                let tls = tls(path).map_err(|why| unreadable("broker.tls_ca", path, why))?;
                Some(Arc::new(tls))
            }
        };
        let usual = if tls.is_some() { 8883 } else { 1883 };
        Ok(Self {
            endpoint: Endpoint {
                host: broker.host.clone(),
                port: broker.port.unwrap_or(usual),
                tls,
            },
            broker: broker.clone(),
            password,
        })
    }

    /// Starts a connection; what happens on it comes as [`Input::Broker`] with its number.
    ///
    /// # Errors
    /// No thread is to be had, or no connection can be asked for like this.
    pub(super) fn connect(
        &self,
        number: u64,
        will: &Message,
        to: &Sender<Input>,
    ) -> io::Result<Client> {
        let user = self.broker.user.as_deref();
        let hello = Hello {
            client_id: &self.broker.client_id,
            user,
            // A password needs a user.
            password: user.and(self.password.as_deref()),
            keep_alive_s: KEEP_ALIVE_S,
            will,
        };
        let connect = packet::connect(&hello).map_err(|why| io::Error::other(why.to_string()))?;
        let to = to.clone();
        connection::start(self.endpoint.clone(), connect, move |note| {
            to.send(Input::Broker(number, note)).is_ok()
        })
    }
}

/// TLS that trusts the authorities in this file, and nobody else.
fn tls(path: &Path) -> Result<rustls::ClientConfig, String> {
    let mut roots = rustls::RootCertStore::empty();
    let certificates = CertificateDer::pem_file_iter(path).map_err(|error| error.to_string())?;
    for certificate in certificates {
        let certificate = certificate.map_err(|error| error.to_string())?;
        roots.add(certificate).map_err(|error| error.to_string())?;
    }
    if roots.is_empty() {
        return Err("there is no certificate in it".to_owned());
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    Ok(rustls::ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|error| error.to_string())?
        .with_root_certificates(roots)
        .with_no_client_auth())
}

/// A connection that lived so long was a good one.
const GOOD: Duration = Duration::from_secs(30);
/// A broker that is not there is tried again at least this often.
const LONGEST_ABSENCE: Duration = Duration::from_secs(5);
/// One that accepts connections and closes them soon, this often.
const LONGEST_QUARREL: Duration = Duration::from_secs(60);

/// When to try again, and what to say of the last connections.
#[derive(Debug, Default)]
pub(super) struct Retry {
    /// When the connection was accepted, if one is.
    since: Option<Instant>,
    /// Attempts in a row that reached no broker.
    absent: u32,
    /// Connections in a row that were accepted and did not last.
    short: u32,
    /// What was said last.
    said: Option<String>,
}

impl Retry {
    /// The broker has accepted the connection; whether it was away before.
    pub(super) fn accepted(&mut self, now: Instant) -> bool {
        self.since = Some(now);
        self.said = None;
        std::mem::take(&mut self.absent) > 0
    }

    /// It is lost: how long to wait, and what to say, if there is something new. A connection that
    /// lived for a moment does not reset the wait. `cause` is why the broker may close connections
    /// that it has just accepted.
    pub(super) fn lost(
        &mut self,
        loss: &Loss,
        cause: &str,
        now: Instant,
    ) -> (Duration, Option<String>) {
        let Some(since) = self.since.take() else {
            self.absent += 1;
            let wait = doubled(self.absent, LONGEST_ABSENCE);
            let said = format!("away ({}); reports are kept on disk", loss.why);
            let is_new = self.said.as_ref() != Some(&said);
            self.said = Some(said.clone());
            return (wait, is_new.then_some(said));
        };
        if now.duration_since(since) >= GOOD {
            self.short = 0;
        }
        self.short += 1;
        // A broker that was started anew twice is no quarrel.
        let wait = doubled(self.short.saturating_sub(1).max(1), LONGEST_QUARREL);
        let mut said = format!("away ({}); reports are kept on disk", loss.why);
        if self.short >= 3 && loss.by_broker {
            said = format!(
                "it accepted the connection and closed it soon after, {} times now; the likely cause: \
                 {cause}; next try in {} s",
                self.short,
                wait.as_secs()
            );
        }
        (wait, Some(said))
    }
}

/// 1 s, 2 s, 4 s … for the first, second, third time.
fn doubled(times: u32, longest: Duration) -> Duration {
    let seconds = 1_u64 << times.saturating_sub(1).min(10);
    Duration::from_secs(seconds).min(longest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn closed() -> Loss {
        Loss {
            why: "it closed it".to_owned(),
            by_broker: true,
        }
    }

    #[test]
    fn a_connection_of_a_second_does_not_reset_the_wait() {
        let (mut retry, mut now) = (Retry::default(), Instant::now());
        let mut waits = vec![];
        let mut said = vec![];
        for _ in 0..9 {
            retry.accepted(now);
            now += Duration::from_secs(1);
            let (wait, line) = retry.lost(&closed(), "a twin", now);
            waits.push(wait.as_secs());
            said.extend(line);
            now += wait;
        }
        assert_eq!(waits, [1, 1, 2, 4, 8, 16, 32, 60, 60]);
        assert!(said[0].starts_with("away"), "{said:?}");
        assert!(
            said[8].contains("cause: a twin; next try in 60 s"),
            "{said:?}"
        );
        // A good one does.
        retry.accepted(now);
        let (wait, line) = retry.lost(&closed(), "a twin", now + GOOD);
        assert_eq!(wait.as_secs(), 1);
        assert!(line.unwrap().starts_with("away"));
    }

    #[test]
    fn a_broker_that_is_away_is_said_once_and_tried_often() {
        let mut retry = Retry::default();
        let refused = |why: &str| Loss {
            why: why.to_owned(),
            by_broker: false,
        };
        let mut try_once = |why| retry.lost(&refused(why), "a twin", Instant::now());
        let said: Vec<bool> = ["x", "x", "x", "y", "y"]
            .map(|why| try_once(why).1.is_some())
            .to_vec();
        assert_eq!(said, [true, false, false, true, false]);
        assert_eq!(try_once("y").0, LONGEST_ABSENCE);
    }
}
