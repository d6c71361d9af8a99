//! Targets of the fuzzer.

use io::image::{ImageLayers, Layer, RgbImage, exr, hdr, pfm, png};
use io::mesh::{gltf, hair, obj, ply, serialized};
use io::part::{Body, Part};
use io::volume::series::{FrameSums, SeriesShape};
use io::volume::{
    AxisOrder, Options, hdf5, jnifti, mat, nifti, npy, npz, nrrd, vdb, vol, vti, vtk,
};
use io::{Diagnostics, Limits, LoadOptions, Loaded, Problem, Run, ies, json, xml};
use std::ops::ControlFlow;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, MeasureState, State, memory, render};

/// A reader of files under test.
pub struct Target {
    pub name: &'static str,
    /// Extensions of the test files that belong to its corpus.
    pub extensions: &'static [&'static str],
    /// Reads an input.
    pub read: fn(&[u8]),
    /// Generates further files for the corpus.
    pub written: fn() -> Vec<Vec<u8>>,
    /// True if inputs may take only the memory that their size justifies.
    pub is_bounded: bool,
}

impl Target {
    /// Adds the checksum that the format requires; without it, a reader stops at once.
    pub fn seal(&self, mut input: Vec<u8>) -> Vec<u8> {
        if self.name == "part" {
            input.truncate(input.len().saturating_sub(HASH));
            let hash = io::part::checksum(&input);
            input.extend(hash);
        }
        input
    }
}

/// Bytes of a checksum.
const HASH: usize = 32;
const LIMITS: Limits = Limits { memory: Some(0) };
/// Maximum number of pixels of a film that is rendered.
const PIXELS: usize = 64;
const FILM: usize = 64 << 20;

const fn target(
    name: &'static str,
    extensions: &'static [&'static str],
    read: fn(&[u8]),
) -> Target {
    Target {
        name,
        extensions,
        read,
        written: Vec::new,
        is_bounded: true,
    }
}

/// Returns a request for three sums over the last three quarters of the frames.
fn quarters(shape: SeriesShape) -> Result<FrameSums, Problem> {
    Ok(FrameSums {
        used: shape.frames / 4..shape.frames,
        count: 3,
        weights: Box::new(|frame| [1.0, frame as f64, 0.5]),
    })
}

pub const TARGETS: &[Target] = &[
    target("vol", &["vol"], |b| drop(vol::parse::<f32>(b))).writing(vol_file),
    target("npy", &["npy"], |b| {
        drop(npy::parse::<f32>(b, zyx()));
        drop(npy::parse_series(b, zyx(), &mut quarters));
        drop(io::npy::parse(b));
    }),
    target("npz", &["npz"], |b| {
        drop(npz::parse::<f32>(b, zyx()));
        drop(npz::parse::<f64>(b, zyx().of("density")));
    }),
    target("mat", &["mat"], |b| {
        drop(mat::parse::<f32>(b, zyx()));
        drop(mat::parse::<f64>(b, zyx().of("density")));
    }),
    target("hdf5", &["h5"], |b| {
        for name in ["p_final", "p_max", "results/rho", "p", "p/2"] {
            drop(hdf5::parse::<f32>(b, zyx().of(name)));
            drop(hdf5::parse_series(b, zyx().of(name), &mut quarters));
        }
        drop(hdf5::parse::<f32>(b, zyx()));
    }),
    target("nrrd", &["nrrd", "nhdr"], |b| {
        drop(nrrd::parse::<f32>(b, any()));
        drop(nrrd::parse::<f32>(b, zyx()));
    }),
    target("vti", &["vti"], |b| {
        drop(vti::parse::<f32>(b, any()));
        drop(vti::parse::<f64>(b, any().of("density")));
    }),
    target("vtk", &["vtk"], |b| {
        drop(vtk::parse::<f32>(b, any()));
        drop(vtk::parse::<f64>(b, any().of("density")));
    }),
    target("vdb", &["vdb"], |b| {
        drop(vdb::parse::<f32>(b, any()));
        drop(vdb::parse::<f64>(b, any().of("density")));
    }),
    target("nifti", &["nii", "gz"], |b| {
        drop(nifti::parse::<f32>(b, any()));
        drop(nifti::parse::<f64>(b, any()));
    }),
    target("jnifti", &["jnii", "bnii", "jdt", "jdb"], |b| {
        drop(jnifti::parse::<f32>(b, any()));
        drop(jnifti::parse::<f64>(b, zyx().of("rho")));
    }),
    target("ply", &["ply"], |b| drop(ply::parse(b, LIMITS))),
    target("obj", &["obj"], |b| drop(obj::parse(b, LIMITS))),
    target("serialized", &["serialized"], |b| {
        drop(serialized::parse(b, 0, LIMITS));
        drop(serialized::parse(b, 1, LIMITS));
    }),
    target("hair", &["hair"], |b| drop(hair::parse(b, LIMITS))).writing(|| {
        let text = b"0 0 0\n0 1 0\n\n1 0 0\n1 0 2\n".to_vec();
        let points = [f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let points = points.into_iter().flat_map(f32::to_le_bytes);
        let header = b"BINARY_HAIR\x02\0\0\0".iter().copied();
        vec![text, header.chain(points).collect()]
    }),
    target("gltf", &["gltf", "glb"], |b| {
        drop(gltf::parse(b, |_| Ok(vec![0; 1000]), LIMITS));
    }),
    target("ies", &["ies"], |b| drop(ies::parse(b))),
    target("exr", &["exr"], |b| drop(exr::decode_within(b, LIMITS))).writing(|| {
        let image = picture();
        vec![exr::encode(&image).unwrap_or_default()]
    }),
    target("png", &["png"], |b| drop(png::decode_within(b, LIMITS))).writing(|| {
        let shown = picture().on_screen().unwrap_or_default();
        let depths = [png::Depth::Eight, png::Depth::Sixteen];
        let file = |depth| png::encode(&shown, depth, io::image::tone::Tone::default());
        depths.map(|d| file(d).unwrap_or_default()).into()
    }),
    target("hdr", &["hdr"], |b| drop(hdr::decode_within(b, LIMITS))).writing(|| {
        let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n".to_vec();
        for row in 0..2 {
            file.extend([2, 2, 0, 8]);
            (0..4).for_each(|c| file.extend([136, 120 + c + row]));
        }
        vec![file]
    }),
    target("pfm", &["pfm"], |b| drop(pfm::decode_within(b, LIMITS))).writing(|| {
        let headers = ["PF\n2 1\n-1.0\n", "Pf 3 2 2\n"];
        headers.map(|h| [h.as_bytes(), &[63; 24]].concat()).into()
    }),
    target("bmp", &["bmp"], |b| drop(RgbImage::decode_bmp(b, LIMITS))),
    target("tga", &["tga"], |b| drop(RgbImage::decode_tga(b, LIMITS))).writing(|| {
        let header =
            |kind: u8, depth: u8| vec![0, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, depth, 0];
        let plain = [header(2, 24), (0..12).collect()].concat();
        let runs = [header(10, 32), vec![131, 1, 2, 3, 4]].concat();
        vec![plain, runs]
    }),
    target("spd", &["spd"], |b| drop(io::spd::parse(b)))
        .writing(|| vec![b"# nm\n400 0.1\n500\t0.3\n700, 0.9\n".to_vec()]),
    target("part", &[], |b| drop(Part::from_bytes(b)))
        .writing(parts)
        .unbounded(),
    target("xml", &["xml"], |b| {
        let mut diagnostics = Diagnostics::new();
        drop(xml::parse(&text(b), "scene.xml", &[], &mut diagnostics));
        drop(diagnostics.to_string());
    })
    .writing(scenes)
    .unbounded(),
    target("json", &["json"], |b| {
        let mut diagnostics = Diagnostics::new();
        drop(json::parse_within(
            &text(b),
            "scene.json",
            &[],
            LIMITS,
            &mut diagnostics,
        ));
        drop(diagnostics.to_string());
    })
    .unbounded(),
    target("scene", &[], picture_of).unbounded(),
    target("mcx", &[], picture_of).unbounded(),
    target("faces", &["ply"], |b| picture_with("ply", b))
        .writing(coincident_faces)
        .unbounded(),
    target("curve", &[], |b| picture_with("linearcurve", b))
        .writing(curves)
        .unbounded(),
];

impl Target {
    const fn writing(self, written: fn() -> Vec<Vec<u8>>) -> Self {
        Target { written, ..self }
    }

    const fn unbounded(self) -> Self {
        Target {
            is_bounded: false,
            ..self
        }
    }
}

fn any() -> Options<'static> {
    Options::default().within(LIMITS)
}

fn zyx() -> Options<'static> {
    Options::order(AxisOrder::ZYX).within(LIMITS)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Reads a scene. Renders two samples of a small film, or traces some particles.
fn picture_of(bytes: &[u8]) {
    if let Some(loaded) = load(&text(bytes)) {
        if loaded.instruments.is_empty() {
            state(&loaded);
        } else {
            readings(&loaded);
        }
    }
}

/// Renders a scene of a shape whose file has these bytes.
fn picture_with(plugin: &str, bytes: &[u8]) {
    let path = std::env::temp_dir().join(format!("fuzz-{}.{plugin}", std::process::id()));
    if std::fs::write(&path, bytes).is_ok() {
        let scene = format!(
            r#"{{"type": "scene",
                "camera": {{"type": "perspective", "film": {{"type": "hdrfilm", "width": 4, "height": 4}}}},
                "shape": {{"type": "{plugin}", "filename": {path:?}, "to_world": [{{"translate": [0, 0, 5]}}]}},
                "light": {{"type": "constant"}}}}"#
        );
        picture_of(scene.as_bytes());
        drop(std::fs::remove_file(&path));
    }
}

fn load(text: &str) -> Option<Loaded> {
    let mut diagnostics = Diagnostics::new();
    let scene = if text.trim_start().starts_with('{') {
        json::parse_within(text, "scene.json", &[], LIMITS, &mut diagnostics)
    } else {
        xml::parse(text, "scene.xml", &[], &mut diagnostics)
    };
    let options = LoadOptions {
        limits: LIMITS,
        ..LoadOptions::default()
    };
    io::assemble(&scene?, &options, diagnostics).ok()
}

fn state(loaded: &Loaded) -> Option<()> {
    let options = transport::render::RenderOptions {
        adaptive: loaded.adaptive,
        reweight: loaded.reweight,
        decomposition: loaded.layering.decomposition,
        ..transport::render::RenderOptions::new(loaded.renderer, 2, 1)
    };
    let film = loaded.scene().film();
    let fits = film.width * film.height <= PIXELS && memory(loaded.scene(), &options) <= FILM;
    if fits {
        let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
        assert!(rendering.film.mean().iter().all(|v| v.is_finite()));
    }
    fits.then_some(())
}

fn meters(loaded: &Loaded) -> Vec<Meter> {
    loaded.instruments.iter().map(|i| i.meter.clone()).collect()
}

fn readings(loaded: &Loaded) -> Option<MeasureState> {
    let meters = meters(loaded);
    let cells: usize = meters.iter().map(Meter::cells).sum();
    if cells > 1 << 16 {
        return None;
    }
    let options = MeasureOptions {
        first: 0,
        particles: 20,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
    };
    let mut state = MeasureState::new(&loaded.groups, &meters).ok()?;
    let handle = Handle::default();
    let advanced = state.advance(&loaded.groups, &meters, &options, &handle, |_| {
        ControlFlow::Continue(())
    });
    advanced.ok()?;
    Some(state)
}

fn picture() -> ImageLayers {
    let values = |scale: f32| (0..24).map(|i| scale * i as f32).collect();
    let channels = [("R", 0.01), ("G", 0.02), ("B", 1.5)];
    ImageLayers {
        width: 6,
        height: 4,
        layers: vec![Layer {
            name: String::new(),
            channels: channels.map(|(n, s)| (n.to_owned(), values(s))).into(),
        }],
        attributes: vec![("scene".into(), "a.xml".into())],
    }
}

fn vol_file() -> Vec<Vec<u8>> {
    let mut bytes = b"VOL\x03\x01\0\0\0\x02\0\0\0\x02\0\0\0\x01\0\0\0\x01\0\0\0".to_vec();
    bytes.resize(48 + 16, 0);
    vec![bytes]
}

/// Returns meshes of coincident triangles: equal, nested, and with a common side.
fn coincident_faces() -> Vec<Vec<u8>> {
    const COUNT: usize = 300;
    let file = |vertices: &[String], face: fn(usize) -> String| {
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {COUNT}\nproperty list uchar int vertex_indices\nend_header\n",
            vertices.len()
        );
        let faces: String = (0..COUNT).map(face).collect();
        (header + &vertices.concat() + &faces).into_bytes()
    };
    let start = ["0 0 0\n", "1 0 0\n", "0 1 0\n"].map(str::to_owned);
    let pair = |i: usize| [format!("{} 0 0\n", i + 1), format!("0 {} 0\n", i + 1)];
    let pairs = (0..COUNT).flat_map(pair);
    let nested: Vec<String> = start[..1].iter().cloned().chain(pairs).collect();
    let side = (0..COUNT).map(|i| format!("0 {} 0\n", i + 1));
    let fan: Vec<String> = start[..2].iter().cloned().chain(side).collect();
    vec![
        file(&start, |_| "3 0 1 2\n".into()),
        file(&nested, |i| format!("3 0 {} {}\n", 2 * i + 1, 2 * i + 2)),
        file(&fan, |i| format!("3 0 1 {}\n", i + 2)),
    ]
}

/// Returns curves: one that turns, one that comes back, one far away.
fn curves() -> Vec<Vec<u8>> {
    let files = [
        "0 0 0 0.1\n1 0 0 0.1\n1 1 0 0.2\n\n0 0 1 0.1\n0 1 1 0\n",
        "0 0 0 0.1\n1 0 0 0.1\n0 0 0 0.1\n1 0 0 0.1\n",
        "0 0 0 0.1\n1 0 0 0.1\n1 0 1e18 0.1\n1 0 0 0.1\n1 1 0 0.1\n",
    ];
    files.map(|file| file.as_bytes().to_vec()).into()
}

/// Returns the scenes that are rendered.
fn scenes() -> Vec<Vec<u8>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/scene");
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|e| e.path()).collect();
    paths.sort();
    paths.retain(|path| path.extension().is_some_and(|e| e == "xml"));
    paths.iter().filter_map(|p| std::fs::read(p).ok()).collect()
}

/// Returns a part file of each kind.
fn parts() -> Vec<Vec<u8>> {
    let loaded = scenes().into_iter().filter_map(|bytes| load(&text(&bytes)));
    let part = |loaded: Loaded| {
        let run = Run {
            seed: 1,
            total: Some(2),
            ..Run::new(&loaded)
        };
        let body = if loaded.instruments.is_empty() {
            Body::Image(State::new(&loaded.groups, &run.options()).into())
        } else {
            Body::Meters(readings(&loaded)?.into())
        };
        let header = run.header();
        Some(Part { header, body }.to_bytes())
    };
    loaded.filter_map(part).collect()
}
