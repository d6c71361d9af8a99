//! The standard atmosphere of 1976: refraction of starlight, compared with the refraction integral
//! of this atmosphere, written from its table of temperatures.

use eikonal::ray::{Flow, Node};
use eikonal::{Field, Tolerance, Work};
use glam::DVec3;
use morgana_io::assemble::steps_across;
use morgana_io::{LoadOptions, Loaded};
use serde_json::{Value, json};
use std::fs;

/// Geopotential height in metres and temperature in K; the temperature is linear in between.
const TEMPERATURES: [[f64; 2]; 8] = [
    [0.0, 288.15],
    [11e3, 216.65],
    [20e3, 216.65],
    [32e3, 228.65],
    [47e3, 270.65],
    [51e3, 270.65],
    [71e3, 214.65],
    [84_852.0, 186.946],
];
/// g₀ M₀/R* in K/m.
const FALL: f64 = 0.034_163_19;
const EARTH: f64 = 6_356_766.0;
/// Radius of the planet, top of the standard, and top for rays and the integral, in metres.
const RADIUS: f64 = 6_371_000.0;
const STANDARD: f64 = 86e3;
const TOP: f64 = 160e3;
/// K of Gladstone and Dale in m³/kg.
const K: f64 = 2.2672e-4;

/// Returns the density at a height in metres, and the change of its logarithm per metre.
fn density(height: f64) -> [f64; 2] {
    if height > STANDARD {
        let [density, slope] = density(STANDARD);
        return [density * (slope * (height - STANDARD)).exp(), slope];
    }
    let h = EARTH * height / (EARTH + height);
    let (mut log_pressure, mut found) = (101_325f64.ln(), [0.0; 2]);
    for pair in TEMPERATURES.windows(2) {
        let [[low, cold], [high, warm]] = [pair[0], pair[1]];
        let lapse = (warm - cold) / (high - low);
        let t = cold + lapse * (h.min(high) - low);
        // ∫ dh/T.
        let passed = if lapse == 0.0 {
            (h.min(high) - low) / t
        } else {
            (t / cold).ln() / lapse
        };
        log_pressure -= FALL * passed;
        let stretch = (EARTH / (EARTH + height)).powi(2);
        found = [
            log_pressure.exp() / (287.053 * t),
            -(FALL + lapse) / t * stretch,
        ];
        if h <= high {
            break;
        }
    }
    found
}

fn index(height: f64) -> f64 {
    1.0 + K * density(height)[0]
}

/// Returns the bending of a ray that reaches the ground at a zenith distance, layer by layer. It is
/// an integral over the zenith distance along the ray (L. H. Auer and E. M. Standish, Astron. J.
/// 119, 2000, eq. 3). Bouguer's invariant n r sin ψ gives the height.
fn bending(zenith: f64) -> f64 {
    let invariant = index(0.0) * zenith.sin();
    let at = |psi: f64| {
        let (mut low, mut high) = (0.0, 1.1 * TOP);
        for _ in 0..80 {
            let h = 0.5 * (low + high);
            if index(h) * (1.0 + h / RADIUS) < invariant / psi.sin() {
                low = h;
            } else {
                high = h;
            }
        }
        0.5 * (low + high)
    };
    let integrand = |psi: f64| {
        let h = at(psi);
        let [density, slope] = density(h);
        let log_slope = K * density * slope * (RADIUS + h) / index(h);
        -log_slope / (1.0 + log_slope)
    };
    let geometric = |h: f64| EARTH * h / (EARTH - h);
    let mut heights: Vec<f64> = TEMPERATURES.iter().map(|[h, _]| geometric(*h)).collect();
    *heights.last_mut().unwrap() = STANDARD;
    heights.push(TOP);
    let angle = |h: &f64| (invariant / (index(*h) * (1.0 + h / RADIUS))).asin();
    let angles: Vec<f64> = heights.iter().map(angle).collect();
    angles
        .windows(2)
        .map(|pair| simpson(integrand, [pair[1], pair[0]]))
        .sum()
}

fn simpson(f: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> f64 {
    let pieces = 400;
    let h = (to - from) / f64::from(pieces);
    let weight = |i: i32| match i {
        0 => 1.0,
        i if i == pieces => 1.0,
        i => f64::from(2 + 2 * (i % 2)),
    };
    // Stay inside the layer, where its law holds.
    let place = |i: i32| (from + h * f64::from(i)).clamp(from + 1e-12, to - 1e-12);
    let terms = (0..=pieces).map(|i| weight(i) * f(place(i)));
    terms.sum::<f64>() * h / 3.0
}

fn scene(volume: &Value) -> Value {
    json!({
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 40, "to_world": [{"translate": [0, 0, 6500]}]},
        "sky": {"type": "constant"},
        "air": {
            "type": "sphere", "radius": 6600, "bsdf": {"type": "null"},
            "interior": {"type": "transparent", "ior": volume},
        },
    })
}

fn load(volume: &Value) -> Result<Loaded, String> {
    load_scene(&scene(volume))
}

fn load_scene(scene: &Value) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn field(volume: &Value) -> Field {
    load(volume).unwrap().scene().media()[1].index.clone()
}

/// Returns the bending of a ray in kilometres between the ground and the top.
fn traced(field: &Field, zenith: f64) -> f64 {
    let direction = DVec3::new(zenith.sin(), 0.0, zenith.cos());
    let height = |x: DVec3| 1e3 * x.length() - RADIUS;
    let node = Node::start(field, 1e-3 * RADIUS * DVec3::Z, direction, ());
    let mut flow = Flow::new(field, node, Tolerance::new(1e-12));
    let mut work = Work::default();
    while height(flow.node().x) < TOP {
        flow.advance(5.0, &mut work);
    }
    direction.cross(flow.node().v.normalize()).length().asin()
}

#[test]
fn stars_are_refracted_as_the_integral_says() {
    let volume = json!({"type": "standard_atmosphere", "radius": 6371, "metres_per_unit": 1000, "constant": K});
    let field = field(&volume);
    for altitude in [0.0, 2.0, 10.0, 60.0f64] {
        let zenith = (90.0 - altitude).to_radians();
        let (found, exact) = (traced(&field, zenith), bending(zenith));
        let error = (found / exact - 1.0).abs();
        assert!(error < 1e-6, "{altitude}°: {found} for {exact}, {error:e}");
    }
}

/// Tests heights above a plane in metres, at the wavelength where air has K = 2.2672e-4 m³/kg.
/// Values stay bounded far away.
#[test]
fn heights_are_above_a_plane_or_a_sphere() {
    let flat = field(&json!({"type": "standard_atmosphere", "wavelength": 550}));
    let round = field(&json!({"type": "standard_atmosphere", "wavelength": 550, "radius": 5000}));
    for h in [-3000.0, 0.0, 5e3, 11e3, 40e3, 86e3] {
        let [density, _] = density(h);
        let expected = K * density;
        let found = flat.n(DVec3::new(7.0, -3.0, h)) - 1.0;
        assert!(
            (found / expected - 1.0).abs() < 2e-4,
            "{h}: {found} {expected}"
        );
        let found = round.n(DVec3::new(0.0, 5000.0 + h, 0.0)) - 1.0;
        assert!(
            (found / expected - 1.0).abs() < 2e-4,
            "{h}: {found} {expected}"
        );
    }
    for x in [DVec3::ZERO, DVec3::Z * 2e6, DVec3::Z * -2e6] {
        for field in [&flat, &round] {
            let n = field.n(x);
            assert!((1.0 - 1e-9..1.001).contains(&n), "{x}: {n}");
        }
    }
}

#[test]
fn mistakes() {
    for (volume, expected) in [
        (
            json!({"type": "standard_atmosphere"}),
            "the index of air needs a 'wavelength' in nm",
        ),
        (
            json!({"type": "standard_atmosphere", "wavelength": 100}),
            "wavelength",
        ),
        (
            json!({"type": "standard_atmosphere", "wavelength": 550, "radius": 0}),
            "radius",
        ),
        (
            json!({"type": "standard_atmosphere", "constant": 1e-4, "metres_per_unit": -1}),
            "metres_per_unit",
        ),
        (
            json!({"type": "standard_atmosphere", "constant": 1e-4, "height": 3}),
            "height",
        ),
    ] {
        let message = load(&volume).expect_err(expected);
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
    }
}

/// The index of air follows the film's wavelength, and `aov` requires a single one: two wavelengths
/// give a single message.
#[test]
fn two_wavelengths_of_quantities_are_one_mistake() {
    let mut scene = scene(&json!({"type": "standard_atmosphere"}));
    scene["integrator"] = json!({"type": "aov", "aovs": "deflection"});
    let film = json!({"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": "450, 550"});
    scene["sensor"]["film"] = film;
    let refused = load_scene(&scene).expect_err("two wavelengths");
    assert!(
        refused.contains("follows rays of one wavelength"),
        "{refused}"
    );
    assert_eq!(refused.matches("error").count(), 1, "{refused}");
}

/// Lines through the middle of the planet pass little of its air. Lines that miss the planet take
/// as many steps as rays do.
#[test]
fn steps_are_those_of_rays_that_pass_the_planet_by() {
    let with = |tolerance: f64| {
        let ball = |radius: f64| json!({"type": "sphere", "radius": radius});
        let (mut earth, mut top) = (ball(RADIUS), ball(RADIUS + STANDARD));
        earth["bsdf"] = json!({"type": "diffuse"});
        top["bsdf"] = json!({"type": "null"});
        let air = json!({"type": "standard_atmosphere", "radius": RADIUS, "wavelength": 550});
        top["interior"] = json!({"type": "transparent", "ior": air});
        let text = json!({
            "type": "scene", "earth": earth, "top": top, "sky": {"type": "constant"},
            "integrator": {"type": "path", "tolerance": tolerance},
            "sensor": {"type": "perspective", "to_world": [{"translate": [0, 0, 7e6]}]},
        });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        fs::write(&path, text.to_string()).unwrap();
        morgana_io::load_scene(&path, &LoadOptions::default()).unwrap()
    };
    let loaded = with(1e-6);
    let estimate = steps_across(loaded.scene(), 1);
    // A ray twenty kilometres up, from end to end.
    let field = &loaded.scene().medium(1).index;
    let x = DVec3::new(-1e6, 0.0, RADIUS + 20e3);
    let mut flow = Flow::new(
        field,
        Node::start(field, x, DVec3::X, ()),
        Tolerance::new(1e-6),
    );
    let mut work = Work::default();
    while flow.node().x.x < 1e6 {
        flow.advance(1e6, &mut work);
    }
    let steps = work.steps as f64;
    assert!(
        (0.5 * steps..4.0 * steps).contains(&estimate),
        "{estimate}: {steps}"
    );
    let warned = with(1e-12).warnings.to_string();
    assert!(warned.contains("given up after 20000"), "{warned}");
}
