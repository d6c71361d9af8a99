//! Meters, which replace the camera.

use super::channels::Channels;
use super::context::{Context, MeterPlace};
use super::described::is_meter;
use super::film::{self, FilmParts, Layering};
use super::frequency_domain::frequency_domain;
use super::instrument::{Gruneisen, Instrument, Normalization};
use super::sampler::{self, Samples};
use super::sensor::SensorParts;
use super::tagging;
use super::transforms::affine;
use crate::diagnostic::lints;
use crate::query::{Query, misplaced_plugin, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Aabb;
use glam::{DAffine3, DVec3};
use transport::Bins;
use transport::film::Filter;
use transport::meter::{
    Acceptance, Coordinates, Cosines, Estimator, FluenceMeter, IrradianceMeter, Meter, MeterGrid,
    Patch, Positions,
};
use transport::scene::{FilmSpec, Object};
use transport::sensor::Sensor;
use transport::shape::{Shape, VoxelFaces};
use transport::sidebands::Sidebands;

/// Default number of particles.
const PARTICLES: i64 = 1_000_000;
/// Builds the meters of the scene and of its shapes, with a stand-in for the camera; `None` after
/// an error.
pub(super) fn build(
    meters: &[&ObjectDescription],
    cameras: &[&ObjectDescription],
    integrator: Option<&ObjectDescription>,
    context: &mut Context,
) -> Option<(SensorParts, Vec<Instrument>)> {
    // Reject a camera beside meters, and warn about an unsuitable integrator.
    if let [camera, ..] = cameras {
        let message = "the scene has meters and a camera: remove one of them, because a scene is either rendered or measured";
        context.error_at(&camera.location, message);
    }
    if let Some(object) = integrator.filter(|o| !["particle", "ptracer"].contains(&&*o.plugin)) {
        let message = format!(
            "meters trace particles from the emitters: they use only max_depth, rr_depth and tolerance of integrator '{}'",
            object.plugin
        );
        let help = match object.plugin.as_str() {
            "tagged" => "use the integrator 'particle', and set 'tagged' of the meters",
            _ => "use the integrator 'particle'",
        };
        let warning = lints::warning(lints::METER_INTEGRATOR, message).help(help.to_owned());
        context
            .diagnostics
            .push(warning.at(&object.plugin_location));
    }
    // Build all meters; their samplers must agree on sound.
    let (mut instruments, mut particles) = (Vec::new(), Samples::default());
    let mut said = None;
    let mut add =
        |object: &ObjectDescription, place: Option<&MeterPlace>, context: &mut Context| {
            let (instrument, samples) = instrument(object, place, context);
            let sound = (samples.bending, samples.instants);
            if instrument.is_some()
                && samples.request != sampler::SamplerRequest::Open
                && *said.get_or_insert(sound) != sound
            {
                let message =
                    "meters share particles: their samplers must agree on 'bending' and 'phases'";
                context.error_at(&object.location, message);
            }
            particles.raise(samples);
            instruments.extend(instrument);
        };
    for object in meters {
        add(object, None, context);
    }
    for place in &std::mem::take(&mut context.meters) {
        add(&place.meter, Some(place), context);
    }
    distinct(&mut instruments);
    Some((nobody(particles, context), instruments))
}

/// Returns a stand-in for the camera, at the centre of the scene.
fn nobody(samples: Samples, context: &Context) -> SensorParts {
    let boxes = context.objects.iter().map(|o| o.shape.aabb());
    let all = boxes.fold(Aabb::EMPTY, Aabb::union);
    let middle = if all.is_empty() {
        DVec3::ZERO
    } else {
        all.center()
    };
    SensorParts {
        sensor: Sensor::Absent(DAffine3::from_translation(middle)),
        medium: None,
        film: FilmParts {
            spec: FilmSpec {
                width: 1,
                height: 1,
                channels: context.channels.count(),
                group_size: context.channels.group_size(),
                filter: Filter::Box,
                window: None,
            },
            layering: Layering::default(),
            reweight: false,
        },
        samples,
    }
}

/// Appends numbers to names that several meters share.
fn distinct(instruments: &mut [Instrument]) {
    let names: Vec<String> = instruments.iter().map(|i| i.name.clone()).collect();
    for (i, instrument) in instruments.iter_mut().enumerate() {
        if names.iter().filter(|name| **name == names[i]).count() > 1 {
            let number = names[..=i].iter().filter(|name| **name == names[i]).count();
            instrument.name = format!("{}_{number}", names[i]);
        }
    }
}

/// Builds the meter that an object describes, at the surfaces in `place` if it belongs to a shape.
/// Also returns the samples that the meter requests.
fn instrument(
    object: &ObjectDescription,
    place: Option<&MeterPlace>,
    context: &mut Context,
) -> (Option<Instrument>, Samples) {
    if !is_meter(object) {
        misplaced_plugin(object, &["irradiancemeter"], context.diagnostics);
        return (None, Samples::default());
    }
    // Read the parameters that all meters share.
    let mut q = Query::new(object, context.diagnostics);
    let film = q.child(PluginKind::Film).cloned();
    let sampler = q.child(PluginKind::Sampler).cloned();
    let normalization = match q.word("normalization") {
        "per_watt" => Normalization::PerWatt,
        _ => Normalization::Absolute,
    };
    let lengths = lengths(&mut q);
    let weight_windows = weight_windows(&mut q, lengths.is_some());
    // Read the parameters of the meter's type.
    let (mut meter, mut pressure, mut metres_per_unit) = (None, None, None);
    match (object.plugin.as_str(), place) {
        ("fluencemeter", None) => {
            metres_per_unit = q.has("metres_per_unit").then(|| q.float("metres_per_unit"));
            pressure = gruneisen(&mut q);
            let sidebands = q.boolean("tagged");
            let sidebands = sidebands.then(|| tagging::sidebands(&mut q, context.channels));
            let sidebands = sidebands.flatten();
            let frequency_domain = frequency_domain(&mut q);
            meter = grid(&mut q).map(|(grid, estimator)| {
                Meter::Fluence(FluenceMeter {
                    grid,
                    estimator,
                    optical_length: lengths,
                    weight_windows,
                    sidebands,
                    frequency_domain,
                })
            });
            q.finish(&[]);
        }
        ("irradiancemeter", Some(place)) => {
            let (tagged, sidebands) = tagged(&mut q, context.channels);
            metres_per_unit = q.float_if_given("metres_per_unit");
            meter = Some(Meter::Irradiance(IrradianceMeter {
                positions: positions(place, &context.objects, &mut q),
                surfaces: place.surfaces.clone(),
                acceptance: acceptance(&mut q),
                cosines: cosines(&mut q),
                optical_length: lengths,
                weight_windows,
                most_records: records(&mut q),
                tagged,
                sidebands,
                frequency_domain: frequency_domain(&mut q),
                stokes: q.boolean("stokes"),
            }));
            q.finish(&[]);
        }
        ("irradiancemeter", None) => {
            let message = "an irradiancemeter belongs inside its shape";
            context.error_at(&object.location, message);
        }
        _ => {
            let message = "a fluencemeter belongs in the scene, not in a shape";
            context.error_at(&object.location, message);
        }
    }
    if let Some(film) = film {
        self::film(&film, place.is_some(), context);
    }
    let samples = sampler::build(sampler.as_deref(), PARTICLES, context);
    let instrument = meter.map(|meter| Instrument {
        name: object.id.clone().unwrap_or_else(|| object.plugin.clone()),
        meter,
        normalization,
        gruneisen: pressure,
        metres_per_unit,
    });
    (instrument, samples)
}

/// Checks the film of a meter, which has channels but no pixels. Meters on surfaces exist in
/// Mitsuba too: their films may give a size and a filter.
fn film(object: &ObjectDescription, on_surface: bool, context: &mut Context) {
    if object.plugin != "hdrfilm" {
        unknown_plugin(object, context.diagnostics);
        return;
    }
    let shared = context.channels.names();
    if Channels::of_film(object, context.diagnostics).names() != shared {
        let message = format!(
            "the film of this meter has no effect: meters use the channels {} of the first meter",
            shared.join(", ")
        );
        let help = "give only the first meter a film";
        let warning = lints::warning(lints::METER_FILM, message).help(help.to_owned());
        context.diagnostics.push(warning.at(&object.location));
    }
    let mut q = Query::new(object, context.diagnostics);
    q.word("pixel_format");
    q.has("wavelengths");
    if on_surface {
        q.child(PluginKind::Rfilter);
        let pixels = ["width", "height"].map(|name| q.integer_or(name, 1));
        if pixels != [1, 1] {
            let message = "a meter has no pixels: 'nu' and 'nv' of the meter divide its surface";
            q.warning(lints::METER_FILM, "width", message);
        }
    }
    q.finish(&[]);
}

/// Reads the cells and the estimator of a fluence meter.
fn grid(q: &mut Query) -> Option<(MeterGrid, Estimator)> {
    let coordinates = match q.word("coordinates") {
        "cylindrical" => Coordinates::Cylindrical,
        "spherical" => Coordinates::Spherical,
        _ => Coordinates::Cartesian,
    };
    let names = match coordinates {
        Coordinates::Cartesian => ["nx", "ny", "nz"],
        Coordinates::Cylindrical => ["nr", "", "nz"],
        Coordinates::Spherical => ["nr", "", ""],
    };
    let size = names.map(|name| match name {
        "" => 1,
        name => q.integer(name) as usize,
    });
    let matrix = q.transform("to_world");
    let to_world = affine(matrix, "to_world", q);
    let grid = MeterGrid::new(coordinates, size, to_world);
    if grid.is_none() {
        q.error(
            "to_world",
            "the meter's transform is singular: a scale of zero?",
        );
    }
    let estimator = match q.word("estimator") {
        "collision" => Estimator::Collision,
        _ => Estimator::TrackLength,
    };
    Some((grid?, estimator))
}

/// Reads the bins of optical path length, if any are requested.
fn lengths(q: &mut Query) -> Option<Bins> {
    let names = ["min_bound", "max_bound", "bin_width"];
    if !names.iter().any(|name| q.has(name)) {
        return None;
    }
    film::bins(q, 1.0)
}

/// Reads `weight_windows`. Warns if there are no bins of optical path length, which weight windows
/// serve.
fn weight_windows(q: &mut Query, has_lengths: bool) -> bool {
    let name = "weight_windows";
    let wanted = q.boolean(name);
    if wanted && !has_lengths {
        let message = "'weight_windows' has no effect without bins of optical path length: give 'max_bound' and 'bin_width'";
        q.warning(lints::IGNORED, name, message);
    }
    wanted
}

/// Reads the bins of position; a volume of labels has a single bin for all its surfaces.
fn positions(place: &MeterPlace, objects: &[Object], q: &mut Query) -> Positions {
    let shapes = || place.surfaces.iter().map(|s| &objects[s.object].shape);
    let faces = shapes().map(|shape| match shape {
        Shape::VoxelFaces(faces) => Some(&**faces),
        _ => None,
    });
    let faces: Option<Vec<&VoxelFaces>> = faces.collect();
    let names = ["nu", "nv", "parts"];
    if let (false, None, Some(name)) = (
        place.is_shape,
        &faces,
        names.into_iter().find(|name| q.has(name)),
    ) {
        let message = "smooth surfaces of labels have no coordinates: set 'surface' of the labels to 'voxels'";
        q.error(name, message);
    }
    let mut resolution = || ["nu", "nv"].map(|name| q.integer(name) as usize);
    match (faces, &place.surfaces[..]) {
        (Some(faces), _) => {
            let resolution = resolution();
            Positions::of_voxel_faces(faces, resolution, q.boolean("parts"))
        }
        (None, [surface]) if place.is_shape => {
            let resolution = resolution();
            let shape = &objects[surface.object].shape;
            Positions::new(shape, resolution, q.boolean("parts"))
        }
        _ => Positions::whole(shapes()),
    }
}

/// Reads the part of the surface and the cone of directions that a meter accepts.
fn acceptance(q: &mut Query) -> Acceptance {
    let names = ["center", "radius"];
    let patch = names.iter().any(|name| q.has(name)).then(|| Patch {
        center: q.point("center"),
        radius: q.float("radius"),
    });
    let aperture = "numerical_aperture";
    Acceptance {
        patch,
        numerical_aperture: q.float_if_given(aperture),
    }
}

/// Reads the maximum number of records, if records are requested.
fn records(q: &mut Query) -> Option<usize> {
    let wanted = q.boolean("records");
    let most = if wanted { q.integer("max_records") } else { 0 };
    wanted.then_some(most as usize)
}

/// Reads the request for tagged light: true if records include the phase shift from sound, and the
/// sidebands that separate power.
fn tagged(q: &mut Query, channels: &Channels) -> (bool, Option<Sidebands>) {
    if !q.boolean("tagged") {
        return (false, None);
    }
    let records = q.boolean("records");
    if q.has("wavelength") {
        return (records, tagging::sidebands(q, channels));
    }
    if !records {
        let message = "'tagged' needs a 'wavelength', or 'records' set to true";
        q.error("tagged", message);
    }
    (records, None)
}

/// Reads the bins of the cosine between directions and an axis, if requested.
fn cosines(q: &mut Query) -> Option<Cosines> {
    let axis = q.has("cosine_axis").then(|| q.vector("cosine_axis"));
    if axis.is_none() && !q.has("cosine_bins") {
        return None;
    }
    let count = q.integer("cosine_bins") as usize;
    let unit = axis.and_then(DVec3::try_normalize);
    if axis.is_some() && unit.is_none() {
        q.error("cosine_axis", "the axis must not be zero");
    }
    Some(Cosines { count, axis: unit })
}

/// Reads the parameters of initial pressures, if requested.
fn gruneisen(q: &mut Query) -> Option<Gruneisen> {
    q.has("gruneisen").then(|| Gruneisen {
        parameter: q.float("gruneisen"),
        pulse_energy: q.float("pulse_energy"),
        metres_per_unit: q.float("metres_per_unit"),
    })
}
