//! Identities of derivatives, path by path or in the mean, and closed forms.

use super::*;
use crate::differences::moments;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::scene::Object;
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Sphere;
use morgana_transport::volume::GridFilter;
use std::ops::ControlFlow;
use testkit::batches::one_sample;
use testkit::z_test::max_abs_z;

/// σ_t ∂/∂σ_t = μ_s ∂/∂μ_s + μ_a ∂/∂μ_a and ∂/∂α = σ_t (∂/∂μ_s − ∂/∂μ_a), path by path, for every
/// number and channel.
#[test]
fn coefficients_obey_the_chain_rule() {
    for made_of in [
        MadeOf::One,
        MadeOf::Labels,
        MadeOf::Voxels(GridFilter::Nearest),
    ] {
        let setup = Setup::new(linear(), made_of);
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

/// A grid of equal samples is equivalent to a homogeneous medium, and its derivatives add up to the
/// derivative by the single number.
#[test]
fn derivatives_by_voxels_add_up() {
    for index in [Field::from(Constant::new(1.0)), linear().into()] {
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

/// The image is linear in emission.
#[test]
fn derivatives_by_emission_add_up_to_the_image() {
    let setup = Setup::new(lens(), MadeOf::One);
    let emitters = [
        RadiometricParameter::Emission(0),
        RadiometricParameter::Emission(1),
    ];
    let found = by(setup.scene(), &emitters, 1024);
    let sum: f64 = found.iter().flat_map(|d| &d.values).sum();
    let error: f64 = found.iter().flat_map(|d| &d.errors).sum();
    let mut comparisons = Comparisons::default();
    let image = moments(&losses(PATH, setup.scene()));
    comparisons.see("sum", (sum, error), image);
    comparisons.check();
}

/// The derivative of Σ image² by a factor on all emission is 2 Σ image², for which the weights are
/// the image itself. With a primal of the same random numbers the result would be larger by the
/// variances.
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
    let p = one_sample(&all, exact, 0.0);
    println!("{:?}, exact {exact}, p = {p}", moments(&all));
    assert!(p > 1e-4, "{:?}, exact {exact}: p = {p}", moments(&all));
}

/// A camera inside an absorbing ball sees the sky through a length of 1: exp(−μ). A ball without
/// absorption looks like the sky, whatever it scatters.
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
    for index in [Field::from(Constant::new(1.0)), lens().into()] {
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
