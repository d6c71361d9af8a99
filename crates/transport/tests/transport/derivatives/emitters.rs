//! Derivatives with respect to the parameters of emitters: spectra, pixels of images, voxels, and
//! emission of media. The image is linear in them, so that differences have no error except noise.

use super::*;
use crate::common::{camera, container, parts, vacuum};
use eikonal::field::Placement;
use glam::{DAffine2, DAffine3, DMat3};
use morgana_transport::Orientation;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Environment, Fiber,
    Projector, Slide, Spot, TexturedArea, VolumeLight,
};
use morgana_transport::integrator::{Bdpt, ParticleTracer};
use morgana_transport::medium::{Medium, MediumLabel, MediumLabels};
use morgana_transport::phase::Phase;
use morgana_transport::scene::Object;
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Checkerboard, Texture, Wrap};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use std::sync::Arc;

/// An emitter with a number of values per channel.
struct Case {
    name: &'static str,
    shape: &'static [usize],
    light: fn(&[[f64; 2]]) -> Light,
}

enum Light {
    Emitter(Box<Emitter>),
    /// Texture of the panel.
    Texture(Texture),
    /// Emission of the haze.
    Medium(VolumeTexture),
    /// Emission of the haze's two labels.
    Labels(Vec<Spectrum>),
}

fn lit_by(emitter: Emitter) -> Light {
    Light::Emitter(Box::new(emitter))
}

fn case(name: &'static str, shape: &'static [usize], light: fn(&[[f64; 2]]) -> Light) -> Case {
    Case { name, shape, light }
}

fn flat(values: &[[f64; 2]]) -> Vec<f32> {
    values.iter().flatten().map(|v| *v as f32).collect()
}

fn bitmap(values: &[[f64; 2]], filter: BitmapFilter) -> Texture {
    let (data, wrap) = (flat(values), Wrap::Mirror);
    let bitmap = Bitmap::new([3, 2], 2, data, filter, wrap, DAffine2::IDENTITY);
    Texture::Bitmap(Arc::new(bitmap.unwrap()))
}

fn voxels(values: &[[f64; 2]], filter: GridFilter) -> VolumeGrid {
    let cube = DAffine3::from_translation(DVec3::NEG_ONE) * DAffine3::from_scale(DVec3::splat(2.0));
    let samples = GridSamples {
        size: [2, 1, 2],
        channels: 2,
        data: flat(values),
    };
    VolumeGrid::new(samples, cube, Placement::Centers, filter, [0.0, 1e3]).unwrap()
}

/// Orientation of an emitter that shines from above towards the haze.
fn downwards() -> Orientation {
    let turn = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
    Orientation::nearest(turn).unwrap().0
}

const ABOVE: DVec3 = DVec3::new(0.2, 2.5, -0.3);

const PICTURE: [f64; 2] = [1.2, 0.8];

/// An aperture with an image.
fn picture(values: &[[f64; 2]], filter: BitmapFilter) -> Aperture {
    let slide = Slide {
        size: [3, 2],
        pixels: values.iter().map(|v| two(*v)).collect(),
        filter,
        wrap: Wrap::Clamp,
    };
    Aperture::picture(ABOVE, downwards(), PICTURE, slide).unwrap()
}

fn cases() -> Vec<Case> {
    vec![
        case("point", &[], |v| lit_by(Emitter::point(ABOVE, two(v[0])))),
        case("constant", &[], |v| lit_by(Emitter::constant(two(v[0])))),
        case("area", &[], |v| Light::Texture(two(v[0]).into())),
        case("directional", &[], |v| {
            lit_by(Emitter::Directional {
                direction: DVec3::new(0.0, -0.6, 0.8),
                irradiance: two(v[0]),
            })
        }),
        case("beam", &[], |v| {
            let profile = BeamProfile::Disc { radius: 0.5 };
            let beam = Collimated::new(ABOVE, DVec3::NEG_Y, profile, two(v[0]));
            lit_by(beam.into())
        }),
        case("fibre", &[], |v| {
            let aperture = Aperture::new(ABOVE, DVec3::NEG_Y, BeamProfile::Disc { radius: 0.3 });
            let angle = Divergence::HalfAngle(0.5);
            lit_by(Fiber::new(aperture, AngularProfile::Lambertian, angle, two(v[0])).into())
        }),
        case("spot", &[2, 3], |v| {
            let spot = Spot::new(ABOVE, DVec3::NEG_Y, Spectrum::splat(20.0), 0.5, 0.3);
            let thrown = spot.with_texture(downwards(), bitmap(v, BitmapFilter::Bilinear));
            lit_by(thrown.unwrap().into())
        }),
        case("projector", &[2, 3], |v| {
            let slide = Slide {
                size: [3, 2],
                pixels: v.iter().map(|v| two(*v)).collect(),
                filter: BitmapFilter::Bilinear,
                wrap: Wrap::Repeat,
            };
            let projector = Projector::new(ABOVE, downwards(), 0.8, slide).unwrap();
            lit_by(Emitter::Projector(Arc::new(projector)))
        }),
        // Give an irradiance where the image is one.
        case("image of a beam", &[2, 3], |v| {
            let half: Vec<[f64; 2]> = v.iter().map(|v| v.map(|v| 0.5 * v)).collect();
            let beam = Collimated::with_irradiance(
                picture(&half, BitmapFilter::Bilinear),
                Spectrum::splat(2.0),
            );
            lit_by(beam.into())
        }),
        // Give a total power, which is the mean irradiance times the area.
        case("image of a fibre", &[2, 3], |v| {
            let mean = [0, 1].map(|c| v.iter().map(|v| v[c]).sum::<f64>() / v.len() as f64);
            let power = two(mean.map(|mean| mean * PICTURE[0] * PICTURE[1]));
            let profile = AngularProfile::Lambertian;
            let aperture = picture(v, BitmapFilter::Nearest);
            let fiber = Fiber::new(aperture, profile, Divergence::HalfAngle(0.5), power);
            lit_by(fiber.into())
        }),
        case("panel", &[2, 3], |v| {
            Light::Texture(bitmap(v, BitmapFilter::Bilinear))
        }),
        case("pixels", &[2, 3], |v| {
            Light::Texture(bitmap(v, BitmapFilter::Nearest))
        }),
        case("checkerboard", &[2], |v| {
            let colours = [two(v[0]), two(v[1])].map(Texture::from);
            let board = Checkerboard::new(colours, DAffine2::IDENTITY);
            Light::Texture(Texture::Checkerboard(Arc::new(board)))
        }),
        case("envmap", &[3, 4], |v| {
            let pixels = v.iter().map(|v| two(*v)).collect();
            let map = Environment::image(4, 3, pixels, Orientation::IDENTITY);
            lit_by(Emitter::Environment(map.unwrap()))
        }),
        case("volume", &[2, 1, 2], |v| {
            let light = VolumeLight::new(voxels(v, GridFilter::Trilinear), Spectrum::ONE);
            lit_by(Emitter::Volume(Arc::new(light.unwrap())))
        }),
        case("medium", &[], |v| {
            Light::Medium(VolumeTexture::Uniform(two(v[0])))
        }),
        case("medium of voxels", &[2, 1, 2], |v| {
            let grid = voxels(v, GridFilter::Nearest);
            Light::Medium(VolumeTexture::Grid(Arc::new(grid)))
        }),
        case("medium of labels", &[2], |v| {
            Light::Labels(v.iter().map(|v| two(*v)).collect())
        }),
    ]
}

impl Case {
    fn values(&self) -> Vec<[f64; 2]> {
        let count = self.shape.iter().product();
        let value = |i: usize| {
            [
                0.5 + 0.25 * (i * 5 % 8) as f64,
                1.0 - 0.1 * (i * 3 % 7) as f64,
            ]
        };
        (0..count).map(value).collect()
    }

    /// A ball of haze in front of a wall.
    fn scene(&self, index: &Field, haze: [f64; 2], values: &[[f64; 2]]) -> Scene {
        let [sigma_t, albedo] = haze;
        let mut medium = Medium::homogeneous("haze", index.clone(), sigma_t, albedo)
            .with_phase(Phase::henyey_greenstein(0.4).unwrap());
        let wall = DAffine3::from_translation(DVec3::Z * 1.5)
            * DAffine3::from_rotation_y(std::f64::consts::PI)
            * DAffine3::from_scale(DVec3::splat(2.0));
        let white = Bsdf::Diffuse(Diffuse::new(Texture::from(0.6)).unwrap());
        let outside = |shape: Shape, bsdf, emitter| Object {
            sides: None,
            emitter,
            ..container(shape, bsdf)
        };
        let mut objects = vec![
            container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null),
            outside(Rectangle::new(wall).unwrap().into(), white, None),
        ];
        let mut emitters = Vec::new();
        match (self.light)(values) {
            Light::Emitter(emitter) => emitters.push(*emitter),
            Light::Texture(texture) => {
                let place = DAffine3::from_translation(DVec3::Y * 1.6)
                    * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
                let panel: Shape = Rectangle::new(place).unwrap().into();
                emitters.push(match texture {
                    Texture::Uniform(radiance) => Emitter::Area {
                        object: 2,
                        radiance,
                    },
                    _ => {
                        let area = TexturedArea::new(2, &panel, texture);
                        Emitter::Textured(Arc::new(area.unwrap()))
                    }
                });
                let black = Bsdf::Diffuse(Diffuse::new(Texture::from(0.0)).unwrap());
                objects.push(outside(panel, black, Some(0)));
            }
            Light::Medium(emission) => medium.emission = Some(emission),
            Light::Labels(emission) => {
                let all = |values: &[Spectrum]| {
                    let grid = VolumeGrid::by_label(Setup::labels(), values, 2);
                    VolumeTexture::Grid(Arc::new(grid.unwrap()))
                };
                let label = |i: usize| MediumLabel {
                    name: i.to_string(),
                    extinction: Spectrum::splat(sigma_t),
                    absorption: Spectrum::splat(sigma_t * (1.0 - albedo)),
                    velocity: None,
                    fluorescence: None,
                };
                medium.labels = MediumLabels::new(Setup::labels(), vec![label(0), label(1)]);
                medium.sigma_t = all(&[Spectrum::splat(sigma_t); 2]);
                medium.albedo = all(&[Spectrum::splat(albedo); 2]);
                medium.emission = Some(all(&emission));
            }
        }
        let sensor = camera(DVec3::new(0.0, 0.5, -4.0), DVec3::ZERO);
        let mut parts = parts(objects, vec![vacuum(), medium], emitters, sensor);
        parts.film.channels = 2;
        Scene::new(parts).unwrap_or_else(|problems| panic!("{}: {problems:?}", self.name))
    }
}

const THIN: [f64; 2] = [0.8, 0.75];
const DEPTH: Option<u32> = Some(6);

fn integrators() -> [Integrator; 3] {
    let rr_depth = 4;
    [
        PATH,
        Integrator::Particle(ParticleTracer {
            max_depth: DEPTH,
            rr_depth,
        }),
        Integrator::Bdpt(Bdpt {
            max_depth: DEPTH,
            rr_depth,
            ..Bdpt::default()
        }),
    ]
}

fn fields() -> [Field; 2] {
    [Constant::new(1.0).into(), linear().into()]
}

#[test]
fn derivatives_by_values_of_emitters_are_differences() {
    let mut comparisons = Comparisons::default();
    for case in cases() {
        for (k, index) in fields().iter().enumerate() {
            let values = case.values();
            // Change one value at a time, so that errors belong to it alone.
            let mut direction = vec![[0.0; 2]; values.len()];
            direction[values.len() / 8][0] = 1.0;
            let exact = quotient(PATH, 0.4, |h| {
                let changed: Vec<[f64; 2]> = values
                    .iter()
                    .zip(&direction)
                    .map(|(v, d)| [v[0] + h * d[0], v[1] + h * d[1]])
                    .collect();
                case.scene(index, THIN, &changed)
            });
            // Compare all three integrators where rays bend.
            for integrator in integrators().into_iter().take(1 + 2 * k) {
                let scene = case.scene(index, THIN, &values);
                let parameters = [RadiometricParameter::Radiance(0)];
                let samples = if long() {
                    1 << 14
                } else {
                    crate::common::samples(512, 128)
                };
                let found = try_with(integrator, scene, &parameters, samples, &weights());
                let found = &found.unwrap()[0];
                assert_eq!(found.shape, [case.shape, &[2]].concat());
                let name = format!("{} {k} {}", case.name, integrator.name());
                comparisons.see(&name, along(found, &direction), exact);
            }
        }
    }
    comparisons.check();
}

/// Values times their derivatives add up to the derivative with respect to a common factor, path by
/// path.
#[test]
fn values_of_emitters_add_up() {
    for case in cases() {
        for integrator in integrators() {
            let values = case.values();
            let scene = case.scene(&fields()[1], THIN, &values);
            let parameters = [
                RadiometricParameter::Radiance(0),
                RadiometricParameter::Emission(0),
                RadiometricParameter::Exposure,
            ];
            let found = try_with(integrator, scene, &parameters, 16, &weights()).unwrap();
            let [all, factor, exposure] = &found[..] else {
                panic!("three derivatives");
            };
            for c in 0..2 {
                let sum: f64 = (0..values.len())
                    .map(|i| values[i][c] * all.values[2 * i + c])
                    .sum();
                let size = factor.values[c].abs() + factor.errors[c];
                // Pixels are stored in single precision.
                let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * size;
                assert!(
                    near(sum, factor.values[c]),
                    "{} {sum} {factor:?}",
                    case.name
                );
                // It is the only emitter.
                assert!(near(factor.values[c], exposure.values[c]), "{}", case.name);
                assert!(factor.values[c] != 0.0, "{}", case.name);
            }
        }
    }
}

/// Media emit in proportion to their absorption.
#[test]
fn media_that_emit_change_with_their_absorption() {
    let medium = &cases()[15];
    assert_eq!(medium.name, "medium");
    let (mut comparisons, values) = (Comparisons::default(), medium.values());
    let [t, a] = THIN;
    type Changed = fn(f64, f64, f64) -> [f64; 2];
    let ways: [(RadiometricParameter, Changed); 4] = [
        (RadiometricParameter::Extinction(HAZE), |t, a, h| [t + h, a]),
        (RadiometricParameter::Albedo(HAZE), |t, a, h| [t, a + h]),
        (RadiometricParameter::Absorption(HAZE), |t, a, h| {
            [t + h, t * a / (t + h)]
        }),
        (RadiometricParameter::Scattering(HAZE), |t, a, h| {
            [t + h, (t * a + h) / (t + h)]
        }),
    ];
    for index in fields() {
        for (parameter, changed) in ways {
            let exact = quotient(PATH, 0.05, |h| {
                medium.scene(&index, changed(t, a, h), &values)
            });
            for integrator in integrators() {
                let scene = medium.scene(&index, THIN, &values);
                let found = try_with(integrator, scene, &[parameter], 1024, &weights()).unwrap();
                let name = format!("{} {parameter:?}", integrator.name());
                comparisons.see(&name, along(&found[0], &[[1.0; 2]]), exact);
            }
        }
    }
    comparisons.check();
    // Without absorption there is no emission, and no path knows the effect of more absorption.
    for parameter in [
        RadiometricParameter::Absorption(HAZE),
        RadiometricParameter::Albedo(HAZE),
    ] {
        let scene = medium.scene(&fields()[0], [0.8, 1.0], &values);
        let found = try_with(PATH, scene, &[parameter], 4, &weights());
        let message = found.unwrap_err().to_string();
        assert!(message.contains("which makes light"), "{message}");
    }
}

#[test]
fn emitters_that_are_black_somewhere_are_refused() {
    for case in cases() {
        let mut values = case.values();
        values[0][1] = 0.0;
        let scene = case.scene(&fields()[0], THIN, &values);
        let found = try_with(
            PATH,
            scene,
            &[RadiometricParameter::Radiance(0)],
            4,
            &weights(),
        );
        assert_eq!(found.unwrap_err(), DerivativeError::Dim(0), "{}", case.name);
    }
}
