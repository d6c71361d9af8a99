//! Random walks: observers do not change them, splitting is unbiased, and walks end where paths
//! become too long.
//!
//! Tests that compare distributions fail by chance about once in 10⁴ runs.

use crate::common::{camera, container, fog, parts, vacuum};
use eikonal::field::Constant;
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::path::{
    Observer, RandomWalk, Start, Survival, TransportMode, WalkEvent, WalkRay,
};
use morgana_transport::path::{ParticleBalance, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

const SIGMA_T: f64 = 4.0;
const ALBEDO: f64 = 0.75;
const INDEX: f64 = 1.25;

/// Log of a walk: depth, throughput and optical length at each vertex, and the number of cuts.
#[derive(Debug, Default, PartialEq)]
struct Log {
    vertices: Vec<(u32, f64, f64)>,
    cuts: usize,
}

impl Observer for Log {
    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        let at = (event.depth, event.throughput[0], event.optical_length);
        self.vertices.extend(event.vertex.map(|_| at));
        ControlFlow::Continue(())
    }

    fn cut(&mut self, _event: &WalkEvent, _ws: &mut Workspace) {
        self.cuts += 1;
    }
}

/// Splits every ray into this number of copies.
struct Copies(usize);

impl Survival for Copies {
    fn copies(&mut self, throughput: &mut Spectrum, _: u32, _: f64, _: &mut Sampler) -> usize {
        *throughput *= 1.0 / self.0 as f64;
        self.0
    }
}

/// A medium that no light leaves.
fn scene() -> Scene {
    let medium = fog(Constant::new(INDEX), SIGMA_T, ALBEDO, 0.0);
    let ball = container(Sphere::around(DVec3::ZERO, 1e3).unwrap(), Bsdf::Null);
    let view = camera(DVec3::ZERO, DVec3::Z);
    Scene::new(parts(vec![ball], vec![vacuum(), medium], vec![], view)).unwrap()
}

/// A walk of power 1 with a maximum number of edges.
fn walk(scene: &Scene, observer: &mut impl Observer, copies: usize, (depth, seed): (u32, u64)) {
    let one = Spectrum([1.0, 0.0, 0.0, 0.0]);
    let walk = RandomWalk {
        scene,
        mode: TransportMode::Importance,
        channel_pdf: one,
        follows_throughput: false,
        max_depth: depth,
    };
    let ray = WalkRay {
        start: Start::point(DVec3::ZERO, DVec3::Z, scene.medium_at(DVec3::ZERO)),
        pdf: 1.0,
        specular: false,
        throughput: one,
        depth: 0,
        optical_length: 0.0,
    };
    let (mut sampler, mut ws) = (Sampler::new(seed, 0, 0), Workspace::new(scene.tolerance()));
    walk.run(ray, observer, &mut Copies(copies), &mut sampler, &mut ws);
}

/// The first vertex lies at an optical length n s whose ∫σ_t ds is exponentially distributed.
#[test]
fn free_flights_are_exponential() {
    let scene = scene();
    let length = |seed| {
        let mut log = Log::default();
        walk(&scene, &mut log, 1, (1, seed));
        log.vertices[0].2 * SIGMA_T / INDEX
    };
    let count = 10_000;
    let sums = (0..count)
        .map(length)
        .fold([0.0; 2], |[a, b], s| [a + s, b + s * s]);
    // Expect means 1 and 2, variances 1 and 20.
    let [mean, square] = sums.map(|sum| sum / f64::from(count as u32));
    let z = |value: f64, exact: f64, variance: f64| {
        (value - exact) / (variance / f64::from(count as u32)).sqrt()
    };
    max_abs_z(&[z(mean, 1.0, 1.0), z(square, 2.0, 20.0)], 1e-4).unwrap();
}

/// A walk that is split in two at each vertex has 2^k vertices after k + 1 edges. Together they
/// carry the power of an unsplit walk.
#[test]
fn divided_walks_carry_what_one_does() {
    let (scene, most) = (scene(), 6);
    let mut log = Log::default();
    walk(&scene, &mut log, 2, (most, 3));
    for depth in 1..=most {
        let at = log.vertices.iter().filter(|v| v.0 == depth);
        let (count, power) = at.fold((0, 0.0), |(n, sum), v| (n + 1, sum + v.1));
        assert_eq!(count, 1 << (depth - 1));
        let exact = ALBEDO.powi(depth as i32);
        assert!((power / exact - 1.0).abs() < 1e-12, "{power} {exact}");
    }
    assert_eq!(log.cuts, 1 << most);
}

/// Observers do not change a walk, and the energy balance contains all of its power.
#[test]
fn walks_do_not_depend_on_who_is_watching() {
    let scene = scene();
    for seed in 0..100 {
        let mut alone = Log::default();
        walk(&scene, &mut alone, 1, (20, seed));
        let mut both = (Log::default(), ParticleBalance::default());
        walk(&scene, &mut both, 1, (20, seed));
        assert_eq!(alone, both.0);
        let ParticleBalance { media, cut, .. } = both.1;
        assert!((media + cut - 1.0).abs() < 1e-12, "{media} {cut}");
        assert!((cut / ALBEDO.powi(20) - 1.0).abs() < 1e-12);
    }
}
