//! One connection to the broker, from its start to its loss.
//!
//! A connection is never mended: when it is lost all of it is thrown away, and the next one sends
//! again from the spool what was not acknowledged. So there is one place that knows what the broker
//! has, and the order holds.

use std::fs;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

use rumqttc::{
    Client, Event, LastWill, MqttOptions, Outgoing, Packet, QoS, TlsConfiguration, Transport,
};
use rustls::pki_types::{CertificateDer, pem::PemObject};

use super::{Input, config::Broker};
use rowtone_failure::Failure;

/// Messages under way at most.
pub(super) const IN_FLIGHT: usize = 64;

/// What a connection tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Note {
    /// The broker has accepted it.
    Connected,
    /// The next message with QoS 1 was sent under this number.
    Sent(u16),
    /// The broker has taken responsibility for the message of this number.
    Acknowledged(u16),
    /// A message came to this gateway.
    Message(Vec<u8>),
    /// It is lost, and why.
    Lost(String),
}

/// What to say to the broker when it starts, and what it is to say when the gateway is gone.
#[derive(Clone, Debug)]
pub(super) struct Will {
    pub(super) topic: String,
    pub(super) payload: Vec<u8>,
    pub(super) retain: bool,
}

/// Checked once at the start: how to reach the broker.
#[derive(Clone)]
pub(super) struct Address {
    broker: Broker,
    password: Option<String>,
    tls: Option<Arc<rustls::ClientConfig>>,
}

impl Address {
    /// Reads the password and the certificates.
    pub(super) fn new(broker: &Broker) -> Result<Self, Failure> {
        let unreadable = |key: &str, path: &std::path::Path, why: String| {
            Failure::input(format!("broker.{key}: {}: {why}", path.display()))
        };
        let password = match &broker.password_file {
            None => broker.password.clone(),
            Some(path) => {
                let text = fs::read_to_string(path)
                    .map_err(|error| unreadable("password_file", path, error.to_string()))?;
                Some(text.trim_end_matches(['\r', '\n']).to_owned())
            }
        };
        let tls = match &broker.tls_ca {
            None => None,
            Some(path) => {
                let tls = tls(path).map_err(|why| unreadable("tls_ca", path, why))?;
                Some(Arc::new(tls))
            }
        };
        Ok(Self {
            broker: broker.clone(),
            password,
            tls,
        })
    }

    /// Starts a connection; what happens on it comes as [`Input::Broker`] with its number.
    pub(super) fn connect(&self, number: u64, will: Will, to: Sender<Input>) -> Client {
        let broker = &self.broker;
        let usual = if self.tls.is_some() { 8883 } else { 1883 };
        let port = broker.port.unwrap_or(usual);
        let mut options = MqttOptions::new(&broker.client_id, &broker.host, port);
        options
            .set_keep_alive(Duration::from_secs(15))
            .set_clean_session(true)
            .set_inflight(IN_FLIGHT as u16)
            .set_max_packet_size(256 * 1024, 256 * 1024)
            .set_last_will(LastWill::new(
                will.topic,
                will.payload,
                QoS::AtLeastOnce,
                will.retain,
            ));
        if let Some(user) = &broker.user {
            options.set_credentials(user, self.password.clone().unwrap_or_default());
        }
        if let Some(tls) = &self.tls {
            let tls = TlsConfiguration::Rustls(Arc::clone(tls));
            options.set_transport(Transport::tls_with_config(tls));
        }
        let (client, mut connection) = Client::new(options, 4 * IN_FLIGHT);
        std::thread::spawn(move || {
            for event in connection.iter() {
                let note = match event {
                    Ok(Event::Incoming(Packet::ConnAck(_))) => Note::Connected,
                    Ok(Event::Incoming(Packet::PubAck(ack))) => Note::Acknowledged(ack.pkid),
                    Ok(Event::Incoming(Packet::Publish(message))) => {
                        Note::Message(message.payload.to_vec())
                    }
                    // Messages with QoS 0 have no number.
                    Ok(Event::Outgoing(Outgoing::Publish(pkid))) if pkid != 0 => Note::Sent(pkid),
                    Ok(_) => continue,
                    Err(error) => Note::Lost(error.to_string()),
                };
                let lost = matches!(note, Note::Lost(_));
                if to.send(Input::Broker(number, note)).is_err() || lost {
                    return;
                }
            }
        });
        client
    }
}

/// TLS that trusts the authorities in this file, and nobody else.
fn tls(path: &std::path::Path) -> Result<rustls::ClientConfig, String> {
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
