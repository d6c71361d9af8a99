//! Emitters and transforms of every kind.

use glam::{DAffine2, DAffine3, DMat3, DVec3};
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, DistantDisc, Divergence, Emission, Emitter,
    Environment, Fiber, Luminaire, Projector, Slide, Spot, Surroundings, TexturedArea,
};
use morgana_transport::sampling::Frame;
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use morgana_transport::{Orientation, Spectrum};
use std::sync::Arc;
use testkit::Rng;

/// False-alarm rate of each family.
pub const FALSE_ALARM: f64 = 1.4e-4;

pub const AROUND: Surroundings = Surroundings {
    center: DVec3::new(3.0, -1.0, 0.5),
    radius: 2.5,
};

/// Half-angles of the spot, in radians.
pub const CUTOFF: f64 = 0.9;
pub const BEAM_WIDTH: f64 = 0.4;

pub fn axis() -> DVec3 {
    DVec3::new(0.48, -0.6, 0.64)
}

pub fn color() -> Spectrum {
    Spectrum([0.5, 1.0, 2.0, 0.0])
}

/// A random map: columns of different lengths at any angles, right- or left-handed, far from
/// singular.
pub fn random_map(rng: &mut Rng) -> DAffine3 {
    loop {
        let mut column = || DVec3::from_array(rng.direction()) * rng.range(-1.5, 1.5).exp();
        let m = DMat3::from_cols(column(), column(), column());
        let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        if m.determinant().abs() > 0.1 * lengths {
            let shift = DVec3::from_array(rng.direction()) * 3.0;
            return DAffine3::from_mat3_translation(m, shift);
        }
    }
}

/// Shapes for area emitters: a parallelogram, an ellipsoid and a sphere.
pub fn shapes() -> [Shape; 3] {
    let rng = &mut Rng::new(11);
    [
        Rectangle::new(random_map(rng)).unwrap().into(),
        Sphere::new(random_map(rng)).unwrap().into(),
        Sphere::around(DVec3::Z, 0.7).unwrap().into(),
    ]
}

pub fn spot(intensity: Spectrum, cutoff: f64, beam_width: f64) -> Emitter {
    Emitter::Spot(Spot::new(DVec3::X, axis(), intensity, cutoff, beam_width))
}

pub fn beam(profile: BeamProfile, power: Spectrum) -> Emitter {
    let origin = DVec3::new(0.3, 0.1, -2.0);
    Emitter::Collimated(Collimated::new(origin, axis(), profile, power))
}

pub const DISC: BeamProfile = BeamProfile::Disc { radius: 0.3 };
pub const GAUSSIAN: BeamProfile = BeamProfile::Gaussian { waist: 0.4 };
/// Width and height of the environment's image.
pub const IMAGE: (usize, usize) = (8, 5);

/// Brightness of a pixel relative to the colour of the environment.
pub fn pixel(i: usize) -> f64 {
    0.25 + ((i * 7) % 5) as f64
}

/// An orientation turned around the axis by an angle in radians.
fn turned(angle: f64) -> Orientation {
    Orientation::nearest(DMat3::from_axis_angle(axis(), angle))
        .unwrap()
        .0
}

fn image(color: Spectrum) -> Environment {
    let pixels = (0..IMAGE.0 * IMAGE.1).map(|i| color * pixel(i)).collect();
    Environment::image(IMAGE.0, IMAGE.1, pixels, turned(1.1)).unwrap()
}

/// Half the angle of a disc in the sky, in radians.
pub const HALF_ANGLE: f64 = 0.3;

/// Angular width of the projector's image, in radians.
pub const FOV: f64 = 1.2;

pub fn projector(color: Spectrum) -> Emitter {
    let thrown = Projector::new(DVec3::X, turned(0.4), FOV, picture(color));
    Emitter::Projector(Arc::new(thrown.unwrap()))
}

fn picture(color: Spectrum) -> Slide {
    Slide {
        size: IMAGE.into(),
        pixels: (0..IMAGE.0 * IMAGE.1).map(|i| color * pixel(i)).collect(),
        filter: BitmapFilter::Bilinear,
        wrap: Wrap::Repeat,
    }
}

/// Centre, width and height of the rectangles of light.
pub const ORIGIN: DVec3 = DVec3::new(0.3, 0.1, -2.0);
pub const SIZE: [f64; 2] = [0.7, 0.4];

/// A rectangle across [`axis`], with or without an image of this colour.
pub fn rectangle(of: Option<Spectrum>) -> Aperture {
    let [width, height] = SIZE;
    match of {
        Some(color) => Aperture::picture(ORIGIN, along_axis(), SIZE, picture(color)).unwrap(),
        None => {
            let profile = BeamProfile::Rectangle { width, height };
            Aperture::oriented(ORIGIN, along_axis(), profile)
        }
    }
}

/// Half-angle of the cone of fibres, in radians.
pub const ACCEPTANCE: f64 = 0.5;

pub fn fiber(profile: AngularProfile, power: Spectrum) -> Fiber {
    let aperture = Aperture::new(ORIGIN, axis(), DISC);
    Fiber::new(aperture, profile, Divergence::HalfAngle(ACCEPTANCE), power)
}

/// The axes of a spot that shines along [`axis`].
pub fn along_axis() -> Orientation {
    let side = axis().any_orthonormal_vector();
    let turn = DMat3::from_cols(side, axis().cross(side), axis());
    Orientation::nearest(turn).unwrap().0
}

/// A spot that projects an image.
pub fn slide(color: Spectrum) -> Emitter {
    let plain = Spot::new(DVec3::X, axis(), color, CUTOFF, BEAM_WIDTH);
    let pixels = (0..IMAGE.0 * IMAGE.1).map(|i| pixel(i) as f32).collect();
    let how = (BitmapFilter::Bilinear, Wrap::Mirror);
    let bitmap = Bitmap::new(IMAGE.into(), 1, pixels, how.0, how.1, DAffine2::IDENTITY);
    let texture = Texture::Bitmap(Arc::new(bitmap.unwrap()));
    plain.with_texture(along_axis(), texture).unwrap().into()
}

/// A ball with an image texture.
fn globe(color: Spectrum) -> Emitter {
    let lit = |i: usize| color.0[..3].iter().map(move |c| (c * pixel(i)) as f32);
    let pixels = (0..IMAGE.0 * IMAGE.1).flat_map(lit).collect();
    let how = (BitmapFilter::Nearest, Wrap::Repeat);
    let bitmap = Bitmap::new(IMAGE.into(), 3, pixels, how.0, how.1, DAffine2::IDENTITY);
    let texture = Texture::Bitmap(Arc::new(bitmap.unwrap()));
    let light = TexturedArea::new(2, &shapes()[2], texture);
    Emitter::Textured(Arc::new(light.unwrap()))
}

/// An emitter whose intensity falls linearly with the polar angle, times a factor with mean 1 over
/// azimuths.
pub fn light(color: Spectrum) -> Emitter {
    let (polar, azimuths) = (vec![0.0, 60.0, 180.0], vec![0.0, 90.0, 180.0, 360.0]);
    let rows = [0.5, 1.0, 1.5, 0.5].map(|f| {
        polar
            .clone()
            .into_iter()
            .map(move |a| f * (1.0 - a / 180.0))
    });
    let values = rows.into_iter().flatten().collect();
    let light = Luminaire::new(DVec3::X, turned(0.4), color, [polar, azimuths], values);
    Emitter::Luminaire(Arc::new(light.unwrap()))
}

/// Returns one emitter of each kind with the given intensity, radiance, irradiance or power.
/// Objects of area emitters are indices into [`shapes`].
pub fn emitters(color: Spectrum) -> Vec<(&'static str, Emitter)> {
    let area = |object| Emitter::Area {
        object,
        radiance: color,
    };
    let mut all = vec![
        (
            "point",
            Emitter::Point {
                position: DVec3::Y,
                intensity: color,
            },
        ),
        ("spot", spot(color, CUTOFF, BEAM_WIDTH)),
        ("slide", slide(color)),
        ("parallelogram", area(0)),
        ("ellipsoid", area(1)),
        (
            "directional",
            Emitter::Directional {
                direction: axis(),
                irradiance: color,
            },
        ),
        (
            "constant",
            Emitter::Environment(Environment::Constant(color)),
        ),
        ("disc beam", beam(DISC, color)),
        ("Gaussian beam", beam(GAUSSIAN, color)),
    ];
    let disc = DistantDisc::new(axis(), HALF_ANGLE, color).unwrap();
    all.push(("sun", Emitter::Environment(Environment::Disc(disc))));
    all.push(("ies", light(color)));
    for (name, aperture) in [
        ("rectangle", rectangle(None)),
        ("picture", rectangle(Some(Spectrum::splat(0.3)))),
    ] {
        all.push((name, Collimated::through(aperture, color).into()));
    }
    for (name, profile) in [
        ("fibre", AngularProfile::Uniform),
        ("Lambertian fibre", AngularProfile::Lambertian),
        ("Gaussian fibre", AngularProfile::Gaussian),
    ] {
        all.push((name, fiber(profile, color).into()));
    }
    let focused = fiber(AngularProfile::Uniform, color).with_focus(0.6);
    all.push(("focused fibre", focused.into()));
    all.push(("globe", globe(color)));
    // Skip images for black: a black image is invalid.
    if !color.is_zero() {
        all.push(("envmap", Emitter::Environment(image(color))));
        all.push(("projector", projector(color)));
    }
    all
}

pub fn emit(emitter: &Emitter, shapes: &[Shape], u: [f64; 4]) -> Option<Emission> {
    emitter.emit(&AROUND, |i| &shapes[i], u)
}

/// Returns the density of a ray, evaluated afterwards.
pub fn pdf_emit(emitter: &Emitter, end: &ConnectionEnd, x: DVec3, direction: DVec3) -> f64 {
    emitter.pdf_emit(&AROUND, end, x, direction)
}

/// Polar coordinates of `x` about the axis through `center` along `direction`.
pub fn polar(x: DVec3, center: DVec3, direction: DVec3) -> [f64; 2] {
    let p = Frame::from_normal(direction).to_local(x - center);
    [p.truncate().length(), p.y.atan2(p.x)]
}

/// The point with given polar coordinates in the plane through `center` across `direction`.
pub fn from_polar([r, phi]: [f64; 2], center: DVec3, direction: DVec3) -> DVec3 {
    let p = DVec3::new(r * phi.cos(), r * phi.sin(), 0.0);
    center + Frame::from_normal(direction).to_world(p)
}
