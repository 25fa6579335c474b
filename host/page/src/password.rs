//! The password that changes ask for: kept as a salted hash, checked slowly.
//!
//! PBKDF2 with HMAC-SHA-256 (RFC 8018, 5.2), written as `pbkdf2-sha256$ITERATIONS$SALT$HASH`, both in hexadecimal.
//! There is no default password: whoever sets up the device sets it, over the page or in its configuration.

use std::fmt;
use std::fmt::Write as _;
use std::str::FromStr;

use hmac_sha256::HMAC;

/// Iterations of a new hash: some 0.1 s of a desktop and half a second of a Raspberry Pi 4.
const ITERATIONS: u32 = 100_000;
/// Most iterations that are believed of a stored hash.
const MOST_ITERATIONS: u32 = 10_000_000;
/// Fewest and most bytes of a password.
const LENGTHS: std::ops::RangeInclusive<usize> = 8..=256;
/// The name of the method.
const METHOD: &str = "pbkdf2-sha256";

/// Why a password or its hash cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PasswordError {
    /// Shorter than 8 or longer than 256 bytes.
    Length(usize),
    /// The system has no random numbers.
    Random,
    /// Not a hash as this module writes it.
    Hash,
}

impl fmt::Display for PasswordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(bytes) => write!(
                f,
                "the password has {bytes} characters: give {} to {}",
                LENGTHS.start(),
                LENGTHS.end()
            ),
            Self::Random => {
                f.write_str("the system gives no random numbers, so no password can be kept")
            }
            Self::Hash => write!(f, "not the hash of a password: it begins with {METHOD}$"),
        }
    }
}

impl std::error::Error for PasswordError {}

/// What is kept of a password.
///
/// ```
/// use rowtone_page::password::Hash;
/// let hash = Hash::of("correct horse")?;
/// let kept: Hash = hash.to_string().parse()?;
/// assert!(kept.is_of("correct horse") && !kept.is_of("wrong horse"));
/// # Ok::<(), rowtone_page::password::PasswordError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hash {
    iterations: u32,
    salt: [u8; 16],
    hash: [u8; 32],
}

impl Hash {
    /// The hash of a password, with a new salt.
    ///
    /// # Errors
    /// [`PasswordError::Length`], or [`PasswordError::Random`] where the system has no random numbers.
    pub fn of(password: &str) -> Result<Self, PasswordError> {
        if !LENGTHS.contains(&password.len()) {
            return Err(PasswordError::Length(password.len()));
        }
        let mut salt = [0; 16];
        getrandom::fill(&mut salt).map_err(|_| PasswordError::Random)?;
        Ok(Self {
            iterations: ITERATIONS,
            salt,
            hash: pbkdf2(password.as_bytes(), &salt, ITERATIONS),
        })
    }

    /// Whether this is the password. It takes as long whatever it is.
    pub fn is_of(&self, password: &str) -> bool {
        if password.len() > *LENGTHS.end() {
            return false;
        }
        let hash = pbkdf2(password.as_bytes(), &self.salt, self.iterations);
        let differing = hash
            .iter()
            .zip(&self.hash)
            .fold(0, |all, (a, b)| all | (a ^ b));
        std::hint::black_box(differing) == 0
    }
}

impl fmt::Display for Hash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hex = |bytes: &[u8]| {
            bytes.iter().fold(String::new(), |mut text, byte| {
                let _ = write!(text, "{byte:02x}");
                text
            })
        };
        write!(
            f,
            "{METHOD}${}${}${}",
            self.iterations,
            hex(&self.salt),
            hex(&self.hash)
        )
    }
}

impl FromStr for Hash {
    type Err = PasswordError;

    fn from_str(text: &str) -> Result<Self, PasswordError> {
        let mut parts = text.trim().split('$');
        let (Some(METHOD), Some(iterations), Some(salt), Some(hash), None) = (
            parts.next(),
            parts.next(),
            parts.next(),
            parts.next(),
            parts.next(),
        ) else {
            return Err(PasswordError::Hash);
        };
        let iterations = iterations.parse().ok();
        let iterations = iterations.filter(|n| (1..=MOST_ITERATIONS).contains(n));
        Ok(Self {
            iterations: iterations.ok_or(PasswordError::Hash)?,
            salt: unhex(salt).ok_or(PasswordError::Hash)?,
            hash: unhex(hash).ok_or(PasswordError::Hash)?,
        })
    }
}

fn unhex<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits: Option<Vec<u32>> = text.chars().map(|c| c.to_digit(16)).collect();
    let digits = digits.filter(|digits| digits.len() == 2 * N)?;
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = (16 * pair.first()? + pair.last()?) as u8;
    }
    Some(bytes)
}

/// The first block of PBKDF2 (RFC 8018, 5.2), which is all of a key of 32 bytes.
fn pbkdf2(password: &[u8], salt: &[u8], iterations: u32) -> [u8; 32] {
    let keyed = HMAC::new(password);
    let mut first = keyed.clone();
    first.update(salt);
    first.update(1_u32.to_be_bytes());
    let mut block = first.finalize();
    let mut key = block;
    for _ in 1..iterations {
        let mut next = keyed.clone();
        next.update(block);
        block = next.finalize();
        for (sum, byte) in key.iter_mut().zip(block) {
            *sum ^= byte;
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 7914, 11, which has PBKDF2 with HMAC-SHA-256; the first half of its 64 bytes.
    #[test]
    fn it_is_pbkdf2() {
        let key: [u8; 32] =
            unhex("55ac046e56e3089fec1691c22544b605f94185216dde0465e68b9d57c20dacbc").unwrap();
        assert_eq!(pbkdf2(b"passwd", b"salt", 1), key);
        let key: [u8; 32] =
            unhex("4ddcd8f60b98be21830cee5ef22701f9641a4418d04c0414aeff08876b34ab56").unwrap();
        assert_eq!(pbkdf2(b"Password", b"NaCl", 80_000), key);
    }

    #[test]
    fn what_is_kept_is_not_the_password() {
        let hash = Hash::of("open sesame").unwrap();
        assert_ne!(hash, Hash::of("open sesame").unwrap(), "salted");
        assert!(!hash.to_string().contains("sesame"));
        assert!(!hash.is_of("open sesam") && !hash.is_of(""));
    }

    #[test]
    fn bad_passwords_and_hashes_are_refused() {
        assert_eq!(Hash::of("short"), Err(PasswordError::Length(5)));
        let hash = Hash::of("long enough").unwrap().to_string();
        for wrong in [
            String::new(),
            hash.replace("sha256", "sha1"),
            hash.replace("$100000$", "$0$"),
            hash.replace("$100000$", "$4000000000$"),
            hash.get(..hash.len() - 1).unwrap().to_owned(),
            format!("{hash}$"),
        ] {
            assert_eq!(wrong.parse::<Hash>(), Err(PasswordError::Hash), "{wrong}");
        }
    }
}
