//! `--tev`: a listener reads the viewer's protocol (its `src/Ipc.cpp`). Packets carry their length
//! (32 bits, itself included) and type (8 bits); all numbers are little-endian, and texts end with
//! a zero byte.

use crate::support::Folder;
use io::image::exr;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;

const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE_V3: u8 = 6;

/// State that a viewer shows.
#[derive(Debug, Default)]
struct Shown {
    name: String,
    size: [usize; 2],
    channels: Vec<String>,
    /// Each channel row by row.
    planes: Vec<Vec<f32>>,
    updates: usize,
}

/// The content of a packet.
struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk().expect("a packet ends early");
        self.0 = rest;
        *head
    }

    fn int(&mut self) -> usize {
        u32::from_le_bytes(self.take()) as usize
    }

    fn long(&mut self) -> usize {
        u64::from_le_bytes(self.take()) as usize
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).expect("a text ends");
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }
}

impl Shown {
    fn accept(&mut self, packet: &[u8]) {
        let mut packet = Packet(packet);
        let [kind] = packet.take();
        let [_grab_focus] = packet.take();
        let name = packet.text();
        match kind {
            CREATE_IMAGE => {
                assert_eq!(self.updates, 0);
                self.name = name;
                self.size = [packet.int(), packet.int()];
                let count = packet.int();
                self.channels = (0..count).map(|_| packet.text()).collect();
                self.planes = vec![vec![0.0; self.size[0] * self.size[1]]; count];
            }
            UPDATE_IMAGE_V3 => {
                assert_eq!(name, self.name);
                self.update(&mut packet);
            }
            other => panic!("unexpected packet of type {other}"),
        }
        assert!(packet.0.is_empty(), "a packet goes on after its end");
    }

    fn update(&mut self, packet: &mut Packet) {
        self.updates += 1;
        let count = packet.int();
        let channels: Vec<String> = (0..count).map(|_| packet.text()).collect();
        let [x, y, width, height] = std::array::from_fn(|_| packet.int());
        let offsets: Vec<usize> = (0..count).map(|_| packet.long()).collect();
        let strides: Vec<usize> = (0..count).map(|_| packet.long()).collect();
        let (values, rest) = packet.0.as_chunks();
        assert!(rest.is_empty());
        for (c, name) in channels.iter().enumerate() {
            let plane = self.channels.iter().position(|n| n == name).unwrap();
            for i in 0..width * height {
                let at = (y + i / width) * self.size[0] + x + i % width;
                self.planes[plane][at] = f32::from_le_bytes(values[offsets[c] + i * strides[c]]);
            }
        }
        packet.0 = &[];
    }
}

/// Listens, and passes the only visitor to a function. Returns the address.
fn listen<T: Send + 'static>(
    visit: impl FnOnce(TcpStream) -> T + Send + 'static,
) -> (String, JoinHandle<T>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (
        address,
        std::thread::spawn(move || visit(listener.accept().unwrap().0)),
    )
}

fn view(mut stream: TcpStream) -> Shown {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let (mut shown, mut rest) = (Shown::default(), bytes.as_slice());
    while let Some(length) = rest.first_chunk() {
        let length = u32::from_le_bytes(*length) as usize;
        shown.accept(&rest[4..length]);
        rest = &rest[length..];
    }
    shown
}

#[test]
fn a_viewer_shows_the_image_in_the_end() {
    let folder = Folder::with_fog();
    let (address, viewer) = listen(view);
    folder.succeed(&format!("render scene.xml --tev {address} -o a.exr"));
    let shown = viewer.join().unwrap();
    assert_eq!((shown.name.as_str(), shown.size), ("scene.xml", [8, 6]));
    assert_eq!(shown.channels, ["R", "G", "B"]);
    // At least the first pass and the end.
    assert!(shown.updates >= 2, "{}", shown.updates);
    let image = exr::read(&folder.path("a.exr")).unwrap();
    for (name, plane) in shown.channels.iter().zip(&shown.planes) {
        assert_eq!(
            image.layer("").unwrap().channel(name).unwrap(),
            plane,
            "{name}"
        );
    }
}

#[test]
fn a_render_outlives_its_viewer() {
    let folder = Folder::with_fog();
    let (address, viewer) = listen(|mut stream| {
        stream.write_all(b"x").unwrap();
        drop(stream);
    });
    let line = format!("render scene.xml --spp 1000000 --time 1s --tev {address} -o a.exr");
    let outcome = folder.run(&line);
    viewer.join().unwrap();
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    assert_eq!(
        outcome
            .stderr
            .matches("the viewer does not answer any more")
            .count(),
        1,
        "{outcome:?}"
    );
    assert!(exr::read(&folder.path("a.exr")).is_ok());
}

/// A film whose image exceeds the system's buffers.
fn large() -> Folder {
    Folder::with_file(
        r#"<scene version="3.0.0">
          <sensor type="perspective"><film type="hdrfilm">
            <integer name="width" value="1024"/><integer name="height" value="1024"/></film>
            <sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor>
          <emitter type="constant"/>
        </scene>"#,
    )
}

/// A viewer may read nothing, or a little now and then.
#[test]
fn a_viewer_that_does_not_read_holds_nothing_up() {
    for drips in [false, true] {
        let folder = large();
        let (done, ended) = std::sync::mpsc::channel::<()>();
        let (address, viewer) = listen(move |mut stream| {
            let mut bytes = [0; 1000];
            let wait = std::time::Duration::from_millis(100);
            while ended.recv_timeout(wait) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                if drips {
                    let _ = stream.read(&mut bytes);
                }
            }
        });
        let started = std::time::Instant::now();
        let line = format!("render scene.xml --tev {address} -o a.npy");
        let outcome = folder.run(&line);
        drop(done);
        viewer.join().unwrap();
        assert_eq!(outcome.status, Some(0), "{outcome:?}");
        assert!(
            outcome
                .stderr
                .contains("the viewer does not answer any more"),
            "{outcome:?}"
        );
        assert!(started.elapsed().as_secs() < 60, "{:?}", started.elapsed());
    }
}

#[test]
fn a_viewer_that_is_not_there_is_noticed_before_rendering() {
    let folder = Folder::with_fog();
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    for address in [free.to_string(), "no.such.host.invalid:1".into()] {
        let message = folder.refuse(&format!("render scene.xml --spp 100000000 --tev {address}"));
        assert!(message.contains("start tev first"), "{message}");
    }
    assert_eq!(folder.files(), ["scene.xml"]);
}
