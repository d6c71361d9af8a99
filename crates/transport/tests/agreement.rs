//! Path tracing, particle tracing and bidirectional path tracing agree.

mod common;

use common::*;
use eikonal::field::*;
use glam::DVec3;
use transport::Spectrum;
use transport::bsdf::Bsdf;
use transport::emitter::Emitter;
use transport::integrator::{Bdpt, Integrator, ParticleTracer};
use transport::shape::Sphere;

fn three() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

#[test]
fn quick() {
    let ball = || Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let point = Emitter::Point {
        position: DVec3::new(0.5, 0.3, 0.1),
        intensity: Spectrum::ONE,
    };
    let lum: eikonal::Field = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into();
    let one: eikonal::Field = Constant::new(1.0).into();
    for (field, wall) in [(one.clone(), Bsdf::Null), (lum, Bsdf::Null), (Constant::new(1.33).into(), glass())] {
        for emitter in [point.clone(), sky()] {
            for tool in three() {
                let p = parts(
                    vec![container(ball(), wall.clone())],
                    vec![vacuum(), fog(field.clone(), 2.0, 0.8, 0.3)],
                    vec![emitter.clone()],
                    camera(DVec3::Z * 3.0, DVec3::ZERO),
                );
                let t = std::time::Instant::now();
                let r = shoot_by(tool, p, 512, 1);
                let (m, e) = r.film.summary();
                println!("{:?} {:9} {m:.5} ± {e:.5} {:?} {:?}", wall, tool.name(), t.elapsed(), r.stats.connections);
            }
        }
    }
}
