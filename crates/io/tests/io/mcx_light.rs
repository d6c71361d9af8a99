//! Sources of MCX with a focus, with distributions of angles, and with other apertures than beams.
//!
//! MCX's documentation gives the starts and directions. Rays that converge are compared exactly, to
//! the width of the cones that stand for them; random quantities by their moments in closed form. All
//! comparisons of moments have a false-alarm rate of 1e-3 together. Seeds are fixed.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded, Run};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use testkit::z_test::max_abs_z;
use testkit::{Moments, Rng};

const FAMILY: f64 = 1e-3;
const UNIT: f64 = 0.5;
const COUNT: usize = 20_000;
/// Largest distance of a ray from its focus, in voxels, for rays of up to 20 voxels in cones of 1e-4
/// degrees, and for lines of 1e-6 voxels.
const SPOT: f64 = 1e-4;

fn load(source: &Value) -> Result<Loaded, String> {
    let input = json!({
        "Session": {"Photons": 200},
        "Optode": {"Source": source},
        "Domain": {
            "OriginType": 1, "LengthUnit": UNIT, "Dim": [10, 8, 12],
            "Media": [{"mua": 0, "mus": 0, "g": 1, "n": 1}, {"mua": 1, "mus": 1, "g": 0, "n": 1}]
        },
        "Shapes": [{"Grid": {"Tag": 1, "Size": [10, 8, 12]}}],
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input.json");
    fs::write(&path, input.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// Position in voxels and direction of a photon of the only source.
fn rays(source: &Value) -> Vec<[DVec3; 2]> {
    let loaded = load(source).unwrap_or_else(|e| panic!("{source}: {e}"));
    let scene = loaded.scene();
    let [emitter] = scene.emitters() else {
        panic!("{source}");
    };
    let mut rng = Rng::new(5);
    let mut ray = || {
        let shape = |i: usize| &scene.objects()[i].shape;
        let emission = emitter.emit(scene.around(), shape, rng.uniform()).unwrap();
        [emission.x / UNIT, emission.direction]
    };
    (0..COUNT).map(|_| ray()).collect()
}

/// Statistics of a quantity of rays, as z scores.
#[derive(Default)]
struct Scores {
    names: Vec<String>,
    list: Vec<f64>,
}

impl Scores {
    fn add(
        &mut self,
        name: &str,
        rays: &[[DVec3; 2]],
        expected: f64,
        of: impl Fn(&[DVec3; 2]) -> f64,
    ) {
        let mut moments = Moments::default();
        rays.iter().for_each(|ray| moments.push(of(ray)));
        self.names.push(name.to_owned());
        self.list.push(moments.z(expected));
    }

    fn check(&self) {
        let joined = self.names.join(", ");
        max_abs_z(&self.list, FAMILY)
            .unwrap_or_else(|e| panic!("{e} of {joined}: {:?}", self.list));
    }
}

fn at(v: [f64; 3]) -> DVec3 {
    DVec3::from(v)
}

/// Sources that MCX focuses, at a place before the volume, and the centres of their light.
fn focused() -> Vec<(Value, DVec3)> {
    let oblique = [0.3, -0.2, 0.9];
    let source = |kind: &str, dir: [f64; 3], first: [f64; 4], second: [f64; 4]| json!({"Type": kind, "Pos": [4, 3, -2], "Dir": dir, "Param1": first, "Param2": second});
    let z = [0.0, 0.0, 1.0];
    let mut pattern = source(
        "pattern",
        oblique,
        [2.0, 0.0, 0.0, 2.0],
        [1.0, 2.0, 0.5, 1.0],
    );
    pattern["Pattern"] = json!({"Nx": 2, "Ny": 1, "Data": [1, 3]});
    vec![
        (
            source("disk", z, [2.0, 0.0, 0.0, 0.0], [0.0; 4]),
            at([4.0, 3.0, -2.0]),
        ),
        (
            source("disk", oblique, [2.0, 1.0, 0.0, 0.0], [0.0; 4]),
            at([4.0, 3.0, -2.0]),
        ),
        (
            source("ring", z, [2.0, 1.0, 0.0, 0.0], [0.0; 4]),
            at([4.0, 3.0, -2.0]),
        ),
        (
            source("gaussian", z, [1.0, 0.0, 0.0, 0.0], [0.0; 4]),
            at([4.0, 3.0, -2.0]),
        ),
        (
            source("planar", z, [2.0, 0.0, 0.0, 0.0], [0.0, 3.0, 0.0, 0.0]),
            at([5.0, 4.5, -2.0]),
        ),
        (
            source(
                "planar",
                oblique,
                [-2.0, 1.0, 0.0, 0.0],
                [1.0, 1.0, 1.0, 0.0],
            ),
            at([3.5, 4.0, -1.5]),
        ),
        (pattern, at([5.5, 4.0, -1.75])),
        (
            source("fourier", z, [2.0, 0.0, 0.0, 1.0], [0.0, 3.0, 0.0, 2.0]),
            at([5.0, 4.5, -2.0]),
        ),
        (
            source("slit", z, [3.0, 0.0, 0.0, 0.0], [0.0; 4]),
            at([5.5, 3.0, -2.0]),
        ),
        (
            source("slit", oblique, [3.0, 0.0, 1.0, 0.0], [0.0; 4]),
            at([5.5, 3.0, -1.5]),
        ),
    ]
}

fn with_focus(source: &Value, focus: &Value) -> Value {
    let mut source = source.clone();
    source["Dir"].as_array_mut().unwrap().push(focus.clone());
    source
}

/// All light goes to the point at the focal length along the direction from the centre; with a
/// negative length, it comes from the point behind. With 0 or an infinite length it is parallel.
#[test]
fn rays_meet_in_the_focus() {
    for (source, center) in focused() {
        let dir: Vec<f64> = source["Dir"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect();
        let along = DVec3::from_slice(&dir).normalize();
        for length in [5.0, -7.0] {
            let focus = center + length * along;
            for [x, direction] in rays(&with_focus(&source, &json!(length))) {
                let offset = focus - x;
                assert!(
                    offset.cross(direction).length() < SPOT,
                    "{source}: {x} {direction}"
                );
                assert!(offset.dot(direction) * length > 0.0, "{source}");
            }
        }
        for length in [json!(0), json!("_Inf_")] {
            for [_, direction] in rays(&with_focus(&source, &length)) {
                assert!((direction - along).length() < SPOT, "{source}: {direction}");
            }
        }
    }
}

/// Without a number as focal length, light is isotropic; with −∞ it is Lambertian.
#[test]
fn focal_lengths_without_a_focus() {
    let mut scores = Scores::default();
    for (source, _) in focused() {
        let dir: Vec<f64> = source["Dir"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect();
        let along = DVec3::from_slice(&dir).normalize();
        let cosine = |ray: &[DVec3; 2]| ray[1].dot(along);
        let isotropic = rays(&with_focus(&source, &json!("_NaN_")));
        scores.add("isotropic", &isotropic, 0.0, cosine);
        scores.add("isotropic, square", &isotropic, 1.0 / 3.0, |r| {
            cosine(r).powi(2)
        });
        let lambertian = rays(&with_focus(&source, &json!("-_Inf_")));
        scores.add("Lambertian", &lambertian, 2.0 / 3.0, cosine);
        scores.add("Lambertian, square", &lambertian, 0.5, |r| {
            cosine(r).powi(2)
        });
        let side = along.any_orthonormal_vector();
        scores.add("turn", &lambertian, 0.0, |r| r[1].dot(side));
    }
    scores.check();
}

/// Starts are uniform on rings, in parallelograms, on lines; Gaussian beams have their waist at the
/// focus.
#[test]
fn starts() {
    let mut scores = Scores::default();
    let oblique = [0.3, -0.2, 0.9];
    let along = DVec3::from(oblique).normalize();
    let ring = json!({"Type": "ring", "Pos": [4, 3, 5], "Dir": oblique, "Param1": [3, 2, 0, 0]});
    let ring = rays(&ring);
    let center = at([4.0, 3.0, 5.0]);
    let square = |ray: &[DVec3; 2]| (ray[0] - center).length_squared();
    assert!(
        ring.iter()
            .all(|r| (4.0 - 1e-3..9.0 + 1e-3).contains(&square(r)))
    );
    assert!(ring.iter().all(|r| (r[0] - center).dot(along).abs() < 1e-3));
    scores.add("ring", &ring, 6.5, square);
    // A pattern on a parallelogram across light that is oblique to it: the second column has three
    // times the light.
    let [u, v] = [at([2.0, 0.0, 0.0]), at([1.0, 2.0, 0.5])];
    let corner = at([4.0, 3.0, -2.0]);
    let pattern = json!({
        "Type": "pattern", "Pos": [4, 3, -2], "Dir": oblique,
        "Param1": [2, 0, 0, 2], "Param2": [1, 2, 0.5, 1], "Pattern": {"Nx": 2, "Ny": 1, "Data": [1, 3]},
    });
    let pattern = rays(&pattern);
    let normal = u.cross(v);
    let coordinates = |ray: &[DVec3; 2]| {
        let p = ray[0] - corner;
        assert!(p.dot(normal).abs() < 1e-9);
        [p.cross(v).dot(normal), u.cross(p).dot(normal)].map(|c| c / normal.length_squared())
    };
    assert!(pattern.iter().all(|r| {
        coordinates(r)
            .iter()
            .all(|c| (-1e-9..1.0 + 1e-9).contains(c))
    }));
    scores.add("column", &pattern, 0.75, |r| {
        f64::from(u8::from(coordinates(r)[0] > 0.5))
    });
    scores.add("row", &pattern, 0.5, |r| coordinates(r)[1]);
    scores.add("row, square", &pattern, 1.0 / 3.0, |r| {
        coordinates(r)[1].powi(2)
    });
    scores.add("both", &pattern, 0.25 * 0.125 + 0.75 * 0.375, |r| {
        let [a, b] = coordinates(r);
        a * b
    });
    // The radius of MCX is the 1/e² radius at the focus. Its mean square is half its square.
    let gaussian = json!({"Type": "gaussian", "Pos": [4, 3, -2], "Dir": [0, 0, 1, 6], "Param1": [0.5, 0.4, 0, 0]});
    let range = PI * 0.25 / 0.4;
    let radius_square = 0.25 * (1.0 + (6.0 / range) * (6.0 / range));
    scores.add("waist", &rays(&gaussian), 0.5 * radius_square, |r| {
        (r[0] - corner).length_squared()
    });
    let line = json!({"Type": "line", "Pos": [4, 3, 2], "Dir": [0, 0, 1], "Param1": [3, 0, 0, 0]});
    let line = rays(&line);
    let part = |ray: &[DVec3; 2]| (ray[0].x - 4.0) / 3.0;
    scores.add("line", &line, 0.5, part);
    scores.add("line, square", &line, 1.0 / 3.0, |r| part(r).powi(2));
    scores.check();
}

/// Angles from the direction, or around a line, have the distributions that MCX draws.
#[test]
fn angles() {
    let mut scores = Scores::default();
    let oblique = [0.3, -0.2, 0.9];
    let along = DVec3::from(oblique).normalize();
    let angle = |ray: &[DVec3; 2]| ray[1].cross(along).length().atan2(ray[1].dot(along));
    let source = |kind: &str, first: [f64; 4]| json!({"Type": kind, "Pos": [4, 3, 5], "Dir": oblique, "Param1": first});
    let arcsine = rays(&source("arcsine", [0.0; 4]));
    scores.add("arcsine", &arcsine, FRAC_PI_2, angle);
    scores.add("arcsine, square", &arcsine, PI * PI / 3.0, |r| {
        angle(r).powi(2)
    });
    let side = along.any_orthonormal_vector();
    scores.add("turn", &arcsine, 0.0, |r| r[1].dot(side));
    let cone = rays(&source("cone", [0.6, 1.0, 0.0, 0.0]));
    scores.add("cone", &cone, 0.3, angle);
    assert!(cone.iter().all(|r| angle(r) < 0.6 + 1e-12));
    // The angle is Param1 times a Rayleigh number times a uniform number in [−1, 1].
    for width in [0.02, 0.3] {
        let gaussian = rays(&source("zgaussian", [width, 0.0, 0.0, 0.0]));
        scores.add(
            "zgaussian",
            &gaussian,
            width * FRAC_PI_2.sqrt() / 2.0,
            angle,
        );
        let square = 2.0 / 3.0 * width * width;
        scores.add("zgaussian, square", &gaussian, square, |r| angle(r).powi(2));
    }
    // Wide angles beyond π are directions on the other side.
    let wide = rays(&source("zgaussian", [2.0, 0.0, 0.0, 0.0]));
    let mut rng = Rng::new(23);
    let mut cosine = Moments::default();
    for _ in 0..200_000 {
        let [a, b] = rng.uniform();
        let rayleigh = (-2.0 * (1.0 - a).ln()).sqrt();
        cosine.push((2.0 * rayleigh * b).cos());
    }
    let mut found = Moments::default();
    wide.iter().for_each(|r| found.push(r[1].dot(along)));
    scores.names.push("folded".into());
    let error = found.standard_error().hypot(cosine.standard_error());
    scores.list.push((found.mean() - cosine.mean()) / error);
    // Quantiles of θ/π.
    let mut quantiles = source("disk", [1.0, 0.0, 0.0, 0.0]);
    quantiles["AngleInverseCDF"] = json!([0.0, 0.1, 0.4]);
    let quantiles = rays(&quantiles);
    scores.add("quantiles", &quantiles, 0.15 * PI, angle);
    let below = |r: &[DVec3; 2]| f64::from(u8::from(angle(r) < 0.1 * PI));
    scores.add("below the median", &quantiles, 0.5, below);
    // Light of a line is perpendicular to it, all around or within a wedge.
    let line = [0.0, 2.0, 0.0];
    let mut source = json!({"Type": "line", "Pos": [4, 3, 2], "Dir": oblique, "Param1": line});
    let across = (along - DVec3::Y * along.y).normalize();
    let turn = |ray: &[DVec3; 2]| {
        assert!(ray[1].y.abs() < 2e-6);
        ray[1].dot(across.cross(DVec3::Y)).atan2(ray[1].dot(across))
    };
    let around = rays(&source);
    scores.add("line", &around, 0.0, turn);
    scores.add("line, square", &around, PI * PI / 3.0, |r| turn(r).powi(2));
    source["Param2"] = json!([0.4, 0, 0, 0]);
    let wedge = rays(&source);
    assert!(wedge.iter().all(|r| turn(r).abs() < 0.4 + 1e-6));
    scores.add("wedge", &wedge, 0.16 / 3.0, |r| turn(r).powi(2));
    // A broadened slit has normal slopes, along the line and across it.
    let slit = json!({
        "Type": "slit", "Pos": [4, 3, 2], "Dir": [0, 0, 1], "Param1": [3, 0, 0, 0], "Param2": [0.2, 0.5, 0, 0],
    });
    let slit = rays(&slit);
    scores.add("across", &slit, 0.04, |r| (r[1].y / r[1].z).powi(2));
    scores.add("along", &slit, 0.25, |r| (r[1].x / r[1].z).powi(2));
    scores.check();
}

/// All sources emit one joule.
#[test]
fn power() {
    for (source, _) in focused() {
        for focus in [json!(0), json!(-4), json!("_NaN_"), json!("-_Inf_")] {
            let source = with_focus(&source, &focus);
            let emitted = Run::new(&load(&source).unwrap()).measure().unwrap().emitted[0];
            assert!((emitted - 1.0).abs() < 1e-9, "{source}: {emitted}");
        }
    }
}

#[test]
fn mistakes() {
    let refused = |change: Value, expected: &str| {
        let mut source =
            json!({"Type": "disk", "Pos": [4, 3, 2], "Dir": [0, 0, 1], "Param1": [2, 0, 0, 0]});
        for (key, value) in change.as_object().unwrap() {
            source[key] = value.clone();
        }
        let message = load(&source).expect_err(expected);
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
        assert!(message.contains("input.json:1:"), "{message}");
    };
    refused(json!({"Dir": [0, 0, 1, "x"]}), "the focal length");
    refused(
        json!({"Dir": ["_NaN_", 0, 1]}),
        "must be a list of three numbers",
    );
    refused(
        json!({"Param1": [2, 2, 0, 0]}),
        "below the first, 2, but it is 2",
    );
    refused(
        json!({"Type": "ring", "Param1": [2, 1, 0, 1]}),
        "sectors of a ring",
    );
    refused(
        json!({"Type": "zgaussian", "Param1": [0, 0, 0, 0]}),
        "but it is 0",
    );
    refused(
        json!({"Type": "zgaussian", "Param1": [99, 0, 0, 0]}),
        "but it is 99",
    );
    refused(
        json!({"Type": "cone", "Param1": [4, 1, 0, 0]}),
        "half angle",
    );
    refused(
        json!({"Type": "line", "Param1": [0, 0, 0, 0]}),
        "one end of the line",
    );
    refused(
        json!({"Type": "line", "Param2": [9, 0, 0, 0]}),
        "half angle of its wedge",
    );
    refused(
        json!({"Type": "line", "Param1": [0, 0, 2, 0], "Param2": [1, 0, 0, 0]}),
        "not be parallel to Dir",
    );
    refused(
        json!({"Type": "slit", "Param1": [0, 0, 0, 0]}),
        "one end of the line",
    );
    refused(
        json!({"Type": "slit", "Param2": [1, 0, 0, 0], "Dir": [0, 0, 1, 5]}),
        "set Param2 to 0",
    );
    refused(
        json!({"Type": "slit", "Param1": [2, 0, 2, 0], "Param2": [1, 0, 0, 0]}),
        "must be perpendicular to Dir",
    );
    refused(
        json!({"Type": "planar", "Param2": [4, 0, 0, 0]}),
        "nor parallel",
    );
    refused(
        json!({"Type": "gaussian", "Param1": [1, -1, 0, 0]}),
        "wavelength",
    );
    refused(
        json!({"Type": "pencilarray", "Dir": [0, 0, 1, 5]}),
        "has no focus",
    );
    refused(json!({"AngleInverseCDF": [0.5]}), "at least two numbers");
    refused(json!({"AngleInverseCDF": [0, 0.5, 0.5]}), "number 3 is 0.5");
    refused(json!({"AngleInverseCDF": [0, 1.5]}), "number 2 is 1.5");
    refused(
        json!({"AngleInverseCDF": [0, 0.5], "Dir": [0, 0, 1, 1]}),
        "the fourth number of Dir must be 0",
    );
    refused(json!({"Type": "hyperboloid"}), "source 'hyperboloid'");
}
