//! One connection to a broker, from its start to its loss, on a thread of its own.
//!
//! It is never mended: when it is lost all of it is thrown away. What happens on it comes as
//! [`Note`]s; the last one is [`Note::Lost`].

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, StreamOwned};

use super::packet::{self, Decoder, Message, PING, Packet};

/// The broker has to answer at its start, to a ping, and take what is written, within this.
const PATIENCE: Duration = Duration::from_secs(10);
/// How often something is said, if only a ping.
const PING_EVERY: Duration = Duration::from_secs(7);
/// What the broker is told of it: it gives up after one and a half times this.
pub(crate) const KEEP_ALIVE_S: u16 = 15;
/// How long to wait for something to come before looking whether something is to be sent.
const STEP: Duration = Duration::from_millis(20);

/// What happens on a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Note {
    /// The broker has accepted it.
    Connected,
    /// The broker has taken responsibility for the message of this number.
    Acknowledged(u16),
    /// A message came.
    Message(Message),
    /// One came that is too long to be read: so many bytes. It is passed over.
    PassedOver(usize),
    /// It is lost.
    Lost(Loss),
}

/// Why a connection is lost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Loss {
    /// In words.
    pub(crate) why: String,
    /// The broker had accepted it, and it was its end that closed it.
    pub(crate) by_broker: bool,
}

/// Where a broker is.
#[derive(Clone)]
pub(crate) struct Endpoint {
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) tls: Option<Arc<ClientConfig>>,
}

/// This side's end. When it is dropped, what was handed over is sent, and the connection ends.
#[derive(Debug)]
pub(crate) struct Client(Sender<Vec<u8>>);

impl Client {
    /// Hands over a packet. On a connection that is lost it goes nowhere; its last note says so.
    pub(crate) fn send(&self, packet: Vec<u8>) {
        let _ = self.0.send(packet);
    }
}

/// Starts a connection with this CONNECT; `note` takes what happens until it returns false.
///
/// # Errors
/// There is no thread to be had.
pub(crate) fn start(
    endpoint: Endpoint,
    connect: Vec<u8>,
    mut note: impl FnMut(Note) -> bool + Send + 'static,
) -> io::Result<Client> {
    let (client, to_send) = channel();
    let work = move || {
        let mut accepted = false;
        let ended = Stream::open(&endpoint).and_then(|mut stream| {
            stream.write_all(&connect)?;
            stream.flush()?;
            serve(&mut stream, &to_send, &mut |one| {
                accepted |= one == Note::Connected;
                note(one)
            })
        });
        let why = match &ended {
            Ok(()) => "ended".to_owned(),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => "it closed it".to_owned(),
            Err(error) => error.to_string(),
        };
        let closed = [
            ErrorKind::UnexpectedEof,
            ErrorKind::ConnectionReset,
            ErrorKind::ConnectionAborted,
            ErrorKind::BrokenPipe,
        ];
        let by_broker = accepted && ended.is_err_and(|error| closed.contains(&error.kind()));
        note(Note::Lost(Loss { why, by_broker }));
    };
    let thread = std::thread::Builder::new().name("mqtt".to_owned());
    thread.spawn(work)?;
    Ok(Client(client))
}

/// Goes on until the connection is lost, the client is dropped, or `note` wants no more.
fn serve(
    stream: &mut Stream,
    to_send: &Receiver<Vec<u8>>,
    note: &mut impl FnMut(Note) -> bool,
) -> io::Result<()> {
    let late = |what: &str| io::Error::new(ErrorKind::TimedOut, what.to_owned());
    let (mut decoder, mut bytes) = (Decoder::default(), vec![0; 16 * 1024]);
    let start = Instant::now();
    let (mut accepted, mut said, mut pinged) = (false, start, None::<Instant>);
    stream.set_step(STEP)?;
    loop {
        let (out, ended) = waiting(to_send);
        if !out.is_empty() && accepted {
            stream.write_all(&out)?;
            stream.flush()?;
            said = Instant::now();
        }
        if ended {
            return Ok(());
        }
        if accepted && pinged.is_none() && said.elapsed() >= PING_EVERY {
            stream.write_all(&PING)?;
            stream.flush()?;
            said = Instant::now();
            pinged = Some(said);
        }
        if pinged.is_some_and(|at| at.elapsed() >= PATIENCE) {
            return Err(late("it does not answer to a ping"));
        }
        if !accepted && start.elapsed() >= PATIENCE {
            return Err(late("it does not answer"));
        }
        match stream.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => decoder.push(&bytes[..count]),
            Err(error) if waits(&error) => continue,
            Err(error) => return Err(error),
        }
        while let Some(packet) = decoder.take().map_err(|_| not_mqtt())? {
            let one = match packet {
                Packet::Accepted if !accepted => {
                    accepted = true;
                    Note::Connected
                }
                Packet::Refused(code) => return Err(refused(code)),
                _ if !accepted => return Err(not_mqtt()),
                Packet::Acknowledged(number) => Note::Acknowledged(number),
                Packet::Message(message, number) => {
                    acknowledge(stream, number)?;
                    Note::Message(message)
                }
                Packet::Oversized(length, number) => {
                    acknowledge(stream, number)?;
                    Note::PassedOver(length)
                }
                Packet::Pong => {
                    pinged = None;
                    continue;
                }
                Packet::Accepted | Packet::Other => continue,
            };
            if !note(one) {
                return Ok(());
            }
        }
    }
}

/// What was handed over, and whether no more comes.
fn waiting(to_send: &Receiver<Vec<u8>>) -> (Vec<u8>, bool) {
    let mut out = vec![];
    loop {
        match to_send.try_recv() {
            Ok(packet) => out.extend(packet),
            Err(TryRecvError::Empty) => return (out, false),
            Err(TryRecvError::Disconnected) => return (out, true),
        }
    }
}

fn acknowledge(stream: &mut Stream, number: Option<u16>) -> io::Result<()> {
    let Some(number) = number else { return Ok(()) };
    stream.write_all(&packet::acknowledge(number))?;
    stream.flush()
}

/// Only that nothing came yet.
fn waits(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}

fn not_mqtt() -> io::Error {
    io::Error::new(ErrorKind::InvalidData, "what it says is no MQTT")
}

/// The broker's refusal in words (section 3.2.2.3).
fn refused(code: u8) -> io::Error {
    io::Error::other(match code {
        1 => "it refuses: it does not speak MQTT 3.1.1".to_owned(),
        2 => "it refuses broker.client_id".to_owned(),
        3 => "it refuses: it is not ready".to_owned(),
        4 => "it refuses broker.user or its password".to_owned(),
        5 => "it refuses: this client is not allowed".to_owned(),
        code => format!("it refuses, with code {code}"),
    })
}

/// Plain, or with TLS.
enum Stream {
    Plain(TcpStream),
    Tls(Box<StreamOwned<ClientConnection, TcpStream>>),
}

impl Stream {
    fn open(endpoint: &Endpoint) -> io::Result<Self> {
        let mut failed = io::Error::new(ErrorKind::NotFound, "its name has no address");
        for address in (endpoint.host.as_str(), endpoint.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(socket) => return Self::begin(socket, endpoint),
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    fn begin(mut socket: TcpStream, endpoint: &Endpoint) -> io::Result<Self> {
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        socket.set_write_timeout(Some(PATIENCE))?;
        let Some(tls) = &endpoint.tls else {
            return Ok(Self::Plain(socket));
        };
        let name = ServerName::try_from(endpoint.host.clone()).map_err(io::Error::other)?;
        let tls = ClientConnection::new(Arc::clone(tls), name);
        let mut tls = tls.map_err(io::Error::other)?;
        let end = Instant::now() + PATIENCE;
        while tls.is_handshaking() {
            tls.complete_io(&mut socket)?;
            if Instant::now() >= end {
                return Err(io::Error::new(
                    ErrorKind::TimedOut,
                    "its TLS does not answer",
                ));
            }
        }
        Ok(Self::Tls(Box::new(StreamOwned::new(tls, socket))))
    }

    /// How long a read may wait.
    fn set_step(&self, step: Duration) -> io::Result<()> {
        match self {
            Self::Plain(socket) => socket.set_read_timeout(Some(step)),
            Self::Tls(tls) => tls.sock.set_read_timeout(Some(step)),
        }
    }
}

impl Read for Stream {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Plain(socket) => socket.read(bytes),
            Self::Tls(tls) => tls.read(bytes),
        }
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Plain(socket) => socket.write(bytes),
            Self::Tls(tls) => tls.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Plain(socket) => socket.flush(),
            Self::Tls(tls) => tls.flush(),
        }
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        if let Self::Tls(tls) = self {
            tls.conn.send_close_notify();
            let _ = tls.flush();
        }
    }
}
