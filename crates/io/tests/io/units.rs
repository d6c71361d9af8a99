//! Light does not depend on the unit of length. Scaling every length of a scene by a power of two,
//! and extinctions, intensities and powers accordingly, changes no bit of any mantissa. Every
//! plugin with a length or a position occurs in one of these scenes.

mod scenes;

use morgana_io::{Diagnostics, LoadOptions, Loaded, json};
use scenes::{
    FLOOR, INSIDES, SAMPLES, camera, emitters, fields, haze, lit, pinhole, power, shapes, sky,
    spline,
};
use std::ops::ControlFlow;
use transport::derivative::RadiometricParameter;
use transport::meter::{Meter, RecordTable};
use transport::render::{
    self, DerivativeOptions, Handle, MeasureOptions, Measurement, RenderOptions, measure,
};

/// Binary logarithms of units of length for meters. Sums of meters are stored in digits of 32 bits
/// (see `transport::sum`), and keep their bits if scores change by whole digits.
const WHOLE_DIGITS: [i32; 2] = [-32, 32];

/// Binary logarithms of units of length for images, whose radiances are equal in each unit.
fn exponents() -> Vec<i32> {
    if is_long() {
        (-60..=60).filter(|e| *e != 0).collect()
    } else {
        vec![-60, 60]
    }
}

fn is_long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}

/// Replaces each `v@d` by v times the d-th power of the unit of length, 2^`exponent`.
fn scaled(text: &str, exponent: i32) -> String {
    let mut result = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('@') {
        let is_number = |c: char| c.is_ascii_digit() || ".-".contains(c);
        let start = rest[..at].rfind(|c| !is_number(c)).map_or(0, |i| i + 1);
        let after = &rest[at + 1..];
        let end = after.find(|c| !is_number(c)).unwrap_or(after.len());
        let value: f64 = rest[start..at].parse().unwrap();
        let power: i32 = after[..end].parse().unwrap();
        let unit = 2.0f64.powi(exponent * power);
        result += &format!("{}{:e}", &rest[..start], value * unit);
        rest = &after[end..];
    }
    result + rest
}

/// Selects the integrator that the scene names.
const OWN: &str = "";

/// Loads a scene with an integrator, or with its [`OWN`].
fn load(parts: &str, integrator: &str, exponent: i32) -> Loaded {
    let text = format!(r#"{{"type": "scene", {}}}"#, scaled(parts, exponent));
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    let options = LoadOptions {
        integrator: (integrator != OWN).then(|| integrator.to_owned()),
        ..LoadOptions::default()
    };
    morgana_io::assemble(&scene, &options, diagnostics).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Means and variances of all pixels and layers.
fn picture(parts: &str, integrator: &str, exponent: i32) -> Vec<f64> {
    let loaded = load(parts, integrator, exponent);
    let samples = if is_long() { 64 } else { 4 };
    let options = RenderOptions::new(loaded.renderer, samples, 7);
    let film = render::render(&loaded.groups, &options, |_| ControlFlow::Continue(())).film;
    let layers = film
        .layers()
        .map_or(0, |layers| layers.decomposition().layers());
    let layers =
        (0..layers).flat_map(|i| film.layer_mean(i).into_iter().chain(film.layer_variance(i)));
    let all = film.mean().into_iter().chain(film.variance()).chain(layers);
    all.map(f64::from).collect()
}

/// Means and errors of all readings.
fn readings(parts: &str, exponent: i32) -> Vec<f64> {
    let measurement = measured(parts, exponent);
    let all = measurement.readings.iter().flatten();
    all.flat_map(|reading| reading.mean.iter().chain(&reading.error))
        .copied()
        .collect()
}

/// All columns of all records.
fn records(parts: &str, exponent: i32) -> Vec<f64> {
    let measurement = measured(parts, exponent);
    let columns = |table: RecordTable| {
        [
            table.weight,
            table.position,
            table.direction,
            table.optical_length,
            table.side,
            table.path_length,
            table.scatterings,
            table.momentum_transfer,
            table.index_modulation,
            table.displacement_modulation,
            table.optical_length_rate,
        ]
        .concat()
    };
    let tables = measurement.records.into_iter().flatten();
    tables.flat_map(columns).collect()
}

/// Measurement by the meters of a scene.
fn measured(parts: &str, exponent: i32) -> Measurement {
    let loaded = load(parts, "particle", exponent);
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles: if is_long() { 2000 } else { 200 },
        seed: 7,
        max_depth: Some(20),
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap()
}

/// Derivatives of the sum of all pixels with respect to every parameter of the scene, with errors.
fn derivatives(parts: &str, integrator: &str, exponent: i32) -> Vec<f64> {
    let loaded = load(parts, integrator, exponent);
    let scene = loaded.scene();
    let of_media = [
        RadiometricParameter::Extinction,
        RadiometricParameter::Albedo,
        RadiometricParameter::Absorption,
        RadiometricParameter::Scattering,
        RadiometricParameter::MeanCosine,
    ];
    let media = (0..scene.media().len()).flat_map(|id| of_media.map(|by| by(id)));
    let of_emitters = [
        RadiometricParameter::Emission,
        RadiometricParameter::Radiance,
    ];
    let emitters = (0..scene.emitters().len()).flat_map(|id| of_emitters.map(|by| by(id)));
    let all = media
        .chain(emitters)
        .chain([RadiometricParameter::Exposure]);
    let exists =
        |by: &RadiometricParameter| render::check_parameters(&loaded.groups, &[*by], None).is_ok();
    let parameters: Vec<_> = all.filter(exists).collect();
    let film = scene.film();
    let weights = vec![1.0; film.width * film.height * film.channels];
    let options = DerivativeOptions {
        integrator: *loaded.renderer.integrator().unwrap(),
        samples: 8,
        seed: 7,
        decomposition: loaded.layering.decomposition,
        hide_emitters: false,
        parameters: &parameters,
        weights: &weights,
    };
    let found = render::derivatives(&loaded.groups, &options, &Handle::default());
    let by = found.unwrap().unwrap().by;
    by.iter()
        .flat_map(|d| d.values.iter().chain(&d.errors))
        .copied()
        .collect()
}

/// Mantissas with their signs, as numbers from 1 to 2; 0 for 0.
fn mantissas(values: Vec<f64>) -> Vec<f64> {
    let mantissa = |v: f64| v / 2.0f64.powi(v.abs().log2().floor() as i32);
    let value = |v: f64| {
        if v == 0.0 || !v.is_finite() {
            v
        } else {
            mantissa(v)
        }
    };
    values.into_iter().map(value).collect()
}

/// Returns a line for each unit in which numbers differ from the numbers of unit 1, with both. Tests
/// that are not long try one unit, which depends on the name.
fn differences(name: &str, exponents: &[i32], compute: impl Fn(i32) -> Vec<f64>) -> Vec<String> {
    let exponents = if is_long() {
        exponents
    } else {
        &exponents[name.len() % exponents.len()..][..1]
    };
    let expected = compute(0);
    assert!(expected.iter().any(|v| *v != 0.0), "{name} is dark");
    let expected = mantissas(expected);
    let of_unit = |exponent: i32| {
        let found = mantissas(compute(exponent));
        let pairs = expected.iter().zip(&found);
        let different = pairs.clone().filter(|(a, b)| a.to_bits() != b.to_bits());
        let count = different.clone().count();
        let (a, b) = different.into_iter().next()?;
        Some(format!(
            "{name}, unit 2^{exponent}: {count} of {} differ, such as {b} for {a}",
            expected.len()
        ))
    };
    exponents.iter().copied().filter_map(of_unit).collect()
}

#[track_caller]
fn same(all: Vec<String>) {
    assert!(all.is_empty(), "\n{}", all.join("\n"));
}

#[test]
fn fields_in_any_unit() {
    let lights = emitters();
    let lit = |ior: &str, light: &str| format!("{}, {}, {light}", pinhole(), haze(ior));
    let mut all = Vec::new();
    for (name, ior) in fields() {
        for (kind, light) in &lights {
            if ["directional", "constant", "collimated, gaussian"].contains(kind) {
                let parts = lit(&ior, light);
                let name = format!("{name} under {kind}");
                all.extend(differences(&name, &exponents(), |e| {
                    picture(&parts, "path", e)
                }));
            }
        }
    }
    same(all);
}

#[test]
fn emitters_in_any_unit() {
    let (bent, straight) = (spline(), r#"{"type": "constant", "value": 1}"#);
    let mut all = Vec::new();
    for (name, light) in emitters() {
        for (ior, integrator) in [(&*bent, "path"), (straight, "bdpt")] {
            let parts = format!("{}, {}, {light}", pinhole(), haze(ior));
            let name = format!("{name} by {integrator}");
            all.extend(differences(&name, &exponents(), |e| {
                picture(&parts, integrator, e)
            }));
        }
    }
    same(all);
}

/// Tests estimators that merge paths, and the choice among all.
#[test]
fn estimators_in_any_unit() {
    let parts = format!("{}, {}", haze(&spline()), lit());
    let parts = parts.replacen(&format!("{FLOOR}, "), "", 1);
    let mut all = Vec::new();
    for integrator in ["vcm", "photon", "sppm", "preview", "auto"] {
        all.extend(differences(integrator, &exponents(), |e| {
            picture(&parts, integrator, e)
        }));
    }
    same(all);
}

/// Tests cameras, each in front of one scene of haze.
#[test]
fn cameras_in_any_unit() {
    let lights = format!(
        r#"{}, "light": {{"type": "point", "position": [0.2@1, 3@1, -1@1], "intensity": 5@2}}"#,
        sky()
    );
    let place = r#""to_world": [{"scale": 1@1}, {"lookat": {"origin": [0.3@1, 0.4@1, -4@1], "target": [0, 0, 0], "up": [0, 1, 0]}}]"#;
    let film = r#""film": {"type": "hdrfilm", "width": 4, "height": 3}"#;
    let cameras = [
        ("perspective", pinhole()),
        ("thinlens", camera("thinlens", r#""fov": 35, "aperture_radius": 0.2@1, "focus_distance": 4@1, "blades": 5,"#)),
        (
            "diffraction",
            camera("thinlens", r#""fov": 35, "aperture_radius": 0.2@1, "focus_distance": 4@1, "diffraction": true, "metres_per_unit": 0.0001@-1,"#)
                .replacen(r#""width""#, r#""pixel_format": "spectral", "wavelengths": [500, 600], "width""#, 1),
        ),
        ("orthographic", format!(r#""sensor": {{"type": "orthographic", {place}, {film}}}"#)),
        (
            "telecentric",
            format!(
                r#""sensor": {{"type": "telecentric", "acceptance_angle": 2, "focus_distance": 4, "knife_edge": [1, 0, 0], {place}, {film}}}"#
            ),
        ),
        (
            "batch",
            format!(
                r#""sensor": {{"type": "batch", "a": {{"type": "orthographic", {place}}}, "b": {{"type": "perspective", "fov": 30, {place}}}, {film}}}"#
            ),
        ),
        (
            "radiancemeter",
            r#""sensor": {"type": "radiancemeter", "origin": [0.3@1, 0.4@1, -4@1], "direction": [0, -0.1, 1],
              "film": {"type": "hdrfilm", "width": 1, "height": 1}}"#
                .to_owned(),
        ),
    ];
    let mut all = Vec::new();
    for (name, sensor) in cameras {
        let parts = format!("{sensor}, {}, {lights}", haze(&spline()));
        // Cameras of other kinds need the path tracer.
        let all_estimators = ["perspective", "thinlens"].contains(&name);
        for integrator in &["path", "bdpt"][..1 + usize::from(all_estimators)] {
            let name = format!("{name} by {integrator}");
            all.extend(differences(&name, &exponents(), |e| {
                picture(&parts, integrator, e)
            }));
        }
    }
    same(all);
}

#[test]
fn shapes_in_any_unit() {
    let mut all = Vec::new();
    for (name, shape) in shapes() {
        for (kind, inside) in INSIDES {
            let shape = shape.replace("INSIDE", inside);
            let parts = format!(r#"{}, "shape": {{{shape}}}"#, lit());
            let name = format!("{name} of {kind}");
            all.extend(differences(&name, &exponents(), |e| {
                picture(&parts, "path", e)
            }));
            all.extend(differences(&name, &exponents(), |e| {
                picture(&parts, "bdpt", e)
            }));
        }
    }
    for open in ["disk", "rectangle"] {
        let parts = format!(
            r#"{}, "shape": {{"type": "{open}", "to_world": [{{"scale": 0.8@1}}]}}"#,
            lit()
        );
        all.extend(differences(open, &exponents(), |e| {
            picture(&parts, "path", e)
        }));
    }
    same(all);
}

/// Tests instances, labels and shapes in files.
#[test]
fn shapes_of_parts_in_any_unit() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let tetrahedron = file(
        "tetrahedron.obj",
        "v 0.9 0 -0.7\nv -0.9 0 -0.7\nv 0 0.9 0.7\nv 0 -0.9 0.7\nf 1 2 3\nf 2 1 4\nf 1 3 4\nf 2 4 3\n",
    );
    let labels = |surface: &str| {
        format!(
            r#""shape": {{"type": "labels", "surface": "{surface}", "to_world": [{{"translate": [-0.5, -0.5, -0.5]}}, {{"scale": 2@1}}],
              "data": [[[1, 1, 0], [1, 2, 1]], [[1, 2, 1], [0, 1, 1]]],
              "1": {{"type": "homogeneous", "sigma_t": 0.7@-1, "albedo": 0.9, "ior": {{"type": "constant", "value": 1.3}}}},
              "2": {{"type": "homogeneous", "sigma_t": 2@-1, "albedo": 0.5, "ior": {{"type": "constant", "value": 1.4}}}}}}"#
        )
    };
    let scale = r#""to_world": [{"scale": 1@1}]"#;
    let cases = [
        (
            "obj",
            format!(
                r#""shape": {{"type": "obj", "filename": "{tetrahedron}", {scale}, {}}}"#,
                INSIDES[0].1
            ),
        ),
        ("labels, voxels", labels("voxels")),
        ("labels, smooth", labels("smooth")),
        (
            "instance",
            r#""group": {"type": "shapegroup", "id": "group", "a": {"type": "sphere", "radius": 0.4@1}, "b": {"type": "cube", "to_world": [{"scale": 0.3@1}, {"translate": [0.5@1, 0, 0]}]}},
                "one": {"type": "instance", "g": {"type": "ref", "id": "group"}},
                "other": {"type": "instance", "to_world": [{"translate": [0, 0.9@1, 0]}], "g": {"type": "ref", "id": "group"}}"#.to_string(),
        ),
    ];
    let mut all = Vec::new();
    for (name, shape) in cases {
        let parts = format!("{}, {shape}", lit());
        all.extend(differences(name, &exponents(), |e| {
            picture(&parts, "path", e)
        }));
    }
    // Transforms do not change the radii of curves, so each unit has its own file.
    for name in ["linearcurve", "bsplinecurve"] {
        let curve = |exponent: i32| {
            let text = "-0.9@1 -0.5@1 0 0.3@1\n-0.2@1 0.6@1 0.1@1 0.2@1\n0.3@1 -0.6@1 0 0.2@1\n0.9@1 0.5@1 0.1@1 0.3@1\n";
            let strand = file(&format!("strand{exponent}.txt"), &scaled(text, exponent));
            let parts = format!(
                r#"{}, "shape": {{"type": "{name}", "filename": "{strand}"}}"#,
                lit()
            );
            picture(&parts, "path", exponent)
        };
        all.extend(differences(name, &exponents(), curve));
    }
    same(all);
}

/// Tests varying extinctions, albedos and emission.
#[test]
fn media_in_any_unit() {
    let placed = r#""to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2@1}]"#;
    let media = [
        (
            "samples",
            format!(
                r#""type": "heterogeneous", "scale": 0.5@-1, "albedo": 0.8, "sigma_t": {{"type": "gridvolume", "data": {SAMPLES}, {placed}}}"#
            ),
        ),
        ("emission", r#""type": "homogeneous", "sigma_t": 0.7@-1, "albedo": 0.3, "emission": 2"#.to_owned()),
        ("colours", r#""type": "homogeneous", "sigma_t": {"type": "rgb", "value": [0.7@-1, 0.3@-1, 0.1@-1]}, "albedo": 0.8, "phase": {"type": "hg", "g": 0.5}"#.to_owned()),
    ];
    let mut all = Vec::new();
    for (name, medium) in media {
        for ior in [
            "",
            r#", "ior": {"type": "gaussian", "n0": 1, "delta": 0.2, "width": 0.4@1}"#,
        ] {
            let parts = format!(
                r#"{}, "haze": {{"type": "cube", "to_world": [{{"scale": 1@1}}], "bsdf": {{"type": "null"}}, "interior": {{{medium}{ior}}}}}"#,
                lit()
            );
            for integrator in ["path", "bdpt", "particle"] {
                let name = format!("{name}{ior} by {integrator}");
                all.extend(differences(&name, &exponents(), |e| {
                    picture(&parts, integrator, e)
                }));
            }
        }
    }
    same(all);
}

/// Tests polarised and tagged images, second moments, and quantities of sensor rays.
#[test]
fn quantities_in_any_unit() {
    let sound = r#"{"type": "acoustic", "n0": 1.33, "amplitude": 1e-5, "wave_number": 9@-1, "elasto_optic": 0.32}"#;
    let path = r#""i": {"type": "path"}"#;
    let quantities = [
        ("stokes", path, ""),
        ("moment", path, ""),
        (
            "tagged",
            path,
            r#""wavelength": 0.0001@1, "orders": 2, "delays": 1,"#,
        ),
        (
            "aov",
            path,
            r#""aovs": "d:depth,p:position,n:sh_normal,o:optical_length,a:deflection,u:uv","#,
        ),
    ];
    let mut all = Vec::new();
    for (name, inner, more) in quantities {
        for ior in [sound.to_owned(), spline()] {
            if name == "tagged" && ior != sound {
                continue;
            }
            let parts = format!(
                r#"{}, {}, "integrator": {{"type": "{name}", {more} {inner}}}"#,
                lit().replacen(&format!("{FLOOR}, "), "", 1),
                haze(&ior)
            );
            all.extend(differences(name, &exponents(), |e| picture(&parts, OWN, e)));
        }
    }
    same(all);
}

/// Tests lights that are read from files.
#[test]
fn emitters_in_files_in_any_unit() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path.display().to_string()
    };
    let table =
        "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 0\n0 45 90\n0\n900 500 20\n";
    let table = file("photometry.ies", table.as_bytes());
    let mut sky = b"PF\n4 2\n-1\n".to_vec();
    sky.extend((0..24u16).flat_map(|i| f32::from(i * i % 7).to_le_bytes()));
    let sky = file("sky.pfm", &sky);
    let above = r#""to_world": [{"lookat": {"origin": [0.2@1, 3@1, -1@1], "target": [0, 0, 0], "up": [0, 0, 1]}}]"#;
    let lights = [
        (
            "ies",
            format!(r#""light": {{"type": "ies", "filename": "{table}", "scale": 1@2, {above}}}"#),
        ),
        (
            "envmap",
            format!(r#""light": {{"type": "envmap", "filename": "{sky}"}}"#),
        ),
        (
            "collimated, texture",
            power(
                r#""profile": "rectangle", "width": 0.3@1, "height": 0.5@1, "texture": {"type": "bitmap", "raw": true, "data": [[[0.5], [1]], [[0.2], [0.7]]]},"#,
                "collimated",
            ),
        ),
    ];
    let mut all = Vec::new();
    for (name, light) in lights {
        let parts = format!("{}, {}, {light}", pinhole(), haze(&spline()));
        for integrator in ["path", "particle"] {
            let name = format!("{name} by {integrator}");
            all.extend(differences(&name, &exponents(), |e| {
                picture(&parts, integrator, e)
            }));
        }
    }
    same(all);
}

#[test]
fn meters_in_any_unit() {
    let beam = power(r#""profile": "gaussian", "radius": 0.3@1,"#, "collimated");
    let place = r#""to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2@1}]"#;
    let gates = r#""min_bound": 2@1, "max_bound": 8@1, "bin_width": 1@1, "weight_windows": true"#;
    let meters = [
        ("cells", format!(r#""type": "fluencemeter", "nx": 2, "ny": 3, "nz": 2, {place}"#)),
        ("collisions", format!(r#""type": "fluencemeter", "estimator": "collision", "nx": 2, "ny": 3, "nz": 2, {place}"#)),
        ("gates", format!(r#""type": "fluencemeter", "nx": 2, "ny": 3, "nz": 2, {gates}, {place}"#)),
        ("rings", r#""type": "fluencemeter", "coordinates": "cylindrical", "nr": 3, "nz": 2, "to_world": [{"scale": 1@1}]"#.to_owned()),
        ("shells", r#""type": "fluencemeter", "coordinates": "spherical", "nr": 3, "to_world": [{"scale": 1@1}]"#.to_owned()),
        (
            "pressure",
            format!(r#""type": "fluencemeter", "nx": 2, "ny": 2, "nz": 2, "gruneisen": 0.2, "metres_per_unit": 0.01@-1, {place}"#),
        ),
    ];
    let walls = [
        ("wall", format!(r#""type": "irradiancemeter", "nu": 2, "nv": 3, "cosine_bins": 2, {gates}"#)),
        ("fibre", r#""type": "irradiancemeter", "center": [0, 1@1, 0], "radius": 0.8@1, "numerical_aperture": 0.9"#.to_owned()),
    ];
    let box_of = |more: &str| {
        let surface = haze(&spline());
        let (surface, _) = surface.rsplit_once('}').unwrap();
        format!("{surface}{more}}}, {beam}")
    };
    let mut all = Vec::new();
    for (name, meter) in meters {
        let parts = format!(r#"{}, "meter": {{{meter}}}"#, box_of(""));
        all.extend(differences(name, &WHOLE_DIGITS, |e| readings(&parts, e)));
    }
    for (name, meter) in walls {
        let parts = box_of(&format!(r#", "meter": {{{meter}}}"#));
        all.extend(differences(name, &WHOLE_DIGITS, |e| readings(&parts, e)));
    }
    same(all);
}

/// Tests records of light that meters accept, with the phase modulation by sound.
#[test]
fn records_in_any_unit() {
    let sound = r#"{"type": "acoustic", "n0": 1.33, "amplitude": 1e-5, "wave_number": 9@-1, "elasto_optic": 0.32}"#;
    let beam = power(r#""profile": "gaussian", "radius": 0.3@1,"#, "collimated");
    let keep = r#""records": true, "max_records": 100"#;
    let meters = [
        (
            "plain",
            spline(),
            format!(r#""type": "irradiancemeter", {keep}"#),
        ),
        (
            "tagged",
            sound.to_owned(),
            format!(r#""type": "irradiancemeter", {keep}, "tagged": true, "wavelength": 0.0001@1"#),
        ),
    ];
    let mut all = Vec::new();
    for (name, ior, meter) in meters {
        let surface = haze(&ior);
        let (surface, _) = surface.rsplit_once('}').unwrap();
        let parts = format!(r#"{surface}, "meter": {{{meter}}}}}, {beam}"#);
        all.extend(differences(name, &WHOLE_DIGITS, |e| records(&parts, e)));
    }
    same(all);
}

/// Tests derivatives by each kind of parameter of media and emitters.
#[test]
fn derivatives_in_any_unit() {
    let parts = format!(
        "{}, {}",
        lit().replacen(&format!("{FLOOR}, "), "", 1),
        haze(&spline())
    );
    let mut all = Vec::new();
    for integrator in ["path", "bdpt", "particle"] {
        all.extend(differences(integrator, &exponents(), |e| {
            derivatives(&parts, integrator, e)
        }));
    }
    same(all);
}

/// In a scene without any extent, light depends on its position only by rounding.
#[test]
fn scenes_without_extent() {
    let parts = r#""sensor": {"type": "perspective", "fov": 35, "film": {"type": "hdrfilm", "width": 4, "height": 3}},
        "sky": {"type": "constant", "radiance": 0.3}"#;
    same(differences("a sky alone", &exponents(), |e| {
        picture(parts, "path", e)
    }));
}
