//! Display of a render in progress in the viewer tev (<https://github.com/Tom94/tev>).
//!
//! A separate thread sends images, so that a render never waits for the viewer. While the viewer is
//! busy, or does not read its messages, no image is made. At the end the viewer has a few seconds
//! to receive the last image.

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

/// Default port of tev.
const PORT: u16 = 14158;
/// Longest wait for a response of the viewer.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait until the viewer has received the last image.
const LAST_IMAGE_TIMEOUT: Duration = Duration::from_secs(2);
/// Least time between two images.
const MIN_INTERVAL: Duration = Duration::from_millis(250);
/// Minimum time between two images, in multiples of the time to make one image.
const MIN_INTERVAL_RATIO: u32 = 50;
/// Approximate number of values per message. tev updates its display between messages.
const VALUES_PER_MESSAGE: usize = 1 << 20;

/// A viewer that shows a render.
#[derive(Debug)]
pub struct Preview {
    frames: SyncSender<Vec<f32>>,
    /// True if the thread has sent all images that it received.
    waiting: Arc<AtomicBool>,
    /// Channel without data, which closes when the thread ends.
    done: Receiver<()>,
    /// Connection to the viewer, to be shut down on a timeout.
    stream: TcpStream,
    /// Time at which the next image is due.
    next: Instant,
}

/// An image in the viewer.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// Name of the image.
    pub name: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
}

impl Preview {
    /// Connects to a viewer at `HOST` or `HOST:PORT`.
    pub fn open(address: &str, canvas: Canvas) -> Result<Self, CommandError> {
        let unreachable = |why| {
            CommandError::Usage(format!(
                "--tev: no viewer answers at '{address}': {why}; start tev first"
            ))
        };
        let stream = connect(address).map_err(unreachable)?;
        let viewer = TevClient::wrap(stream.try_clone().map_err(unreachable)?);
        // Room for an image being sent, and for the last image.
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
                let message = format!(
                    "--tev: the viewer does not answer any more ({why}); the render continues"
                );
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

    /// Sends the current image, unless an image was sent shortly before.
    pub fn update(&mut self, film: &Film) {
        let now = Instant::now();
        // Skip the image if the viewer is busy or gone.
        if now >= self.next && self.waiting.swap(false, Ordering::AcqRel) {
            let _ = self.frames.try_send(film.mean());
            self.next = now + MIN_INTERVAL.max(MIN_INTERVAL_RATIO * now.elapsed());
        }
    }

    /// Sends the finished image, and waits briefly until the viewer has received it.
    pub fn finish(self, film: &Film) {
        let _ = self.frames.try_send(film.mean());
        drop(self.frames);
        // No data ever arrives: this returns when the thread ends, or at the timeout.
        if self.done.recv_timeout(LAST_IMAGE_TIMEOUT) == Err(RecvTimeoutError::Timeout) {
            // The thread then reports that the viewer is gone.
            let _ = self.stream.shutdown(Shutdown::Both);
            let _ = self.done.recv_timeout(LAST_IMAGE_TIMEOUT);
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
        match TcpStream::connect_timeout(&address, RESPONSE_TIMEOUT) {
            Ok(stream) => {
                stream.set_write_timeout(Some(RESPONSE_TIMEOUT))?;
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
    /// Sends an image in bands of rows. Channels are interleaved.
    fn send(&self, viewer: &mut TevClient, frame: &[f32]) -> std::io::Result<()> {
        let ([width, height], channels) = (self.size, self.channels.len());
        let row = width as usize * channels;
        let rows = (VALUES_PER_MESSAGE / row).clamp(1, height as usize);
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
