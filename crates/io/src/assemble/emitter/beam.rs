//! Beams and fibres, which emit light from an aperture.

use super::super::context::Context;
use super::super::surface_texture::screen;
use super::super::transforms::{axis, pose};
use super::{check_medium, light};
use crate::diagnostic::lints;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::{Aabb, Shown};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber,
};
use transport::scene::Object;
use transport::{Orientation, Spectrum};

const TEXTURE: &str = "texture";
/// Parameters of rectangles.
const OF_RECTANGLES: [&str; 3] = ["width", "height", "skew"];
/// Parameters of round apertures.
const OF_DISCS: [&str; 2] = ["radius", "inner_radius"];
/// Parameters of the edge of a cone, and of the distributions without an edge.
const OF_EDGES: [&str; 2] = ["cutoff_angle", "numerical_aperture"];
const OF_SLOPES: [&str; 1] = ["slopes"];
const OF_ANGLES: [&str; 2] = ["angles", "angle_weights"];

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
    let profile = angular_profile(&mut q);
    let divergence = match &profile {
        Some(profile) if profile.has_edge() => divergence(&mut q, profile.max_edge()),
        _ => Divergence::HalfAngle(FRAC_PI_2),
    };
    let focus = q.float_if_given("focus");
    if focus == Some(0.0) {
        q.error("focus", "the focus must not lie in the aperture");
    }
    let along = q.vector_or("axis", DVec3::Z);
    if along == DVec3::ZERO {
        q.error("axis", "the axis must not be zero");
    }
    let is_oblique = along.truncate() != DVec2::ZERO || along.z < 0.0;
    let power = q.spectrum("power");
    let across = across?;
    let has_sides = matches!(
        profile,
        Some(AngularProfile::Fan | AngularProfile::Slopes(_))
    );
    if across.is_round() && (is_oblique || has_sides) {
        let name = if is_oblique {
            "axis"
        } else {
            "angular_profile"
        };
        let message =
            "a direction across the light needs the profile 'rectangle', which has a local x and y";
        q.error(name, message);
    }
    let mut ineffective = across.ineffective().to_vec();
    ineffective.extend(of_other_profiles(profile.as_ref()));
    q.finish(&ineffective);
    let profile = profile?;
    let power = light(&power, "power", object, context);
    check_medium(inside, context);
    let aperture = across.aperture(context)?;
    check_power(object, &across, &aperture, power, context);
    let fiber = Fiber::new(aperture, profile, divergence, power);
    let fiber = match across.orientation() {
        Some(orientation) if is_oblique => fiber.with_axis(orientation.to_world(along)),
        _ => fiber,
    };
    Some(Emitter::Fiber(match focus {
        Some(distance) => fiber.with_focus(distance),
        None => fiber,
    }))
}

/// Reads the angular distribution of a fibre's light; `None` after an error.
fn angular_profile(q: &mut Query) -> Option<AngularProfile> {
    match q.word("angular_profile") {
        "lambertian" => Some(AngularProfile::Lambertian),
        "gaussian" => Some(AngularProfile::Gaussian),
        "fan" => Some(AngularProfile::Fan),
        "slopes" => {
            let slopes: Option<[f64; 2]> = q.numbers(OF_SLOPES[0]).try_into().ok();
            let slopes = slopes.filter(|s| s.iter().all(|v| *v > 0.0));
            if slopes.is_none() {
                let message = "'slopes' are two standard deviations above 0, along local x and y";
                q.error(OF_SLOPES[0], message);
            }
            slopes.map(AngularProfile::Slopes)
        }
        "angles" => {
            let [name, weights] = OF_ANGLES;
            let angles = q.numbers(name);
            if let Some(wrong) = angles.iter().find(|a| !(0.0..=180.0).contains(*a)) {
                q.error(
                    name,
                    format!("'angles' are from 0 to 180 degrees, not {wrong}"),
                );
                return None;
            }
            let angles = angles.into_iter().map(|a| a.to_radians().min(PI)).collect();
            let made = if q.has(weights) {
                AngularProfile::angles(angles, &q.numbers(weights))
            } else {
                AngularProfile::quantiles(angles)
            };
            made.map_err(|e| q.error(name, format!("angles and their weights: {e}")))
                .ok()
        }
        _ => Some(AngularProfile::Uniform),
    }
}

/// Returns the parameters that have no effect for an angular distribution.
fn of_other_profiles(profile: Option<&AngularProfile>) -> Vec<&'static str> {
    let [edges, slopes, angles] = [&OF_EDGES[..], &OF_SLOPES[..], &OF_ANGLES[..]];
    match profile {
        Some(AngularProfile::Slopes(_)) => [edges, angles].concat(),
        Some(AngularProfile::Angles(_)) => [edges, slopes].concat(),
        Some(_) => [slopes, angles].concat(),
        None => [edges, slopes, angles].concat(),
    }
}

/// Reads the divergence of a fibre's light. `max_edge` is the largest angle in radians.
fn divergence(q: &mut Query, max_edge: f64) -> Divergence {
    const ANGLE: &str = OF_EDGES[0];
    const APERTURE: &str = OF_EDGES[1];
    if !q.has(ANGLE) {
        return Divergence::NumericalAperture(q.float(APERTURE));
    }
    if q.has(APERTURE) {
        q.error(
            APERTURE,
            "give the numerical aperture or the cutoff_angle, not both",
        );
    }
    let most = max_edge.to_degrees();
    let angle = q.float_within(ANGLE, ABOVE_ZERO..=most, None);
    Divergence::HalfAngle(angle.to_radians().min(max_edge))
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
    /// Rectangle or parallelogram, possibly with an image.
    Rectangle {
        orientation: Orientation,
        size: [f64; 2],
        skew: f64,
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
            let [width, height, skew] = OF_RECTANGLES;
            let size = [width, height].map(|name| thin_or(q, name, 2.0 * thin));
            let skew = q.float(skew);
            let (origin, orientation) = pose?;
            let section = CrossSection::Rectangle {
                orientation,
                size,
                skew,
                image,
            };
            return Some(Across { origin, section });
        }
        if image.is_some() {
            q.error(TEXTURE, "a texture needs the profile 'rectangle'");
        }
        let place = axis(q);
        let [name, hole] = OF_DISCS;
        let radius = thin_or(q, name, thin);
        let inner = match profile {
            "gaussian" => 0.0,
            _ => q.float_within(hole, 0.0..radius, 0.0),
        };
        let profile = match profile {
            "gaussian" => BeamProfile::Gaussian { waist: radius },
            _ if inner > 0.0 => BeamProfile::Annulus { inner, radius },
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

    /// Returns true for a round aperture, which has no local x and y.
    fn is_round(&self) -> bool {
        matches!(self.section, CrossSection::Round { .. })
    }

    /// Returns the orientation of the local frame, if the aperture has one.
    fn orientation(&self) -> Option<Orientation> {
        match &self.section {
            CrossSection::Round { .. } => None,
            CrossSection::Rectangle { orientation, .. } => Some(*orientation),
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
                skew,
                image: None,
            } => {
                let (width, height) = (*width, *height);
                let profile = BeamProfile::Rectangle { width, height };
                let aperture = Aperture::oriented(origin, *orientation, profile);
                Some(sheared(aperture, *skew))
            }
            CrossSection::Rectangle {
                orientation,
                size,
                skew,
                image: Some(image),
            } => {
                if image.plugin != "bitmap" {
                    misplaced_plugin(image, &["bitmap"], context.diagnostics);
                    return None;
                }
                let slide = screen(image, context)?;
                let aperture = Aperture::picture(origin, *orientation, *size, slide);
                let aperture = context.accept(&image.location, aperture)?;
                Some(sheared(aperture, *skew))
            }
        }
    }
}

/// Returns an aperture with a rectangle sheared into a parallelogram, unless `skew` is 0.
fn sheared(aperture: Aperture, skew: f64) -> Aperture {
    if skew == 0.0 {
        aperture
    } else {
        aperture.with_skew(skew)
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

/// Smallest angle of a cone, in degrees.
const ABOVE_ZERO: f64 = f64::MIN_POSITIVE;

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
