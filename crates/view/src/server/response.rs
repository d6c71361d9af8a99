//! HTTP responses, within limits of time.

use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum time for a response, and minimum rate of large responses in bytes per second, which
/// extends the time.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(20);
const MIN_RATE: f64 = 1e6;
/// Number of values that are converted at a time.
const CHUNK: usize = 16 << 10;
/// Time in which a client may send further data before the connection closes.
const LINGER_TIME: Duration = Duration::from_millis(200);

/// Status of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    Ok,
    BadRequest,
    Forbidden,
    NotFound,
    BadMethod,
    Timeout,
    BodyTooLarge,
    TooManyRequests,
    HeadTooLarge,
}

impl Status {
    /// Returns the number of the status, with which its line begins.
    pub(crate) fn code(self) -> u16 {
        let digits = self.line().bytes().take_while(u8::is_ascii_digit);
        digits.fold(0, |code, digit| 10 * code + u16::from(digit - b'0'))
    }

    fn line(self) -> &'static str {
        match self {
            Status::Ok => "200 OK",
            Status::BadRequest => "400 Bad Request",
            Status::Forbidden => "403 Forbidden",
            Status::NotFound => "404 Not Found",
            Status::BadMethod => "405 Method Not Allowed",
            Status::Timeout => "408 Request Timeout",
            Status::BodyTooLarge => "413 Content Too Large",
            Status::TooManyRequests => "429 Too Many Requests",
            Status::HeadTooLarge => "431 Request Header Fields Too Large",
        }
    }
}

/// Body of a response.
#[derive(Clone, Debug)]
pub(crate) enum Body {
    /// Bytes that are sent unchanged.
    Bytes(Cow<'static, [u8]>),
    /// Numbers that are sent as little-endian float32: a range of shared values.
    Floats(Arc<Vec<f32>>, Range<usize>),
}

/// Response to a request.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    pub(crate) status: Status,
    pub(crate) kind: &'static str,
    pub(crate) body: Body,
}

impl Response {
    /// Makes a response of some media type.
    pub(crate) fn text(kind: &'static str, body: impl Into<Cow<'static, [u8]>>) -> Self {
        Response {
            status: Status::Ok,
            kind,
            body: Body::Bytes(body.into()),
        }
    }

    /// Makes a response of numbers.
    pub(crate) fn floats(values: Vec<f32>) -> Self {
        let range = 0..values.len();
        Self::shared_floats(Arc::new(values), range)
    }

    /// Makes a response of shared numbers.
    pub(crate) fn shared_floats(values: Arc<Vec<f32>>, range: Range<usize>) -> Self {
        Response {
            status: Status::Ok,
            kind: "application/octet-stream",
            body: Body::Floats(values, range),
        }
    }

    /// Makes a response that refuses a request.
    pub(crate) fn refusal(status: Status) -> Self {
        let text = match status {
            Status::Forbidden => {
                "This is not an address of the viewer: open the address that morgana has printed, with its token.\n"
            }
            status => status.line(),
        };
        Response::failure(status, text.to_owned())
    }

    /// Makes a response that refuses a request, with a message.
    pub(crate) fn failure(status: Status, message: String) -> Self {
        Response {
            status,
            kind: "text/plain; charset=utf-8",
            body: Body::Bytes(message.into_bytes().into()),
        }
    }

    /// Sends the response and closes the connection. Aborts if the client disconnects or is too
    /// slow.
    pub(super) fn send(&self, stream: &TcpStream, policy: &str) {
        let mut out = Timed::new(stream, self.length());
        let head = format!(
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             Content-Security-Policy: {policy}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
             Cross-Origin-Resource-Policy: same-origin\r\n\r\n",
            self.status.line(),
            self.kind,
            self.length()
        );
        let sent = out
            .write_all(head.as_bytes())
            .and_then(|()| self.body.write(&mut out));
        if sent.is_ok() && stream.shutdown(Shutdown::Write).is_ok() {
            // Read the rest first: closing a connection with unread data would discard the
            // response.
            drain(stream);
        }
    }

    fn length(&self) -> usize {
        match &self.body {
            Body::Bytes(bytes) => bytes.len(),
            Body::Floats(_, range) => range.len() * size_of::<f32>(),
        }
    }
}

impl Body {
    /// Returns the bytes that are sent.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        if let Body::Bytes(bytes) = self {
            return bytes.into_owned();
        }
        let mut bytes = Vec::new();
        self.write(&mut bytes).expect("memory takes all bytes");
        bytes
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        match self {
            Body::Bytes(bytes) => out.write_all(bytes),
            Body::Floats(values, range) => {
                let values = values.get(range.clone()).unwrap_or_default();
                let mut bytes = vec![[0; size_of::<f32>()]; CHUNK.min(values.len())];
                values.chunks(CHUNK).try_for_each(|chunk| {
                    for (bytes, value) in bytes.iter_mut().zip(chunk) {
                        *bytes = value.to_le_bytes();
                    }
                    out.write_all(bytes[..chunk.len()].as_flattened())
                })
            }
        }
    }
}

/// Reads remaining data for a short time.
fn drain(mut stream: &TcpStream) {
    let (deadline, mut chunk) = (Instant::now() + LINGER_TIME, [0; 4096]);
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
            return;
        }
        if !matches!(stream.read(&mut chunk), Ok(1..)) {
            return;
        }
    }
}

/// Connection with a deadline for all writes.
struct Timed<'a> {
    stream: &'a TcpStream,
    deadline: Instant,
}

impl<'a> Timed<'a> {
    fn new(stream: &'a TcpStream, length: usize) -> Self {
        let longer = Duration::from_secs_f64(length as f64 / MIN_RATE);
        Timed {
            stream,
            deadline: Instant::now() + RESPONSE_TIMEOUT + longer,
        }
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.stream.set_write_timeout(Some(left))?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
