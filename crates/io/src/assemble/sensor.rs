//! Sensors with their films and samplers.

use super::aperture::{Opening, SHAPES};
use super::context::Context;
use super::described::{METERS, diffracts, is_meter};
use super::distant::Distant;
use super::film::{self, FilmParts};
use super::medium;
use super::sampler::{self, Samples};
use super::transforms::affine;
use crate::diagnostic::lints;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, PluginKind, Property};
use crate::schema;
use eikonal::Aabb;
use glam::{DAffine3, DMat3, DVec3};
use std::ops::Bound;
use std::sync::Arc;
use transport::film::Filter;
use transport::scene::{FilmSpec, FilmWindow, MediumId};
use transport::sensor::{
    ApertureStop, Batch, Orthographic, Perspective, Sensor, Telecentric, ThinLens,
};

/// Default number of samples per pixel.
const SAMPLES: i64 = 64;
/// Sensor with its film and sampler.
pub(super) struct SensorParts {
    pub sensor: Sensor,
    pub medium: Option<MediumId>,
    pub film: FilmParts,
    pub samples: Samples,
}

/// Builds the sensor that an object describes; `None` after an error.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<SensorParts> {
    // Read the sensor, or the cameras of a batch.
    let wavelength = context.wavelength();
    let mut q = Query::new(object, context.diagnostics);
    let film = q.child(PluginKind::Film).cloned();
    let sampler = q.child(PluginKind::Sampler).cloned();
    if let Some(filter) = q.child(PluginKind::Rfilter) {
        q.ignored_child(filter, "belongs in the film: it has no effect here");
    }
    let inside = q.child(PluginKind::Medium).cloned();
    let batch = (object.plugin == "batch").then(|| q.children(PluginKind::Sensor));
    let views = match batch {
        Some(cameras) => {
            q.finish(&[]);
            cameras.iter().map(|camera| view(camera, context)).collect()
        }
        None => view_of(object, wavelength, q)
            .or_else(|| unknown(object, context))
            .map(|view| vec![view]),
    };
    // Build film, sampler and medium.
    let mut film = film::build(film.as_deref(), context);
    let samples = sampler::build(sampler.as_deref(), SAMPLES, context);
    let medium = inside.map(|m| medium::medium(&m, context));
    if object.plugin == "distant" {
        one_mean(object, &mut film.spec, context);
    }
    if object.plugin == "radiancemeter" && film.spec.width * film.spec.height > 1 {
        let message = "a radiancemeter sees along one ray: all pixels of its film show nearly the same; give it 1 x 1";
        let warning = lints::warning(lints::POINT_SENSOR, message).at(&object.location);
        context.diagnostics.push(warning);
    }
    let views = views?;
    // Divide the width of the image among the cameras of a batch.
    let whole = |spec: &FilmSpec| FilmWindow {
        image: [spec.width, spec.height],
        corner: [0.0; 2],
    };
    let mut window = film.spec.window.unwrap_or(whole(&film.spec));
    let [width, height] = window.image;
    if !width.is_multiple_of(views.len()) {
        let message = format!(
            "a batch is one or several cameras side by side: {width} pixels cannot be divided among {}",
            views.len()
        );
        context.error_at(&object.location, message);
        return None;
    }
    let aspect = width as f64 / (views.len() * height) as f64;
    // Shift the visible region by the offset of the principal point.
    if let Some(shifted) = views.iter().find(|view| view.shift != [0.0; 2]) {
        if object.plugin == "batch" {
            let message =
                "cameras of a batch have their principal points in the middle of the picture";
            context.error_at(&object.location, message);
        }
        for (corner, (shift, size)) in window
            .corner
            .iter_mut()
            .zip(shifted.shift.into_iter().zip(window.image))
        {
            *corner += shift * size as f64;
        }
        film.spec.window = Some(window);
    }
    let sensors = views.iter().map(|view| view.sensor(aspect, context));
    let mut sensors: Vec<Sensor> = sensors.collect::<Option<_>>()?;
    let sensor = if object.plugin == "batch" {
        Sensor::Batch(Arc::new(Batch::new(sensors)?))
    } else {
        sensors.pop()?
    };
    Some(SensorParts {
        sensor,
        medium,
        film,
        samples,
    })
}

/// Prepares the film of a distant sensor, which holds one mean: all samples have equal weights.
fn one_mean(object: &ObjectDescription, spec: &mut FilmSpec, context: &mut Context) {
    if [spec.width, spec.height] != [1, 1] || spec.window.is_some() {
        let message = format!(
            "a distant sensor measures one mean, but its film has {} x {} pixels: give the film width 1 and height 1, \
             or use 'orthographic' for an image",
            spec.width, spec.height
        );
        context.error_at(&object.location, message);
    }
    spec.filter = Filter::Box;
}

/// Reads a camera of a batch. Its film and sampler are ignored, as in Mitsuba. `None` after an
/// error.
fn view(object: &ObjectDescription, context: &mut Context) -> Option<View> {
    if object.plugin == "batch" || is_meter(object) {
        let message = "a batch must contain cameras, not other batches or meters";
        context.error_at(&object.location, message);
        return None;
    }
    if object.plugin == "distant" {
        let message = "a distant sensor has no image, and cannot be in a batch: render it alone";
        context.error_at(&object.location, message);
        return None;
    }
    if diffracts(object) {
        let message = "a camera of a batch cannot have 'diffraction', which spreads light beyond its column; render it alone";
        context.error_at(&object.location, message);
        return None;
    }
    let mut q = Query::new(object, context.diagnostics);
    for kind in [
        PluginKind::Film,
        PluginKind::Sampler,
        PluginKind::Medium,
        PluginKind::Rfilter,
    ] {
        q.child(kind);
    }
    view_of(object, None, q).or_else(|| unknown(object, context))
}

/// Reports a plugin that is not a camera.
fn unknown(object: &ObjectDescription, context: &mut Context) -> Option<View> {
    let plugins = schema::plugins(PluginKind::Sensor).iter();
    let names = plugins.map(|plugin| plugin.name);
    let cameras: Vec<&str> = names.filter(|name| !METERS.contains(name)).collect();
    misplaced_plugin(object, &cameras, context.diagnostics);
    None
}

/// View of a camera, without its film.
struct View {
    optics: Optics,
    frame: DAffine3,
    /// Shift of the visible region to the right and downward, as a fraction of the picture's width
    /// and height.
    shift: [f64; 2],
    /// Wavelength in scene units, if the aperture diffracts.
    wavelength: Option<f64>,
}

/// Reads the view of a camera; `None` if the plugin is unknown. `wavelength` is the wavelength of
/// the channel in nm, if it has one.
fn view_of(object: &ObjectDescription, wavelength: Option<f64>, mut q: Query) -> Option<View> {
    let frame = match object.plugin.as_str() {
        "radiancemeter" => along_a_ray(&mut q),
        _ => {
            let matrix = q.transform("to_world");
            affine(matrix, "to_world", &mut q)
        }
    };
    let axes = [
        frame.matrix3.x_axis,
        frame.matrix3.y_axis,
        frame.matrix3.z_axis,
    ];
    let size: f64 = axes.iter().map(|a| a.length()).product();
    if frame.matrix3.determinant().abs() <= 1e-9 * size {
        q.error("to_world", "the sensor's transform is singular");
    }
    let optics = optics(object, &frame, &mut q);
    let wavelength = match &optics {
        Some(Optics::ThinLens(_) | Optics::Telecentric(..)) => {
            diffraction(wavelength, &frame, &mut q)
        }
        _ => None,
    };
    let shift = if object.plugin == "perspective" {
        ["principal_point_offset_x", "principal_point_offset_y"].map(|name| q.float(name))
    } else {
        [0.0; 2]
    };
    // Accept clipping planes, which Mitsuba needs for its intersection tests. Segments start at the
    // sensor regardless of them.
    q.float("near_clip");
    q.float("far_clip");
    // Accept shutter times: nothing moves.
    q.float("shutter_open");
    q.float("shutter_close");
    if q.has("srf") {
        let message = "morgana does not support spectral responses of sensors: render a film of 'wavelengths', and weight its channels";
        q.error("srf", message);
    }
    q.finish(&[]);
    optics.map(|optics| View {
        optics,
        frame,
        shift,
        wavelength,
    })
}

/// Maximum cosine between axes that rounding explains; a larger cosine is a shear.
const MAX_SHEAR: f64 = 1e-6;

/// Returns the wavelength in scene units of the light that the aperture diffracts, or `None`
/// without diffraction. `wavelength` is the wavelength of the channel in nm.
fn diffraction(wavelength: Option<f64>, frame: &DAffine3, q: &mut Query) -> Option<f64> {
    if !q.boolean("diffraction") {
        let is_boolean = |p: &Property| p.name != "diffraction" || p.value.type_name() == "boolean";
        if q.has("metres_per_unit") && q.object().properties.iter().all(is_boolean) {
            let message = "the length of a scene unit matters to 'diffraction' only: set that, or leave this out";
            q.error("metres_per_unit", message);
        }
        return None;
    }
    let metres = q.float("metres_per_unit");
    let axes = [
        frame.matrix3.x_axis,
        frame.matrix3.y_axis,
        frame.matrix3.z_axis,
    ];
    let [x, y, z] = axes.map(|axis| axis.normalize_or_zero());
    if [x.dot(y), y.dot(z), z.dot(x)]
        .iter()
        .any(|c| c.abs() > MAX_SHEAR)
    {
        let message = "the transform of a sensor with 'diffraction' must not shear";
        q.error("to_world", message);
    }
    if wavelength.is_none() {
        let message = "diffraction depends on the wavelength: the film needs the pixel_format 'spectral' and 'wavelengths'";
        q.error("diffraction", message);
    }
    Some(wavelength? * 1e-9 / metres)
}

/// Returns the frame of a radiance meter, which looks along +z of its transform, or from a point in
/// a direction.
fn along_a_ray(q: &mut Query) -> DAffine3 {
    let matrix = q.transform("to_world");
    let frame = affine(matrix, "to_world", q);
    if !["origin", "direction"].iter().any(|name| q.has(name)) {
        return frame;
    }
    if q.has("to_world") {
        let message = "give 'origin' and 'direction', or 'to_world', not both";
        q.error("to_world", message);
    }
    let (origin, direction) = (q.point("origin"), q.vector("direction").try_normalize());
    let Some(z) = direction else {
        q.error("direction", "the direction must not be zero");
        return frame;
    };
    let x = z.any_orthonormal_vector();
    DAffine3 {
        matrix3: DMat3::from_cols(x, z.cross(x), z),
        translation: origin,
    }
}

/// Angular width of the cone that a radiance meter sees, in degrees.
const METER_ANGLE: f64 = 1e-3;
/// Field of view in degrees of the default camera for scenes without a camera, as in Mitsuba 0.6.
const DEFAULT_FOV: f64 = 45.0;

/// Builds the default camera for scenes without a camera, as in Mitsuba 0.6. It looks along +z,
/// from the distance at which the larger of the scene's width and height fills its field of view.
pub(super) fn absent(context: &mut Context) -> SensorParts {
    let boxes = context.objects.iter().map(|o| o.shape.aabb());
    let all = boxes.fold(Aabb::EMPTY, Aabb::union);
    let half = (0.5 * DEFAULT_FOV.to_radians()).tan();
    let eye = if all.is_empty() {
        DVec3::ZERO
    } else {
        let distance = (all.max - all.min).truncate().max_element() / (2.0 * half);
        all.center().with_z(all.min.z - distance)
    };
    let film = film::build(None, context);
    let fov = Fov {
        angle: DEFAULT_FOV.to_radians(),
        axis: "x",
    };
    let aspect = film.spec.width as f64 / film.spec.height as f64;
    let pinhole = fov.pinhole(DAffine3::from_translation(eye), aspect);
    SensorParts {
        sensor: Sensor::Perspective(pinhole),
        medium: None,
        film,
        samples: sampler::build(None, SAMPLES, context),
    }
}

/// Optics of a camera, without its frame and film.
enum Optics {
    Pinhole(Fov),
    ThinLens(Lens),
    Orthographic,
    Distant(Distant),
    Telecentric(f64, Stop),
}

/// Stop of a telecentric sensor, in units of slope.
enum Stop {
    Open { radius: f64, opening: Opening },
    Knife(ApertureStop),
}

/// Thin lens, in local units.
struct Lens {
    fov: Fov,
    radius: f64,
    opening: Opening,
    focus_distance: f64,
}

/// Full angle in radians along an axis of the image.
pub(super) struct Fov {
    angle: f64,
    axis: &'static str,
}

/// Width and height in mm of a frame of 35 mm film, to which focal lengths refer.
const FRAME: [f64; 2] = [36.0, 24.0];
/// Reads the optics of a camera; `None` for an unknown type.
fn optics(object: &ObjectDescription, frame: &DAffine3, q: &mut Query) -> Option<Optics> {
    Some(match object.plugin.as_str() {
        "perspective" => {
            q.has("focus_distance");
            Optics::Pinhole(fov(q))
        }
        "thinlens" => {
            let fov = fov(q);
            let radius = q.float("aperture_radius");
            let far = q.float("far_clip");
            Optics::ThinLens(Lens {
                fov,
                radius,
                opening: Opening::read(object, q),
                focus_distance: focus(frame, far, q),
            })
        }
        "orthographic" => Optics::Orthographic,
        "distant" => Optics::Distant(Distant::read(frame, q)),
        "radiancemeter" => Optics::Pinhole(Fov {
            angle: METER_ANGLE.to_radians(),
            axis: "x",
        }),
        "telecentric" => Optics::Telecentric(focus(frame, 0.0, q), stop(object, q)),
        _ => return None,
    })
}

/// Reads the distance of the plane of focus along the axis in local units, given by its value or by
/// a point in the world.
fn focus(frame: &DAffine3, default: f64, q: &mut Query) -> f64 {
    if !q.has("focus_point") {
        return q.float_or("focus_distance", default);
    }
    if q.has("focus_distance") {
        let message = "give focus_distance, or focus_point, not both";
        q.error("focus_point", message);
    }
    let point = q.point("focus_point");
    let distance = frame.inverse().transform_point3(point).z;
    if q.limits("focus_distance").contains(distance) {
        return distance;
    }
    q.error("focus_point", "the point must be in front of the sensor");
    1.0
}

/// Reads the stop of a telecentric sensor, with its knife edge.
fn stop(object: &ObjectDescription, q: &mut Query) -> Stop {
    let angle = q.float("acceptance_angle");
    let radius = angle.to_radians().tan();
    let opening = Opening::read(object, q);
    if !q.has("knife_edge") {
        if q.has("knife_angle") {
            q.error(
                "knife_angle",
                "a knife needs a vector 'knife_edge', its direction",
            );
        }
        return Stop::Open { radius, opening };
    }
    for name in SHAPES.into_iter().chain(["diffraction"]) {
        if q.has(name) {
            let message = format!(
                "the stop has a knife edge or '{name}', not both: the image behind a knife edge depends on the coherence of the light"
            );
            q.error(name, message);
        }
    }
    let edge = q.vector("knife_edge");
    if edge.truncate().length() < 1e-9 || edge.z != 0.0 {
        let message =
            "'knife_edge' points to the covered side, across the axis: (x, y, 0), not zero";
        q.error("knife_edge", message);
        return Stop::Open { radius, opening };
    }
    let open = (Bound::Excluded(-angle), Bound::Included(angle));
    let cut = q.float_within("knife_angle", open, 0.0).to_radians().tan();
    Stop::Knife(ApertureStop::with_knife(radius, edge.truncate(), cut))
}

/// Reads the field of view, given as an angle or as the focal length of a lens for 35 mm film. A
/// focal length gives the angle along the diagonal.
pub(super) fn fov(q: &mut Query) -> Fov {
    if q.has("fov") {
        if q.has("focal_length") {
            q.error("focal_length", "give fov, or focal_length, not both");
        }
        let angle = q.float("fov").to_radians();
        let axis = q.word("fov_axis");
        return Fov { angle, axis };
    }
    if q.has("fov_axis") {
        q.error(
            "fov_axis",
            "a focal_length is about the diagonal: 'fov_axis' needs 'fov'",
        );
    }
    let text = q.string("focal_length");
    let number = text.strip_suffix("mm").unwrap_or(&text).trim().parse();
    let focal = number.ok().filter(|f: &f64| *f > 0.0 && f.is_finite());
    if focal.is_none() {
        let message =
            format!("'focal_length' is a number of millimetres such as \"50mm\", not '{text}'");
        q.error("focal_length", message);
    }
    Fov {
        angle: 2.0 * (FRAME[0].hypot(FRAME[1]) / (2.0 * focal.unwrap_or(1.0))).atan(),
        axis: "diagonal",
    }
}

impl Fov {
    fn pinhole(&self, frame: DAffine3, aspect: f64) -> Perspective {
        Perspective::new(frame, self.horizontal(aspect), aspect)
    }

    /// Returns the horizontal angle for an aspect ratio (width over height).
    pub(super) fn horizontal(&self, aspect: f64) -> f64 {
        if self.axis == "diagonal" {
            let half = (0.5 * self.angle).tan() / (1.0 + aspect.powi(-2)).sqrt();
            return 2.0 * half.atan();
        }
        let vertical = match self.axis {
            "y" => true,
            "smaller" => aspect > 1.0,
            "larger" => aspect < 1.0,
            _ => false,
        };
        if vertical {
            2.0 * ((0.5 * self.angle).tan() * aspect).atan()
        } else {
            self.angle
        }
    }
}

impl View {
    /// Returns the sensor; `None` after an error.
    fn sensor(&self, aspect: f64, context: &mut Context) -> Option<Sensor> {
        let frame = self.frame;
        Some(match &self.optics {
            Optics::Pinhole(fov) => Sensor::Perspective(fov.pinhole(frame, aspect)),
            Optics::ThinLens(lens) => {
                let pinhole = lens.fov.pinhole(frame, aspect);
                let sensor = ThinLens::new(pinhole, lens.radius, lens.focus_distance)
                    .with_aperture(lens.opening.aperture(context)?);
                Sensor::ThinLens(match self.wavelength {
                    Some(wavelength) => sensor.with_diffraction(wavelength),
                    None => sensor,
                })
            }
            Optics::Orthographic => Sensor::Orthographic(Orthographic::new(frame, aspect)),
            Optics::Distant(distant) => Sensor::Orthographic(distant.sensor(&context.objects)),
            Optics::Telecentric(distance, stop) => {
                let stop = match stop {
                    Stop::Open { radius, opening } => {
                        ApertureStop::new(*radius, opening.aperture(context)?)
                    }
                    Stop::Knife(stop) => stop.clone(),
                };
                let sensor = Telecentric::new(frame, aspect, *distance, stop);
                let diffracted = self.wavelength.and_then(|w| sensor.with_diffraction(w));
                Sensor::Telecentric(diffracted.unwrap_or(sensor))
            }
        })
    }
}
