//! Surfaces with shading normals: means over the image, compared with Mitsuba 3.9.1.
//!
//! False alarms: 1e-3 for each test over all its comparisons, with fixed seeds.

use morgana_io::{LoadOptions, Loaded, load_scene};
use std::fmt::Write;
use std::fs;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;
use transport::render::{RenderOptions, render};

const RATE: f64 = 1e-3;

/// Corners of an icosahedron with a circumradius of 1: (0, ±1, ±g) and its cyclic permutations, normalised.
fn icosahedron() -> ([[f64; 3]; 12], [[usize; 3]; 20]) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let length = g.hypot(1.0);
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    (corners.map(|c| c.map(|x| x / length)), faces)
}

/// An OBJ file, with the normals of the surrounding ball or without normals.
fn obj(with_normals: bool) -> String {
    let (corners, faces) = icosahedron();
    let mut text = String::new();
    for [x, y, z] in corners {
        writeln!(text, "v {x} {y} {z}").unwrap();
        if with_normals {
            writeln!(text, "vn {x} {y} {z}").unwrap();
        }
    }
    for face in faces.map(|face| face.map(|i| i + 1)) {
        let corner = |i: usize| {
            if with_normals {
                format!("{i}//{i}")
            } else {
                i.to_string()
            }
        };
        writeln!(text, "f {}", face.map(corner).join(" ")).unwrap();
    }
    text
}

/// A ball of 20 triangles over a floor, under an area light and a sky.
fn scene(bsdf: &str) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><float name="fov" value="35"/>
<transform name="to_world"><lookat origin="1, 2.5, 3.5" target="0, -0.1, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler></sensor>
<shape type="obj"><string name="filename" value="ball.obj"/>{bsdf}</shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/><translate y="-1"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.7"/>
<lookat origin="2.5, 2.5, 0" target="0, 0, 0" up="0, 1, 0"/></transform>
<emitter type="area"><rgb name="radiance" value="8"/></emitter></shape>
<emitter type="constant"><rgb name="radiance" value="0.3"/></emitter></scene>"#
    )
}

fn load(scene: &str, mesh: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.obj"), mesh).unwrap();
    for (name, bytes) in maps() {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let path = folder.path().join("main.xml");
    fs::write(&path, scene).unwrap();
    load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}"))
}

/// Mean over the image, and its error.
fn mean(loaded: &Loaded, samples: u64) -> [f64; 2] {
    let options = RenderOptions::new(loaded.renderer, samples, 1);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    let (mean, variance) = (rendering.film.mean(), rendering.film.variance());
    let n = (mean.len() / 3) as f64;
    let of = |values: &[f32]| values.iter().step_by(3).map(|v| f64::from(*v)).sum::<f64>() / n;
    [of(&mean), (of(&variance) / n).sqrt()]
}

/// Means over the image of eight renders of 400 samples, with their errors.
#[test]
fn means_of_a_coarse_ball() {
    let cases = [
        (r#"<bsdf type="diffuse"/>"#, [0.22593, 0.00004]),
        (
            r#"<bsdf type="roughconductor"><float name="alpha" value="0.3"/><string name="material" value="none"/></bsdf>"#,
            [0.28392, 0.00009],
        ),
        (
            r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#,
            [0.28103, 0.00012],
        ),
        (r#"<bsdf type="principled"/>"#, [0.23378, 0.00004]),
    ];
    let mut zs = Vec::new();
    for (bsdf, [theirs, error]) in cases {
        let [ours, own] = mean(&load(&scene(bsdf), &obj(true)), 64);
        println!("{bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        zs.push((ours - theirs) / own.hypot(error));
    }
    max_abs_z(&zs, RATE).unwrap();
}

/// Mitsuba computes normals that files omit; here, by symmetry, they are the normals of the ball.
/// With `face_normals` there are none: Mitsuba's mean is 0.23069.
#[test]
fn normals_of_files_without_any() {
    let bsdf = r#"<bsdf type="diffuse"/>"#;
    let given = mean(&load(&scene(bsdf), &obj(true)), 16);
    let made = mean(&load(&scene(bsdf), &obj(false)), 16);
    assert!((given[0] - made[0]).abs() < 1e-6, "{given:?} {made:?}");
    let flat = format!(r#"<boolean name="face_normals" value="true"/>{bsdf}"#);
    let flat = mean(&load(&scene(&flat), &obj(true)), 16);
    assert!(flat[0] - given[0] > 0.003, "{flat:?} {given:?}");
}

/// A band around a ball as an OBJ file, of 8 × 4 cells with normals. Lines of constant v of its
/// texture coordinates follow the band's circles; lines of constant u are oblique.
fn band(with_texcoords: bool) -> String {
    let mut text = String::new();
    for (r, c) in (0..=4).flat_map(|r| (0..=8).map(move |c| (r, c))) {
        let [down, around] = [f64::from(r) / 4.0, f64::from(c) / 8.0];
        let theta = std::f64::consts::PI * (1.0 / 6.0 + 2.0 / 3.0 * down);
        let phi = std::f64::consts::TAU * around;
        let [x, y, z] = [
            theta.sin() * phi.cos(),
            theta.cos(),
            theta.sin() * phi.sin(),
        ];
        writeln!(text, "v {x} {y} {z}\nvn {x} {y} {z}").unwrap();
        if with_texcoords {
            writeln!(text, "vt {} {down}", around + 0.5 * down).unwrap();
        }
    }
    let corner = |i: usize| {
        let texcoord = if with_texcoords {
            i.to_string()
        } else {
            String::new()
        };
        format!("{i}/{texcoord}/{i}")
    };
    for (r, c) in (0..4).flat_map(|r| (0..8).map(move |c| (r, c))) {
        let a = 9 * r + c + 1;
        let [a, b, d, e] = [a, a + 1, a + 9, a + 10].map(corner);
        writeln!(text, "f {a} {b} {e}\nf {a} {e} {d}").unwrap();
    }
    text
}

/// Brushed copper on meshes, compared with 16 renders of 1024 samples by Mitsuba 3.9.1. There u
/// grows along the first side of a triangle without texture coordinates.
#[test]
fn brushed_meshes() {
    let cases = [
        (true, false, [0.05, 0.4], [0.307747, 0.00015]),
        (true, false, [0.4, 0.05], [0.312603, 0.00014]),
        (true, true, [0.05, 0.4], [0.373305, 0.00027]),
        (true, true, [0.4, 0.05], [0.292568, 0.00005]),
        (false, false, [0.05, 0.4], [0.309747, 0.00014]),
        (false, false, [0.4, 0.05], [0.312543, 0.00018]),
    ];
    let mut zs = Vec::new();
    for (with_texcoords, flat, [u, v], [theirs, error]) in cases {
        let text = format!(
            r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="30"/>
<transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
<shape type="obj"><string name="filename" value="ball.obj"/><boolean name="face_normals" value="{flat}"/>
<bsdf type="roughconductor"><string name="distribution" value="ggx"/>
<rgb name="eta" value="0.2, 0.92, 1.1"/><rgb name="k" value="3.9, 2.45, 2.14"/>
<float name="alpha_u" value="{u}"/><float name="alpha_v" value="{v}"/></bsdf></shape>
<shape type="sphere"><point name="center" x="2" y="3" z="2"/><float name="radius" value="0.5"/>
<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
<emitter type="area"><rgb name="radiance" value="20"/></emitter></shape>
<emitter type="constant"><rgb name="radiance" value="0.3"/></emitter></scene>"#
        );
        let [ours, own] = mean(&load(&text, &band(with_texcoords)), 1024);
        println!("{with_texcoords} {flat} {u} {v}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        zs.push((ours - theirs) / own.hypot(error));
    }
    max_abs_z(&zs, RATE).unwrap();
}

/// Pixels of a portable float map.
fn pfm(channels: usize, pixel: impl Fn(usize) -> [f64; 3]) -> Vec<u8> {
    let kind = if channels == 3 { "PF" } else { "Pf" };
    let mut bytes = format!("{kind}\n8 8\n-1.0\n").into_bytes();
    // Rows from the bottom to the top.
    for row in (0..8).rev() {
        for value in (0..8)
            .flat_map(|i| pixel(8 * row + i))
            .collect::<Vec<_>>()
            .chunks(3)
        {
            let kept = value.iter().take(channels);
            bytes.extend(kept.flat_map(|v| (*v as f32).to_le_bytes()));
        }
    }
    bytes
}

/// Normals and heights that vary from pixel to pixel.
fn maps() -> [(&'static str, Vec<u8>); 2] {
    let normal = |k: usize| {
        let [x, y] = [2.0, 3.0].map(|a: f64| 0.6 * (a * k as f64).sin());
        let length = (x * x + y * y + 1.0).sqrt();
        [x, y, 1.0].map(|c| 0.5 * (c / length + 1.0))
    };
    let height = |k: usize| [0.5 + 0.5 * (5.0 * k as f64).sin(); 3];
    [
        ("normals.pfm", pfm(3, normal)),
        ("heights.pfm", pfm(1, height)),
    ]
}

/// Means over the image of eight renders of 400 samples, with their errors. Smooth surfaces are
/// excluded: see `bump and normal maps` in docs/mitsuba.md.
#[test]
fn means_under_maps() {
    let texture = |name: &str, file: &str| {
        format!(
            r#"<texture type="bitmap"{name}><string name="filename" value="{file}"/><boolean name="raw" value="true"/></texture>"#
        )
    };
    let normals = texture(r#" name="normalmap""#, "normals.pfm");
    let heights = texture("", "heights.pfm");
    let mapped = |nested: &str| format!(r#"<bsdf type="normalmap">{normals}{nested}</bsdf>"#);
    let bumpy = |nested: &str| {
        format!(r#"<bsdf type="bumpmap">{heights}<float name="scale" value="0.3"/>{nested}</bsdf>"#)
    };
    let diffuse = r#"<bsdf type="diffuse"/>"#;
    let metal = r#"<bsdf type="roughconductor"><float name="alpha" value="0.3"/><string name="material" value="none"/></bsdf>"#;
    let glass = r#"<bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>"#;
    let back = format!(r#"<bsdf type="twosided">{}</bsdf>"#, mapped(diffuse));
    let cube = r#"<shape type="cube"><transform name="to_world"><scale value="0.6"/><rotate x="1" angle="30"/><rotate y="1" angle="20"/></transform>"#;
    let cylinder = r#"<shape type="cylinder"><point name="p0" x="-1" y="0" z="0"/><point name="p1" x="1" y="0.2" z="0"/><float name="radius" value="0.8"/>"#;
    let square = r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-60"/></transform>"#;
    let sphere = r#"<shape type="sphere">"#;
    let cases = [
        (sphere, mapped(diffuse), [0.224524, 0.00002]),
        (cube, mapped(metal), [0.300961, 0.00006]),
        (cylinder, back, [0.196424, 0.00001]),
        (square, bumpy(diffuse), [0.219775, 0.00004]),
        (sphere, bumpy(metal), [0.326526, 0.0002]),
        (sphere, mapped(glass), [0.229526, 0.0001]),
    ];
    let mut zs = Vec::new();
    for (shape, bsdf, [theirs, error]) in cases {
        let ball = format!(r#"<shape type="obj"><string name="filename" value="ball.obj"/>{bsdf}"#);
        let text = scene(&bsdf).replace(&ball, &format!("{shape}{bsdf}"));
        let [ours, own] = mean(&load(&text, &obj(true)), 64);
        println!("{bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        zs.push((ours - theirs) / own.hypot(error));
    }
    max_abs_z(&zs, RATE).unwrap();
}
