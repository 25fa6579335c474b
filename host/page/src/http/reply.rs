//! Answers.

use serde_json::json;

/// One answer, whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Status code.
    pub status: u16,
    /// What kind of bytes the body is.
    pub content_type: &'static str,
    /// Further header fields, each whole and without its line end.
    pub fields: Vec<String>,
    /// The body.
    pub body: Vec<u8>,
}

/// Only what comes from here is shown, and nothing else may show it.
const POLICY: &str = "Content-Security-Policy: default-src 'none'; script-src 'self' 'unsafe-inline'; \
                      style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; \
                      form-action 'none'; base-uri 'none'; frame-ancestors 'none'";

impl Reply {
    /// An answer with this body.
    pub fn new(status: u16, content_type: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status,
            content_type,
            fields: Vec::new(),
            body: body.into(),
        }
    }

    /// A JSON text that is one already.
    pub fn json(text: impl Into<Vec<u8>>) -> Self {
        Self::new(200, "application/json", text)
    }

    /// Why nothing is given or changed: `{"error": …}`.
    pub fn refusal(status: u16, why: impl AsRef<str>) -> Self {
        let body = json!({ "error": why.as_ref() }).to_string();
        Self::new(status, "application/json", body)
    }

    /// The same with one header field more.
    pub fn with(mut self, field: impl Into<String>) -> Self {
        self.fields.push(field.into());
        self
    }

    /// Status line and header fields, up to and with the empty line.
    pub fn head(&self, keep_alive: bool) -> String {
        let mut head = first_lines(self.status, self.content_type, keep_alive);
        head += &format!("Content-Length: {}\r\n", self.body.len());
        for field in &self.fields {
            head += field;
            head += "\r\n";
        }
        head + "\r\n"
    }
}

/// What every answer begins with.
pub(super) fn first_lines(status: u16, content_type: &str, keep_alive: bool) -> String {
    let connection = if keep_alive { "keep-alive" } else { "close" };
    format!(
        "HTTP/1.1 {status} {}\r\nContent-Type: {content_type}\r\nConnection: {connection}\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\n{POLICY}\r\n",
        reason(status)
    )
}

const fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        401 => "Unauthorized",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        422 => "Unprocessable Content",
        429 => "Too Many Requests",
        431 => "Request Header Fields Too Large",
        501 => "Not Implemented",
        503 => "Service Unavailable",
        505 => "HTTP Version Not Supported",
        _ => "Error",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_json_whatever_it_says() {
        let reply = Reply::refusal(422, "window is \"9\" s");
        let body: serde_json::Value = serde_json::from_slice(&reply.body).unwrap();
        assert_eq!(body["error"], "window is \"9\" s");
        let head = reply.head(false);
        assert!(
            head.starts_with("HTTP/1.1 422 Unprocessable Content\r\n"),
            "{head}"
        );
        assert!(head.contains(&format!("Content-Length: {}\r\n", reply.body.len())));
        assert!(head.ends_with("\r\n\r\n"));
    }
}
