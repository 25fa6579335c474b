//! As much of HTTP/1.1 (RFC 9112) as a page needs, with a bound on everything.
//!
//! [`request`] reads a request's head from bytes that anybody may have sent; [`reply`] writes answers;
//! [`connection`] joins both to a socket with deadlines. There is no chunked body, no compression, no
//! upgrade and no TLS: whoever asks for one is told so and the connection ends.

pub mod connection;
pub mod reply;
pub mod request;
