//! Derivatives with respect to the index of an absorbing ball, in single pixels
//! (docs/theory.md#derivatives-by-the-index-behind-scattering). The reference is a difference of
//! the whole tree of rays that reflection and refraction make of one; it has no noise.
//!
//! The cases are `null` and refracting boundaries × two rays × a coloured extinction, or an
//! extinction of voxels of which some are empty × three parameters and the light itself; further
//! cases have two layers by bounces. There are 40 comparisons: with other seeds, correct code would
//! fail with a probability below 2.6e-3. Derivatives are accurate to a few per cent of the largest
//! one.

use crate::differences::{self, Comparisons};
use eikonal::Field;
use eikonal::field::Gaussian;
use glam::{DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric, fresnel};
use morgana_transport::emitter::{Emitter, Environment};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Medium;
use morgana_transport::render::{Handle, IndexDerivativeOptions, index_derivatives};
use morgana_transport::scene::Object;
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Sphere;
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Orientation, Scene, Spectrum};

const SAMPLES: u64 = 1 << 15;
const WEIGHTS: [f64; 2] = [1.0, -0.4];
/// Parameters of the bump: n₀, Δn, width.
const BUMP: [f64; 3] = [1.3, 0.25, 0.45];
const CENTER: DVec3 = DVec3::new(0.15, -0.1, 0.05);
/// Layers of light: none, one and two bounces, and more.
const LAYERS: usize = 4;
/// Step in σ of the tree's rays.
const STEP: f64 = 1e-3;
/// Smallest contribution of a ray of the tree; fainter rays are left out.
const MIN_CONTRIBUTION: f64 = 1e-7;

#[derive(Clone, Copy, Debug)]
struct Setup {
    bump: [f64; 3],
    dielectric: bool,
    graded: bool,
    /// The layer by bounces that counts; `None` for all.
    layer: Option<usize>,
    eye: DVec3,
    target: DVec3,
}

/// Samples around the ball, about a quarter of them empty.
fn voxels() -> VolumeTexture {
    differences::voxels(|i| (3.0 * (i * 53 % 31) as f64 / 30.0 - 0.8).max(0.0) as f32)
}

fn sky() -> Environment {
    let pixel = |i: usize| {
        let (u, t) = ((i % 8) as f64, (i / 8) as f64);
        let a = 1.0 + 0.6 * (0.8 * u).sin() * (0.7 * t).sin();
        Spectrum([a, 1.0 + 0.3 * (1.6 * u + t).cos(), 0.0, 0.0])
    };
    let turned = Orientation::nearest(DMat3::from_rotation_x(0.7)).unwrap().0;
    Environment::image(8, 5, (0..40).map(pixel).collect(), turned).unwrap()
}

impl Setup {
    fn field(&self) -> Field {
        let [n0, delta, width] = self.bump;
        Gaussian::new(n0, delta, CENTER, width).unwrap().into()
    }

    fn smoke(&self) -> Medium {
        let even = Spectrum([0.9, 0.3, 0.0, 0.0]);
        let smoke = Medium::homogeneous("smoke", self.field(), even, 0.0);
        if self.graded {
            let sigma_t = voxels();
            Medium { sigma_t, ..smoke }
        } else {
            smoke
        }
    }

    fn scene(&self) -> Scene {
        let boundary = if self.dielectric {
            Bsdf::Dielectric(Dielectric::default())
        } else {
            Bsdf::Null
        };
        let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
        let scene = Scene::builder()
            .film(1, 1)
            .channels(2)
            .camera(Camera::perspective(self.eye, self.target, 1e-4))
            .medium(self.smoke())
            .object(
                Object::builder("ball", ball)
                    .interior("smoke")
                    .bsdf(boundary),
            )
            .emitter(Emitter::Environment(sky()));
        scene.build().unwrap()
    }

    /// Returns the weighted light of the tree.
    fn loss(&self) -> f64 {
        let direction = (self.target - self.eye).normalize();
        let b = self.eye.dot(direction);
        let way = -b - (b * b - self.eye.length_squared() + 1.0).sqrt();
        let x = self.eye + direction * way;
        let tree = Tree {
            field: self.field(),
            smoke: self.smoke(),
            sky: sky(),
            dielectric: self.dielectric,
            layer: self.layer,
        };
        let light = tree.outside(x, direction, Spectrum::ONE);
        (0..2).map(|c| WEIGHTS[c] * light[c]).sum()
    }
}

/// Tree of all rays that follow from one ray.
struct Tree {
    field: Field,
    smoke: Medium,
    sky: Environment,
    dielectric: bool,
    layer: Option<usize>,
}

impl Tree {
    /// Light of a ray that leaves the ball after a number of events.
    fn light(&self, direction: DVec3, events: usize) -> Spectrum {
        match self.layer {
            Some(layer) if layer != events.min(LAYERS - 1) => Spectrum::ZERO,
            _ => self.sky.radiance(direction),
        }
    }

    /// Light of a ray that meets the ball from outside.
    fn outside(&self, x: DVec3, direction: DVec3, worth: Spectrum) -> Spectrum {
        let (normal, n) = (x.normalize(), self.field.n(x));
        if !self.dielectric {
            // Radiance passes declared matches unchanged; radiance over n² passes the medium
            // unchanged.
            return self.inside(x, direction * n, worth * (n * n), 0);
        }
        let cos = -normal.dot(direction);
        let f = fresnel::dielectric(cos, 1.0, n).reflectance;
        let mirrored = direction + normal * (2.0 * cos);
        let across = direction + normal * cos;
        let v = across - normal * (n * n - across.length_squared()).sqrt();
        let reflected = worth * f * self.light(mirrored, 1);
        reflected + self.inside(x, v, worth * (1.0 - f), 1)
    }

    /// Light of a ray that starts inside, after a number of events.
    fn inside(&self, x: DVec3, v: DVec3, worth: Spectrum, events: usize) -> Spectrum {
        if worth.max() < MIN_CONTRIBUTION {
            return Spectrum::ZERO;
        }
        let (x, v, depth) = self.through(x, v);
        let worth = worth * depth.map(|depth| (-depth).exp());
        let (normal, n) = (x.normalize(), v.length());
        if !self.dielectric {
            return worth * self.light(v / n, events) / (n * n);
        }
        let p = normal.dot(v);
        let f = fresnel::dielectric(p / n, n, 1.0).reflectance;
        let mirrored = v - normal * (2.0 * p);
        let back = self.inside(x, mirrored, worth * f, events + 1);
        if f == 1.0 {
            return back;
        }
        let across = v - normal * p;
        let out = across + normal * (1.0 - across.length_squared()).sqrt();
        back + worth * (1.0 - f) * self.light(out, events + 1)
    }

    /// Returns half the gradient of n².
    fn force(&self, x: DVec3) -> DVec3 {
        self.field.gradient(x).1 * 0.5
    }

    /// Advances by a step of the classical Runge–Kutta scheme.
    fn step(&self, x: DVec3, v: DVec3, h: f64) -> (DVec3, DVec3) {
        let (x1, v1) = (v, self.force(x));
        let (x2, v2) = (v + v1 * (0.5 * h), self.force(x + x1 * (0.5 * h)));
        let (x3, v3) = (v + v2 * (0.5 * h), self.force(x + x2 * (0.5 * h)));
        let (x4, v4) = (v + v3 * h, self.force(x + x3 * h));
        let mean = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (a + b * 2.0 + c * 2.0 + d) * (h / 6.0);
        (x + mean(x1, x2, x3, x4), v + mean(v1, v2, v3, v4))
    }

    /// Returns the optical depth of a step.
    fn depth(&self, x: DVec3, v: DVec3, h: f64) -> Spectrum {
        let (middle, v) = self.step(x, v, 0.5 * h);
        self.smoke.extinction(middle) * (v.length() * h)
    }

    /// Returns the position and direction where a ray leaves the ball, and the optical depth up to
    /// there.
    fn through(&self, mut x: DVec3, mut v: DVec3) -> (DVec3, DVec3, Spectrum) {
        let mut depth = Spectrum::ZERO;
        loop {
            let (next, velocity) = self.step(x, v, STEP);
            if next.length() > 1.0 {
                break;
            }
            depth += self.depth(x, v, STEP);
            (x, v) = (next, velocity);
        }
        let mut last = 0.0;
        for _ in 0..6 {
            let (end, velocity) = self.step(x, v, last);
            last += (1.0 - end.length_squared()) / (2.0 * end.dot(velocity));
        }
        depth += self.depth(x, v, last);
        let (x, v) = self.step(x, v, last);
        (x, v, depth)
    }
}

/// Compares derivatives with respect to the parameters of a bump. Returns the largest value and the
/// largest error.
fn compare(setup: Setup, comparisons: &mut Comparisons) -> [f64; 2] {
    let bounces = setup.layer.map(|_| LAYERS as u32 - 2);
    let weights: Vec<f64> = match setup.layer {
        None => WEIGHTS.into(),
        Some(own) => (0..LAYERS)
            .flat_map(|layer| WEIGHTS.map(|w| if layer == own { w } else { 0.0 }))
            .collect(),
    };
    let options = IndexDerivativeOptions {
        path: PathTracer {
            max_depth: None,
            rr_depth: 100,
        },
        samples: SAMPLES,
        seed: 3,
        decomposition: Decomposition {
            bounces,
            ..Decomposition::default()
        },
        hide_emitters: false,
        media: &[1],
        weights: &weights,
    };
    let found = index_derivatives(&[setup.scene()], &options, &Handle::default());
    let found = found.unwrap().unwrap();
    println!("{setup:?}");
    comparisons.see("light", found.value, (setup.loss(), 0.0));
    let mut most = [0.0f64; 2];
    for (i, of) in [0, 1, 5].into_iter().enumerate() {
        let step = 1e-3;
        let at = |h: f64| {
            let mut changed = setup;
            changed.bump[i] += h;
            changed.loss()
        };
        let exact = (at(step) - at(-step)) / (2.0 * step);
        let by = (found.by[0].values[of], found.by[0].errors[of]);
        comparisons.see(["n0", "delta", "width"][i], by, (exact, 0.0));
        most = [most[0].max(exact.abs()), most[1].max(by.1)];
    }
    most
}

fn cases(dielectric: bool) {
    let mut comparisons = Comparisons::default();
    for graded in [false, true] {
        for (eye, target) in [
            ([0.3, 0.2, -4.0], [0.0, 0.1, 0.0]),
            ([3.0, 1.5, -2.0], [0.4, -0.3, 0.2]),
        ] {
            let setup = Setup {
                bump: BUMP,
                dielectric,
                graded,
                layer: None,
                eye: eye.into(),
                target: target.into(),
            };
            let [value, error] = compare(setup, &mut comparisons);
            assert!(error < 0.1 * value, "{setup:?}: {error} of {value}");
        }
    }
    comparisons.check();
}

#[test]
fn derivatives_through_smoke_are_differences_of_one_ray() {
    cases(false);
}

#[test]
fn derivatives_through_smoke_in_glass_are_differences_of_a_tree_of_rays() {
    cases(true);
}

#[test]
fn derivatives_of_layers_by_bounces_are_those_of_rays_of_as_many_events() {
    let mut comparisons = Comparisons::default();
    for layer in [2, 3] {
        let setup = Setup {
            bump: BUMP,
            dielectric: true,
            graded: false,
            layer: Some(layer),
            eye: DVec3::new(3.0, 1.5, -2.0),
            target: DVec3::new(0.4, -0.3, 0.2),
        };
        let [value, error] = compare(setup, &mut comparisons);
        assert!(error < 0.1 * value, "{setup:?}: {error} of {value}");
    }
    comparisons.check();
}
