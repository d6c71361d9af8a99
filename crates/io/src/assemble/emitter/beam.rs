//! Beams and fibres, which emit light from an aperture.

use super::super::context::Context;
use super::super::surface_texture::screen;
use super::super::transforms::{axis, pose};
use super::{check_medium, light};
use crate::diagnostic::lints;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::{Aabb, Shown};
use glam::DVec3;
use std::sync::Arc;
use transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber,
};
use transport::scene::Object;
use transport::{Orientation, Spectrum};

const TEXTURE: &str = "texture";
/// Parameters of rectangles.
const OF_RECTANGLES: [&str; 2] = ["width", "height"];
/// Parameters of round apertures.
const OF_DISCS: [&str; 1] = ["radius"];

/// Builds a beam of parallel light.
pub(super) fn collimated(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let thin = thin(&context.objects);
    let mut q = Query::new(object, context.diagnostics);
    let inside = q.child(PluginKind::Medium).cloned();
    let across = Across::read(&mut q, thin);
    let total = !q.has("irradiance");
    if !total && q.has("power") {
        q.error(
            "power",
            "give 'power' or 'irradiance' of the beam, not both",
        );
    }
    let name = if total { "power" } else { "irradiance" };
    let value = q.spectrum(name);
    let across = across?;
    q.finish(across.ineffective());
    let value = light(&value, name, object, context);
    check_medium(inside, context);
    let aperture = across.aperture(context)?;
    Some(Emitter::Collimated(if total {
        check_power(object, &across, &aperture, value, context);
        Collimated::through(aperture, value)
    } else {
        Collimated::with_irradiance(aperture, value)
    }))
}

/// Builds the end of a fibre.
pub(super) fn fiber(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let thin = thin(&context.objects);
    let mut q = Query::new(object, context.diagnostics);
    let inside = q.child(PluginKind::Medium).cloned();
    let across = Across::read(&mut q, thin);
    let divergence = divergence(&mut q);
    let profile = match q.word("angular_profile") {
        "lambertian" => AngularProfile::Lambertian,
        "gaussian" => AngularProfile::Gaussian,
        _ => AngularProfile::Uniform,
    };
    let focus = q.float_if_given("focus");
    if focus == Some(0.0) {
        q.error("focus", "the focus must not lie in the aperture");
    }
    let power = q.spectrum("power");
    let across = across?;
    q.finish(across.ineffective());
    let power = light(&power, "power", object, context);
    check_medium(inside, context);
    let aperture = across.aperture(context)?;
    check_power(object, &across, &aperture, power, context);
    let fiber = Fiber::new(aperture, profile, divergence, power);
    Some(Emitter::Fiber(match focus {
        Some(distance) => fiber.with_focus(distance),
        None => fiber,
    }))
}

/// Reads the divergence of a fibre's light.
fn divergence(q: &mut Query) -> Divergence {
    const ANGLE: &str = "cutoff_angle";
    const APERTURE: &str = "numerical_aperture";
    if !q.has(ANGLE) {
        return Divergence::NumericalAperture(q.float(APERTURE));
    }
    if q.has(APERTURE) {
        q.error(
            APERTURE,
            "give the numerical aperture or the cutoff_angle, not both",
        );
    }
    Divergence::HalfAngle(q.float(ANGLE).to_radians())
}

/// Origin and aperture of emitted light, as given in the scene.
struct Across {
    origin: DVec3,
    section: CrossSection,
}

/// Direction and cross section of emitted light.
enum CrossSection {
    /// Rotationally symmetric about its axis.
    Round {
        direction: DVec3,
        profile: BeamProfile,
    },
    /// Rectangle, possibly with an image.
    Rectangle {
        orientation: Orientation,
        size: [f64; 2],
        image: Option<Arc<ObjectDescription>>,
    },
}

impl Across {
    /// Reads `to_world` and the profile; `None` after an error.
    fn read(q: &mut Query, thin: f64) -> Option<Self> {
        let profile = q.word("profile");
        let image = q.role(PluginKind::Texture, TEXTURE).cloned();
        if profile == "rectangle" {
            let pose = pose(q, "a rectangle of light");
            let size = OF_RECTANGLES.map(|name| thin_or(q, name, 2.0 * thin));
            let (origin, orientation) = pose?;
            let section = CrossSection::Rectangle {
                orientation,
                size,
                image,
            };
            return Some(Across { origin, section });
        }
        if image.is_some() {
            q.error(TEXTURE, "a texture needs the profile 'rectangle'");
        }
        let place = axis(q);
        let radius = thin_or(q, OF_DISCS[0], thin);
        let profile = match profile {
            "gaussian" => BeamProfile::Gaussian { waist: radius },
            _ => BeamProfile::Disc { radius },
        };
        let (origin, direction) = place?;
        let section = CrossSection::Round { direction, profile };
        Some(Across { origin, section })
    }

    /// Returns the parameters that have no effect for this cross section.
    fn ineffective(&self) -> &'static [&'static str] {
        match self.section {
            CrossSection::Round { .. } => &OF_RECTANGLES,
            CrossSection::Rectangle { .. } => &OF_DISCS,
        }
    }

    fn aperture(&self, context: &mut Context) -> Option<Aperture> {
        let origin = self.origin;
        match &self.section {
            CrossSection::Round { direction, profile } => {
                Some(Aperture::new(origin, *direction, *profile))
            }
            CrossSection::Rectangle {
                orientation,
                size: [width, height],
                image: None,
            } => {
                let (width, height) = (*width, *height);
                let profile = BeamProfile::Rectangle { width, height };
                Some(Aperture::oriented(origin, *orientation, profile))
            }
            CrossSection::Rectangle {
                orientation,
                size,
                image: Some(image),
            } => {
                if image.plugin != "bitmap" {
                    misplaced_plugin(image, &["bitmap"], context.diagnostics);
                    return None;
                }
                let slide = screen(image, context)?;
                let aperture = Aperture::picture(origin, *orientation, *size, slide);
                context.accept(&image.location, aperture)
            }
        }
    }
}

/// Reports power that the aperture does not emit: its image may be black, or the irradiance may
/// overflow.
fn check_power(
    object: &ObjectDescription,
    across: &Across,
    aperture: &Aperture,
    power: Spectrum,
    context: &mut Context,
) {
    let lit = Collimated::through(aperture.clone(), power).power();
    let passes = |c: usize| power[c] == 0.0 || (lit[c] / power[c] - 1.0).abs() < ROUNDING;
    let Some(blocked) = (0..Spectrum::CHANNELS).find(|c| !passes(*c)) else {
        return;
    };
    match &across.section {
        CrossSection::Rectangle {
            image: Some(image), ..
        } if lit[blocked] == 0.0 => {
            let message = "the texture is black in a channel in which the light has power";
            context.error_at(&image.location, message);
        }
        _ => {
            let message =
                "the aperture is too small or too large for its irradiance to be a number";
            context.error_at(&object.location, message);
        }
    }
}

/// Relative error of powers that rounding explains.
const ROUNDING: f64 = 1e-9;

/// Radius of a beam without a given size, relative to half the diagonal of the bounding box of all
/// shapes.
const DEFAULT_RADIUS: f64 = 1e-3;

/// Returns the radius of a beam without a given size.
fn thin(objects: &[Object]) -> f64 {
    let boxes = objects.iter().map(|o| o.shape.aabb());
    let all = boxes.fold(Aabb::EMPTY, Aabb::union);
    let size = (all.max - all.min).length();
    if all.is_empty() || size == 0.0 {
        DEFAULT_RADIUS
    } else {
        0.5 * DEFAULT_RADIUS * size
    }
}

/// Reads a length across a beam. If it is not given, returns `thin` and adds a note.
fn thin_or(q: &mut Query, name: &str, thin: f64) -> f64 {
    if !q.has(name) {
        let message = format!(
            "a beam without a '{name}' is a thousandth of the scene wide: {}",
            Shown::rounded(thin)
        );
        q.note(lints::THIN_BEAM, "type", message);
    }
    q.float_or(name, thin)
}
