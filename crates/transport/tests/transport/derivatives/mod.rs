//! Derivatives of images by coefficients of media, colours of surfaces and emission (docs/theory.md#derivatives-of-light).
//!
//! Against central differences of renders with the same random numbers: means of 32 batches, whose differences vary like Student's t of 31
//! degrees of freedom, and derivatives that vary like it with 31, too. At |t| < 5 each comparison fails with a probability of 2e-5
//! although the code is right; for the 200 comparisons the false-alarm rate is below 4e-3. Differences are those of steps of a tenth: their
//! error is that of the third derivative, below 3e-3 of the derivative.
//!
//! Identities hold path by path, to rounding. Closed forms are compared at a family-wise false-alarm rate of 1e-4.

mod emitters;
mod integrators;

use eikonal::Field;
use eikonal::field::{Constant, LinearIndex, Luneburg, Placement};
use glam::{DAffine2, DAffine3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::derivative::{DerivativeError, RadiometricParameter};
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::medium::{Medium, MediumLabel, MediumLabels};
use morgana_transport::phase::{Phase, PhaseByLabel};
use morgana_transport::render::{
    Derivative, DerivativeOptions, Handle, RenderOptions, State, derivatives, render,
};
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use morgana_transport::volume::{GridFilter, GridSamples, LabelGrid, VolumeGrid, VolumeTexture};
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
use std::sync::Arc;
use testkit::z_test::max_abs_z;

const BATCHES: u64 = 32;
const MOST: f64 = 5.0;
const PATH: Integrator = Integrator::Path(PathTracer {
    max_depth: Some(6),
    rr_depth: 4,
});
/// Media and the other parts of [`Setup::scene`].
const HAZE: usize = 1;
const WALL: usize = 1;
const LIGHT: usize = 0;

/// How the extinction and the albedo of the haze are made up.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MadeOf {
    One,
    Labels,
    Voxels(GridFilter),
}

/// A ball of haze before a wall, lit by a point light and by a dim sky. Two channels.
#[derive(Clone, Debug)]
struct Setup {
    index: Field,
    made_of: MadeOf,
    /// In both channels, of each number.
    extinction: Vec<[f64; 2]>,
    albedo: Vec<[f64; 2]>,
    /// Of each number, if there are several.
    g: Vec<f64>,
    /// Of one colour, or of 2 × 2 pixels.
    reflectance: Vec<[f64; 2]>,
    filter: BitmapFilter,
    intensity: f64,
    sky: f64,
}

fn two([a, b]: [f64; 2]) -> Spectrum {
    Spectrum([a, b, 0.0, 0.0])
}

impl Setup {
    fn new(index: impl Into<Field>, made_of: MadeOf) -> Self {
        let count = match made_of {
            MadeOf::One => 1,
            MadeOf::Labels => 2,
            MadeOf::Voxels(_) => 8,
        };
        let varied = |i: usize| 0.5 + 0.25 * (i * 5 % 8) as f64;
        Setup {
            index: index.into(),
            made_of,
            extinction: (0..count).map(|i| [varied(i), 1.5 * varied(i)]).collect(),
            albedo: (0..count).map(|i| [0.9 - 0.05 * i as f64, 0.7]).collect(),
            g: vec![0.4],
            reflectance: vec![[0.5, 0.8]],
            filter: BitmapFilter::Bilinear,
            intensity: 20.0,
            sky: 0.25,
        }
    }

    fn labels() -> Arc<LabelGrid> {
        let cube =
            DAffine3::from_translation(DVec3::NEG_ONE) * DAffine3::from_scale(DVec3::splat(2.0));
        Arc::new(LabelGrid::new([2, 1, 2], vec![0, 1, 1, 0], cube).unwrap())
    }

    fn texture(&self, values: &[[f64; 2]]) -> VolumeTexture {
        let spectra: Vec<Spectrum> = values.iter().map(|v| two(*v)).collect();
        let cube =
            DAffine3::from_translation(DVec3::NEG_ONE) * DAffine3::from_scale(DVec3::splat(2.0));
        let grid = match self.made_of {
            MadeOf::One => return VolumeTexture::Uniform(spectra[0]),
            MadeOf::Labels => VolumeGrid::by_label(Self::labels(), &spectra, 2),
            MadeOf::Voxels(filter) => {
                let data = values.iter().flatten().map(|v| *v as f32).collect();
                let samples = GridSamples {
                    size: [2; 3],
                    channels: 2,
                    data,
                };
                VolumeGrid::new(samples, cube, Placement::Centers, filter, [0.0, 1e3])
            }
        };
        VolumeTexture::Grid(Arc::new(grid.unwrap()))
    }

    fn medium(&self) -> Medium {
        let label = |(i, (t, a)): (usize, (&[f64; 2], &[f64; 2]))| MediumLabel {
            name: i.to_string(),
            extinction: two(*t),
            absorption: two([t[0] * (1.0 - a[0]), t[1] * (1.0 - a[1])]),
            velocity: None,
        };
        let each = self.extinction.iter().zip(&self.albedo).enumerate();
        let labels = MediumLabels::new(Self::labels(), each.map(label).collect());
        Medium {
            name: "haze".into(),
            index: self.index.clone(),
            sigma_t: self.texture(&self.extinction),
            scale: 1.0,
            albedo: self.texture(&self.albedo),
            phase: self.phase(),
            emission: None,
            velocity: None,
            labels: labels.filter(|_| self.made_of == MadeOf::Labels),
        }
    }

    fn phase(&self) -> Phase {
        let hg = |g: &f64| Phase::henyey_greenstein(*g).unwrap();
        match (self.made_of, &self.g[..]) {
            (_, [one]) => hg(one),
            (MadeOf::Voxels(filter), all) => {
                let samples = GridSamples {
                    size: [2; 3],
                    channels: 1,
                    data: all.iter().map(|g| *g as f32).collect(),
                };
                let (cube, range) = (Self::labels().to_world(), [-0.99, 0.99]);
                let grid = VolumeGrid::new(samples, cube, Placement::Centers, filter, range);
                Phase::HenyeyGreensteinGrid(Arc::new(grid.unwrap()))
            }
            (_, all) => {
                let each = all.iter().map(hg).collect();
                let phases = PhaseByLabel::new(Self::labels(), each).unwrap();
                Phase::ByLabel(Box::new(phases))
            }
        }
    }

    fn colour(&self) -> Texture {
        if let [one] = self.reflectance[..] {
            return two(one).into();
        }
        let data = self.reflectance.iter().flatten().map(|v| *v as f32);
        let (filter, wrap) = (self.filter, Wrap::Clamp);
        let bitmap = Bitmap::new([2; 2], 2, data.collect(), filter, wrap, DAffine2::IDENTITY);
        Texture::Bitmap(Arc::new(bitmap.unwrap()))
    }

    fn scene(&self) -> Scene {
        self.builder().build().unwrap()
    }

    fn builder(&self) -> SceneBuilder {
        let wall = DAffine3::from_translation(DVec3::Z * 1.5)
            * DAffine3::from_rotation_y(std::f64::consts::PI)
            * DAffine3::from_scale(DVec3::splat(2.0));
        let wall = Object::builder("wall", Rectangle::new(wall).unwrap());
        let white = Bsdf::Diffuse(Diffuse::new(self.colour()).unwrap());
        let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
        Scene::builder()
            .film(4, 4)
            .channels(2)
            .camera(Camera::perspective([0.0, 0.0, -4.0], [0.0; 3], 30.0))
            .medium(self.medium())
            .object(Object::builder("ball", ball).interior("haze"))
            .object(wall.bsdf(white))
            .emitter(Emitter::point(
                [1.0, 1.0, -1.5],
                two([self.intensity, 0.5 * self.intensity]),
            ))
            .emitter(Emitter::constant(two([self.sky, self.sky])))
    }

    /// The setup with a parameter changed along `direction`, a number for each of its numbers in each channel, by a step.
    fn changed(&self, parameter: RadiometricParameter, direction: &[[f64; 2]], step: f64) -> Self {
        let mut setup = self.clone();
        for (i, d) in direction.iter().enumerate() {
            for (c, d) in d.iter().enumerate() {
                let d = step * d;
                let (t, a) = match parameter {
                    RadiometricParameter::Reflectance(_) => {
                        setup.reflectance[i][c] += d;
                        continue;
                    }
                    RadiometricParameter::Emission(_) => {
                        // Both channels change alike.
                        setup.intensity *= if c == 0 { 1.0 + d } else { 1.0 };
                        continue;
                    }
                    RadiometricParameter::MeanCosine(_) => {
                        // Both channels change alike.
                        setup.g[i] += if c == 0 { d } else { 0.0 };
                        continue;
                    }
                    _ => (setup.extinction[i][c], setup.albedo[i][c]),
                };
                let (scattering, absorption) = (t * a, t * (1.0 - a));
                let of = |s: f64, a: f64| (s + a, s / (s + a));
                let (t, a) = match parameter {
                    RadiometricParameter::Extinction(_) => (t + d, a),
                    RadiometricParameter::Albedo(_) => (t, a + d),
                    RadiometricParameter::Absorption(_) => of(scattering, absorption + d),
                    _ => of(scattering + d, absorption),
                };
                (setup.extinction[i][c], setup.albedo[i][c]) = (t, a);
            }
        }
        setup
    }
}

/// Any weights, of either sign.
fn weights() -> Vec<f64> {
    (0..32).map(|i| ((i * 7 % 13) as f64 - 4.0) / 8.0).collect()
}

/// Σ weight × image of each batch of samples.
fn losses(scene: Scene) -> Vec<f64> {
    losses_by(PATH, scene)
}

fn losses_by(integrator: Integrator, scene: Scene) -> Vec<f64> {
    let scenes = [scene];
    let each = if long() { 1024 } else { 32 };
    let options = |first| RenderOptions {
        first,
        ..RenderOptions::new(integrator, each, 0)
    };
    let mut state = State::new(&scenes, &options(0));
    let mut before = 0.0;
    let batch = |number: u64| {
        state.advance(&scenes, &options(number * each), &Handle::default(), |_| {
            ControlFlow::Continue(())
        });
        let image = state.film().mean();
        let terms = image.iter().zip(weights());
        let mean: f64 = terms
            .map(|(value, weight)| f64::from(*value) * weight)
            .sum();
        let all = mean * (number + 1) as f64;
        let own = all - before;
        before = all;
        own
    };
    (0..BATCHES).map(batch).collect()
}

/// Mean and standard error.
fn moments(all: &[f64]) -> (f64, f64) {
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let squares: f64 = all.iter().map(|q| (q - mean) * (q - mean)).sum();
    (
        mean,
        (squares / (all.len() * (all.len() - 1)) as f64).sqrt(),
    )
}

/// Whether tests take more samples.
fn long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}

fn by(scene: Scene, parameters: &[RadiometricParameter], samples: u64) -> Vec<Derivative> {
    try_by(scene, parameters, samples, &weights()).unwrap()
}

fn try_by(
    scene: Scene,
    parameters: &[RadiometricParameter],
    samples: u64,
    weights: &[f64],
) -> Result<Vec<Derivative>, DerivativeError> {
    try_with(PATH, scene, parameters, samples, weights)
}

fn try_with(
    integrator: Integrator,
    scene: Scene,
    parameters: &[RadiometricParameter],
    samples: u64,
    weights: &[f64],
) -> Result<Vec<Derivative>, DerivativeError> {
    let options = DerivativeOptions {
        integrator,
        samples,
        seed: 1,
        decomposition: Decomposition::default(),
        hide_emitters: false,
        parameters,
        weights,
    };
    let found = derivatives(&[scene], &options, &Handle::default())?;
    Ok(found.unwrap().by)
}

/// Along a direction: the mean, and the error as if its numbers were fully correlated, which is at least what it is.
fn along(derivative: &Derivative, direction: &[[f64; 2]]) -> (f64, f64) {
    let pairs = direction.iter().flatten().enumerate();
    let mean = pairs.clone().map(|(i, d)| derivative.values[i] * d).sum();
    let error = pairs.map(|(i, d)| derivative.errors[i] * d.abs()).sum();
    (mean, error)
}

/// Mean and standard error of a central difference of the loss.
fn difference(
    setup: &Setup,
    parameter: RadiometricParameter,
    direction: &[[f64; 2]],
    step: f64,
) -> (f64, f64) {
    quotient(PATH, step, |h| {
        setup.changed(parameter, direction, h).scene()
    })
}

/// Mean and standard error of the difference quotient of the loss of a scene that a step changes.
fn quotient(integrator: Integrator, step: f64, changed: impl Fn(f64) -> Scene) -> (f64, f64) {
    let [up, down] = [step, -step].map(|h| losses_by(integrator, changed(h)));
    let pairs = up.into_iter().zip(down);
    let quotients: Vec<f64> = pairs.map(|(up, down)| (up - down) / (2.0 * step)).collect();
    moments(&quotients)
}

/// A direction in which all numbers change, by different parts of a size.
fn direction(count: usize, size: f64) -> Vec<[f64; 2]> {
    let part = |i: usize| size * (0.5 + 0.5 * (i * 3 % 5) as f64 / 4.0);
    (0..count).map(|i| [part(2 * i), part(2 * i + 1)]).collect()
}

const IN_MEDIA: [RadiometricParameter; 5] = [
    RadiometricParameter::Extinction(HAZE),
    RadiometricParameter::Albedo(HAZE),
    RadiometricParameter::Absorption(HAZE),
    RadiometricParameter::Scattering(HAZE),
    RadiometricParameter::MeanCosine(HAZE),
];
const OTHERS: [RadiometricParameter; 2] = [
    RadiometricParameter::Reflectance(WALL),
    RadiometricParameter::Emission(LIGHT),
];

/// Compares all derivatives of a setup with differences.
fn compare(name: &str, setup: &Setup, parameters: &[RadiometricParameter]) {
    let all = by(
        setup.scene(),
        parameters,
        if long() { 1 << 15 } else { 1024 },
    );
    let mut wrong = Vec::new();
    for (parameter, derivative) in parameters.iter().zip(all) {
        let count = derivative.values.len() / 2;
        let direction = match parameter {
            // Both channels alike.
            RadiometricParameter::MeanCosine(_) | RadiometricParameter::Emission(_) => (0..count)
                .map(|i| [1.0 - 0.2 * (i % 3) as f64; 2])
                .collect(),
            _ => direction(count, 1.0),
        };
        let (found, error) = along(&derivative, &direction);
        let (exact, spread) = difference(setup, *parameter, &direction, 0.05);
        let t = (found - exact) / error.hypot(spread);
        println!(
            "{name} {parameter:?}: {found:.4} ± {error:.4}, difference {exact:.4} ± {spread:.4}, t = {t:.2}"
        );
        if t.is_nan() || t.abs() >= MOST {
            wrong.push(format!("{name} {parameter:?}: t = {t}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn derivatives_are_differences_where_rays_are_straight() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    compare(
        "straight",
        &Setup::new(Constant::new(1.0), MadeOf::One),
        &all,
    );
}

#[test]
fn derivatives_are_differences_along_curved_rays() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    compare("linear", &Setup::new(linear, MadeOf::One), &all);
}

#[test]
fn derivatives_are_differences_in_a_lens() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    let lens = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    compare("lens", &Setup::new(lens, MadeOf::One), &all);
}

#[test]
fn derivatives_by_labels_and_voxels_are_differences() {
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    // Between samples, products of coefficients are no coefficients: of voxels that are interpolated only σ_t and α can be changed.
    for (made_of, parameters) in [
        (MadeOf::Labels, &IN_MEDIA[..4]),
        (MadeOf::Voxels(GridFilter::Nearest), &IN_MEDIA[..4]),
        (MadeOf::Voxels(GridFilter::Trilinear), &IN_MEDIA[..2]),
    ] {
        for index in [Field::from(Constant::new(1.0)), linear.into()] {
            let setup = Setup::new(index.clone(), made_of);
            compare(&format!("{made_of:?} {index:?}"), &setup, parameters);
        }
    }
}

#[test]
fn derivatives_by_mean_cosines_of_labels_and_voxels_are_differences() {
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    for (made_of, g) in [
        (MadeOf::Labels, vec![0.6, -0.3]),
        (
            MadeOf::Voxels(GridFilter::Trilinear),
            (0..8).map(|i| 0.1 * f64::from(i) - 0.2).collect(),
        ),
    ] {
        let mut setup = Setup::new(linear, made_of);
        setup.g = g;
        compare(&format!("g of {made_of:?}"), &setup, &IN_MEDIA[4..]);
    }
}

#[test]
fn derivatives_by_pixels_of_a_reflectance_are_differences() {
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    for filter in [BitmapFilter::Bilinear, BitmapFilter::Nearest] {
        let mut setup = Setup::new(linear, MadeOf::One);
        setup.reflectance = vec![[0.5, 0.8], [0.3, 0.4], [0.7, 0.2], [0.6, 0.5]];
        setup.filter = filter;
        compare(&format!("{filter:?}"), &setup, &OTHERS[..1]);
        // Pixels that are alike are one colour.
        let half = [0.5, 0.75];
        let [one, four] = [1, 4].map(|count| {
            setup.reflectance = vec![half; count];
            by(setup.scene(), &OTHERS[..1], 64).remove(0)
        });
        assert_eq!(four.shape, [2, 2, 2]);
        for c in 0..2 {
            let sum: f64 = four.values.iter().skip(c).step_by(2).sum();
            assert!(close(
                sum,
                one.values[c],
                one.values[c].abs() + one.errors[c]
            ));
        }
    }
}

fn close(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 1e-9 * size
}

/// σ_t ∂/∂σ_t = μ_s ∂/∂μ_s + μ_a ∂/∂μ_a and ∂/∂α = σ_t (∂/∂μ_s − ∂/∂μ_a), path by path, for every number and channel.
#[test]
fn coefficients_obey_the_chain_rule() {
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    for made_of in [
        MadeOf::One,
        MadeOf::Labels,
        MadeOf::Voxels(GridFilter::Nearest),
    ] {
        let setup = Setup::new(linear, made_of);
        let [t, a, absorption, scattering] = &by(setup.scene(), &IN_MEDIA[..4], 64)[..] else {
            panic!("four derivatives");
        };
        let exact = made_of != MadeOf::Voxels(GridFilter::Nearest);
        for (i, (sigma, albedo)) in setup.extinction.iter().zip(&setup.albedo).enumerate() {
            for c in 0..2 {
                let (at, size) = (2 * i + c, t.values[2 * i + c].abs() + t.errors[2 * i + c]);
                let mean =
                    albedo[c] * scattering.values[at] + (1.0 - albedo[c]) * absorption.values[at];
                // Samples are stored in single precision.
                let slack = if exact { 1.0 } else { 1e3 };
                assert!(
                    close(t.values[at], mean, slack * size),
                    "{made_of:?} {i} {c}"
                );
                let difference = sigma[c] * (scattering.values[at] - absorption.values[at]);
                assert!(
                    close(
                        a.values[at],
                        difference,
                        slack * (a.values[at].abs() + size)
                    ),
                    "{made_of:?} {i} {c}"
                );
            }
        }
    }
}

/// A grid of equal samples is the same medium, and its derivatives add up to the one by its only number.
#[test]
fn derivatives_by_voxels_add_up() {
    let linear = LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap();
    for index in [Field::from(Constant::new(1.0)), linear.into()] {
        let one = Setup::new(index.clone(), MadeOf::One);
        let mut many = Setup::new(index, MadeOf::Voxels(GridFilter::Trilinear));
        many.extinction = vec![one.extinction[0]; 8];
        many.albedo = vec![[0.875, 0.75]; 8];
        let one = Setup {
            albedo: vec![[0.875, 0.75]],
            ..one
        };
        let [one, many] = [one, many].map(|setup| by(setup.scene(), &IN_MEDIA[..4], 256));
        for (one, many) in one.iter().zip(&many) {
            for c in 0..2 {
                let sum: f64 = many.values.iter().skip(c).step_by(2).sum();
                let difference = (sum - one.values[c]).abs();
                assert!(
                    difference < 1e-3 * one.values[c].abs() + 0.02 * one.errors[c],
                    "{sum} {one:?}"
                );
            }
        }
    }
}

/// The image is linear in what emitters emit.
#[test]
fn derivatives_by_emission_add_up_to_the_image() {
    let setup = Setup::new(Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap(), MadeOf::One);
    let emitters = [
        RadiometricParameter::Emission(0),
        RadiometricParameter::Emission(1),
    ];
    let found = by(setup.scene(), &emitters, 1024);
    let sum: f64 = found.iter().flat_map(|d| &d.values).sum();
    let error: f64 = found.iter().flat_map(|d| &d.errors).sum();
    let (mean, spread) = moments(&losses(setup.scene()));
    let t = (sum - mean) / error.hypot(spread);
    assert!(t.abs() < MOST, "{sum} {mean}: t = {t}");
}

/// Σ image² by a factor on all emission is twice itself, for which weights are the image itself. With a primal of the same random
/// numbers it would be larger by the variances.
#[test]
fn a_loss_that_is_not_linear_has_a_derivative_without_bias() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::One);
    let truth = setup.scene();
    let truth = truth
        .render(&RenderOptions::new(PATH, 1 << 14, 99))
        .film
        .mean();
    let exact: f64 = truth.iter().map(|v| f64::from(v * v)).sum();
    let emitters = [
        RadiometricParameter::Emission(0),
        RadiometricParameter::Emission(1),
    ];
    let scenes = [setup.scene()];
    let found = |seed| {
        let primal = render(&scenes, &RenderOptions::new(PATH, 2, seed), |_| {
            ControlFlow::Continue(())
        });
        let weights: Vec<f64> = primal.film.mean().iter().map(|v| f64::from(*v)).collect();
        let options = DerivativeOptions {
            integrator: PATH,
            samples: 2,
            seed,
            decomposition: Decomposition::default(),
            hide_emitters: false,
            parameters: &emitters,
            weights: &weights,
        };
        let found = derivatives(&scenes, &options, &Handle::default()).unwrap();
        found.unwrap().by.iter().flat_map(|d| &d.values).sum()
    };
    let all: Vec<f64> = (0..256).map(found).collect();
    let (mean, error) = moments(&all);
    let t = (mean - exact) / error;
    println!("{mean} ± {error}, exact {exact}, t = {t}");
    assert!(t.abs() < MOST, "{mean} ± {error}, exact {exact}");
}

/// A camera inside a ball that absorbs sees the sky through a length 1 of it: exp(−μ). A ball that does not absorb looks like the
/// sky whatever it scatters.
#[test]
fn closed_forms() {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let white = vec![1.0 / 16.0; 16];
    let scene = |medium: Medium| {
        Scene::builder()
            .film(4, 4)
            .channels(1)
            .camera(Camera::perspective([0.0; 3], [0.0, 0.0, 1.0], 40.0))
            .ambient(Medium::transparent("ambient", Constant::new(1.0)))
            .medium(medium)
            .object(Object::builder("ball", ball.clone()).interior("haze"))
            .emitter(Emitter::constant(1.0))
            .build()
            .unwrap()
    };
    let mut zs = Vec::new();
    for mu in [0.25, 2.0] {
        let ink = Medium::homogeneous("haze", Constant::new(1.0), mu, 0.0);
        for parameter in [
            RadiometricParameter::Absorption(HAZE),
            RadiometricParameter::Extinction(HAZE),
        ] {
            let found = try_by(scene(ink.clone()), &[parameter], 4096, &white).unwrap();
            zs.push((found[0].values[0] + (-mu).exp()) / found[0].errors[0]);
        }
    }
    for index in [
        Field::from(Constant::new(1.0)),
        Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(),
    ] {
        let snow = Medium::homogeneous("haze", index, 2.0, 1.0);
        let snow = snow.with_phase(Phase::henyey_greenstein(0.5).unwrap());
        let parameters = [
            RadiometricParameter::Scattering(HAZE),
            RadiometricParameter::MeanCosine(HAZE),
        ];
        let options = DerivativeOptions {
            integrator: Integrator::Path(PathTracer::default()),
            samples: 4096,
            seed: 1,
            decomposition: Decomposition::default(),
            hide_emitters: false,
            parameters: &parameters,
            weights: &white,
        };
        let found = derivatives(&[scene(snow)], &options, &Handle::default())
            .unwrap()
            .unwrap();
        zs.extend(found.by.iter().map(|d| d.values[0] / d.errors[0]));
    }
    println!("{zs:?}");
    max_abs_z(&zs, 1e-4).unwrap();
}

#[test]
fn results_do_not_depend_on_threads() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::Voxels(GridFilter::Trilinear));
    let all = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| by(setup.scene(), &IN_MEDIA[..4], 16))
    });
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0][0].shape, [2, 2, 2, 2]);
}

#[test]
fn what_has_no_derivative_is_refused() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::One);
    let refused = |setup: &Setup, parameter, weights: &[f64], samples| {
        try_by(setup.scene(), &[parameter], samples, weights)
            .unwrap_err()
            .to_string()
    };
    let clear = Setup {
        extinction: vec![[0.0, 1.0]],
        ..setup.clone()
    };
    let message = refused(
        &clear,
        RadiometricParameter::Scattering(HAZE),
        &weights(),
        4,
    );
    assert!(
        message.contains("sigma_t of 'haze' is zero") && message.contains("sigma_a"),
        "{message}"
    );
    assert!(
        try_by(
            clear.scene(),
            &[RadiometricParameter::Absorption(HAZE)],
            4,
            &weights()
        )
        .is_ok()
    );
    let black = Setup {
        reflectance: vec![[0.5, 0.0]],
        ..setup.clone()
    };
    let message = refused(
        &black,
        RadiometricParameter::Reflectance(WALL),
        &weights(),
        4,
    );
    assert!(
        message.contains("the reflectance of 'wall' is zero"),
        "{message}"
    );
    let message = refused(&setup, RadiometricParameter::Reflectance(0), &weights(), 4);
    assert!(message.contains("'ball' has no reflectance"), "{message}");
    let message = refused(&setup, RadiometricParameter::MeanCosine(0), &weights(), 4);
    assert!(message.contains("phase function of 'ambient'"), "{message}");
    let message = refused(
        &setup,
        RadiometricParameter::Emission(0),
        &weights()[1..],
        4,
    );
    assert!(message.contains("expected 32 weights"), "{message}");
    let message = refused(
        &setup,
        RadiometricParameter::Emission(0),
        &[f64::NAN; 32],
        4,
    );
    assert!(message.contains("weight 0 is not finite"), "{message}");
    let message = refused(&setup, RadiometricParameter::Emission(0), &weights(), 1);
    assert!(message.contains("at least two samples"), "{message}");
    let twice = [RadiometricParameter::Emission(0); 2];
    assert_eq!(
        try_by(setup.scene(), &twice, 4, &weights()).unwrap_err(),
        DerivativeError::Twice
    );
}
