//! The page's server: a thread a connection, few connections, and a bound on each.
//!
//! Why its own and not a library's: what a page for a dozen viewers needs of HTTP/1.1 is some five hundred lines that are
//! tested and fuzzed here, with deadlines for slow readers and writers that `tiny_http` has none of, and without the forty
//! packages and the runtime that `axum` brings into everybody's first build.

use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::events;
use crate::http::connection::{Broken, Connection};
use crate::http::reply::Reply;
use crate::http::request::Method;
use crate::site::Site;

/// Most connections at once; more are told to come back.
pub const MAX_CONNECTIONS: usize = 48;
/// Most of them that listen to events: the rest polls.
const MAX_LISTENERS: usize = 16;
/// Most clips, and most long lists, that are on their way at once: each is in memory until it is taken.
const MAX_CLIPS: usize = 1;
const MAX_LISTS: usize = 4;
/// Requests on one connection.
const MAX_REQUESTS: usize = 1000;
/// How often the thread that takes connections gives a sign of life.
const WAKE: Duration = Duration::from_millis(500);
/// A connection's thread needs little.
const STACK: usize = 256 << 10;

/// A server that runs until it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Counts {
    connections: AtomicUsize,
    listeners: AtomicUsize,
    clips: AtomicUsize,
    lists: AtomicUsize,
}

impl Counts {
    /// The answers of which a slow reader could hold too many.
    fn large(&self, path: &str) -> Option<(&AtomicUsize, usize)> {
        match path {
            "/api/clip.y4m" => Some((&self.clips, MAX_CLIPS)),
            "/api/reports" | "/api/reports.csv" => Some((&self.lists, MAX_LISTS)),
            _ => None,
        }
    }
}

/// One of those that are counted, until it is dropped.
struct One<'a>(&'a AtomicUsize);

impl<'a> One<'a> {
    /// `None` where there are as many as there may be.
    fn of(count: &'a AtomicUsize, most: usize) -> Option<Self> {
        let more = |count: usize| (count < most).then_some(count + 1);
        count
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, more)
            .ok()
            .map(|_| Self(count))
    }
}

impl Drop for One<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl Server {
    /// Listens at `address` and serves `site` on threads of its own.
    ///
    /// # Errors
    /// What the system says where nobody can listen there.
    pub fn start(address: SocketAddr, site: Arc<Site>) -> io::Result<Self> {
        Self::start_watched(address, site, || {})
    }

    /// As [`start`](Self::start); the thread that takes connections calls `alive` at least every
    /// half second, where the system can wake it (Linux).
    ///
    /// # Errors
    /// What the system says where nobody can listen there.
    pub fn start_watched(
        address: SocketAddr,
        site: Arc<Site>,
        alive: impl Fn() + Send + 'static,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        wake(&listener)?;
        let address = listener.local_addr()?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        let thread = std::thread::Builder::new()
            .name("page".to_owned())
            .spawn(move || accept(&listener, &site, &stopping, &alive))?;
        Ok(Self {
            address,
            stop,
            thread: Some(thread),
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        // It waits for the next connection: here is one.
        let mut address = self.address;
        match address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
            IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        let woken = TcpStream::connect_timeout(&address, Duration::from_secs(1)).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| woken) {
            let _ = thread.join();
        }
    }
}

/// Lets `accept` come back now and then although nobody connects.
#[cfg(target_os = "linux")]
fn wake(listener: &TcpListener) -> io::Result<()> {
    use nix::sys::socket::{setsockopt, sockopt::ReceiveTimeout};
    use nix::sys::time::{TimeVal, TimeValLike};
    use std::os::fd::AsRawFd;

    let every = TimeVal::milliseconds(WAKE.as_millis() as i64);
    Ok(setsockopt(listener.as_raw_fd(), ReceiveTimeout, &every)?)
}

#[cfg(not(target_os = "linux"))]
fn wake(_listener: &TcpListener) -> io::Result<()> {
    Ok(())
}

fn accept(listener: &TcpListener, site: &Arc<Site>, stop: &AtomicBool, alive: &dyn Fn()) {
    let full = full();
    let counts = Arc::new(Counts::default());
    for stream in listener.incoming() {
        if stop.load(Ordering::Acquire) {
            return;
        }
        alive();
        let stream = match stream {
            Ok(stream) => stream,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => continue,
            Err(_) => {
                // Out of descriptors, mostly: the next one may have more luck.
                std::thread::sleep(Duration::from_millis(50));
                continue;
            }
        };
        if counts.connections.load(Ordering::Acquire) >= MAX_CONNECTIONS {
            turn_away(stream, &full);
            continue;
        }
        let (site, counts) = (Arc::clone(site), Arc::clone(&counts));
        let thread = std::thread::Builder::new()
            .name("viewer".to_owned())
            .stack_size(STACK);
        // Where no thread can be had the connection closes.
        let _ = thread.spawn(move || {
            if let Some(_one) = One::of(&counts.connections, MAX_CONNECTIONS) {
                serve(stream, &site, &counts);
            }
        });
    }
}

/// What is said where there are too many.
fn full() -> Vec<u8> {
    let reply =
        Reply::refusal(503, "too many viewers: come back in a moment").with("Retry-After: 2");
    let mut bytes = reply.head(false).into_bytes();
    bytes.extend(&reply.body);
    bytes
}

/// Says that there are too many, without waiting for anything.
fn turn_away(mut stream: TcpStream, full: &[u8]) {
    if stream.set_nonblocking(true).is_ok() {
        let _ = stream.write_all(full);
    }
}

fn serve(stream: TcpStream, site: &Site, counts: &Counts) {
    let Ok(peer) = stream.peer_addr() else {
        return;
    };
    // An IPv4 address in an IPv6 one's clothes is the same viewer.
    let from = peer.ip().to_canonical();
    let mut connection = Connection::new(stream);
    for _ in 0..MAX_REQUESTS {
        let (head, body) = match connection.request() {
            Ok(request) => request,
            Err(Broken::Gone) => return,
            Err(Broken::Refused(error)) => {
                return connection.refuse(&Reply::refusal(error.status(), error.to_string()));
            }
        };
        if let Err(reply) = site.admit(&head, from) {
            return connection.refuse(&reply);
        }
        if head.method == Method::Get && events::are_wanted(&head) {
            let reply = match One::of(&counts.listeners, MAX_LISTENERS) {
                Some(_one) => {
                    let _ = events::serve(site, &head, &mut connection);
                    return;
                }
                None => Reply::refusal(
                    503,
                    "too many listeners: ask for /api/reports?after=ID instead",
                ),
            };
            return connection.refuse(&reply);
        }
        // Held until it has been sent.
        let _large = match counts.large(&head.path) {
            None => None,
            Some((count, most)) => match One::of(count, most) {
                Some(one) => Some(one),
                None => {
                    let why = "too many are taking this just now: come back in a moment";
                    return connection.refuse(&Reply::refusal(503, why).with("Retry-After: 2"));
                }
            },
        };
        let viewers = counts.connections.load(Ordering::Relaxed);
        let reply = site.answer(&head, &body, from, viewers);
        let head_only = head.method == Method::Head;
        if connection.send(&reply, head.keep_alive, head_only).is_err() || !head.keep_alive {
            return;
        }
    }
}
