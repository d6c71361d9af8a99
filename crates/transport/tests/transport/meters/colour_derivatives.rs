//! Derivatives of readings with respect to colours that particles meet. Light that has met a colour
//! m times is proportional to its mth power, particle by particle: ρ ∂P/∂ρ = m P.

use super::derivatives::by;
use crate::meters::support::*;
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{
    Bsdf, Conductor, Diffuse, Distribution, RoughDielectric, RoughPlastic, Roughness,
    ThinDielectric, Tint,
};
use morgana_transport::derivative::RadiometricParameter;
use morgana_transport::medium::Medium;
use morgana_transport::meter::Meter;
use morgana_transport::render::{Derivative, ReadingFunctional};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Cube, Rectangle};
use std::f64::consts::FRAC_PI_4;

const ALL: RadiometricParameter = RadiometricParameter::Emission(0);

fn rectangle(place: DAffine3, bsdf: Bsdf) -> Object {
    Object {
        sides: None,
        ..container(Rectangle::new(place).unwrap(), bsdf)
    }
}

/// Light of a beam along z.
fn lit(objects: Vec<Object>, media: Vec<Medium>) -> Parts {
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.2);
    parts(objects, media, vec![light], nobody())
}

fn of_power(
    parts: Parts,
    meters: &[Meter],
    meter: usize,
    parameters: &[RadiometricParameter],
) -> Vec<Derivative> {
    let of = ReadingFunctional::Each { meter, reading: 0 };
    by(parts, meters, parameters, of, 400)
}

/// True if ρ ∂P/∂ρ = m P in a bin that is not empty.
fn met(found: &[Derivative], bin: usize, colour: f64, m: f64) -> bool {
    let (power, derivative) = (found[0].values[bin], found[1].values[bin]);
    power > 0.0 && (colour * derivative - m * power).abs() < 1e-9 * power
}

fn facets() -> Roughness {
    Roughness::new(Distribution::Ggx, 0.3).unwrap()
}

/// Tests a pane, a mirror behind it that turns the beam aside, and a black wall.
#[test]
fn light_has_met_the_colours_before_a_meter() {
    let (passed, reflected) = (0.7, 0.4);
    let pane = Bsdf::ThinDielectric(ThinDielectric::new(1.5, 0.3, passed).unwrap());
    let (eta, k) = (Spectrum::splat(0.5), Spectrum::splat(2.0));
    let mirror = Bsdf::Conductor(Conductor::new(eta, k, reflected).unwrap());
    let black = Bsdf::Diffuse(Diffuse::new(0.0).unwrap());
    let turned = DAffine3::from_rotation_y(3.0 * FRAC_PI_4);
    let aside =
        DAffine3::from_translation(DVec3::X * 2.0) * DAffine3::from_rotation_y(-2.0 * FRAC_PI_4);
    let objects = vec![
        rectangle(DAffine3::from_translation(DVec3::NEG_Z), pane),
        rectangle(turned, mirror),
        rectangle(aside, black),
    ];
    let mut meters: Vec<Meter> = (0..3)
        .map(|i| Meter::Irradiance(through(&objects, i, [1; 2], false)))
        .collect();
    // A cell between the mirror and the wall.
    let cell = scaled(DVec3::new(0.5, 1.0, 1.0), DVec3::new(1.0, -0.5, -0.5));
    let coordinates = morgana_transport::meter::Coordinates::Cartesian;
    meters.push(Meter::Fluence(fluence(coordinates, [1; 3], cell)));
    // Numbers of events at the pane, at the mirror, at the wall and in front of it.
    let cases = [
        (0, Tint::SpecularTransmittance, passed, [1.0; 4]),
        (
            1,
            Tint::SpecularReflectance,
            reflected,
            [0.0, 0.0, 1.0, 1.0],
        ),
    ];
    for (object, tint, colour, times) in cases {
        let by_colour = RadiometricParameter::Colour(object, tint);
        for (meter, m) in times.into_iter().enumerate() {
            let parts = lit(objects.clone(), vec![vacuum()]);
            let found = of_power(parts, &meters, meter, &[ALL, by_colour]);
            let bins = 0..found[0].values.len();
            let bin = bins.max_by(|a, b| found[0].values[*a].total_cmp(&found[0].values[*b]));
            assert!(
                met(&found, bin.unwrap(), colour, m),
                "{tint:?} {meter} {found:?}"
            );
        }
    }
}

/// Light enters a block of ground glass once, and leaves it once.
#[test]
fn meters_at_an_interface_see_what_it_lets_pass() {
    let passed = 0.6;
    let ground = RoughDielectric::new(facets(), 0.9, passed).unwrap();
    let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
    let objects = vec![container(cube, Bsdf::RoughDielectric(ground))];
    let meters = [Meter::Irradiance(through(&objects, 0, [1; 2], false))];
    let glass = Medium::transparent("glass", Constant::new(1.5));
    let parts = lit(objects, vec![vacuum(), glass]);
    let by_colour = RadiometricParameter::Colour(0, Tint::SpecularTransmittance);
    let found = of_power(parts, &meters, 0, &[ALL, by_colour]);
    // Side 0 is outside.
    assert!(
        met(&found, 0, passed, 2.0) && met(&found, 1, passed, 1.0),
        "{found:?}"
    );
}

/// Rough plastic reflects in proportion to both its colours together.
#[test]
fn both_colours_of_plastic_add_up() {
    let colours = [0.5, 0.8];
    let plastic = RoughPlastic::new(facets(), true, 1.5, colours[0], colours[1], false);
    let black = Bsdf::Diffuse(Diffuse::new(0.0).unwrap());
    let wall = DAffine3::from_translation(DVec3::Z) * DAffine3::from_rotation_x(4.0 * FRAC_PI_4);
    let screen =
        DAffine3::from_translation(DVec3::NEG_Z * 3.0) * DAffine3::from_scale(DVec3::splat(2.0));
    let objects = vec![
        rectangle(wall, Bsdf::RoughPlastic(plastic.unwrap())),
        rectangle(screen, black),
    ];
    let meters = [Meter::Irradiance(through(&objects, 1, [1; 2], false))];
    let of = [Tint::DiffuseReflectance, Tint::SpecularReflectance];
    let mut parameters = vec![ALL];
    parameters.extend(of.map(|tint| RadiometricParameter::Colour(0, tint)));
    let found = of_power(lit(objects, vec![vacuum()]), &meters, 0, &parameters);
    let sum = |i: usize| colours[0] * found[1].values[i] + colours[1] * found[2].values[i];
    let powers = &found[0].values;
    assert!(powers.iter().any(|p| *p > 0.01), "{found:?}");
    for (i, power) in powers.iter().enumerate() {
        assert!((sum(i) - power).abs() <= 1e-9 * power, "{found:?}");
    }
    assert!(found[1..].iter().all(|d| d.values.iter().any(|v| *v > 0.0)));
}
