#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

mod api;
mod item;
mod live;
mod page;
mod picture;
mod server;
mod source;

pub use item::{Item, ItemOptions, OpenError};
pub use live::{Live, LiveProgress};

use server::{Guard, Server};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;

/// Where a page is served, and to whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ViewOptions {
    /// Address to listen at: only programs on this machine reach a loopback address.
    pub listen: IpAddr,
    /// Port; 0 for any that is free.
    pub port: u16,
    /// Whether pages that this machine serves, such as notebooks, may hold the page in a frame.
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

/// A page that is served until this is dropped.
#[derive(Debug)]
pub struct ViewServer {
    server: Server,
    token: String,
}

impl ViewServer {
    /// Serves a page that shows these things.
    ///
    /// # Errors
    ///
    /// An address that cannot be listened at, and a system without random numbers.
    pub fn start(items: Vec<Item>, options: &ViewOptions) -> io::Result<Self> {
        let listener = TcpListener::bind(SocketAddr::new(options.listen, options.port))?;
        let guard = Guard::new(options.listen.is_loopback())?;
        let token = guard.token().to_owned();
        let policy = page::policy(options.may_be_framed);
        let api = api::Api::new(items);
        let answer = move |request: &server::Request, path: &str| match page::asset(path) {
            Some(asset) => asset,
            None => api.answer(request, path),
        };
        let server = Server::start(listener, guard, policy, Arc::new(answer))?;
        Ok(ViewServer { server, token })
    }

    /// The address of the page, with the token without which nothing is served.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.server.address(), self.token)
    }
}
