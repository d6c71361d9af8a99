#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

mod api;
mod described;
mod item;
mod live;
mod page;
mod picture;
mod server;
mod source;

pub use item::{Item, ItemOptions, OpenError};
pub use live::{Live, LiveProgress};
pub use page::{Page, PageResponse};

use server::{Guard, Server};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;

/// Address of a page, and access to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewOptions {
    /// Listening address: only programs on this machine reach a loopback address.
    pub listen: IpAddr,
    /// Port; 0 for any free port.
    pub port: u16,
    /// True if pages from this machine, such as notebooks, may show the page in a frame.
    pub may_be_framed: bool,
}

impl Default for ViewOptions {
    fn default() -> Self {
        ViewOptions {
            listen: Ipv4Addr::LOCALHOST.into(),
            port: 0,
            may_be_framed: false,
        }
    }
}

/// HTTP server of a page, which runs until this object is dropped.
#[derive(Debug)]
pub struct ViewServer {
    server: Server,
    token: String,
}

impl ViewServer {
    /// Serves a page.
    ///
    /// # Errors
    ///
    /// An unavailable address, or a system without random numbers.
    pub fn start(page: Arc<Page>, options: &ViewOptions) -> io::Result<Self> {
        let listener = TcpListener::bind(SocketAddr::new(options.listen, options.port))?;
        let guard = Guard::new(options.listen.is_loopback())?;
        let token = guard.token().to_owned();
        let policy = page::policy(options.may_be_framed);
        let answer = move |request: &server::Request, path: &str| page.answer(request, path);
        let server = Server::start(listener, guard, policy, Arc::new(answer))?;
        Ok(ViewServer { server, token })
    }

    /// Returns the address of the page, with the token that every request needs.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.server.address(), self.token)
    }
}
