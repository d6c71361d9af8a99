//! `morgana view`, and watched renders: a page receives the content of files.

use crate::support::{Folder, program};
use io::image::ImageLayers;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const TIME_LIMIT: Duration = Duration::from_secs(60);

/// The program while it serves a page.
struct Served {
    program: Child,
    output: BufReader<std::process::ChildStdout>,
    host: String,
    token: String,
}

impl Served {
    /// Starts the program, which prints the page's address first.
    fn start(folder: &Folder, arguments: &str) -> Self {
        let mut program = Command::new(program())
            .current_dir(folder.path("."))
            .args(arguments.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut output = BufReader::new(program.stdout.take().unwrap());
        let mut line = String::new();
        output.read_line(&mut line).unwrap();
        let rest = line.trim().strip_prefix("http://").expect("an address");
        let (host, rest) = rest.split_once('/').unwrap();
        let token = rest.split('/').next().unwrap();
        let (host, token) = (host.to_owned(), token.to_owned());
        Served {
            program,
            output,
            host,
            token,
        }
    }

    /// Returns the body of the response to a request.
    fn ask(&self, method: &str, path: &str, body: &str) -> Vec<u8> {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let (host, token, length) = (&self.host, &self.token, body.len());
        let text = format!(
            "{method} /{token}/{path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(text.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        assert!(
            answer.starts_with(b"HTTP/1.1 200"),
            "{path}: {}",
            String::from_utf8_lossy(&answer)
        );
        answer[end + 4..].to_vec()
    }

    fn json(&self, method: &str, path: &str, body: &str) -> serde_json::Value {
        serde_json::from_slice(&self.ask(method, path, body)).unwrap()
    }

    fn plane(&self, path: &str) -> Vec<f32> {
        let bytes = self.ask("GET", path, "");
        bytes
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

#[test]
fn rays_of_a_page_are_those_of_trace_and_connect() {
    let folder = Folder::with_lens();
    let served = Served::start(&folder, "view scene.xml");
    let items = served.json("GET", "api/items", "");
    assert_eq!(items[0]["kind"], "scene");
    let body = r#"{"from": [0.1, 0.2, -5], "direction": [0, 0, 2]}"#;
    let ray = served.json("POST", "api/0/trace", body);
    folder.succeed("trace scene.xml --from=0.1,0.2,-5 --direction 0,0,1 -o ray.json");
    let file = folder.json("ray.json");
    let expected = file["rays"][0]["points"].as_array().unwrap();
    let points = ray["points"].as_array().unwrap();
    assert_eq!(points.len(), expected.len());
    for (point, expected) in points.iter().zip(expected) {
        assert_eq!(point, &expected["x"]);
    }
    let body = r#"{"from": [0.1, 0.2, -5], "to": [0.3, 0, 4]}"#;
    let found = served.json("POST", "api/0/connect", body);
    let branch = &found["branches"][0];
    let points = branch["points"].as_array().unwrap();
    assert_eq!(points[0], serde_json::json!([0.1, 0.2, -5.0]));
    // The curve has the stated length, except for its chords.
    let at = |p: &serde_json::Value| [0, 1, 2].map(|i| p[i].as_f64().unwrap());
    let distance =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let length: f64 = points
        .windows(2)
        .map(|pair| distance(at(&pair[0]), at(&pair[1])))
        .sum();
    let exact = branch["arc_length"].as_f64().unwrap();
    assert!(
        length <= exact * (1.0 + 1e-6) && length > exact * 0.999,
        "{length} {exact}"
    );
    assert!(distance(at(points.last().unwrap()), [0.3, 0.0, 4.0]) < 1e-4);
}

/// Connections that start after some length of the ray of a pixel start there.
#[test]
fn connections_start_along_the_ray_of_a_pixel() {
    let folder = Folder::with_lens();
    let served = Served::start(&folder, "view scene.xml");
    let ray = served.json("POST", "api/0/trace", r#"{"pixel": [0, 0]}"#);
    let at = |p: &serde_json::Value| [0, 1, 2].map(|i| p[i].as_f64().unwrap());
    let points = ray["points"].as_array().unwrap();
    let [a, b] = [&points[0], points.last().unwrap()].map(at);
    let body = r#"{"pixel": [0, 0], "at": 1.5, "to": [0, 3, 0]}"#;
    let found = served.json("POST", "api/0/connect", body);
    // This ray misses the lens: it is straight.
    let length = (0..3).map(|i| (b[i] - a[i]).powi(2)).sum::<f64>().sqrt();
    let start = at(&found["branches"][0]["points"][0]);
    for i in 0..3 {
        let expected = a[i] + 1.5 * (b[i] - a[i]) / length;
        assert!((start[i] - expected).abs() < 1e-9, "{start:?}");
    }
}

#[test]
fn a_render_is_watched_to_its_end() {
    let folder = Folder::with_fog();
    let mut served = Served::start(&folder, "render scene.xml --view --spp 16 -o a.exr");
    let started = Instant::now();
    let status = loop {
        let status = served.json("GET", "api/0/status", "");
        if status["ended"] == true {
            break status;
        }
        assert!(started.elapsed() < TIME_LIMIT);
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(
        (&status["done"], &status["fraction"]),
        (&serde_json::json!(16.0), &serde_json::json!(1.0))
    );
    let mut line = String::new();
    served.output.read_line(&mut line).unwrap();
    assert!(!line.is_empty());
    let file = ImageLayers::read(&folder.path("a.exr")).unwrap();
    for (name, channel) in [("", "R"), ("variance", "G"), ("samples", "N")] {
        let shown = served.plane(&format!("api/0/plane?layer={name}&channel={channel}"));
        assert_eq!(
            shown,
            file.layer(name).unwrap().channel(channel).unwrap(),
            "{name}"
        );
    }
}

#[test]
fn a_page_pauses_and_stops_a_render() {
    let folder = Folder::with_fog();
    let served = Served::start(&folder, "render scene.xml --view --time 10m -o a.exr");
    let command = |name: &str| {
        served.json(
            "POST",
            "api/0/command",
            &format!("{{\"name\": \"{name}\"}}"),
        )
    };
    let done = || {
        served.json("GET", "api/0/status", "")["done"]
            .as_f64()
            .unwrap()
    };
    let started = Instant::now();
    while done() < 2.0 {
        assert!(started.elapsed() < TIME_LIMIT);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(command("pause")["paused"], true);
    // The current pass completes.
    std::thread::sleep(Duration::from_secs(2));
    let paused = done();
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(done(), paused);
    command("continue");
    while done() <= paused {
        assert!(started.elapsed() < TIME_LIMIT);
        std::thread::sleep(Duration::from_millis(20));
    }
    command("stop");
    while served.json("GET", "api/0/status", "")["ended"] != true {
        assert!(started.elapsed() < TIME_LIMIT);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(ImageLayers::read(&folder.path("a.exr")).is_ok());
}

/// `--open` starts the browser that the environment names, with the printed address.
#[cfg(target_os = "linux")]
#[test]
fn the_page_opens_in_the_browser() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_lens();
    let browser = folder.path("xdg-open");
    let seen = folder.path("seen");
    let script = format!("#!/bin/sh\necho \"$@\" > {}\n", seen.display());
    std::fs::write(&browser, script).unwrap();
    std::fs::set_permissions(&browser, PermissionsExt::from_mode(0o755)).unwrap();
    let path = format!(
        "{}:{}",
        folder.path(".").display(),
        std::env::var("PATH").unwrap()
    );
    let mut program = Command::new(program())
        .current_dir(folder.path("."))
        .args(["view", "scene.xml", "--open"])
        .env("PATH", path)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let mut output = BufReader::new(program.stdout.take().unwrap());
    output.read_line(&mut line).unwrap();
    let started = Instant::now();
    let opened = loop {
        match std::fs::read_to_string(&seen) {
            Ok(text) if !text.is_empty() => break text,
            _ => assert!(started.elapsed() < TIME_LIMIT),
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    program.kill().unwrap();
    program.wait().unwrap();
    assert_eq!(line.split_whitespace().next(), Some(opened.trim()));
}

#[test]
fn files_that_cannot_be_shown_are_refused() {
    let folder = Folder::with_fog();
    std::fs::write(folder.path("bad.exr"), "bad").unwrap();
    for (arguments, word) in [
        ("view none.exr", "none.exr"),
        ("view bad.exr", "bad.exr"),
        ("view", "FILE"),
        ("view scene.xml --listen 192.0.2.1", "192.0.2.1"),
        ("render scene.xml --view --frames 1..2", "--frames"),
    ] {
        let message = folder.fail(2, arguments);
        assert!(message.contains(word), "{message}");
    }
}
