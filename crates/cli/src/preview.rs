//! The image while it is made, in the viewer tev (<https://github.com/Tom94/tev>).
//!
//! A thread of its own sends images, so that a render never waits for the viewer. While the viewer is busy, or does not read
//! what it is sent, no image is even made; at the end it gets a few seconds for the last one.

use crate::command_error::{CommandError, show};
use io::{Diagnostic, Diagnostics};
use std::io::ErrorKind;
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};
use transport::Film;

/// Where tev listens unless it is told otherwise.
const PORT: u16 = 14158;
/// Longest time to wait for a viewer that does not answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest time to wait until a viewer has the last image.
const LAST: Duration = Duration::from_secs(2);
/// Time between two images, at least; and in terms of the time that it takes to make one.
const INTERVAL: Duration = Duration::from_millis(250);
const SHARE: u32 = 50;
/// Values of a message, about: tev shows what it has between messages.
const MESSAGE: usize = 1 << 20;

/// A viewer that shows a render.
#[derive(Debug)]
pub struct Preview {
    frames: SyncSender<Vec<f32>>,
    /// Whether the thread has sent all images that it has been given.
    waiting: Arc<AtomicBool>,
    /// Sends nothing, but ends when the thread does.
    done: Receiver<()>,
    /// To break off.
    stream: TcpStream,
    /// When the next image is due.
    next: Instant,
}

/// An image in the viewer.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// What it is called.
    pub name: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Names of its channels.
    pub channels: Vec<String>,
}

impl Preview {
    /// Connects to a viewer, `HOST` or `HOST:PORT`.
    pub fn open(address: &str, canvas: Canvas) -> Result<Self, CommandError> {
        let unreachable = |why| {
            CommandError::Usage(format!(
                "--tev: no viewer answers at '{address}': {why}; start tev first"
            ))
        };
        let stream = connect(address).map_err(unreachable)?;
        let viewer = TevClient::wrap(stream.try_clone().map_err(unreachable)?);
        // Room for one on its way, and the last.
        let (frames, received) = sync_channel(2);
        let (ending, done) = sync_channel(0);
        let waiting = Arc::new(AtomicBool::new(true));
        let wait = waiting.clone();
        std::thread::spawn(move || {
            // Dropped when the thread ends.
            let _ending: SyncSender<()> = ending;
            if let Err(error) = send(viewer, &canvas, &received, &wait) {
                let why = match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => "it does not answer".into(),
                    _ => error.to_string(),
                };
                let message = format!("--tev: the viewer is gone ({why}); the render continues");
                let mut diagnostics = Diagnostics::new();
                diagnostics.push(Diagnostic::warning(message));
                show(&diagnostics);
            }
        });
        Ok(Preview {
            frames,
            waiting,
            done,
            stream,
            next: Instant::now(),
        })
    }

    /// Shows how far a render has got, unless that has just been done.
    pub fn update(&mut self, film: &Film) {
        let now = Instant::now();
        // A viewer that is busy or gone gets nothing.
        if now >= self.next && self.waiting.swap(false, Ordering::AcqRel) {
            let _ = self.frames.try_send(film.mean());
            self.next = now + INTERVAL.max(SHARE * now.elapsed());
        }
    }

    /// Shows the image that is done, and waits until the viewer has it, but not for long.
    pub fn finish(self, film: &Film) {
        let _ = self.frames.try_send(film.mean());
        drop(self.frames);
        // Nothing is ever sent: this ends with the thread, or with patience.
        if self.done.recv_timeout(LAST) == Err(RecvTimeoutError::Timeout) {
            // The thread says that the viewer is gone.
            let _ = self.stream.shutdown(Shutdown::Both);
            let _ = self.done.recv_timeout(LAST);
        }
    }
}

fn connect(address: &str) -> std::io::Result<TcpStream> {
    let addresses = match address.to_socket_addrs() {
        Ok(addresses) => addresses,
        Err(_) => (address, PORT).to_socket_addrs()?,
    };
    let mut error = std::io::Error::other("there is no such host");
    for address in addresses {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(e) => error = e,
        }
    }
    Err(error)
}

/// Sends images as they come.
fn send(
    mut viewer: TevClient,
    canvas: &Canvas,
    frames: &Receiver<Vec<f32>>,
    waiting: &AtomicBool,
) -> std::io::Result<()> {
    let [width, height] = canvas.size;
    viewer.send(PacketCreateImage {
        image_name: &canvas.name,
        grab_focus: true,
        width,
        height,
        channel_names: &canvas.channels,
    })?;
    for frame in frames {
        canvas.send(&mut viewer, &frame)?;
        waiting.store(true, Ordering::Release);
    }
    Ok(())
}

impl Canvas {
    /// Sends an image in bands of rows; its channels are interleaved.
    fn send(&self, viewer: &mut TevClient, frame: &[f32]) -> std::io::Result<()> {
        let ([width, height], channels) = (self.size, self.channels.len());
        let row = width as usize * channels;
        let rows = (MESSAGE / row).clamp(1, height as usize);
        for (band, data) in frame.chunks(rows * row).enumerate() {
            viewer.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &self.channels,
                channel_offsets: &(0..channels as u64).collect::<Vec<_>>(),
                channel_strides: &vec![channels as u64; channels],
                x: 0,
                y: (band * rows) as u32,
                width,
                height: (data.len() / row) as u32,
                data,
            })?;
        }
        Ok(())
    }
}
