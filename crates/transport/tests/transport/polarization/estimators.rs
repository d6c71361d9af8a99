//! Stokes vectors by estimators that trace light from the sensor, from the emitters, and from both.
//!
//! Estimators share the matrices of events, but neither frames nor the order of multiplication. The
//! path tracer multiplies matrices from the sensor on, and the particle tracer multiplies Stokes
//! vectors from the emitter on. False-alarm rate: 1e-4 for each test.

use super::filters::{polarizer, square};
use super::polarized_by;
use crate::layers::bounded;
use eikonal::field::{Constant, LinearSquare};
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{
    Bsdf, Dielectric, Distribution, RoughConductor, RoughDielectric, Roughness,
};
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::phase::{Phase, Spheres};
use morgana_transport::scene::{Object, ObjectBuilder, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::{Cube, Rectangle};
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Scene, Spectrum};
use testkit::z_test::{max_abs_z, two_sample_z};

const RATE: f64 = 1e-4;
const CHANNELS: usize = 2;

/// A mean and its standard error.
type Estimate = (f64, f64);

fn total(all: &[Estimate]) -> Estimate {
    let sum = all.iter().map(|(mean, _)| mean).sum();
    let variance: f64 = all.iter().map(|(_, error)| error * error).sum();
    (sum, variance.sqrt())
}

/// Asserts that estimators find equal Stokes parameters, and that the light has all `expected`
/// kinds of polarisation: the smallest fractions of Q, U and V in the image.
fn assert_agree(scene: &Scene, max_depth: u32, samples: [u64; 3], expected: [f64; 3]) {
    let pixels = scene.film().width * scene.film().height;
    let [path, particle, both] = std::array::from_fn(|i| {
        let integrator = bounded(max_depth)[i];
        let film = polarized_by(integrator, scene, samples[i], 7 + i as u64).film;
        let at = |layer: usize, channel: usize, pixel: usize| {
            let mean = f64::from(film.mean_at(Some(layer), channel, pixel));
            let variance = f64::from(film.variance_at(Some(layer), channel, pixel));
            (mean, variance.sqrt())
        };
        let places = (0..4).flat_map(|layer| {
            (0..CHANNELS).flat_map(move |channel| (0..pixels).map(move |p| (layer, channel, p)))
        });
        places
            .map(|(layer, channel, p)| at(layer, channel, p))
            .collect::<Vec<_>>()
    });
    let sum = |layer: usize| {
        let values = &both[layer * CHANNELS * pixels..][..CHANNELS * pixels];
        values.iter().map(|(mean, _)| mean.abs()).sum::<f64>()
    };
    let shares = [1, 2, 3].map(|layer| sum(layer) / sum(0));
    println!("shares of Q, U, V: {shares:?}");
    for (share, least) in shares.iter().zip(expected) {
        assert!(*share >= least, "{shares:?}");
    }
    for (name, other) in [("particle", &particle), ("bdpt", &both)] {
        let z = |(a, sa): &Estimate, (b, sb): &Estimate| two_sample_z(*a, *sa, *b, *sb);
        let mut zs: Vec<f64> = path.iter().zip(other).map(|(a, b)| z(a, b)).collect();
        // Compare each parameter and channel of the whole image.
        let sums = path.chunks(pixels).zip(other.chunks(pixels));
        zs.extend(sums.map(|(a, b)| z(&total(a), &total(b))));
        let [(light, a), (_, b)] = [&path, other].map(|all| total(&all[..pixels]));
        println!("{name}: {:.2} %", 100.0 * a.hypot(b) / light);
        max_abs_z(&zs, RATE).unwrap_or_else(|e| panic!("{name}: {e}\n{zs:.1?}"));
    }
}

fn view(origin: DVec3, target: DVec3, fov: f64) -> SceneBuilder {
    let camera = Camera::perspective(origin, target, fov).with_up(DVec3::new(0.3, 0.2, 1.0));
    Scene::builder()
        .film(3, 2)
        .channels(CHANNELS)
        .camera(camera)
}

fn plate(name: &str, center: DVec3, normal: DVec3, half: f64) -> ObjectBuilder {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    let to_world = DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, center);
    Object::builder(name, Rectangle::new(to_world).unwrap())
}

fn roughness() -> Roughness {
    Roughness::new(Distribution::Ggx, 0.4).unwrap()
}

/// Two rough metals, whose matrices differ by channel, behind a polariser, and a rough pane of
/// glass that light passes.
#[test]
fn rough_surfaces_polarise_alike_from_both_ends() {
    let spectrum = |a, b| Spectrum([a, b, 0.0, 0.0]);
    let [eta, k] = [spectrum(0.2, 1.5), spectrum(3.0, 2.0)];
    let metal = || {
        let metal = RoughConductor::new(roughness(), eta, k, Spectrum::ONE);
        Bsdf::RoughConductor(metal.unwrap())
    };
    let glass = RoughDielectric::new(roughness(), Spectrum::ONE, Spectrum::ONE).unwrap();
    let pane = DAffine3::from_scale_rotation_translation(
        DVec3::new(2.0, 2.0, 0.1),
        DQuat::from_rotation_x(0.5),
        DVec3::new(0.0, -1.5, 1.0),
    );
    let filter = square(
        "filter",
        DVec3::new(0.0, 0.0, 3.5),
        DQuat::from_rotation_y(0.3),
        polarizer(30.0),
    );
    let scene = view(DVec3::new(0.5, -2.8, 1.8), DVec3::new(0.0, 0.0, 0.3), 110.0)
        .medium(Medium::transparent("glass", Constant::new(1.5)))
        .object(plate("floor", DVec3::ZERO, DVec3::Z, 3.0).bsdf(metal()))
        .object(
            plate(
                "wall",
                DVec3::new(-2.0, 1.0, 1.0),
                DVec3::new(1.0, -0.4, 0.2),
                2.0,
            )
            .bsdf(metal()),
        )
        .object(
            Object::builder("pane", Cube::new(pane).unwrap())
                .bsdf(Bsdf::RoughDielectric(glass))
                .interior("glass"),
        )
        .object(filter)
        .object(
            plate(
                "light",
                DVec3::new(0.5, 0.5, 5.0),
                DVec3::new(0.0, -0.2, -1.0),
                1.0,
            )
            .emission(3.0),
        )
        .build()
        .unwrap();
    assert_agree(&scene, 6, [20_000, 20_000, 10_000], [0.05, 0.05, 0.005]);
}

/// Small spheres in glass of varying index, with lights inside and outside of its smooth faces:
/// rays bend, and connections are refracted.
#[test]
fn spheres_in_graded_glass_polarise_alike_from_both_ends() {
    let spheres = Spheres {
        radius: 1.2,
        geometric_deviation: 1.0,
        n: 1.5,
        k: 0.1,
        exterior: 1.0,
        wavelength: std::f64::consts::TAU,
    };
    let phase = Phase::mie(&spheres).unwrap();
    let index = LinearSquare::new(1.4, DVec3::new(0.1, 0.25, -0.2), DVec3::ZERO).unwrap();
    let haze = Medium::homogeneous("haze", index, 0.8, 0.9).with_phase(phase);
    let scene = view(DVec3::new(1.0, -5.0, 1.5), DVec3::ZERO, 40.0)
        .medium(haze)
        .object(
            Object::builder("block", Cube::new(DAffine3::IDENTITY).unwrap())
                .bsdf(Bsdf::Dielectric(Dielectric::default()))
                .interior("haze"),
        )
        .emitter(Emitter::point(DVec3::new(0.3, 0.2, 0.5), 1.0))
        .object(
            plate(
                "light",
                DVec3::new(2.0, 0.5, 2.0),
                DVec3::new(-1.0, -0.2, -1.0),
                0.7,
            )
            .emission(3.0),
        )
        .build()
        .unwrap();
    assert_agree(&scene, 6, [20_000, 40_000, 20_000], [0.05, 0.05, 0.003]);
}

/// Glowing and scattering glass: paths from the sensor find the light of volumes along their edges.
#[test]
fn glowing_volumes_polarise_alike_from_both_ends() {
    let glow = Medium {
        emission: Some(VolumeTexture::Uniform(Spectrum::splat(1.0))),
        ..Medium::homogeneous("glow", Constant::new(1.4), 1.0, 0.9)
    };
    let half = DVec3::new(1.0, 0.6, 0.8);
    let scene = view(DVec3::new(1.5, -5.0, 2.5), DVec3::ZERO, 40.0)
        .medium(glow.with_phase(Phase::rayleigh()))
        .object(
            Object::builder("block", Cube::new(DAffine3::from_scale(half)).unwrap())
                .bsdf(Bsdf::Dielectric(Dielectric::default()))
                .interior("glow"),
        )
        .build()
        .unwrap();
    assert_agree(&scene, 4, [20_000, 20_000, 10_000], [0.03, 0.02, 0.0]);
}
