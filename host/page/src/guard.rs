//! Who is asking: by which name, from which page, how often, and with which password.
//!
//! A browser that stands in the device's network and shows a stranger's page must not become the stranger's hand:
//!
//! - **Host**: a name that a stranger's DNS server may point at the device (DNS rebinding) is refused; addresses,
//!   `localhost` and this machine's own names are not.
//! - **Origin**: a change is taken from the device's own page, or from no page at all.
//! - **Nothing ambient**: there are no cookies, and browsers are never asked to remember the password: each change carries
//!   it in its own header field, which a stranger's page cannot send.
//! - **Rates**: each address has so many requests a second, and few guesses at the password.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::http::request::Head;

/// The names by which the page may be asked for, besides addresses and `localhost`.
#[derive(Clone, Debug, Default)]
pub struct Names(Vec<String>);

impl Names {
    /// These names, in any case; of this machine's name, `NAME.local` too.
    pub fn new(names: impl IntoIterator<Item = String>) -> Self {
        let mut all = Vec::new();
        for name in names {
            let name = name.trim().trim_end_matches('.').to_ascii_lowercase();
            if !name.is_empty() {
                if !name.contains('.') {
                    all.push(format!("{name}.local"));
                }
                all.push(name);
            }
        }
        Self(all)
    }

    /// Those of this machine, and these.
    pub fn of_this_machine(more: impl IntoIterator<Item = String>) -> Self {
        let own = std::fs::read_to_string("/proc/sys/kernel/hostname");
        let own = own.ok().or_else(|| std::env::var("COMPUTERNAME").ok());
        Self::new(own.into_iter().chain(more))
    }

    /// Whether a request that names this host is meant for us.
    pub fn know(&self, host: &str) -> bool {
        let Some(name) = name_of(host) else {
            return false;
        };
        name.parse::<IpAddr>().is_ok() || name == "localhost" || self.0.contains(&name)
    }
}

/// The name without its port, in lower case and without the brackets of an IPv6 address.
fn name_of(host: &str) -> Option<String> {
    let (name, rest) = match host.strip_prefix('[') {
        Some(inner) => inner.split_once(']')?,
        None => host
            .split_once(':')
            .map_or((host, ""), |(name, _)| (name, &host[name.len()..])),
    };
    let port = rest.strip_prefix(':').unwrap_or(rest);
    let is_port = port.bytes().all(|b| b.is_ascii_digit()) && port.len() <= 5;
    let name = name.trim_end_matches('.').to_ascii_lowercase();
    (is_port && !name.is_empty()).then_some(name)
}

/// Whether a request that changes something comes from the device's own page, or from a program.
pub fn is_from_here(head: &Head) -> bool {
    let host = head.field("host").unwrap_or_default();
    let origin_is_ours = head.field("origin").is_none_or(|origin| {
        let of = |scheme| origin.strip_prefix(scheme);
        of("http://")
            .or(of("https://"))
            .is_some_and(|from| from.eq_ignore_ascii_case(host))
    });
    let site_is_ours = head
        .field("sec-fetch-site")
        .is_none_or(|site| matches!(site, "same-origin" | "none"));
    origin_is_ours && site_is_ours
}

/// The password of a request: that of `Authorization: Basic`, whatever the user is called.
pub fn password(head: &Head) -> Option<String> {
    let field = head.field("authorization")?;
    let (scheme, rest) = field.split_once(' ')?;
    if !scheme.eq_ignore_ascii_case("basic") {
        return None;
    }
    let text = String::from_utf8(unbase64(rest.trim())?).ok()?;
    text.split_once(':')
        .map(|(_, password)| password.to_owned())
}

/// RFC 4648, 4; nothing but its characters, and padding or none.
fn unbase64(text: &str) -> Option<Vec<u8>> {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let text = text.trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
    let (mut bits, mut count) = (0_u32, 0);
    for character in text.bytes() {
        let value = ALPHABET.iter().position(|&c| c == character)?;
        bits = (bits << 6 | value as u32) & 0xffff;
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}

/// So many at once, and then so many a second.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// At once.
    pub burst: f32,
    /// A second.
    pub per_s: f32,
}

/// Most addresses of which the rate is remembered.
const ADDRESSES: usize = 256;

/// How often each address may ask.
#[derive(Debug)]
pub struct Rates {
    allowance: Allowance,
    left: Mutex<HashMap<IpAddr, (f32, Instant)>>,
}

impl Rates {
    /// Every address has this allowance.
    pub fn new(allowance: Allowance) -> Self {
        Self {
            allowance,
            left: Mutex::default(),
        }
    }

    /// Takes one from what an address has left; `false` where nothing is.
    pub fn take(&self, who: IpAddr, now: Instant) -> bool {
        let Allowance { burst, per_s } = self.allowance;
        let left_at = |(left, at): (f32, Instant)| {
            (left + per_s * now.saturating_duration_since(at).as_secs_f32()).min(burst)
        };
        let mut all = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() >= ADDRESSES && !all.contains_key(&who) {
            // Whoever has all of its allowance back need not be remembered.
            all.retain(|_, &mut known| left_at(known) < burst);
            if all.len() >= ADDRESSES {
                return false;
            }
        }
        let left = all.get(&who).map_or(burst, |&known| left_at(known));
        let allowed = left >= 1.0;
        all.insert(who, (if allowed { left - 1.0 } else { left }, now));
        allowed
    }

    /// Gives one back that need not have counted.
    pub fn give_back(&self, who: IpAddr) {
        let mut all = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((left, _)) = all.get_mut(&who) {
            *left = (*left + 1.0).min(self.allowance.burst);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::request::parse;
    use std::time::Duration;

    #[test]
    fn a_strangers_name_for_us_is_refused() {
        let names = Names::new(["Pi".to_owned(), "press.example.com".to_owned()]);
        for host in [
            "pi",
            "PI.local:7357",
            "pi.local.",
            "localhost:7357",
            "127.0.0.1:7357",
            "192.168.0.9",
            "[::1]:7357",
            "press.example.com",
        ] {
            assert!(names.know(host), "{host}");
        }
        for host in [
            "",
            "evil.com",
            "pi.evil.com",
            "127.0.0.1.evil.com",
            "localhost.evil.com:7357",
            "[::1",
            "pi:port",
            "1.2.3.4:80:80",
        ] {
            assert!(!names.know(host), "{host}");
        }
    }

    fn head(fields: &str) -> Head {
        let text = format!("PUT /x HTTP/1.1\r\nHost: pi.local:7357\r\n{fields}\r\n");
        parse(text.as_bytes()).unwrap().unwrap().0
    }

    #[test]
    fn a_change_from_another_page_is_none() {
        for ours in [
            "",
            "Origin: http://pi.local:7357\r\n",
            "Sec-Fetch-Site: same-origin\r\n",
        ] {
            assert!(is_from_here(&head(ours)), "{ours}");
        }
        for other in [
            "Origin: http://evil.com\r\n",
            "Origin: null\r\n",
            "Origin: http://pi.local:80\r\n",
            "Sec-Fetch-Site: cross-site\r\n",
            "Sec-Fetch-Site: same-site\r\n",
        ] {
            assert!(!is_from_here(&head(other)), "{other}");
        }
    }

    #[test]
    fn the_password_is_that_of_basic() {
        // RFC 7617, 2.
        let basic = head("Authorization: Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ==\r\n");
        assert_eq!(password(&basic).as_deref(), Some("open sesame"));
        for not in [
            "",
            "Authorization: Bearer abc\r\n",
            "Authorization: Basic &&&\r\n",
            "Authorization: Basic\r\n",
        ] {
            assert_eq!(password(&head(not)), None, "{not}");
        }
    }

    #[test]
    fn a_rate_is_used_up_and_comes_back() {
        let rates = Rates::new(Allowance {
            burst: 3.0,
            per_s: 1.0,
        });
        let (now, a, b) = (
            Instant::now(),
            IpAddr::from([1, 1, 1, 1]),
            IpAddr::from([2, 2, 2, 2]),
        );
        assert!((0..3).all(|_| rates.take(a, now)));
        assert!(!rates.take(a, now));
        assert!(rates.take(b, now), "another address has its own");
        assert!(rates.take(a, now + Duration::from_secs(1)));
        assert!(!rates.take(a, now + Duration::from_secs(1)));
        for k in 0..2000_u32 {
            rates.take(IpAddr::from(k.to_be_bytes()), now);
        }
        assert!(rates.left.lock().unwrap().len() <= ADDRESSES);
        assert!(rates.take(IpAddr::from([9, 9, 9, 9]), now + Duration::from_secs(10)));
    }
}
