//! Small HTTP server: one request per connection, within limits of number, size and time.
//!
//! The server is independent of the content. A slow or silent client occupies one of a limited
//! number of connections for a limited time.

mod bucket;
mod guard;
mod request;
mod response;

pub(crate) use guard::Guard;
pub(crate) use request::{Method, Request};
pub(crate) use response::{Body, Response, Status};

use bucket::Bucket;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// Maximum number of simultaneous connections: a browser has six.
const MAX_CONNECTIONS: usize = 32;
/// Maximum number of requests per second, and of simultaneous requests after a pause.
const MAX_RATE: f64 = 200.0;
const MAX_BURST: f64 = 400.0;
/// Maximum time for a request to arrive.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// Waiting time after a failure to accept a connection, for instance with too many open files.
const RETRY_PAUSE: Duration = Duration::from_millis(50);

/// Function that responds to requests, given their paths after the token.
pub(crate) type Answer = dyn Fn(&Request, &str) -> Response + Send + Sync;

/// Server that runs until it is dropped.
#[derive(Debug)]
pub(crate) struct Server {
    address: SocketAddr,
    stopping: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// State that all connections share.
struct Shared {
    guard: Guard,
    /// Value of the header `Content-Security-Policy`.
    policy: String,
    answer: Arc<Answer>,
    bucket: Mutex<Bucket>,
    connections: AtomicUsize,
}

impl Server {
    /// Starts a server that responds by `answer` to requests that the guard admits.
    pub(crate) fn start(
        listener: TcpListener,
        guard: Guard,
        policy: String,
        answer: Arc<Answer>,
    ) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let stopping = Arc::new(AtomicBool::new(false));
        let shared = Arc::new(Shared {
            guard,
            policy,
            answer,
            bucket: Mutex::new(Bucket::new(MAX_RATE, MAX_BURST)),
            connections: AtomicUsize::new(0),
        });
        let stop = stopping.clone();
        let accept = move || accept(&listener, &shared, &stop);
        let thread = Builder::new().name("view".into()).spawn(accept)?;
        Ok(Server {
            address,
            stopping,
            thread: Some(thread),
        })
    }

    /// Returns the address of the server for clients on this machine.
    pub(crate) fn address(&self) -> SocketAddr {
        match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => {
                (Ipv4Addr::LOCALHOST, self.address.port()).into()
            }
            _ => self.address,
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stopping.store(true, Ordering::Release);
        // Wake the thread, which waits for a connection.
        let woken = TcpStream::connect_timeout(&self.address(), REQUEST_TIMEOUT).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| woken) {
            let _ = thread.join();
        }
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>, stopping: &AtomicBool) {
    loop {
        let accepted = listener.accept();
        if stopping.load(Ordering::Acquire) {
            return;
        }
        match accepted {
            Ok((stream, _)) => serve(stream, shared),
            Err(_) => std::thread::sleep(RETRY_PAUSE),
        }
    }
}

/// Serves a connection in a separate thread. Closes it at once if there are too many connections,
/// or no thread is available.
fn serve(stream: TcpStream, shared: &Arc<Shared>) {
    let Some(place) = Place::take(shared) else {
        return;
    };
    let work = move || {
        let shared = &place.0;
        let response = match Request::receive(&stream, Instant::now() + REQUEST_TIMEOUT) {
            Ok(request) => shared.respond(&request),
            Err(status) => Response::refusal(status),
        };
        response.send(&stream, &shared.policy);
    };
    drop(Builder::new().name("view-client".into()).spawn(work));
}

impl Shared {
    fn respond(&self, request: &Request) -> Response {
        let mut bucket = self.bucket.lock().unwrap_or_else(PoisonError::into_inner);
        if !bucket.take(Instant::now()) {
            return Response::refusal(Status::TooManyRequests);
        }
        drop(bucket);
        match self.guard.admit(request) {
            Ok(path) => (self.answer)(request, path),
            Err(status) => Response::refusal(status),
        }
    }
}

/// Slot of a limited number of connections, released on drop.
struct Place(Arc<Shared>);

impl Place {
    fn take(shared: &Arc<Shared>) -> Option<Self> {
        let taken = shared.connections.fetch_add(1, Ordering::AcqRel);
        // Release the slot at once if there are too many.
        let place = Place(shared.clone());
        // Planted error "connections without a limit", found by morgana-view/served::floods_are_held_off:
        // (taken < 9 * MAX_CONNECTIONS).then_some(place)
        (taken < MAX_CONNECTIONS).then_some(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::AcqRel);
    }
}
