//! Derivatives of images by light tracing and bidirectional path tracing, compared with path
//! tracing and with differences of their own images. Densities and weights of paths differ among
//! the three and must not be differentiated; the factors at connections differ, too.

use super::*;
use morgana_transport::Bins;
use morgana_transport::film::Filter;
use morgana_transport::integrator::{Bdpt, Connections, ParticleTracer};
use morgana_transport::volume::GridFilter;

const PARTICLE: Integrator = Integrator::Particle(ParticleTracer {
    max_depth: Some(6),
    rr_depth: 4,
});

fn bdpt(connections: Connections) -> Integrator {
    Integrator::Bdpt(Bdpt {
        max_depth: Some(6),
        rr_depth: 4,
        connections,
        ..Bdpt::default()
    })
}

fn fields() -> [(&'static str, Field); 3] {
    [
        ("straight", Constant::new(1.0).into()),
        ("linear", linear().into()),
        ("lens", lens().into()),
    ]
}

const ALL: [RadiometricParameter; 9] = [
    RadiometricParameter::Extinction(HAZE),
    RadiometricParameter::Albedo(HAZE),
    RadiometricParameter::Absorption(HAZE),
    RadiometricParameter::Scattering(HAZE),
    RadiometricParameter::MeanCosine(HAZE),
    RadiometricParameter::Colour(WALL, Tint::Reflectance),
    RadiometricParameter::Emission(LIGHT),
    RadiometricParameter::Radiance(1),
    RadiometricParameter::Exposure,
];

/// Compares all numbers of all parameters with path tracing, and a few directions with differences.
fn check(name: &str, integrator: Integrator, setup: &Setup, parameters: &[RadiometricParameter]) {
    let samples = if long() {
        1 << 15
    } else {
        crate::common::samples(512, 128)
    };
    let of =
        |integrator| try_with(integrator, setup.scene(), parameters, samples, &weights()).unwrap();
    let (by_path, own) = (of(PATH), of(integrator));
    let mut comparisons = Comparisons::default();
    let mut judge = |what: String, a: Mean, b: Mean| {
        comparisons.see(&format!("{name} {what}"), a, b);
    };
    for ((parameter, a), b) in parameters.iter().zip(&own).zip(&by_path) {
        assert_eq!(a.shape, b.shape);
        for i in 0..a.values.len() {
            let of = |d: &Derivative| (d.values[i], d.errors[i]);
            judge(format!("{parameter:?} {i}"), of(a), of(b));
        }
    }
    for (parameter, derivative) in parameters.iter().zip(&own).take(1) {
        let direction = direction(derivative.values.len() / 2, 1.0);
        let exact = quotient(integrator, 0.05, |h| {
            setup.changed(*parameter, &direction, h).scene()
        });
        judge(
            format!("{parameter:?} by difference"),
            along(derivative, &direction),
            exact,
        );
    }
    comparisons.check();
}

#[test]
fn derivatives_by_light_tracing_are_those_by_path_tracing() {
    for (name, field) in fields() {
        check(name, PARTICLE, &Setup::new(field, MadeOf::One), &ALL);
    }
}

#[test]
fn derivatives_by_bidirectional_path_tracing_are_those_by_path_tracing() {
    for (name, field) in fields() {
        let setup = Setup::new(field, MadeOf::One);
        check(name, bdpt(Connections::Resampled), &setup, &ALL);
        if name == "lens" {
            check("all in a lens", bdpt(Connections::All), &setup, &ALL);
        }
    }
}

#[test]
fn derivatives_by_voxels_and_labels_are_those_by_path_tracing() {
    let (_, field) = fields()[1].clone();
    for made_of in [
        MadeOf::Labels,
        MadeOf::Voxels(GridFilter::Nearest),
        MadeOf::Voxels(GridFilter::Trilinear),
    ] {
        let setup = Setup::new(field.clone(), made_of);
        for integrator in [PARTICLE, bdpt(Connections::Resampled)] {
            let name = format!("{} {made_of:?}", integrator.name());
            check(&name, integrator, &setup, &IN_MEDIA[..2]);
        }
    }
}

/// Particles contribute to all pixels that a filter reaches, and to the layer of their length.
#[test]
fn splats_count_by_filter_and_layer() {
    let decomposition = Decomposition {
        length: Some(Bins {
            min: 4.0,
            max: 16.0,
            count: 3,
        }),
        ..Decomposition::default()
    };
    let layers = decomposition.layers();
    let setup = Setup::new(lens(), MadeOf::One);
    let scene = setup.builder().filter(Filter::Gaussian { stddev: 0.5 });
    let scenes = [scene.build().unwrap()];
    let weights: Vec<f64> = (0..layers)
        .flat_map(|layer| weights().into_iter().map(move |w| w * (layer as f64 - 1.2)))
        .collect();
    let parameters = [
        RadiometricParameter::Extinction(HAZE),
        RadiometricParameter::Exposure,
    ];
    let by = |integrator| {
        let options = DerivativeOptions {
            integrator,
            samples: 2048,
            seed: 1,
            decomposition,
            hide_emitters: false,
            parameters: &parameters,
            weights: &weights,
        };
        let found = derivatives(&scenes, &options, &Handle::default());
        found.unwrap().unwrap().by
    };
    let path = by(PATH);
    let mut comparisons = Comparisons::default();
    for integrator in [PARTICLE, bdpt(Connections::Resampled)] {
        for (a, b) in by(integrator).iter().zip(&path) {
            for i in 0..2 {
                let of = |d: &Derivative| (d.values[i], d.errors[i]);
                comparisons.see(integrator.name(), of(a), of(b));
            }
        }
    }
    comparisons.check();
}

#[test]
fn integrators_that_blur_are_refused() {
    use morgana_transport::integrator::{PhotonMapping, Vcm};
    let setup = Setup::new(Constant::new(1.0), MadeOf::One);
    for integrator in [
        Integrator::Photon(PhotonMapping::default()),
        Integrator::Vcm(Vcm::default()),
    ] {
        let found = try_with(integrator, setup.scene(), &ALL, 4, &weights());
        let message = found.unwrap_err().to_string();
        assert!(message.contains(integrator.name()), "{message}");
    }
}

#[test]
fn results_of_bdpt_do_not_depend_on_threads() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::Voxels(GridFilter::Trilinear));
    let all = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let integrator = bdpt(Connections::Resampled);
        pool.install(|| {
            try_with(integrator, setup.scene(), &IN_MEDIA[..4], 16, &weights()).unwrap()
        })
    });
    assert_eq!(all[0], all[1]);
}
