//! A request's head, from bytes.

use std::fmt;

/// Longest head, bytes: the request line and all fields.
pub const MAX_HEAD: usize = 8192;
/// Most header fields.
const MAX_FIELDS: usize = 64;
/// Longest body, bytes: settings are far shorter.
pub const MAX_BODY: usize = 16 << 10;

/// What a request wants done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Read.
    Get,
    /// Read the head of the answer alone.
    Head,
    /// Change.
    Put,
    /// Anything else, which nothing here answers.
    Other,
}

/// Why the bytes are no request that is answered; each has its status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestError {
    /// The head is longer than [`MAX_HEAD`] or has more than 64 fields.
    HeadTooLong,
    /// The body is longer than [`MAX_BODY`].
    BodyTooLong,
    /// It is not HTTP/1.0 or 1.1 as RFC 9112 has it; says what.
    Malformed(&'static str),
    /// A way of sending the body that is not spoken here.
    TransferEncoding,
    /// Another version of HTTP.
    Version,
}

impl RequestError {
    /// The status code of the answer.
    pub const fn status(self) -> u16 {
        match self {
            Self::HeadTooLong => 431,
            Self::BodyTooLong => 413,
            Self::Malformed(_) => 400,
            Self::TransferEncoding => 501,
            Self::Version => 505,
        }
    }
}

impl fmt::Display for RequestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HeadTooLong => write!(
                f,
                "the request's head is longer than {MAX_HEAD} bytes or {MAX_FIELDS} fields"
            ),
            Self::BodyTooLong => write!(f, "the request's body is longer than {MAX_BODY} bytes"),
            Self::Malformed(what) => write!(f, "not a request: {what}"),
            Self::TransferEncoding => f.write_str("send the body with a Content-Length"),
            Self::Version => f.write_str("only HTTP/1.0 and HTTP/1.1 are spoken here"),
        }
    }
}

impl std::error::Error for RequestError {}

/// A request's head.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// What it wants done.
    pub method: Method,
    /// The path, percent signs decoded, beginning with a slash.
    pub path: String,
    /// Keys and values behind the question mark, decoded.
    pub query: Vec<(String, String)>,
    /// Names in lower case, and values without space around them.
    fields: Vec<(String, String)>,
    /// Bytes of the body behind the head.
    pub content_length: usize,
    /// Whether the connection stays open for another request.
    pub keep_alive: bool,
}

impl Head {
    /// The value of a header field, by its name in lower case; the first of several.
    pub fn field(&self, name: &str) -> Option<&str> {
        let mut found = self.fields.iter().filter(|(known, _)| known == name);
        found.next().map(|(_, value)| value.as_str())
    }

    /// The value of a key behind the question mark.
    pub fn query(&self, key: &str) -> Option<&str> {
        let mut found = self.query.iter().filter(|(known, _)| known == key);
        found.next().map(|(_, value)| value.as_str())
    }
}

/// Reads a head from the bytes received so far: the head and its length, `None` where more must come.
///
/// # Errors
/// [`RequestError`] where no further bytes could make it a request.
///
/// ```
/// use rowtone_page::http::request::{Method, parse};
/// let bytes = b"GET /api/report?x=1 HTTP/1.1\r\nHost: pi.local:7357\r\n\r\n";
/// let (head, length) = parse(bytes)?.expect("a whole head");
/// assert_eq!((head.method, head.path.as_str(), length), (Method::Get, "/api/report", bytes.len()));
/// assert_eq!(head.field("host"), Some("pi.local:7357"));
/// assert_eq!(parse(b"GET / HTT")?, None);
/// # Ok::<(), rowtone_page::http::request::RequestError>(())
/// ```
pub fn parse(bytes: &[u8]) -> Result<Option<(Head, usize)>, RequestError> {
    let within = bytes.get(..MAX_HEAD).unwrap_or(bytes);
    let Some(length) = end_of_head(within) else {
        return match bytes.len() {
            0..MAX_HEAD => Ok(None),
            _ => Err(RequestError::HeadTooLong),
        };
    };
    let text = within.get(..length).unwrap_or_default();
    let text = std::str::from_utf8(text)
        .map_err(|_| RequestError::Malformed("its head is not plain text"))?;
    let mut lines = text.split("\r\n");
    let (method, target, version) = request_line(lines.next().unwrap_or_default())?;
    let mut fields = Vec::new();
    for line in lines.take_while(|line| !line.is_empty()) {
        if fields.len() == MAX_FIELDS {
            return Err(RequestError::HeadTooLong);
        }
        fields.push(field(line)?);
    }
    let (path, query) = target_parts(target)?;
    let mut head = Head {
        method,
        path,
        query,
        fields,
        content_length: 0,
        keep_alive: version == Version::Http11,
    };
    head.content_length = content_length(&head)?;
    if let Some(connection) = head.field("connection") {
        head.keep_alive &= !connection.to_ascii_lowercase().contains("close");
    }
    if version == Version::Http11 && head.field("host").is_none() {
        return Err(RequestError::Malformed("it has no Host"));
    }
    Ok(Some((head, length)))
}

/// Bytes up to and with the empty line.
fn end_of_head(bytes: &[u8]) -> Option<usize> {
    let at = bytes.windows(4).position(|four| four == b"\r\n\r\n");
    at.map(|at| at + 4)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    Http10,
    Http11,
}

fn request_line(line: &str) -> Result<(Method, &str, Version), RequestError> {
    let mut words = line.split(' ');
    let (Some(method), Some(target), Some(version), None) =
        (words.next(), words.next(), words.next(), words.next())
    else {
        return Err(RequestError::Malformed(
            "its first line has not three words",
        ));
    };
    let method = match method {
        "GET" => Method::Get,
        "HEAD" => Method::Head,
        "PUT" => Method::Put,
        word if is_token(word) => Method::Other,
        _ => return Err(RequestError::Malformed("its method is no word")),
    };
    let version = match version {
        "HTTP/1.1" => Version::Http11,
        "HTTP/1.0" => Version::Http10,
        other if other.starts_with("HTTP/") => return Err(RequestError::Version),
        _ => {
            return Err(RequestError::Malformed(
                "its first line names no HTTP version",
            ));
        }
    };
    Ok((method, target, version))
}

/// The characters of a token, RFC 9110, 5.6.2.
fn is_token(word: &str) -> bool {
    let is_one = |b: u8| b.is_ascii_alphanumeric() || b"!#$%&'*+-.^_`|~".contains(&b);
    !word.is_empty() && word.bytes().all(is_one)
}

fn field(line: &str) -> Result<(String, String), RequestError> {
    let (name, value) = line
        .split_once(':')
        .ok_or(RequestError::Malformed("a header field has no colon"))?;
    // A space before the colon, or a folded line, is how requests are smuggled past proxies.
    if !is_token(name) {
        return Err(RequestError::Malformed(
            "the name of a header field is no word",
        ));
    }
    let value = value.trim_matches([' ', '\t']);
    if value.bytes().any(|b| b.is_ascii_control() && b != b'\t') {
        return Err(RequestError::Malformed(
            "a header field holds a control character",
        ));
    }
    Ok((name.to_ascii_lowercase(), value.to_owned()))
}

fn content_length(head: &Head) -> Result<usize, RequestError> {
    if head.field("transfer-encoding").is_some() {
        return Err(RequestError::TransferEncoding);
    }
    let mut lengths = head
        .fields
        .iter()
        .filter(|(name, _)| name == "content-length");
    let Some((_, length)) = lengths.next() else {
        return Ok(0);
    };
    let is_number = !length.is_empty() && length.bytes().all(|b| b.is_ascii_digit());
    if !is_number || lengths.next().is_some() {
        return Err(RequestError::Malformed(
            "its Content-Length is no single number",
        ));
    }
    match length.parse::<usize>() {
        Ok(length) if length <= MAX_BODY => Ok(length),
        _ => Err(RequestError::BodyTooLong),
    }
}

type Target = (String, Vec<(String, String)>);

fn target_parts(target: &str) -> Result<Target, RequestError> {
    // Also the absolute form, which a server must take (RFC 9112, 3.2.2); Host still counts.
    let target = match target.strip_prefix("http://") {
        Some(rest) => rest
            .find('/')
            .map_or("/", |at| rest.get(at..).unwrap_or("/")),
        None => target,
    };
    if !target.starts_with('/') {
        return Err(RequestError::Malformed(
            "its target does not begin with a slash",
        ));
    }
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let pairs = query.split('&').filter(|pair| !pair.is_empty());
    let pairs = pairs.map(|pair| {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        Ok((decoded(key)?, decoded(value)?))
    });
    Ok((decoded(path)?, pairs.collect::<Result<_, _>>()?))
}

/// Percent signs decoded.
fn decoded(text: &str) -> Result<String, RequestError> {
    let wrong = RequestError::Malformed("its target has a percent sign that means nothing");
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let mut digit = || rest.next().and_then(|b| char::from(b).to_digit(16));
                let (high, low) = (digit().ok_or(wrong)?, digit().ok_or(wrong)?);
                (16 * high + low) as u8
            }
            b'+' => b' ',
            byte => byte,
        });
    }
    String::from_utf8(bytes).map_err(|_| wrong)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(text: &str) -> RequestError {
        parse(text.as_bytes()).expect_err("it is refused")
    }

    #[test]
    fn what_is_no_request_is_refused_with_its_status() {
        for (text, status) in [
            ("GET /\r\n\r\n", 400),
            ("GET / HTTP/2.0\r\nHost: a\r\n\r\n", 505),
            ("GET / HTTP/1.1\r\n\r\n", 400),
            ("GET a HTTP/1.1\r\nHost: a\r\n\r\n", 400),
            ("GET /%zz HTTP/1.1\r\nHost: a\r\n\r\n", 400),
            ("GET / HTTP/1.1\r\nHost : a\r\n\r\n", 400),
            ("GET / HTTP/1.1\r\nHost: a\r\n folded\r\n\r\n", 400),
            (
                "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
                400,
            ),
            (
                "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
                400,
            ),
            (
                "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n",
                413,
            ),
            (
                "PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n",
                501,
            ),
        ] {
            assert_eq!(error(text).status(), status, "{text:?}");
        }
        let many = "X: y\r\n".repeat(MAX_FIELDS);
        let text = format!("GET / HTTP/1.1\r\nHost: a\r\n{many}\r\n");
        assert_eq!(error(&text).status(), 431);
        let long = format!("GET /{} HTTP/1.1\r\nHost: a\r\n\r\n", "a".repeat(MAX_HEAD));
        assert_eq!(error(&long).status(), 431);
    }

    #[test]
    fn a_connection_stays_open_unless_told_otherwise() {
        let head = |text: &str| parse(text.as_bytes()).unwrap().unwrap().0;
        assert!(head("GET / HTTP/1.1\r\nHost: a\r\n\r\n").keep_alive);
        assert!(!head("GET / HTTP/1.1\r\nHost: a\r\nConnection: Close\r\n\r\n").keep_alive);
        assert!(!head("GET / HTTP/1.0\r\n\r\n").keep_alive);
    }

    #[test]
    fn targets_are_decoded() {
        let text = b"GET http://x/a%20b?since=3&q=%C3%A9+x HTTP/1.1\r\nHost: a\r\n\r\n";
        let (head, _) = parse(text).unwrap().unwrap();
        assert_eq!(head.path, "/a b");
        assert_eq!(head.query("since"), Some("3"));
        assert_eq!(head.query("q"), Some("é x"));
    }

    proptest! {
        /// Whatever comes: no panic; nothing shorter than a head is one, and what is one stays one, whatever follows.
        #[test]
        fn any_bytes_are_taken(bytes in prop::collection::vec(any::<u8>(), 0..600), tail in any::<u8>()) {
            if let Ok(Some((head, length))) = parse(&bytes) {
                prop_assert!(length <= bytes.len() && head.path.starts_with('/'));
                prop_assert_eq!(parse(&bytes[..length - 1]), Ok(None));
                let mut longer = bytes.clone();
                longer.push(tail);
                prop_assert_eq!(parse(&longer), Ok(Some((head, length))));
            }
        }

        /// The same of bytes that look like a request.
        #[test]
        fn almost_requests_are_taken(
            target in "[a-z/%?=&+]{0,12}",
            name in "[A-Za-z:; -]{0,8}",
            value in "[ -~\r\n]{0,16}",
            length in any::<u16>(),
        ) {
            let text = format!(
                "PUT /{target} HTTP/1.1\r\nHost: a\r\n{name}: {value}\r\nContent-Length: {length}\r\n\r\n"
            );
            if let Ok(Some((head, _))) = parse(text.as_bytes()) {
                prop_assert!(head.content_length <= MAX_BODY);
                prop_assert_eq!(head.field("host"), Some("a"));
            }
        }
    }
}
