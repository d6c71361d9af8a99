//! HTTP requests, within limits of size and time.

use super::Status;
use httparse::{EMPTY_HEADER, Header};
use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::Instant;

/// Maximum size of a request without its body, in bytes.
const MAX_HEAD_SIZE: usize = 16 << 10;
/// Maximum number of headers.
const MAX_HEADERS: usize = 64;
/// Maximum size of a body, in bytes.
const MAX_BODY_SIZE: usize = 64 << 10;

/// Method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    Get,
    Post,
}

/// Received request.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    pub(crate) method: Method,
    /// Path as received, without decoding.
    pub(crate) path: String,
    /// Names and values of the query string, decoded.
    pub(crate) query: Vec<(String, String)>,
    pub(crate) host: Option<String>,
    pub(crate) origin: Option<String>,
    pub(crate) body: Vec<u8>,
}

impl Request {
    /// Makes a request of this process from its target, a path with a query string.
    pub(crate) fn local(method: &str, target: &str, body: Vec<u8>) -> Result<Self, Status> {
        if body.len() > MAX_BODY_SIZE {
            return Err(Status::BodyTooLarge);
        }
        let mut request = Self::new(method, target)?;
        request.body = body;
        Ok(request)
    }

    /// Makes a request without headers and body.
    fn new(method: &str, target: &str) -> Result<Self, Status> {
        let method = match method {
            "GET" => Method::Get,
            "POST" => Method::Post,
            _ => return Err(Status::BadMethod),
        };
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        Ok(Request {
            method,
            path: path.to_owned(),
            query: parameters(query)?,
            host: None,
            origin: None,
            body: Vec::new(),
        })
    }

    /// Reads a request, which must arrive before the deadline.
    pub(super) fn receive(stream: &TcpStream, deadline: Instant) -> Result<Self, Status> {
        let mut bytes = Vec::new();
        loop {
            if let Some((mut request, head, length)) = parse(&bytes)? {
                while bytes.len() < head + length {
                    read(stream, &mut bytes, deadline)?;
                }
                request.body = bytes[head..head + length].to_vec();
                return Ok(request);
            }
            if bytes.len() > MAX_HEAD_SIZE {
                return Err(Status::HeadTooLarge);
            }
            read(stream, &mut bytes, deadline)?;
        }
    }

    /// Returns the value of a query parameter; empty if it is missing.
    pub(crate) fn parameter(&self, name: &str) -> &str {
        let found = self.query.iter().find(|(n, _)| n == name);
        found.map_or("", |(_, value)| value)
    }
}

/// Appends the next received bytes.
fn read(mut stream: &TcpStream, bytes: &mut Vec<u8>, deadline: Instant) -> Result<(), Status> {
    // Planted error "clients that may send a byte now and then for ever", found by morgana-view/served::slow_clients_hold_nobody_up:
    // let left = deadline.saturating_duration_since(Instant::now()).max(std::time::Duration::from_secs(10));
    let left = deadline.saturating_duration_since(Instant::now());
    if left.is_zero() {
        return Err(Status::Timeout);
    }
    let timeout = stream.set_read_timeout(Some(left));
    timeout.map_err(|_| Status::BadRequest)?;
    let mut chunk = [0; 4096];
    match stream.read(&mut chunk) {
        Ok(0) => Err(Status::BadRequest),
        Ok(n) => {
            bytes.extend_from_slice(&chunk[..n]);
            Ok(())
        }
        Err(e) if e.kind() == ErrorKind::Interrupted => Ok(()),
        Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
            Err(Status::Timeout)
        }
        Err(_) => Err(Status::BadRequest),
    }
}

/// Parses a request without its body, and the lengths of its head and of its body; `None` if the
/// head is incomplete.
fn parse(bytes: &[u8]) -> Result<Option<(Request, usize, usize)>, Status> {
    let mut headers = [EMPTY_HEADER; MAX_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let head = match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(head)) => head,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err(Status::HeadTooLarge),
        Err(_) => return Err(Status::BadRequest),
    };
    let (method, target) = (
        parsed.method.unwrap_or_default(),
        parsed.path.unwrap_or_default(),
    );
    let mut request = Request::new(method, target)?;
    let length = length(parsed.headers)?;
    request.host = only(parsed.headers, "host")?;
    request.origin = only(parsed.headers, "origin")?;
    Ok(Some((request, head, length)))
}

/// Returns the value of a header that may occur once.
fn only(headers: &[Header], name: &str) -> Result<Option<String>, Status> {
    let mut found = headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
    match (found.next(), found.next()) {
        (None, _) => Ok(None),
        (Some(header), None) => match std::str::from_utf8(header.value) {
            Ok(value) => Ok(Some(value.to_owned())),
            Err(_) => Err(Status::BadRequest),
        },
        (Some(_), Some(_)) => Err(Status::BadRequest),
    }
}

/// Returns the length of the body, in bytes.
fn length(headers: &[Header]) -> Result<usize, Status> {
    if only(headers, "transfer-encoding")?.is_some() {
        return Err(Status::BadRequest);
    }
    let Some(length) = only(headers, "content-length")? else {
        return Ok(0);
    };
    if length.is_empty() || !length.bytes().all(|b| b.is_ascii_digit()) {
        return Err(Status::BadRequest);
    }
    // Parse the number, which fails for too many digits.
    match length.parse() {
        Ok(length) if length <= MAX_BODY_SIZE => Ok(length),
        _ => Err(Status::BodyTooLarge),
    }
}

fn parameters(query: &str) -> Result<Vec<(String, String)>, Status> {
    let decode = |text: &str| match urlencoding::decode(&text.replace('+', " ")) {
        Ok(text) => Ok(text.into_owned()),
        Err(_) => Err(Status::BadRequest),
    };
    let pairs = query.split('&').filter(|pair| !pair.is_empty());
    let pairs = pairs.map(|pair| pair.split_once('=').unwrap_or((pair, "")));
    pairs
        .map(|(name, value)| Ok((decode(name)?, decode(value)?)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(text: &str) -> Status {
        parse(text.as_bytes()).unwrap_err()
    }

    #[test]
    fn requests_are_taken_apart() {
        let text = "POST /t/a%2F..?layer=length.1&name=a%20b+c HTTP/1.1\r\nHost: localhost:1\r\n\
                    Origin: http://localhost:1\r\nContent-Length: 3\r\n\r\nabc";
        let (request, head, length) = parse(text.as_bytes()).unwrap().unwrap();
        assert_eq!((request.method, length), (Method::Post, 3));
        assert_eq!(&text[head..], "abc");
        assert_eq!(request.path, "/t/a%2F..");
        assert_eq!(request.parameter("layer"), "length.1");
        assert_eq!(request.parameter("name"), "a b c");
        assert_eq!(request.parameter("missing"), "");
        assert_eq!(request.host.as_deref(), Some("localhost:1"));
        // Expect all incomplete heads to be incomplete requests.
        for end in 0..head {
            assert!(parse(&text.as_bytes()[..end]).unwrap().is_none(), "{end}");
        }
    }

    #[test]
    fn what_is_doubtful_is_refused() {
        assert_eq!(status("DELETE / HTTP/1.1\r\n\r\n"), Status::BadMethod);
        assert_eq!(
            status("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"),
            Status::BadRequest
        );
        assert_eq!(status("GET /\0 HTTP/1.1\r\n\r\n"), Status::BadRequest);
        assert_eq!(
            status("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"),
            Status::BadRequest
        );
        assert_eq!(
            status("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"),
            Status::BadRequest
        );
        assert_eq!(status("GET /?a=%ff HTTP/1.1\r\n\r\n"), Status::BadRequest);
        let large = format!(
            "POST / HTTP/1.1\r\nContent-Length: {}\r\n\r\n",
            MAX_BODY_SIZE + 1
        );
        assert_eq!(status(&large), Status::BodyTooLarge);
        let digits = format!(
            "POST / HTTP/1.1\r\nContent-Length: {}\r\n\r\n",
            "9".repeat(40)
        );
        assert_eq!(status(&digits), Status::BodyTooLarge);
        let many = format!(
            "GET / HTTP/1.1\r\n{}\r\n",
            "A: b\r\n".repeat(MAX_HEADERS + 1)
        );
        assert_eq!(status(&many), Status::HeadTooLarge);
    }
}
