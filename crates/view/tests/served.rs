//! The viewer's page with friendly and hostile clients: access, reachable paths, and limits of
//! requests.

use io::image::{ImageLayers, Layer};
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use view::{Item, ItemOptions, Page, ViewOptions, ViewServer};

/// Longest duration in these tests; no limit of the server exceeds it.
const TIME_LIMIT: Duration = Duration::from_secs(15);

fn image(width: usize, value: f32) -> ImageLayers {
    let layer = |name: &str, value: f32| Layer {
        name: name.into(),
        channels: vec![(
            "Y".into(),
            (0..width * 2).map(|i| value + i as f32).collect(),
        )],
    };
    ImageLayers {
        width,
        height: 2,
        layers: vec![layer("", value), layer("variance", 1.0)],
        attributes: vec![("seed".into(), "7".into())],
    }
}

fn serve(items: Vec<Item>) -> ViewServer {
    ViewServer::start(Page::new(items).into(), &ViewOptions::default()).unwrap()
}

fn one_image() -> ViewServer {
    serve(vec![Item::image("a.exr".into(), image(3, 0.5))])
}

/// Address of a server, and its token.
fn parts(server: &ViewServer) -> (SocketAddr, String) {
    let address = server.address();
    let rest = address.strip_prefix("http://").unwrap();
    let (socket, token) = rest.split_once('/').unwrap();
    (
        socket.parse().unwrap(),
        token.trim_end_matches('/').to_owned(),
    )
}

/// Sends bytes. Returns the response.
fn exchange(socket: SocketAddr, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(socket).unwrap();
    stream.set_read_timeout(Some(TIME_LIMIT)).unwrap();
    // A server that has read enough closes the connection.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    answer
}

/// Sends `GET` with further headers. Returns status and body of the response.
fn get(server: &ViewServer, path: &str, headers: &str) -> (u16, Vec<u8>) {
    let (socket, token) = parts(server);
    let host = if headers.contains("Host:") {
        String::new()
    } else {
        format!("Host: {socket}\r\n")
    };
    let text = format!("GET /{token}/{path} HTTP/1.1\r\n{host}{headers}\r\n");
    split(&exchange(socket, text.as_bytes()))
}

fn split(answer: &[u8]) -> (u16, Vec<u8>) {
    let end = answer.windows(4).position(|w| w == b"\r\n\r\n");
    let end = end.expect("an answer") + 4;
    let status = std::str::from_utf8(&answer[9..12])
        .unwrap()
        .parse()
        .unwrap();
    (status, answer[end..].to_vec())
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect()
}

#[test]
fn values_arrive_as_they_are() {
    let other = Item::image("b.exr".into(), image(3, 2.5));
    let server = serve(vec![Item::image("a.exr".into(), image(3, 0.5)), other]);
    let (status, body) = get(&server, "api/items", "");
    let text = String::from_utf8(body).unwrap();
    assert!(
        status == 200 && text.contains("a.exr") && text.contains("\"width\":3"),
        "{text}"
    );
    let (_, plane) = get(&server, "api/0/plane?layer=&channel=Y", "");
    assert_eq!(floats(&plane), [0.5, 1.5, 2.5, 3.5, 4.5, 5.5]);
    // (a − b)/√(var a + var b), as in `morgana compare`.
    let (_, z) = get(&server, "api/difference?a=0&b=1&kind=z&channel=Y", "");
    let expected = (0..6).map(|i| -2.0 / (2.0 * (1.0 + i as f32)).sqrt());
    let is_close = |(z, expected): (f32, f32)| (z - expected).abs() < 1e-6;
    assert!(floats(&z).into_iter().zip(expected).all(is_close));
    let (_, flip) = get(&server, "api/difference?a=0&b=0&kind=flip&exposure=0", "");
    assert_eq!(floats(&flip), [0.0; 6]);
    let (status, exr) = get(&server, "api/1/image.exr", "");
    assert_eq!(status, 200);
    assert_eq!(io::image::exr::decode(&exr).unwrap(), image(3, 2.5));
}

#[test]
fn files_that_have_changed_are_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let write = |values: &[f32]| io::npy::write(&path, &[1, values.len()], values).unwrap();
    write(&[1.0, 2.0]);
    let item = Item::open(&path, &ItemOptions::default()).unwrap();
    let server = serve(vec![item]);
    let plane = || floats(&get(&server, "api/0/plane?layer=&channel=Y", "").1);
    let begin = || String::from_utf8(get(&server, "api/items", "").1).unwrap();
    write(&[3.0, 4.0, 5.0]);
    // An open page keeps its data.
    assert_eq!(plane(), [1.0, 2.0]);
    assert!(begin().contains("\"note\":null"));
    assert_eq!(plane(), [3.0, 4.0, 5.0]);
    std::fs::write(&path, "no array").unwrap();
    assert!(begin().contains("has changed and cannot be read"));
    assert_eq!(plane(), [3.0, 4.0, 5.0]);
    // A deleted file is shown as it was.
    std::fs::remove_file(&path).unwrap();
    assert!(begin().contains("\"note\":null"));
    assert_eq!(plane(), [3.0, 4.0, 5.0]);
}

#[test]
fn every_answer_forbids_what_the_page_does_not_need() {
    let server = one_image();
    let (socket, token) = parts(&server);
    for path in [format!("/{token}/"), "/".to_owned()] {
        let text = format!("GET {path} HTTP/1.1\r\nHost: {socket}\r\n\r\n");
        let answer = exchange(socket, text.as_bytes());
        let head = String::from_utf8_lossy(&answer).to_lowercase();
        let wanted = [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "frame-ancestors 'none'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cache-control: no-store",
        ];
        for header in wanted {
            assert!(head.contains(header), "{header}");
        }
        // Other origins may not read it.
        assert!(!head.contains("access-control-allow"));
    }
}

#[test]
fn strangers_are_refused() {
    let server = one_image();
    let (socket, token) = parts(&server);
    let refused = [
        // A request from another page, with and without a host name that its owner has bound to
        // this address.
        (
            format!("/{token}/api/items"),
            format!("Host: {socket}\r\nOrigin: http://evil.example\r\n"),
        ),
        (
            format!("/{token}/api/items"),
            format!("Host: {socket}\r\nOrigin: null\r\n"),
        ),
        (
            format!("/{token}/api/items"),
            "Host: evil.example\r\nOrigin: http://evil.example\r\n".into(),
        ),
        (
            format!("/{token}/api/items"),
            format!("Host: evil.example:{}\r\n", socket.port()),
        ),
        (format!("/{token}/api/items"), String::new()),
        ("/api/items".into(), format!("Host: {socket}\r\n")),
        (
            "/00000000000000000000000000000000/api/items".into(),
            format!("Host: {socket}\r\n"),
        ),
        (
            format!("http://{socket}/{token}/api/items"),
            format!("Host: {socket}\r\n"),
        ),
    ];
    for (path, headers) in refused {
        let text = format!("GET {path} HTTP/1.1\r\n{headers}\r\n");
        let (status, body) = split(&exchange(socket, text.as_bytes()));
        assert_eq!(status, 403, "{path} {headers}");
        assert!(!String::from_utf8(body).unwrap().contains("a.exr"));
    }
    let same = format!("Origin: http://{socket}\r\n");
    assert_eq!(get(&server, "api/items", &same).0, 200);
}

#[test]
fn there_are_no_paths_to_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shown.npy");
    std::fs::write(folder.path().join("secret"), "secret").unwrap();
    image(3, 0.5).write(&path).unwrap();
    let server = serve(vec![Item::open(&path, &ItemOptions::default()).unwrap()]);
    let inside = folder.path().display().to_string();
    let paths = [
        "../secret",
        "..%2fsecret",
        "%2e%2e/secret",
        "vendor/../../secret",
        "api/../secret",
        "api/0/../../secret",
        "/etc/passwd",
        "//etc/passwd",
        "vendor/..%5c..%5csecret",
        "api/0/plane?layer=../secret&channel=Y",
        "api/0/shown.npy",
        "api/1/plane",
        "api/-1/plane",
        "secret",
        "index.html%00",
        "api/0/mesh?object=0",
    ];
    for path in paths
        .into_iter()
        .map(str::to_owned)
        .chain([format!("{inside}/secret"), inside])
    {
        let (status, body) = get(&server, &path, "");
        assert_eq!(status, 404, "{path}");
        assert_ne!(body, b"secret");
    }
}

#[test]
fn what_is_too_large_is_refused() {
    let server = one_image();
    let (socket, token) = parts(&server);
    let head = format!("GET /{token}/ HTTP/1.1\r\nHost: {socket}\r\n");
    let long = format!("{head}A: {}\r\n\r\n", "a".repeat(100_000));
    assert_eq!(split(&exchange(socket, long.as_bytes())).0, 431);
    let post = format!(
        "POST /{token}/api/0/trace HTTP/1.1\r\nHost: {socket}\r\nContent-Length: 9999999\r\n\r\n"
    );
    assert_eq!(split(&exchange(socket, post.as_bytes())).0, 413);
    assert_eq!(split(&exchange(socket, b"BREW / HTTP/1.1\r\n\r\n")).0, 405);
    assert_eq!(
        split(&exchange(socket, b"\x16\x03\x01\x02\x00\r\n\r\n")).0,
        400
    );
    assert_eq!(get(&server, "api/items", "").0, 200);
}

/// Clients that send slowly, or nothing at all, hold their connections for a limited time. Others
/// are served in the meantime.
#[test]
fn slow_clients_hold_nobody_up() {
    let server = one_image();
    let (socket, token) = parts(&server);
    let started = Instant::now();
    let mut slow: Vec<TcpStream> = (0..20)
        .map(|_| TcpStream::connect(socket).unwrap())
        .collect();
    for stream in &mut slow[..10] {
        stream
            .write_all(format!("GET /{token}/api").as_bytes())
            .unwrap();
    }
    assert_eq!(get(&server, "api/items", "").0, 200);
    assert!(started.elapsed() < TIME_LIMIT / 3);
    // Sending a byte now and then does not extend the limit.
    let mut closed = 0;
    while closed < slow.len() && started.elapsed() < 2 * TIME_LIMIT {
        std::thread::sleep(Duration::from_millis(500));
        slow[9].write_all(b"a").ok();
        closed = slow.iter().filter(|stream| is_closed(stream)).count();
    }
    assert_eq!(closed, slow.len());
    assert!(started.elapsed() < TIME_LIMIT);
}

/// True if the other end has closed its side. Unread data stay unread.
fn is_closed(stream: &TcpStream) -> bool {
    stream
        .set_read_timeout(Some(Duration::from_millis(1)))
        .unwrap();
    let mut text = [0; 16];
    match stream.peek(&mut text) {
        Ok(0) => true,
        // The refusal, which arrives before the end.
        Ok(_) => text.starts_with(b"HTTP/1.1 408"),
        Err(e) => !matches!(
            e.kind(),
            std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
        ),
    }
}

/// A client that does not read a large response does not prevent the server from ending.
#[test]
fn clients_that_do_not_read_hold_nobody_up() {
    let server = serve(vec![Item::image("large".into(), image(4_000_000, 0.5))]);
    let (socket, token) = parts(&server);
    let mut stream = TcpStream::connect(socket).unwrap();
    let text = format!("GET /{token}/api/0/plane?channel=Y HTTP/1.1\r\nHost: {socket}\r\n\r\n");
    stream.write_all(text.as_bytes()).unwrap();
    let started = Instant::now();
    assert_eq!(get(&server, "api/0/plane?channel=none", "").0, 404);
    drop(server);
    assert!(started.elapsed() < TIME_LIMIT / 3);
}

/// Connections beyond the limit are closed at once, and places are freed.
#[test]
fn floods_are_held_off() {
    let server = one_image();
    let (socket, token) = parts(&server);
    let held: Vec<TcpStream> = (0..200)
        .map(|_| TcpStream::connect(socket).unwrap())
        .collect();
    std::thread::sleep(Duration::from_millis(300));
    let closed = held.iter().filter(|stream| is_closed(stream)).count();
    assert_eq!(closed, 200 - 32);
    held.iter()
        .for_each(|stream| drop(stream.shutdown(Shutdown::Both)));
    drop(held);
    std::thread::sleep(Duration::from_millis(500));
    let text = format!("GET /{token}/icon.svg HTTP/1.1\r\nHost: {socket}\r\n\r\n");
    let answers: Vec<u16> = (0..1000)
        .map(|_| split(&exchange(socket, text.as_bytes())).0)
        .collect();
    let count = |status| answers.iter().filter(|s| **s == status).count();
    assert_eq!(count(200) + count(429), 1000);
    // A burst of 400, and 200 per second.
    assert!(count(200) >= 400, "{}", count(200));
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(get(&server, "api/items", "").0, 200);
}

/// A point light in a ball of haze, and a camera.
const SCENE: &str = r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/></film></sensor>
  <emitter type="point"><point name="position" x="0.3" y="0" z="0"/></emitter>
  <shape type="sphere"><transform name="to_world"><scale value="1"/></transform><bsdf type="null"/>
    <medium type="homogeneous" name="interior"><float name="sigma_t" value="2"/></medium></shape>
</scene>"#;

fn page_of_scene() -> Page {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, SCENE).unwrap();
    Page::new(vec![Item::open(&path, &ItemOptions::default()).unwrap()])
}

#[test]
fn previews_have_the_wanted_size_and_view() {
    let page = page_of_scene();
    let picture = |body: &str| page.respond("POST", "api/0/picture", body.into());
    let own = picture(r#"{"page": "a", "size": [8, 6], "number": 0, "camera": null}"#);
    let values = floats(&own.content);
    assert_eq!((own.status, values.len()), (200, 1 + 3 * 8 * 6));
    assert!(values[1..].iter().any(|value| *value > 0.0));
    // A camera that looks away sees nothing.
    let camera = r#""camera": {"from": [0, 0, -5], "to": [0, 0, -9], "up": [0, 1, 0], "fov": 40}"#;
    let away = picture(&format!(
        r#"{{"page": "a", "size": [4, 4], "number": 0, {camera}}}"#
    ));
    assert_eq!(away.status, 200);
    assert_eq!(floats(&away.content)[1..], [0.0; 48]);
    for (body, expected) in [
        (
            r#"{"page": "a", "size": [0, 6], "number": 0}"#,
            "size: from 1 to 262144 pixels",
        ),
        (
            r#"{"page": "a", "size": [4294967296, 4294967296], "number": 0}"#,
            "size: from 1 to 262144 pixels",
        ),
        (
            r#"{"page": "a", "size": [4, 4], "number": 0, "camera": {"from": [0, 0, 0], "to": [0, 0, 0], "up": [0, 1, 0], "fov": 40}}"#,
            "origin and target must be finite and differ",
        ),
        (r#"{"size": [4, 4], "number": 0}"#, "missing field `page`"),
        (
            r#"{"page": "a", "size": [4, 4], "number": 0, "estimator": "pathh"}"#,
            "pathh",
        ),
    ] {
        let refused = picture(body);
        let message = String::from_utf8(refused.content).unwrap();
        assert!(
            refused.status == 400 && message.contains(expected),
            "{message}"
        );
    }
}

/// Pictures and rays follow changed parameters, which stay as they are for other requests.
#[test]
fn parameters_change_pictures() {
    let page = page_of_scene();
    let picture = |changes: &str| {
        let body = format!(
            r#"{{"page": "a", "size": [8, 6], "number": 0, "estimator": "path", "changes": {changes}}}"#
        );
        page.respond("POST", "api/0/picture", body.into())
    };
    let sum = |changes: &str| {
        let response = picture(changes);
        assert_eq!(response.status, 200, "{changes}");
        floats(&response.content)[1..].iter().sum::<f32>()
    };
    let own = sum("{}");
    assert!(own > 0.0);
    assert_eq!(sum(r#"{"shape.interior.sigma_t": 0}"#), 0.0);
    let far = sum(r#"{"emitter.position": [0, 0, 1000]}"#);
    assert!(far < 1e-4 * own, "{far} {own}");
    // The ball is out of sight.
    assert_eq!(sum(r#"{"shape.to_world": [50, 0, 0]}"#), 0.0);
    assert_eq!(sum("{}"), own);
    for (changes, expected) in [
        (r#"{"shape.interior.sigma_t": -1}"#, "sigma_t"),
        (r#"{"shape.interior.sigma_t": "x"}"#, "expected a number"),
        (r#"{"shape.interior.sigma_tt": 1}"#, "cannot change"),
        (r#"{"sensor.film.width": 100000}"#, "cannot change"),
        (r#"{"shape.to_world": 3}"#, "expected a number"),
    ] {
        let refused = picture(changes);
        let message = String::from_utf8(refused.content).unwrap();
        assert!(
            refused.status == 400 && message.contains(expected),
            "{changes}: {message}"
        );
    }
}
