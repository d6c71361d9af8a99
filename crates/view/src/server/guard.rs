//! Access control: requests must have the token, and come from the page itself.
//!
//! Other pages in the same browser can send requests, too. They do not know the token, and their
//! requests have their own `Origin`. A page whose name was rebound to this machine's address (DNS
//! rebinding) has its own name as `Host`.

use super::{Request, Status};
use std::fmt::Write;
use std::io;
use std::net::IpAddr;

/// Number of random bytes of a token: 128 bits cannot be guessed.
const TOKEN_BYTES: usize = 16;

/// Conditions of access.
#[derive(Debug)]
pub(crate) struct Guard {
    token: String,
    /// True if only clients on this machine have access.
    is_loopback: bool,
}

impl Guard {
    /// Makes a guard with a random token.
    pub(crate) fn new(is_loopback: bool) -> io::Result<Self> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        let token = bytes.iter().fold(String::new(), |mut token, byte| {
            // Ignore the result: writing to a string cannot fail.
            let _ = write!(token, "{byte:02x}");
            token
        });
        Ok(Guard { token, is_loopback })
    }

    /// Returns the token, the first part of the paths.
    pub(crate) fn token(&self) -> &str {
        &self.token
    }

    /// Returns the path after the token, for a request with access.
    pub(crate) fn admit<'a>(&self, request: &'a Request) -> Result<&'a str, Status> {
        let host = request.host.as_deref().ok_or(Status::Forbidden)?;
        // Planted error "pages served to whatever name their host is given", found by morgana-view/served::strangers_are_refused:
        // if host.is_empty() {
        if !self.is_own(host) {
            return Err(Status::Forbidden);
        }
        let origin = request.origin.as_deref();
        if origin.is_some_and(|origin| !is_origin_of(origin, host)) {
            return Err(Status::Forbidden);
        }
        let path = request.path.strip_prefix('/').ok_or(Status::Forbidden)?;
        let (token, path) = path.split_once('/').ok_or(Status::Forbidden)?;
        if !is_equal(token.as_bytes(), self.token.as_bytes()) {
            return Err(Status::Forbidden);
        }
        Ok(path)
    }

    /// Returns true if a `Host` cannot be a foreign name: it is `localhost`, or an address. The
    /// address must belong to this machine, if only this machine has access. The port may be any,
    /// as at the client's end of a tunnel.
    fn is_own(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => host,
        };
        let bare = name.strip_prefix('[').and_then(|n| n.strip_suffix(']'));
        match bare.unwrap_or(name).parse::<IpAddr>() {
            Ok(ip) => !self.is_loopback || ip.is_loopback(),
            Err(_) => name.eq_ignore_ascii_case("localhost"),
        }
    }
}

/// Returns true if an `Origin` is a page from `host`.
fn is_origin_of(origin: &str, host: &str) -> bool {
    let of = origin.strip_prefix("http://");
    // Planted error "pages served to other origins", found by morgana-view/served::strangers_are_refused:
    // of.is_some_and(|of| !host.is_empty() && !of.is_empty())
    of.is_some_and(|of| of.eq_ignore_ascii_case(host))
}

/// Compares in a time that does not depend on the position of a difference.
fn is_equal(a: &[u8], b: &[u8]) -> bool {
    let differences = a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differences == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::server::Method;

    fn guard(is_loopback: bool) -> Guard {
        let token = "00ff".to_owned();
        Guard { token, is_loopback }
    }

    fn request(host: &str, origin: Option<&str>, path: &str) -> Request {
        Request {
            method: Method::Get,
            path: path.into(),
            query: Vec::new(),
            host: Some(host.into()),
            origin: origin.map(str::to_owned),
            body: Vec::new(),
        }
    }

    #[test]
    fn the_page_itself_is_served() {
        for host in [
            "127.0.0.1:80",
            "localhost:9000",
            "[::1]:7",
            "LOCALHOST",
            "127.0.0.1",
        ] {
            let origin = format!("http://{host}");
            for origin in [None, Some(origin.as_str())] {
                let request = request(host, origin, "/00ff/a/b");
                assert_eq!(guard(true).admit(&request), Ok("a/b"), "{host}");
            }
        }
    }

    #[test]
    fn names_that_others_may_own_are_refused() {
        let names = [
            "evil.example:80",
            "localhost.evil.example",
            "127.0.0.1.evil.example:80",
            "192.168.0.7:80",
            "0x7f.1",
            "",
            ":80",
            "[::1",
            "[127.0.0.1]:80x",
        ];
        for host in names {
            let request = request(host, None, "/00ff/");
            assert_eq!(
                guard(true).admit(&request),
                Err(Status::Forbidden),
                "{host}"
            );
        }
        let request = request("192.168.0.7:80", None, "/00ff/");
        assert_eq!(guard(false).admit(&request), Ok(""));
    }

    #[test]
    fn other_origins_are_refused() {
        for origin in [
            "null",
            "http://evil.example",
            "https://127.0.0.1:80",
            "http://127.0.0.1:81",
            "",
        ] {
            let request = request("127.0.0.1:80", Some(origin), "/00ff/");
            assert_eq!(
                guard(true).admit(&request),
                Err(Status::Forbidden),
                "{origin}"
            );
        }
    }

    #[test]
    fn without_the_token_nothing_is_served() {
        for path in [
            "", "/", "/00ff", "/00fe/", "/00ff0/", "/00f/", "//00ff/", "00ff/",
        ] {
            let request = request("localhost", None, path);
            assert_eq!(
                guard(true).admit(&request),
                Err(Status::Forbidden),
                "{path}"
            );
        }
    }

    #[test]
    fn tokens_differ() {
        let token = || Guard::new(true).unwrap().token().to_owned();
        let (a, b) = (token(), token());
        assert_eq!(a.len(), 2 * TOKEN_BYTES);
        assert_ne!(a, b);
    }
}
