//! Scenes of Mitsuba: its defaults, and means of its renders.
//!
//! False alarms: 1e-3 for the means. Seeds are fixed.

use morgana_io::image::{ImageLayers, Layer, exr};
use morgana_io::schema::{self, Default, Parameter};
use morgana_io::{Diagnostics, LoadOptions, Loaded, PluginKind, json};
use std::ops::ControlFlow;
use testkit::samples;
use transport::Spectrum;
use transport::emitter::Emitter;
use transport::render::{RenderOptions, render};

fn load_in(directory: &std::path::Path, text: &str) -> Loaded {
    let path = directory.join("scene.json");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}\n{text}"))
}

fn load(text: &str) -> Loaded {
    let mut diagnostics = Diagnostics::new();
    let description = json::parse(text, "scene.json", &[], &mut diagnostics);
    let description = description.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    morgana_io::assemble(&description, &LoadOptions::default(), diagnostics)
        .unwrap_or_else(|d| panic!("{d}\n{text}"))
}

/// Defaults of plugins as Mitsuba 3.9.1 (`scalar_rgb`) shows them by `print` and `mi.traverse` if
/// only the type is given; where these show nothing, as in its sources.
#[test]
fn defaults_are_those_of_mitsuba() {
    use PluginKind::{
        Bsdf, Emitter, Film, Integrator, Medium, Phase, Rfilter, Sensor, Shape, Texture, Volume,
    };
    let table = [
        (Bsdf, "diffuse", "reflectance", "0.5"),
        (Bsdf, "dielectric", "specular_reflectance", "1"),
        (Bsdf, "dielectric", "specular_transmittance", "1"),
        (Bsdf, "roughdielectric", "distribution", "beckmann"),
        (Bsdf, "roughdielectric", "alpha", "0.1"),
        (Bsdf, "roughdielectric", "sample_visible", "true"),
        (Bsdf, "thindielectric", "int_ior", "1.5046"),
        (Bsdf, "thindielectric", "ext_ior", "air"),
        (Bsdf, "conductor", "eta", "0"),
        (Bsdf, "conductor", "k", "1"),
        (Bsdf, "conductor", "material", "none"),
        (Bsdf, "roughconductor", "distribution", "beckmann"),
        (Bsdf, "roughconductor", "alpha", "0.1"),
        (Bsdf, "roughconductor", "eta", "0"),
        (Bsdf, "plastic", "diffuse_reflectance", "0.5"),
        (Bsdf, "plastic", "int_ior", "1.49"),
        (Bsdf, "plastic", "nonlinear", "false"),
        (Bsdf, "roughplastic", "distribution", "beckmann"),
        (Bsdf, "roughplastic", "alpha", "0.1"),
        (Bsdf, "roughplastic", "int_ior", "1.49"),
        (Bsdf, "roughplastic", "nonlinear", "false"),
        (Bsdf, "principled", "base_color", "0.5"),
        (Bsdf, "principled", "roughness", "0.5"),
        (Bsdf, "principled", "metallic", "0"),
        (Bsdf, "principled", "specular", "0.5"),
        (Bsdf, "principled", "clearcoat_gloss", "0"),
        (Bsdf, "principledthin", "eta", "1.5"),
        (Bsdf, "pplastic", "alpha", "0.1"),
        (Bsdf, "retarder", "delta", "90"),
        (Bsdf, "mask", "opacity", "0.5"),
        (Emitter, "point", "intensity", "1"),
        (Emitter, "spot", "intensity", "1"),
        (Emitter, "spot", "cutoff_angle", "20"),
        (Emitter, "spot", "beam_width", "¾ of the cut-off"),
        (Emitter, "projector", "irradiance", "1"),
        (Emitter, "projector", "scale", "1"),
        (Emitter, "directional", "irradiance", "1"),
        (Emitter, "constant", "radiance", "1"),
        (Emitter, "envmap", "scale", "1"),
        (Emitter, "area", "radiance", "1"),
        (Film, "hdrfilm", "width", "768"),
        (Film, "hdrfilm", "height", "576"),
        (Film, "hdrfilm", "pixel_format", "rgb"),
        (Rfilter, "tent", "radius", "1"),
        (Rfilter, "gaussian", "stddev", "0.5"),
        (Integrator, "path", "max_depth", "-1"),
        (Integrator, "path", "rr_depth", "5"),
        (Integrator, "path", "hide_emitters", "false"),
        (Integrator, "volpath", "rr_depth", "5"),
        (Integrator, "ptracer", "rr_depth", "5"),
        (Sensor, "perspective", "focal_length", "50mm"),
        (Sensor, "perspective", "fov_axis", "x"),
        (Sensor, "thinlens", "focus_distance", "far_clip"),
        (Shape, "sphere", "radius", "1"),
        (Shape, "cylinder", "radius", "1"),
        (Shape, "sphere", "flip_normals", "false"),
        (Shape, "serialized", "shape_index", "0"),
        (Medium, "homogeneous", "sigma_t", "1"),
        (Medium, "homogeneous", "albedo", "0.75"),
        (Medium, "homogeneous", "scale", "1"),
        (Medium, "heterogeneous", "sigma_t", "1"),
        (Medium, "heterogeneous", "albedo", "0.75"),
        (Phase, "hg", "g", "0.8"),
        (Texture, "bitmap", "filter_type", "bilinear"),
        (Texture, "bitmap", "wrap_mode", "repeat"),
        (Texture, "bitmap", "raw", "false"),
        (Texture, "checkerboard", "color0", "0.4"),
        (Texture, "checkerboard", "color1", "0.2"),
        (Volume, "gridvolume", "filter_type", "trilinear"),
        (Volume, "gridvolume", "wrap_mode", "clamp"),
        (Volume, "gridvolume", "use_grid_bbox", "false"),
    ];
    for (kind, plugin, name, expected) in table {
        let plugin = schema::find(kind, plugin).unwrap();
        let default = |p: &Parameter| match p.default {
            Default::Computed(words) => Some(words.to_owned()),
            default => default.json().map(|value| value.to_string()),
        };
        let found = plugin.parameter(name).and_then(default);
        let found = found.as_deref().map(|text| text.trim_matches('"'));
        assert_eq!(found, Some(expected), "{kind} {} {name}", plugin.name);
    }
}

/// Plugins for which Mitsuba needs only their type (and a film) are complete.
#[test]
fn what_mitsuba_accepts_bare_is_accepted() {
    for emitter in ["point", "spot", "projector", "directional", "constant"] {
        load(&format!(
            r#"{{"type": "scene", "s": {{"type": "perspective"}}, "e": {{"type": "{emitter}"}}}}"#
        ));
    }
    let lens = r#"{"type": "scene", "e": {"type": "constant"}, "s": {"type": "thinlens", "aperture_radius": 0.1}}"#;
    load(lens);
    let area = r#"{"type": "scene", "s": {"type": "perspective"}, "b": {"type": "sphere", "center": [0, 0, 5], "e": {"type": "area"}}}"#;
    load(area);
}

/// A ball with some surface, an emitter and a sky.
fn ball(bsdf: &str) -> String {
    let light = r#""light": {"type": "sphere", "center": [2, 3, 2], "radius": 0.5, "bsdf": {"type": "diffuse", "reflectance": 0},
    "emitter": {"type": "area", "radiance": 20}},
  "sky": {"type": "constant", "radiance": 0.3}"#;
    ball_in(bsdf, light)
}

/// A ball with some surface among emitters.
fn ball_in(bsdf: &str, emitters: &str) -> String {
    format!(
        r#"{{"type": "scene",
  "sensor": {{"type": "perspective", "fov": 30,
    "to_world": [{{"lookat": {{"origin": [0, 1, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}}}],
    "film": {{"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {{"type": "box"}}}}}},
  "ball": {{"type": "sphere", "bsdf": {{{bsdf}}}}},
  {emitters}}}"#
    )
}

/// Mean of the first channel and its standard error.
fn mean(text: &str, samples: u64) -> [f64; 2] {
    mean_of(load(text), samples)
}

fn mean_of(loaded: Loaded, samples: u64) -> [f64; 2] {
    let options = RenderOptions::new(loaded.renderer, samples, 1);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    let (mean, variance) = (rendering.film.mean(), rendering.film.variance());
    let n = (mean.len() / 3) as f64;
    let of = |values: &[f32]| values.iter().step_by(3).map(|v| f64::from(*v)).sum::<f64>() / n;
    [of(&mean), (of(&variance) / n).sqrt()]
}

/// Means over the image (first channel) of 16 renders of 1024 samples by Mitsuba 3.9.1,
/// `scalar_rgb`, integrator `path`, with their standard errors. The last column is the fraction by
/// which morgana's means may differ, as docs/mitsuba.md explains: Mitsuba's fit of Beckmann's
/// masking, the base below rough coats, the index of air around glass, steep facets of sheets.
#[test]
fn means_are_those_of_mitsuba() {
    let metal = r#""eta": {"type": "rgb", "value": [0.2, 0.92, 1.1]}, "k": {"type": "rgb", "value": [3.9, 2.45, 2.14]}"#;
    let conductor =
        |more: &str| format!(r#""type": "roughconductor", "alpha": 0.3, {metal}{more}"#);
    let colour = r#""base_color": {"type": "rgb", "value": [0.8, 0.5, 0.2]}"#;
    let principled = |more: &str| format!(r#""type": "principled", {colour}, {more}"#);
    let thin = format!(
        r#""type": "principledthin", {colour}, "spec_trans": 0.6, "diff_trans": 1.2, "roughness": 0.4, "sheen": 0.5,
  "flatness": 0.5, "spec_tint": 0.5"#
    );
    let table = [
        (r#""type": "roughdielectric", "alpha": 0.3"#.to_owned(), 0.296295, 1.5e-4, 1e-3),
        (r#""type": "roughdielectric", "alpha": 0.3, "distribution": "ggx""#.into(), 0.270390, 8e-5, 2e-4),
        (conductor(""), 0.332419, 1.0e-4, 1e-3),
        (conductor(r#", "distribution": "ggx""#), 0.317048, 9e-5, 0.0),
        (format!(r#""type": "roughconductor", {metal}, "distribution": "ggx", "alpha_u": 0.15, "alpha_v": 0.5"#), 0.306779, 1e-4, 0.0),
        (r#""type": "roughdielectric", "distribution": "ggx", "alpha_u": 0.1, "alpha_v": 0.5"#.into(), 0.264038, 8e-5, 2e-4),
        (r#""type": "roughplastic", "alpha": 0.3"#.into(), 0.259489, 3e-5, 5e-3),
        (r#""type": "roughplastic", "alpha": 0.1, "nonlinear": true, "diffuse_reflectance": 0.9"#.into(), 0.321811, 4e-5, 8e-3),
        (r#""type": "plastic""#.into(), 0.273777, 5e-5, 5e-4),
        (r#""type": "thindielectric""#.into(), 0.305628, 1.2e-4, 0.0),
        (r#""type": "dielectric""#.into(), 0.301845, 8e-5, 2e-4),
        (r#""type": "principled", "base_color": {"type": "rgb", "value": [0.8, 0.5, 0.2]}"#.into(), 0.339961, 6e-5, 0.0),
        (principled(r#""spec_tint": 0.8, "roughness": 0.3, "specular": 0.9"#), 0.348472, 9e-5, 0.0),
        (principled(r#""sheen": 1, "sheen_tint": 0.7, "flatness": 0.8, "roughness": 0.8"#), 0.333450, 7e-5, 0.0),
        (principled(r#""clearcoat": 1, "clearcoat_gloss": 0.2, "metallic": 0.4, "eta": 1.7"#), 0.329269, 8e-5, 0.0),
        (principled(r#""metallic": 0.8, "anisotropic": 0.9"#), 0.293270, 7e-5, 0.0),
        (principled(r#""spec_trans": 0.8, "roughness": 0.4, "metallic": 0.2, "eta": 1.4"#), 0.261483, 6e-5, 0.0),
        (thin, 0.266910, 9e-5, 1e-3),
        (r#""type": "pplastic", "alpha": 0.3, "distribution": "ggx""#.into(), 0.260317, 5e-5, 0.0),
        (r#""type": "polarizer""#.into(), 0.201552, 2e-5, 0.0),
    ];
    let mut zs = Vec::new();
    for (bsdf, theirs, error, share) in table {
        let [ours, own] = mean(&ball(&bsdf), 256);
        println!("{bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5} ± {error:.5}");
        let z = (ours - theirs) / own.hypot(error);
        // Subtract the allowed difference.
        let excess = ((ours - theirs).abs() - share * theirs).max(0.0);
        zs.push(z.signum() * excess / own.hypot(error));
        assert!(own < 4e-3 * theirs, "{bsdf}: no power");
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Like [`means_are_those_of_mitsuba`], for brushed copper: the tangents along which other shapes
/// are rough, without and under maps, and with a checkerboard of roughness, whose fields Mitsuba
/// swaps.
#[test]
fn brushed_shapes_are_those_of_mitsuba() {
    let brushed = |u: &str, v: &str| {
        format!(
            r#"{{"type": "roughconductor", "distribution": "ggx", "alpha_u": {u}, "alpha_v": {v},
  "eta": {{"type": "rgb", "value": [0.2, 0.92, 1.1]}}, "k": {{"type": "rgb", "value": [3.9, 2.45, 2.14]}}}}"#
        )
    };
    let normals =
        r#"{"type": "normalmap", "normalmap": {"type": "rgb", "value": [0.7, 0.6, 0.9]}, "b": "#;
    let board = r#"{"type": "checkerboard", "color0": 0.5, "color1": 0.05, "to_uv": [{"scale": [4, 4, 1]}]}"#;
    let tilt = r#"{"rotate": {"axis": [1, 0, 0], "angle": -50}}"#;
    let turn = r#"{"rotate": {"axis": [0, 0, 1], "angle": 30}}"#;
    let square = format!(r#""type": "rectangle", "to_world": [{turn}, {tilt}]"#);
    let disk = format!(r#""type": "disk", "to_world": [{tilt}]"#);
    let cube = r#""type": "cube", "to_world": [{"scale": 0.8}, {"rotate": {"axis": [2, 3, 6], "angle": 40}}]"#;
    let cylinder = r#""type": "cylinder", "p0": [-1.2, 0, 0], "p1": [1.2, 0, 0], "radius": 0.7"#;
    let [along, across] = [brushed("0.05", "0.4"), brushed("0.4", "0.05")];
    let under = |bsdf: &str| format!("{normals}{bsdf}}}");
    let table = [
        (cylinder, along.clone(), 0.332176, 2.4e-4),
        (cylinder, across.clone(), 0.339347, 1.9e-4),
        (&square, along.clone(), 0.444257, 2.2e-4),
        (&square, across.clone(), 0.280617, 3e-5),
        (&disk, along.clone(), 0.335249, 1.2e-4),
        (&disk, across.clone(), 0.330365, 1.5e-4),
        (cube, along.clone(), 0.273687, 5e-5),
        (cube, across.clone(), 0.273362, 5e-5),
        (&square, under(&along), 0.251870, 6e-5),
        (&square, under(&across), 0.235419, 4e-5),
        (r#""type": "sphere""#, under(&along), 0.307799, 1.2e-4),
        (r#""type": "sphere""#, under(&across), 0.312680, 2.2e-4),
        (&square, brushed(board, "0.2"), 0.353660, 1.8e-4),
        (&square, brushed("0.2", board), 0.343922, 1.0e-4),
    ];
    let mut zs = Vec::new();
    for (shape, bsdf, theirs, error) in table {
        let text = ball("").replace(
            r#""type": "sphere", "bsdf": {}"#,
            &format!(r#"{shape}, "bsdf": {bsdf}"#),
        );
        let [ours, own] = mean(&text, 1024);
        println!("{shape}, {bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5} ± {error:.5}");
        assert!(own < 4e-3 * theirs, "{shape}: no power");
        zs.push((ours - theirs) / own.hypot(error));
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Control points of a tapered curve.
const CURVES: &str = "-1.6 -0.9 0 0\n-1.4 -0.6 0 0\n-1.2 -0.4 0.1 0\n-0.5 0.8 0.4 0.3\n0.3 -0.6 -0.2 0.3\n\
                      1.0 0.7 0.2 0.3\n1.6 0.1 0.5 0\n1.8 0 0.5 0\n2.0 0 0.5 0\n";

/// Like [`means_are_those_of_mitsuba`], for curves scaled by 1.2. They may differ by 2e-3, because
/// they are triangles.
#[test]
fn curves_are_those_of_mitsuba() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("curves.txt"), CURVES).unwrap();
    let mut zs = Vec::new();
    for (plugin, theirs, error) in [
        ("bsplinecurve", 0.280360, 2e-5),
        ("linearcurve", 0.263402, 3e-5),
    ] {
        let curve = format!(
            r#""ball": {{"type": "{plugin}", "filename": "curves.txt", "to_world": [{{"scale": 1.2}}], "#
        );
        let text = ball(r#""type": "diffuse""#).replace(r#""ball": {"type": "sphere", "#, &curve);
        let [ours, own] = mean_of(load_in(directory.path(), &text), 256);
        println!("{plugin}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        assert!(own < 4e-3 * theirs, "{plugin}: no power");
        let excess = ((ours - theirs).abs() - 2e-3 * theirs).max(0.0);
        zs.push(excess / own.hypot(error));
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Like [`curves_are_those_of_mitsuba`], for distances from a shape like an ellipsoid on a grid of
/// 16³ nodes, with Mitsuba's `analytic` normals.
#[test]
fn distances_are_those_of_mitsuba() {
    let node = |k: usize| k as f64 / 15.0 - 0.5;
    let distance =
        |x: usize, y: usize, z: usize| node(x).hypot(node(y) / 1.2).hypot(node(z)) - 0.38;
    let row = |z: usize, y: usize| (0..16).map(|x| distance(x, y, z)).collect::<Vec<f64>>();
    let layer = |z: usize| (0..16).map(|y| row(z, y)).collect::<Vec<_>>();
    let grid: Vec<_> = (0..16).map(layer).collect();
    let shape = format!(
        r#""ball": {{"type": "sdfgrid", "grid": {grid:?},
  "to_world": [{{"translate": [-0.5, -0.5, -0.5]}}, {{"scale": 2}}], "#
    );
    let text = ball(r#""type": "diffuse""#).replace(r#""ball": {"type": "sphere", "#, &shape);
    let [ours, own] = mean(&text, 256);
    let [theirs, error] = [0.277604, 3e-5];
    println!("sdfgrid: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
    assert!(own < 4e-3 * theirs);
    let excess = ((ours - theirs).abs() - 3e-3 * theirs).max(0.0);
    testkit::z_test::max_abs_z(&[excess / own.hypot(error)], 1e-3).unwrap();
}

/// Radiances of `sunsky` by Mitsuba 3.9.1 (`scalar_rgb`), from its `eval` in given directions. The
/// sky may differ by 4e-3 (interpolation between pixels, and single precision), and the sun by 1 %
/// (interpolation in a table) and 2e-3 of the brightest one: a table cannot follow a setting sun.
#[test]
fn suns_and_skies_are_those_of_mitsuba() {
    use glam::DVec3;
    const BRIGHTEST: f64 = 2.27e4;
    let clear = r#""sun_direction": [0.5, 0.2, 0.6], "turbidity": 2.5, "albedo": {"type": "rgb", "value": [0.1, 0.5, 0.9]}"#;
    let evening = r#""hour": 18.5, "turbidity": 7.3, "sky_scale": 2, "sun_scale": 0.5, "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}]"#;
    let sydney = r#""latitude": -33.9, "longitude": 151.2, "timezone": 10, "month": 1, "day": 3, "hour": 9, "minute": 20"#;
    let table = [
        (
            r#""turbidity": 3"#,
            [0.051385447, 0.69174796, 0.72030848],
            [21418.736, 17626.246, 13041.786],
        ),
        (
            r#""turbidity": 3"#,
            [0.0, 0.0, 1.0],
            [0.02435108, 0.04230875, 0.08559477],
        ),
        (
            r#""turbidity": 3"#,
            [0.6, 0.0, 0.8],
            [0.02877388, 0.05145225, 0.10133342],
        ),
        (
            r#""turbidity": 3"#,
            [0.0, 1.0, 0.1],
            [0.19849424, 0.26411304, 0.33214977],
        ),
        (r#""turbidity": 3"#, [0.3, 0.8, -0.6], [0.0; 3]),
        (clear, [0.5, 0.2, 0.6], [21729.709, 17961.498, 13382.162]),
        (clear, [0.6, 0.0, 0.8], [0.06713343, 0.10587789, 0.18520704]),
        (clear, [-0.5, 0.5, 0.7], [0.02223407, 0.058429, 0.14554304]),
        (
            evening,
            [-0.40868393, 0.07891099, -0.90925825],
            [1041.1606, 409.49564, 58.534195],
        ),
        (evening, [0.0, -0.02, 1.0], [0.0; 3]),
        (
            evening,
            [0.3, 0.8, -0.6],
            [0.04172193, 0.05027457, 0.05536551],
        ),
        (
            evening,
            [0.5, 0.2, 0.6],
            [0.09672037, 0.10757237, 0.0900749],
        ),
        (
            sydney,
            [-0.0721906, -0.59066433, 0.80368167],
            [21699.984, 18050.637, 13688.485],
        ),
        (
            sydney,
            [0.0, 1.0, 0.1],
            [0.12679866, 0.18885781, 0.26827767],
        ),
    ];
    for (parameters, toward, theirs) in table {
        let sky = format!(r#""sky": {{"type": "sunsky", {parameters}}}"#);
        let loaded = load(&ball_in(r#""type": "diffuse""#, &sky));
        let toward = DVec3::from(toward).normalize();
        let parts = loaded.groups[0].emitters().iter().map(|e| match e {
            Emitter::Environment(part) => part.radiance(toward),
            _ => Spectrum::ZERO,
        });
        let ours = parts.fold(Spectrum::ZERO, |sum, part| sum + part);
        for (c, theirs) in theirs.into_iter().enumerate() {
            let sun = if theirs > 1.0 {
                0.01 * theirs + 2e-3 * BRIGHTEST
            } else {
                0.0
            };
            let error = (ours[c] - theirs).abs();
            assert!(
                error <= 4e-3 * theirs + sun,
                "{parameters}, {toward}: {ours:?}, Mitsuba {theirs}"
            );
        }
    }
}

/// Like [`means_are_those_of_mitsuba`], for a ball under a sky and a sun, which agree with
/// Mitsuba's within 1 %.
#[test]
fn suns_light_as_mitsubas_do() {
    let mut zs = Vec::new();
    for (parameters, theirs, error) in [
        (
            r#""sun_direction": [0.5, 0.9, 0.4], "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}]"#,
            0.072854,
            9.2e-5,
        ),
        (
            r#""sun_direction": [-0.5, 0.3, 0.4], "sun_scale": 0, "turbidity": 6, "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}]"#,
            0.035571,
            2.8e-5,
        ),
    ] {
        let sky = format!(r#""sky": {{"type": "sunsky", {parameters}}}"#);
        let [ours, own] = mean(&ball_in(r#""type": "diffuse""#, &sky), 256);
        println!("{parameters}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        assert!(own < 4e-3 * theirs, "{parameters}: no power");
        let excess = ((ours - theirs).abs() - 0.01 * theirs).max(0.0);
        zs.push(excess / own.hypot(error));
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

#[test]
fn suns_that_cannot_be_are_refused() {
    let sky = |parameters: &str| {
        ball_in(
            r#""type": "diffuse""#,
            &format!(r#""sky": {{"type": "sunsky", {parameters}}}"#),
        )
    };
    for (parameters, expected) in [
        (r#""turbidity": 0.5"#, "turbidity"),
        (r#""albedo": 1.5"#, "albedo"),
        (r#""sun_direction": [0, 0, 1], "hour": 3"#, "not both"),
        (r#""sun_direction": [0, 0, 0]"#, "must not be zero"),
        (r#""sun_aperture": 90"#, "sun_aperture"),
        (r#""year": 99999999999"#, "year"),
    ] {
        let mut diagnostics = Diagnostics::new();
        let description =
            json::parse(&sky(parameters), "scene.json", &[], &mut diagnostics).unwrap();
        let refused = morgana_io::assemble(&description, &LoadOptions::default(), diagnostics);
        let message = refused.err().map(|d| d.to_string()).unwrap_or_default();
        assert!(message.contains(expected), "{parameters}: {message}");
    }
    // At night nothing shines, which is reported.
    let mut diagnostics = Diagnostics::new();
    let night =
        sky(r#""hour": 1"#).replacen(r#""hour": 1}"#, r#""hour": 1}, "p": {"type": "point"}"#, 1);
    let description = json::parse(&night, "scene.json", &[], &mut diagnostics).unwrap();
    let loaded = morgana_io::assemble(&description, &LoadOptions::default(), diagnostics).unwrap();
    assert_eq!(loaded.groups[0].emitters().len(), 1);
    assert!(loaded.warnings.to_string().contains("below the horizon"));
}

/// A pixel of the maps that [`maps_light_as_mitsubas_do`] compares.
fn pixel(i: usize) -> f32 {
    let spread = (i * i * 7919 + 31 * i + 13) % 101;
    (spread * spread) as f32 / 2500.0
}

/// Means over the image of 16 renders of 1024 samples by Mitsuba 3.9.1, `scalar_rgb`, integrator
/// `path`, with their standard errors: a white ball and a mirror in front of coarse maps.
#[test]
fn maps_light_as_mitsubas_do() {
    let table = [
        ([8, 4], "diffuse", 1.849686, 1.8e-4),
        ([8, 4], "conductor", 2.251615, 1.4e-4),
        ([32, 16], "diffuse", 1.177904, 1.7e-4),
        ([32, 16], "conductor", 1.530390, 1.9e-4),
    ];
    let directory = tempfile::tempdir().unwrap();
    let mut zs = Vec::new();
    for ([width, height], bsdf, theirs, error) in table {
        let values: Vec<f32> = (0..width * height).map(pixel).collect();
        let layer = Layer {
            name: String::new(),
            channels: ["B", "G", "R"]
                .map(|c| (c.to_owned(), values.clone()))
                .into(),
        };
        let image = ImageLayers {
            width,
            height,
            layers: vec![layer],
            attributes: Vec::new(),
        };
        exr::write(&directory.path().join("map.exr"), &image).unwrap();
        let sky = r#""sky": {"type": "envmap", "filename": "map.exr"}"#;
        let text = ball_in(&format!(r#""type": "{bsdf}""#), sky);
        let [ours, own] = mean_of(load_in(directory.path(), &text), 256);
        println!("{width} × {height}, {bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
        assert!(own < 4e-3 * theirs, "{bsdf}: no power");
        zs.push((ours - theirs) / own.hypot(error));
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Like [`maps_light_as_mitsubas_do`], by every estimator: a ball in the light of a spot that
/// projects an image or a checkerboard.
#[test]
fn spots_throw_textures_as_mitsubas_do() {
    const SIZE: [usize; 2] = [8, 6];
    let channel = |c: usize| (0..SIZE[0] * SIZE[1]).map(|i| pixel(3 * i + c)).collect();
    let layer = Layer {
        name: String::new(),
        channels: [("B", 2), ("G", 1), ("R", 0)]
            .map(|(name, c)| (name.to_owned(), channel(c)))
            .into(),
    };
    let image = ImageLayers {
        width: SIZE[0],
        height: SIZE[1],
        layers: vec![layer],
        attributes: Vec::new(),
    };
    let directory = tempfile::tempdir().unwrap();
    exr::write(&directory.path().join("slide.exr"), &image).unwrap();
    let bitmap = r#""type": "bitmap", "filename": "slide.exr""#;
    let table = [
        (bitmap.to_owned(), [16, 12], 0.086670, 2.2e-5),
        (
            format!(
                r#"{bitmap}, "filter_type": "nearest", "wrap_mode": "mirror",
  "to_uv": [{{"scale": [1.7, 1.3, 1]}}, {{"rotate": {{"axis": [0, 0, 1], "angle": 30}}}}]"#
            ),
            [20, 5],
            0.089933,
            5.4e-5,
        ),
        (
            r#""type": "checkerboard", "color0": {"type": "rgb", "value": [0.9, 0.1, 0.5]}, "color1": 0,
  "to_uv": [{"scale": [2.5, 3.5, 1]}]"#
                .to_owned(),
            [14, 14],
            0.026602,
            1.8e-5,
        ),
    ];
    let mut zs = Vec::new();
    for (texture, [cutoff, beam], theirs, error) in table {
        let spot = format!(
            r#""spot": {{"type": "spot", "intensity": 30, "cutoff_angle": {cutoff}, "beam_width": {beam},
  "to_world": [{{"lookat": {{"origin": [3, 2, 3], "target": [0.2, 0, 0], "up": [0.3, 1, 0]}}}}],
  "texture": {{{texture}}}}}"#
        );
        for (integrator, samples) in [
            ("path", samples(1024, 256)),
            ("bdpt", samples(1024, 256)),
            ("particle", samples(16384, 4096)),
        ] {
            let integrator =
                format!(r#"{{"type": "scene", "integrator": {{"type": "{integrator}"}}"#);
            let text = ball_in(r#""type": "diffuse""#, &spot);
            let text = text.replacen(r#"{"type": "scene""#, &integrator, 1);
            let [ours, own] = mean_of(load_in(directory.path(), &text), samples);
            println!("{integrator} {texture}: {ours:.6} ± {own:.6}, Mitsuba {theirs:.6}");
            // A quarter of the samples has twice the error.
            let most = 1e-3 * testkit::samples(4, 8) as f64;
            assert!(own < most * theirs, "{integrator}: no power");
            zs.push((ours - theirs) / own.hypot(error));
        }
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Like [`means_are_those_of_mitsuba`] by Mitsuba's `volpath`, here by every estimator: a ball of
/// fog with a smaller ball of chalk inside, behind holes, behind a pane, and behind nothing.
#[test]
fn masks_and_panes_around_fog_are_those_of_mitsuba() {
    const BALL: &str = r#""ball": {"type": "sphere""#;
    // Mitsuba swaps the colours of a checkerboard of numbers.
    let board = r#"{"type": "checkerboard", "color0": 0.1, "color1": 0.9, "to_uv": [{"scale": [4, 4, 1]}]}"#;
    let mask = format!(
        r#""type": "mask", "opacity": {board}, "n": {{"type": "twosided", "n": {{"type": "diffuse", "reflectance": 0.7}}}}"#
    );
    let pane = r#""type": "thindielectric", "specular_transmittance": 0.9, "ext_ior": 1.000277"#;
    let table = [
        (mask.as_str(), 0.268282, 4.7e-5),
        (pane, 0.253190, 1.2e-4),
        (r#""type": "null""#, 0.263200, 4.2e-5),
    ];
    let fog = r#""interior": {"type": "homogeneous", "sigma_t": 2, "albedo": 0.8, "phase": {"type": "hg", "g": 0.4}}"#;
    let chalk = r#""chalk": {"type": "sphere", "radius": 0.4, "bsdf": {"type": "diffuse", "reflectance": 0.6}}"#;
    let mut zs = Vec::new();
    for (bsdf, theirs, error) in table {
        for (integrator, samples) in [
            ("path", samples(512, 128)),
            ("bdpt", samples(512, 128)),
            ("particle", samples(8192, 2048)),
        ] {
            let start =
                format!(r#"{{"type": "scene", "integrator": {{"type": "{integrator}"}}, {chalk}"#);
            let text = ball(bsdf)
                .replacen(r#"{"type": "scene""#, &start, 1)
                .replacen(BALL, &format!("{BALL}, {fog}"), 1);
            let [ours, own] = mean(&text, samples);
            println!("{integrator} {bsdf}: {ours:.5} ± {own:.5}, Mitsuba {theirs:.5}");
            // A quarter of the samples has twice the error.
            let most = 1e-3 * testkit::samples(4, 8) as f64;
            assert!(own < most * theirs, "{integrator}: no power");
            zs.push((ours - theirs) / own.hypot(error));
        }
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

/// Optical depth of a grid of ones in the unit cube around the origin, seen along an axis through a
/// larger shape. Cases: straight, rotated by 45° (where a window of 0.02 sees √2 − 2|x|), and along
/// bent rays. The length of bent rays in the cube differs from straight rays by the square of their
/// slope (1e-4).
#[test]
fn extinctions_end_with_their_grids() {
    let ones = "[[[1, 1], [1, 1]], [[1, 1], [1, 1]]]";
    let scene = |place: &str, index: &str| {
        format!(
            r#"{{"type": "scene", "integrator": {{"type": "aov", "aovs": ["optical_depth"]}},
  "sensor": {{"type": "orthographic",
    "to_world": [{{"scale": [0.01, 0.01, 1]}}, {{"lookat": {{"origin": [0, 0, -5], "target": [0, 0, 0], "up": [0, 1, 0]}}}}],
    "film": {{"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {{"type": "box"}}}}}},
  "box": {{"type": "cube", "bsdf": {{"type": "null"}}, "interior": {{"type": "heterogeneous", "albedo": 0 {index},
    "sigma_t": {{"type": "gridvolume", "data": {ones}, "to_world": [{{"translate": [-0.5, -0.5, -0.5]}} {place}]}}}}}},
  "sky": {{"type": "constant"}}}}"#
        )
    };
    let turned = r#", {"rotate": {"axis": [0, 1, 0], "angle": 45}}"#;
    let bent = r#", "ior": {"type": "linear", "n0": 1, "slope": [0.01, 0, 0]}"#;
    let cases = [
        ("", "", 1.0),
        (turned, "", 2f64.sqrt() - 0.01),
        ("", bent, 1.0),
    ];
    for (place, index, length) in cases {
        let loaded = load(&scene(place, index));
        let channel = loaded
            .channel_names
            .iter()
            .position(|n| n == "optical_depth");
        let options = RenderOptions::new(loaded.renderer, 256, 1);
        let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
        let mean = rendering.film.mean();
        let depths = mean
            .chunks(loaded.channel_names.len())
            .map(|p| f64::from(p[channel.unwrap()]));
        let depth = depths.sum::<f64>() / 4.0;
        assert!(
            (depth - length).abs() < 1e-3,
            "{place}{index}: {depth} for {length}"
        );
    }
}
