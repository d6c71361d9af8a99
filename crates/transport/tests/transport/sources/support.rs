//! Sources for tests.

use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::{AngularProfile, Aperture, BeamProfile, Divergence, Fiber, Slide};
use morgana_transport::scene::Object;
use morgana_transport::shape::Shape;
use morgana_transport::texture::{BitmapFilter, Wrap};

/// False-alarm rate of each family.
pub const FAMILY: f64 = 1.1e-4;

/// Ten times as many samples under `MORGANA_LONG_TESTS`.
pub fn effort(samples: u64) -> u64 {
    match std::env::var_os("MORGANA_LONG_TESTS") {
        Some(_) => 10 * samples,
        None => samples,
    }
}

/// Local +z along `direction`, scaled.
pub fn facing(position: DVec3, direction: DVec3, scale: f64) -> DAffine3 {
    let z = direction.normalize();
    let x = z.any_orthonormal_vector();
    DAffine3 {
        matrix3: DMat3::from_cols(x, z.cross(x), z) * scale,
        translation: position,
    }
}

/// A surface that bounds no medium.
pub fn unseen(shape: impl Into<Shape>) -> Object {
    Object {
        sides: None,
        ..crate::common::container(shape, Bsdf::Null)
    }
}

/// A fibre of unit power at the origin that shines along +z.
pub fn fiber(radius: f64, profile: AngularProfile, divergence: Divergence) -> Fiber {
    let aperture = Aperture::new(DVec3::ZERO, DVec3::Z, BeamProfile::Disc { radius });
    Fiber::new(aperture, profile, divergence, Spectrum::ONE)
}

/// Four pixels of different brightness.
pub fn picture() -> Slide {
    Slide {
        size: [2, 2],
        pixels: [0.5, 3.0, 2.0, 1.0].map(Spectrum::splat).to_vec(),
        filter: BitmapFilter::Nearest,
        wrap: Wrap::Clamp,
    }
}
