//! Sun and sky by the model of Hosek and Wilkie (2012, 2013), as in Mitsuba.

use super::super::context::Context;
use super::super::texture_role::Role;
use super::super::transforms::pose;
use super::sun::{self, Observer};
use crate::diagnostic::difference::SUNSKY;
use crate::diagnostic::lints;
use crate::query::Query;
use crate::scene::{ObjectDescription, SpectrumValue};
use eikonal::Shown;
use glam::{DMat3, DVec3};
use hw_skymodel::rgb::{SkyParams, SkyState};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use transport::Orientation;
use transport::emitter::{DistantDisc, Environment};

/// Width in pixels of the image of the sky: columns are 0.7° apart.
const WIDTH: usize = 512;
/// Height in pixels of the image of the sky: rows are 0.35° apart.
const HEIGHT: usize = 513;
/// Integral of the eye's response ȳ in nm, by which Mitsuba divides spectra when it converts them
/// to colours.
const CIE_Y: f64 = 106.750_259_4;
/// Sun and sky as given in the scene.
struct Sunsky {
    turbidity: f64,
    albedo: [f64; 3],
    /// Unit direction to the sun, z up.
    sun: DVec3,
    sun_scale: f64,
    sky_scale: f64,
    /// Half of the sun's angular diameter, in radians.
    half_angle: f64,
    orientation: Orientation,
}

/// Builds the environments that an object describes: the sky and the sun, except dark ones.
pub(super) fn environments(
    object: &ObjectDescription,
    context: &mut Context,
) -> Vec<(&'static str, Environment)> {
    context.differences.insert(SUNSKY);
    let Some(parts) = read(object, context) else {
        return Vec::new();
    };
    let colour = SpectrumValue::Rgb([1.0; 3]);
    if let Err(message) = context.in_channels(&colour) {
        context.error_at(&object.location, message);
        return Vec::new();
    }
    let sky = (parts.sky_scale > 0.0).then(|| parts.sky(object, context));
    let sun = (parts.sun_scale > 0.0).then(|| parts.sun(object, context));
    let named = [("sky", sky.flatten()), ("sun", sun.flatten())];
    let lit = named.into_iter();
    lit.filter_map(|(name, part)| part.map(|part| (name, part)))
        .collect()
}

/// Reads the parameters; `None` after an error, or if the sun is below the horizon.
fn read(object: &ObjectDescription, context: &mut Context) -> Option<Sunsky> {
    let mut q = Query::new(object, context.diagnostics);
    let turbidity = q.float("turbidity");
    let albedo = q.spectrum("albedo");
    let scales = ["sun_scale", "sky_scale"].map(|name| q.float(name));
    let aperture = q.float("sun_aperture");
    // Accept the choice of limb darkening: the power is equal with and without it.
    q.boolean("complex_sun");
    let pose = pose(&mut q, "an environment");
    let given = given_sun(&mut q);
    let observer = observer(&mut q);
    let albedo = match albedo {
        SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) => [v; 3],
        SpectrumValue::Rgb(rgb) => rgb,
        _ => {
            q.error("albedo", "the ground's albedo is a number or a colour");
            return None;
        }
    };
    if let Some(bad) = albedo.into_iter().find(|v| !(0.0..=1.0).contains(v)) {
        q.error(
            "albedo",
            format!("the ground's albedo lies in [0, 1], got {}", Shown(bad)),
        );
        return None;
    }
    let (_, orientation) = pose?;
    let sun = given.map_or_else(|| observer.sun(), |given| orientation.to_local(given));
    if sun.z < 0.0 {
        let name = if given.is_some() {
            "sun_direction"
        } else {
            "type"
        };
        q.warning(
            lints::SUN_BELOW_HORIZON,
            name,
            "the sun is below the horizon: the sun and the sky are black",
        );
    }
    q.finish(&[]);
    (sun.z >= 0.0).then_some(Sunsky {
        turbidity,
        albedo,
        sun,
        sun_scale: scales[0],
        sky_scale: scales[1],
        half_angle: 0.5 * aperture.to_radians(),
        orientation,
    })
}

/// Reads the direction to the sun in the world, if it is given instead of a place and a time.
fn given_sun(q: &mut Query) -> Option<DVec3> {
    const NAME: &str = "sun_direction";
    if !q.has(NAME) {
        return None;
    }
    let told = [
        "latitude",
        "longitude",
        "timezone",
        "year",
        "month",
        "day",
        "hour",
        "minute",
        "second",
    ];
    if let Some(name) = told.into_iter().find(|name| q.has(name)) {
        q.error(name, format!("give '{NAME}', or place and time, not both"));
    }
    let direction = q.vector(NAME).try_normalize();
    if direction.is_none() {
        q.error(NAME, "the direction must not be zero");
    }
    direction
}

/// Reads place and time. The default is an afternoon of July in Tokyo.
fn observer(q: &mut Query) -> Observer {
    let minutes = q.float("minute") + q.float("second") / 60.0;
    Observer {
        latitude: q.float("latitude"),
        longitude: q.float("longitude"),
        timezone: q.float("timezone"),
        year: q.integer("year"),
        month: q.integer("month"),
        day: q.integer("day"),
        hours: q.float("hour") + minutes / 60.0,
    }
}

/// Converts a vector from the axes of images, which have y up, to the axes of Mitsuba's sky, which
/// has z up.
fn upright(local: DVec3) -> DVec3 {
    DVec3::new(local.x, -local.z, local.y)
}

impl Sunsky {
    /// Builds the image of the sky; `None` after an error.
    fn sky(&self, object: &ObjectDescription, context: &mut Context) -> Option<Environment> {
        // Evaluate the coefficients of the model.
        let elevation = (FRAC_PI_2 - self.sun.z.min(1.0).acos()).max(0.0);
        let state = SkyState::new(&SkyParams {
            elevation: (elevation as f32).min(std::f32::consts::FRAC_PI_2),
            turbidity: self.turbidity as f32,
            albedo: self.albedo.map(|v| v as f32),
        });
        let (coefficients, means) = context.accept(&object.location, state)?.raw();
        let channel = |c: usize| {
            let of_channel = &coefficients[9 * c..9 * (c + 1)];
            let coefficients = std::array::from_fn(|i| f64::from(of_channel[i]));
            let mean = f64::from(means[c]) * self.sky_scale / CIE_Y;
            Skylight { coefficients, mean }
        };
        let channels: [Skylight; 3] = std::array::from_fn(channel);
        // Compute the radiance of each pixel.
        let mut pixels = Vec::with_capacity(WIDTH * HEIGHT);
        for row in 0..HEIGHT {
            let (sin, cos) = (PI * row as f64 / (HEIGHT - 1) as f64).sin_cos();
            // Halve the row of the horizon. Interpolation then adds as much light below the horizon
            // as it removes above.
            let share = match row.cmp(&(HEIGHT / 2)) {
                std::cmp::Ordering::Less => 1.0,
                std::cmp::Ordering::Equal => 0.5,
                std::cmp::Ordering::Greater => 0.0,
            };
            for column in 0..WIDTH {
                let longitude = (column as f64 + 0.5) / WIDTH as f64 * TAU;
                let y_up = DVec3::new(longitude.sin() * sin, cos, -longitude.cos() * sin);
                let toward = upright(y_up);
                let rgb = channels.each_ref().map(|light| {
                    if share > 0.0 {
                        share * light.radiance(toward.z.max(0.0), toward.angle_between(self.sun))
                    } else {
                        0.0
                    }
                });
                pixels.push(context.spectrum(
                    &SpectrumValue::Rgb(rgb),
                    Role::Emission,
                    &object.location,
                ));
            }
        }
        // Turn the image so that its y axis is the zenith.
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let [x, y, z] = axes.map(|axis| self.orientation.to_world(upright(axis)));
        let (orientation, _) = Orientation::nearest(DMat3::from_cols(x, y, z))?;
        let sky = Environment::image(WIDTH, HEIGHT, pixels, orientation);
        context.accept(&object.location, sky)
    }

    /// Builds a uniform disc for the sun. Its power does not depend on its angular size.
    fn sun(&self, object: &ObjectDescription, context: &mut Context) -> Option<Environment> {
        let elevation = FRAC_PI_2 - self.sun.z.min(1.0).acos();
        let irradiance = sun::irradiance(self.turbidity, elevation);
        let irradiance = SpectrumValue::Rgb(irradiance.map(|v| v * self.sun_scale));
        let irradiance = context.spectrum(&irradiance, Role::Emission, &object.location);
        let solid_angle = TAU * 2.0 * (0.5 * self.half_angle).sin().powi(2);
        let center = self.orientation.to_world(self.sun);
        let disc = DistantDisc::new(center, self.half_angle, irradiance / solid_angle);
        context
            .accept(&object.location, disc)
            .map(Environment::Disc)
    }
}

/// Single colour channel of the sky (Hosek and Wilkie 2012, eq. 8).
struct Skylight {
    /// Coefficients A to G, I and H, in this order.
    coefficients: [f64; 9],
    /// Mean radiance.
    mean: f64,
}

impl Skylight {
    /// Returns the radiance for a cosine to the zenith and an angle to the sun. Negative values of
    /// the model are set to 0.
    fn radiance(&self, cos: f64, gamma: f64) -> f64 {
        let [a, b, c, d, e, f, g, i, h] = self.coefficients;
        let cos_gamma = gamma.cos();
        let scattered = 1.0 + cos_gamma * cos_gamma;
        let aureole = scattered / libm::pow(1.0 + h * h - 2.0 * h * cos_gamma, 1.5);
        let gradient = 1.0 + a * libm::exp(b / (cos + 0.01));
        let around =
            c + d * libm::exp(e * gamma) + f * cos_gamma * cos_gamma + g * aureole + i * cos.sqrt();
        (self.mean * gradient * around).max(0.0)
    }
}
