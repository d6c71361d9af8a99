//! Derivatives with respect to colours of surfaces.

use super::setup::Finish;
use super::*;
use crate::differences::BATCHES;
use morgana_transport::integrator::{Bdpt, ParticleTracer};
use morgana_transport::texture::BitmapFilter;

const BY_COLOURS: [RadiometricParameter; 1] =
    [RadiometricParameter::Colour(WALL, Tint::Reflectance)];

#[test]
fn derivatives_by_colours_of_a_wall_are_differences() {
    for painted in [
        Painted::Pixels(BitmapFilter::Bilinear),
        Painted::Pixels(BitmapFilter::Nearest),
        Painted::Scaled,
        Painted::Squares,
        Painted::Vertices,
        Painted::Triangles,
    ] {
        let mut setup = Setup::new(linear(), MadeOf::One);
        setup.paint(painted);
        compare(&format!("{painted:?}"), &setup, &BY_COLOURS);
        // Equal colours act as a single one: their derivatives add up.
        setup.reflectance.fill([0.5, 0.75]);
        let many = by(setup.scene(), &BY_COLOURS, 64).remove(0);
        let shape: &[usize] = match painted {
            Painted::Pixels(_) | Painted::Scaled => &[2, 2, 2],
            Painted::Vertices => &[4, 2],
            _ => &[2, 2],
        };
        assert_eq!(many.shape, shape);
        let is_mesh = matches!(painted, Painted::Vertices | Painted::Triangles);
        setup.paint(if is_mesh { Painted::Mesh } else { Painted::One });
        setup.reflectance.fill([0.5, 0.75]);
        let one = by(setup.scene(), &BY_COLOURS, 64).remove(0);
        for c in 0..2 {
            let sum: f64 = many.values.iter().skip(c).step_by(2).sum();
            let size = one.values[c].abs() + one.errors[c];
            assert!(close(sum, one.values[c], size), "{painted:?}: {sum}");
        }
    }
}

/// All three integrators agree for a wall of each kind, painted with pixels.
#[test]
fn derivatives_by_colours_of_metals_masks_and_normal_maps_are_differences() {
    let (max_depth, rr_depth) = (Some(6), 4);
    let particle = ParticleTracer {
        max_depth,
        rr_depth,
    };
    let bdpt = Bdpt {
        max_depth,
        rr_depth,
        ..Bdpt::default()
    };
    let mut comparisons = Comparisons::default();
    for finish in [
        Finish::Metal(0.3),
        Finish::Metal(0.7),
        Finish::Mask,
        Finish::Leaning,
    ] {
        let mut setup = Setup::new(linear(), MadeOf::One);
        setup.paint(Painted::Pixels(BitmapFilter::Bilinear));
        setup.finish = finish;
        let direction = direction(4, 1.0);
        let tint = match finish {
            Finish::Metal(_) => Tint::SpecularReflectance,
            _ => Tint::Reflectance,
        };
        let parameters = [RadiometricParameter::Colour(WALL, tint)];
        let exact = difference(&setup, parameters[0], &direction, 0.05);
        for integrator in [PATH, Integrator::Particle(particle), Integrator::Bdpt(bdpt)] {
            let samples = 32 * if long() { BATCHES * 32 } else { BATCHES };
            let found = try_with(integrator, setup.scene(), &parameters, samples, &weights());
            let found = along(&found.unwrap()[0], &direction);
            comparisons.see(&format!("{finish:?} {}", integrator.name()), found, exact);
        }
    }
    comparisons.check();
}
