//! Derivatives with respect to colours of smooth and rough surfaces of all kinds, which light meets
//! at vertices, on edges, and on connections.

use super::setup::two;
use super::*;
use crate::differences::BATCHES;
use eikonal::field::Placement;
use glam::{DAffine2, DAffine3};
use morgana_transport::bsdf::{
    BlendBsdf, Bsdf, Coating, CoatingParameters, Conductor, Dielectric, Diffuse, Distribution,
    FilterElement, GlossyDiffuse, GlossyLobe, Mask, NormalMap, NormalSource, Plastic,
    PolarizedPlastic, PolarizingFilter, RoughDielectric, RoughDiffuse, RoughPlastic, Roughness,
    ThinDielectric, Tint, TwoSided, fresnel,
};
use morgana_transport::emitter::{Emitter, VolumeLight};
use morgana_transport::integrator::{Bdpt, ParticleTracer};
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::Object;
use morgana_transport::sensor::Camera;
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid};
use std::sync::Arc;

/// Part of the scene that has the colours.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// The surface of a ball of haze.
    Shell,
    /// A wall behind the ball.
    Wall,
    /// A pane in front of the ball and of the light.
    Pane,
}

/// A surface with one or two colours.
struct Case {
    name: &'static str,
    part: Part,
    tints: &'static [Tint],
    bsdf: fn([Texture; 2]) -> Bsdf,
}

/// Values of each colour, for each pixel in both channels.
type Colours = [Vec<[f64; 2]>; 2];

const SPECULAR: &[Tint] = &[Tint::SpecularReflectance];
const BOTH: &[Tint] = &[Tint::DiffuseReflectance, Tint::SpecularReflectance];
const INTERFACE: &[Tint] = &[Tint::SpecularReflectance, Tint::SpecularTransmittance];

fn facets(alpha: f64) -> Roughness {
    Roughness::new(Distribution::Ggx, alpha).unwrap()
}

/// A metal with the tint `colour`.
fn mirror(colour: Texture) -> Bsdf {
    let (eta, k) = (two([0.6, 0.8]), two([1.6, 2.4]));
    Bsdf::Conductor(Conductor::new(eta, k, colour).unwrap())
}

fn diffuse(colour: Texture) -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(colour).unwrap())
}

fn coated(roughness: Option<Roughness>, nested: Bsdf, specular_reflectance: Texture) -> Bsdf {
    let parameters = CoatingParameters {
        eta: 1.8,
        sigma_a: Texture::from(0.2),
        thickness: 1.0,
        specular_reflectance,
        roughness,
    };
    Bsdf::Coating(Box::new(Coating::new(parameters, nested).unwrap()))
}

fn on_wall() -> Vec<Case> {
    let case = |name, tints, bsdf| Case {
        name,
        part: Part::Wall,
        tints,
        bsdf,
    };
    vec![
        case("mirror", SPECULAR, |[a, _]| mirror(a)),
        case("two-sided mirror", SPECULAR, |[a, _]| {
            Bsdf::TwoSided(TwoSided::new(mirror(a.clone()), mirror(a)).unwrap())
        }),
        case("masked mirror", SPECULAR, |[a, _]| {
            Bsdf::Mask(Mask::new(0.75, mirror(a)).unwrap())
        }),
        case("leaning mirror", SPECULAR, |[a, _]| {
            let normals = Texture::Uniform(Spectrum([0.6, 0.55, 0.95, 0.0]));
            let source = NormalSource::Normals(normals);
            let map = NormalMap::new(source, false, false, mirror(a));
            Bsdf::NormalMap(Box::new(map.unwrap()))
        }),
        case("plastic", BOTH, |[a, b]| {
            Bsdf::Plastic(Plastic::new(1.9, a, b, true).unwrap())
        }),
        case("rough plastic", BOTH, |[a, b]| {
            let plastic = RoughPlastic::new(facets(0.4), true, 1.9, a, b, true);
            Bsdf::RoughPlastic(plastic.unwrap())
        }),
        case("polarised plastic", BOTH, |[a, b]| {
            Bsdf::PolarizedPlastic(PolarizedPlastic::new(facets(0.4), 1.9, a, b).unwrap())
        }),
        case("rough diffuse", &[Tint::Reflectance], |[a, _]| {
            Bsdf::RoughDiffuse(RoughDiffuse::new(a, 0.6, false).unwrap())
        }),
        case("phong", BOTH, |[a, b]| {
            let lobe = GlossyLobe::Phong(Texture::from(8.0));
            Bsdf::GlossyDiffuse(Box::new(GlossyDiffuse::new(lobe, a, b).unwrap()))
        }),
        case(
            "rough coating",
            &[Tint::Reflectance, Tint::SpecularReflectance],
            |[a, b]| coated(Some(facets(0.4)), diffuse(a), b),
        ),
        case("smooth coating", &[Tint::Reflectance], |[a, _]| {
            coated(None, diffuse(a), Texture::from(0.8))
        }),
        case(
            "blend",
            &[Tint::Reflectance, Tint::SpecularReflectance],
            |[a, b]| Bsdf::Blend(BlendBsdf::new(0.6, diffuse(a), mirror(b)).unwrap()),
        ),
    ]
}

fn on_the_way() -> Vec<Case> {
    let case = |name, part, tints, bsdf| Case {
        name,
        part,
        tints,
        bsdf,
    };
    let thin = |[a, b]: [Texture; 2]| Bsdf::ThinDielectric(ThinDielectric::new(2.2, a, b).unwrap());
    vec![
        case("pane", Part::Pane, INTERFACE, thin),
        case("thin shell", Part::Shell, INTERFACE, thin),
        case("filter", Part::Pane, &[Tint::Transmittance], |[a, _]| {
            let filter = PolarizingFilter::new(FilterElement::Neutral, a);
            Bsdf::Filter(Box::new(filter.unwrap()))
        }),
        case("glass", Part::Shell, INTERFACE, |[a, b]| {
            let [a, b] = [a, b].map(|colour| match colour {
                Texture::Uniform(value) => value,
                _ => panic!("one colour"),
            });
            Bsdf::Dielectric(Dielectric::new(a, b).unwrap())
        }),
        case("ground glass", Part::Shell, INTERFACE, |[a, b]| {
            Bsdf::RoughDielectric(RoughDielectric::new(facets(0.3), a, b).unwrap())
        }),
    ]
}

impl Case {
    fn parameters(&self) -> Vec<RadiometricParameter> {
        let object = self.part as usize;
        let each = self.tints.iter();
        each.map(|tint| RadiometricParameter::Colour(object, *tint))
            .collect()
    }

    /// Four pixels per colour; smooth glass has a single colour. Colours of two parts that share
    /// the light add up to less than 1.
    fn colours(&self) -> Colours {
        let count = if self.name == "glass" { 1 } else { 4 };
        let scale = if self.name == "phong" { 0.5 } else { 1.0 };
        let all = [
            [[0.5, 0.8], [0.3, 0.4], [0.7, 0.2], [0.6, 0.5]],
            [[0.9, 0.6], [0.7, 0.8], [0.5, 0.9], [0.8, 0.7]],
        ];
        let scaled = |pixel: &[f64; 2]| pixel.map(|v| scale * v);
        all.map(|pixels| pixels[..count].iter().map(scaled).collect())
    }

    fn bsdf(&self, colours: &Colours) -> Bsdf {
        let texture = |pixels: &Vec<[f64; 2]>| match pixels[..] {
            [one] => two(one).into(),
            _ => {
                let data = pixels.iter().flatten().map(|v| *v as f32).collect();
                let (filter, wrap) = (BitmapFilter::Bilinear, Wrap::Clamp);
                let bitmap = Bitmap::new([2; 2], 2, data, filter, wrap, DAffine2::IDENTITY);
                Texture::Bitmap(Arc::new(bitmap.unwrap()))
            }
        };
        (self.bsdf)(colours.each_ref().map(texture))
    }

    /// A ball of haze in front of a wall, lit by a point light and a dim sky, seen through a pane.
    fn scene(&self, colours: &Colours) -> Scene {
        let on = |part, bsdf: Bsdf| {
            if self.part == part {
                self.bsdf(colours)
            } else {
                bsdf
            }
        };
        let square = |z: f64, size: f64| {
            let place = DAffine3::from_translation(DVec3::Z * z)
                * DAffine3::from_rotation_y(std::f64::consts::PI)
                * DAffine3::from_scale(DVec3::splat(size));
            Rectangle::new(place).unwrap()
        };
        // A pane has equal indices on both sides.
        let index: Field = if self.name == "thin shell" {
            Constant::new(1.0).into()
        } else {
            LinearIndex::new(1.35, DVec3::Y * 0.1, DVec3::NEG_Y)
                .unwrap()
                .into()
        };
        let haze = Medium::homogeneous("haze", index, 0.8, 0.8)
            .with_phase(Phase::henyey_greenstein(0.4).unwrap());
        let ball = Object::builder("ball", Sphere::around(DVec3::ZERO, 1.0).unwrap());
        let ball = ball.interior("haze").bsdf(on(Part::Shell, Bsdf::Null));
        let wall = Object::builder("wall", square(1.5, 2.0));
        let pane = Object::builder("pane", square(-1.3, 1.2));
        Scene::builder()
            .film(4, 4)
            .channels(2)
            .camera(Camera::perspective([0.0, 0.0, -4.0], [0.0; 3], 30.0))
            .medium(haze)
            .object(ball)
            .object(wall.bsdf(on(Part::Wall, diffuse(Texture::from(0.6)))))
            .object(pane.bsdf(on(Part::Pane, Bsdf::Null)))
            .emitter(Emitter::point([0.6, 0.7, -1.7], two([20.0, 10.0])))
            .emitter(Emitter::constant(0.5))
            .build()
            .unwrap()
    }
}

fn integrators() -> [Integrator; 3] {
    let (max_depth, rr_depth) = (Some(6), 4);
    [
        PATH,
        Integrator::Particle(ParticleTracer {
            max_depth,
            rr_depth,
        }),
        Integrator::Bdpt(Bdpt {
            max_depth,
            rr_depth,
            ..Bdpt::default()
        }),
    ]
}

/// Compares each integrator with differences of its own images, because not all integrators find
/// all light.
fn compare(cases: &[Case], integrators: &[Integrator]) {
    let mut comparisons = Comparisons::default();
    let many = if long() { 32 * BATCHES } else { BATCHES };
    for case in cases {
        for integrator in integrators {
            let (parameters, colours) = (case.parameters(), case.colours());
            let scene = case.scene(&colours);
            let all = try_with(*integrator, scene, &parameters, 16 * many, &weights()).unwrap();
            for (k, found) in all.iter().enumerate() {
                let direction = direction(colours[k].len(), 1.0);
                let losses = |h: f64| {
                    let mut colours = colours.clone();
                    for (pixel, d) in colours[k].iter_mut().zip(&direction) {
                        *pixel = [pixel[0] + h * d[0], pixel[1] + h * d[1]];
                    }
                    let scene = case.scene(&colours);
                    differences::losses(*integrator, scene, 8 * many, &weights())
                };
                let step = 0.05;
                let exact = differences::quotient([-step, step].map(losses), step);
                let tint = case.tints[k].name();
                let what = format!("{} {tint} {}", case.name, integrator.name());
                comparisons.see(&what, along(found, &direction), exact);
            }
        }
    }
    comparisons.check();
}

#[test]
fn derivatives_by_the_colours_of_walls_are_differences() {
    let (mut all, [path, particle, bdpt]) = (on_wall(), integrators());
    compare(&all, &[path]);
    // Keep a mirror, whose light is on edges, and plastics, whose light is at vertices.
    all.retain(|case| ["mirror", "plastic", "rough plastic"].contains(&case.name));
    compare(&all, &[particle, bdpt]);
}

#[test]
fn derivatives_by_the_colours_of_what_light_passes_are_differences() {
    compare(&on_the_way(), &integrators());
}

/// Light that a camera sees by way of a surface in front of it, across its view.
fn seen(
    light: impl Into<Emitter>,
    bsdf: Bsdf,
    parameters: &[RadiometricParameter],
    integrator: Integrator,
) -> Closed {
    let place = DAffine3::from_translation(DVec3::Z * 2.0)
        * DAffine3::from_rotation_y(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(10.0));
    let wall = Object::builder("wall", Rectangle::new(place).unwrap());
    let scene = Scene::builder()
        .film(4, 4)
        .channels(2)
        .camera(Camera::perspective([0.0; 3], [0.0, 0.0, 1.0], 30.0))
        .object(wall.bsdf(bsdf))
        .emitter(light)
        .build()
        .unwrap();
    let mut all = vec![RadiometricParameter::Exposure];
    all.extend(parameters);
    let mut found = try_with(integrator, scene, &all, 32, &weights()).unwrap();
    let image = found.remove(0).values;
    Closed {
        image: [image[0], image[1]],
        by: found,
    }
}

/// Loss in both channels, and its derivatives.
struct Closed {
    image: [f64; 2],
    by: Vec<Derivative>,
}

/// Light that met a colour ρ once is proportional to ρ: ∂I/∂ρ = I/ρ, path by path. Derivatives by
/// reflected and transmitted light add up.
#[test]
fn light_that_met_a_colour_once_is_in_proportion_to_it() {
    let (one, other) = ([0.7, 0.3], [0.25, 0.9]);
    let [a, b] = [one, other].map(|colour| Texture::from(two(colour)));
    let wall = |tint| RadiometricParameter::Colour(0, tint);
    let thin = ThinDielectric::new(1.8, a.clone(), b.clone()).unwrap();
    let glass = Dielectric::new(two(one), two(other)).unwrap();
    let plastic = Plastic::new(1.8, b.clone(), a.clone(), false).unwrap();
    let cases: [(Bsdf, &[Tint]); 4] = [
        (mirror(a), SPECULAR),
        (Bsdf::ThinDielectric(thin), INTERFACE),
        (Bsdf::Dielectric(glass), INTERFACE),
        (
            Bsdf::Plastic(plastic),
            &[Tint::SpecularReflectance, Tint::DiffuseReflectance],
        ),
    ];
    for (bsdf, tints) in cases {
        let parameters: Vec<_> = tints.iter().map(|tint| wall(*tint)).collect();
        for integrator in integrators() {
            let sky = Emitter::constant(1.0);
            let found = seen(sky, bsdf.clone(), &parameters, integrator);
            for c in 0..2 {
                let parts = found.by.iter().zip([one, other]);
                let sum: f64 = parts.map(|(by, colour)| colour[c] * by.values[c]).sum();
                let image = found.image[c];
                let is_seen = image != 0.0 || integrator.name() == "particle";
                assert!(
                    is_seen && close(sum, image, image.abs()),
                    "{} {image} {sum} {bsdf:?}",
                    integrator.name()
                );
            }
        }
    }
}

/// ∂I/∂ρ = I/ρ also for the light of a volume behind the camera, reflected at a vertex by a coat
/// over a black base.
#[test]
fn what_a_coat_shows_of_volumes_is_in_proportion_to_its_colour() {
    let cube = DAffine3::from_translation(DVec3::new(-2.0, -2.0, -5.0))
        * DAffine3::from_scale(DVec3::splat(4.0));
    let samples = GridSamples {
        size: [1; 3],
        channels: 1,
        data: vec![1.0],
    };
    let filter = GridFilter::Nearest;
    let grid = VolumeGrid::new(samples, cube, Placement::Centers, filter, [0.0, 1e3]);
    let glow = VolumeLight::new(grid.unwrap(), Spectrum::ONE).unwrap();
    let glow = Emitter::Volume(Arc::new(glow));
    let coat = RadiometricParameter::Colour(0, Tint::SpecularReflectance);
    for integrator in integrators() {
        let plastic = Plastic::new(1.8, Texture::from(0.0), 0.7, false).unwrap();
        let found = seen(glow.clone(), Bsdf::Plastic(plastic), &[coat], integrator);
        let (image, by) = (found.image[0], found.by[0].values[0]);
        let what = format!("{} {image} {by}", integrator.name());
        assert!(
            image != 0.0 && close(0.7 * by, image, image.abs()),
            "{what}"
        );
    }
}

/// ∂I/∂ρ = I/ρ also for light of an emitter in a glass ball on a wall: connections pass its surface
/// once. Longer paths are left out.
#[test]
fn light_through_glass_is_in_proportion_to_its_colour() {
    let colour = [0.7, 0.3];
    let place = DVec3::new(0.0, 0.1, -2.1);
    let ball = Sphere::around(DVec3::NEG_Z * 2.0, 0.5).unwrap();
    let wall = DAffine3::from_translation(DVec3::Z * 2.0)
        * DAffine3::from_rotation_y(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(4.0));
    let glass = Bsdf::Dielectric(Dielectric::new(Spectrum::ONE, two(colour)).unwrap());
    let parameters = [
        RadiometricParameter::Exposure,
        RadiometricParameter::Colour(0, Tint::SpecularTransmittance),
    ];
    let (max_depth, rr_depth) = (Some(3), 4);
    let path = PathTracer {
        max_depth,
        rr_depth,
    };
    let bdpt = Bdpt {
        max_depth,
        rr_depth,
        ..Bdpt::default()
    };
    for integrator in [Integrator::Path(path), Integrator::Bdpt(bdpt)] {
        let ball = Object::builder("ball", ball.clone()).interior("glass");
        let wall = Object::builder("wall", Rectangle::new(wall).unwrap());
        let scene = Scene::builder()
            .film(4, 4)
            .channels(2)
            .camera(Camera::perspective([0.0; 3], [0.0, 0.0, 1.0], 30.0))
            .medium(Medium::transparent("glass", Constant::new(1.4)))
            .object(ball.bsdf(glass.clone()))
            .object(wall.bsdf(diffuse(Texture::from(0.8))))
            .emitter(Emitter::point(place, two([5.0, 2.0])))
            .build()
            .unwrap();
        let found = try_with(integrator, scene, &parameters, 32, &weights()).unwrap();
        for (c, colour) in colour.into_iter().enumerate() {
            let (image, by) = (found[0].values[c], found[1].values[c]);
            let what = format!("{} {image} {by}", integrator.name());
            assert!(
                image != 0.0 && close(colour * by, image, image.abs()),
                "{what}"
            );
        }
    }
}

/// A base below a coat with mean internal reflectance r returns ρ/(1 − ρr). Hence ∂I/∂ρ = I/(ρ (1 −
/// ρr)), path by path.
#[test]
fn a_base_below_a_coat_deepens_with_its_colour() {
    const STEPS: u32 = 100_000;
    let reflected = |i: u32| {
        let cos = (f64::from(i) + 0.5) / f64::from(STEPS);
        2.0 * cos * fresnel::dielectric(cos, 1.5, 1.0).reflectance
    };
    let r = (0..STEPS).map(reflected).sum::<f64>() / f64::from(STEPS);
    for colour in [0.5, 0.9] {
        // Make the coat black, so that only the base is seen.
        let plastic = Plastic::new(1.5, colour, Texture::from(0.0), true).unwrap();
        let parameter = RadiometricParameter::Colour(0, Tint::DiffuseReflectance);
        let sky = Emitter::constant(1.0);
        let found = seen(sky, Bsdf::Plastic(plastic), &[parameter], PATH);
        let exact = found.image[0] / (colour * (1.0 - colour * r));
        let by = found.by[0].values[0];
        assert!((by - exact).abs() < 1e-6 * exact.abs(), "{by} {exact}");
    }
}
