//! Rayleigh scattering: once in closed form, often against electric fields that are followed from the sun.

use crate::field::Coherency;
use crate::slab::{Field, Scatterer, TRAVELS, assert_fields_agree, slab};
use crate::{assert_alike, horizontal, polarized, stokes};
use glam::DVec3;
use morgana_transport::phase::Phase;

#[test]
fn single_scattering_polarises_across_its_plane() {
    for (view, up) in [
        (DVec3::new(0.0, 0.0, -1.0), DVec3::X),
        (DVec3::new(0.3, 0.5, -0.4), DVec3::Z),
        (DVec3::new(-0.8, 0.0, -0.6), DVec3::new(0.0, 1.0, 0.2)),
        (DVec3::new(0.1, -0.7, -0.3), DVec3::new(0.2, 1.0, 1.0)),
    ] {
        let view = view.normalize();
        let found = stokes(&polarized(
            &slab(0.3, Phase::rayleigh(), view, up),
            Some(2),
            64,
            1,
        ));
        let field = Coherency::unpolarized(TRAVELS).scattered(-view);
        assert_alike(found, field.stokes(-view, horizontal(view, up)), 1e-6);
    }
}

/// Radiates what a field has across the direction.
struct Dipole;

impl Scatterer for Dipole {
    fn scattered(&self, field: Field, _: DVec3, to: DVec3) -> Field {
        Field {
            re: field.re.reject_from_normalized(to),
            im: field.im.reject_from_normalized(to),
        }
    }

    fn mean(&self) -> f64 {
        2.0 / 3.0
    }
}

/// Intensity and polarisation of a slab in which light is scattered a few times, where unpolarised scattering errs by several per cent.
#[test]
fn slabs_agree_with_electric_fields() {
    assert_fields_agree(&Phase::rayleigh(), &Dipole, 400_000, 0.004);
}
