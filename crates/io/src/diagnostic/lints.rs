//! Checks that warn about scenes. Users silence a check by its name.

use super::{Diagnostic, suggest};
use transport::lints;
use transport::scene::{Lint, ProblemSeverity, SceneProblem};

lints! {
    ABSENT_LABELS: "absent_labels", "Media of labels that no voxel has.";
    ANIMATION: "animation", "Motion, which morgana does not render.";
    BLACK_EMITTER: "black_emitter", "An emitter whose light is 0.";
    CLIPPED_VALUES: "clipped_values", "Values beyond their limits, which are clipped.";
    CONTRADICTING_INDEX: "contradicting_index", "An index stated twice, in nearly equal numbers.";
    DENSE_SPHERES: "dense_spheres", "Spheres so dense that they do not scatter independently.";
    DEPOLARIZING: "depolarizing", "Surfaces and media that morgana takes to depolarise light.";
    DIFFERS_FROM_MITSUBA: "differs_from_mitsuba", "Something that Mitsuba 3 renders differently.";
    EMPTY_MESH: "empty_mesh", "A mesh without a triangle of positive area.";
    EXTINCTION_UNITS: "extinction_units", "An extinction that looks like other units of length.";
    FEW_SAMPLES: "few_samples", "Too few samples for adaptive sampling.";
    FLAT_HEIGHTS: "flat_heights", "A height map without slopes.";
    FLUORESCENCE: "fluorescence", "Fluorescence that no light excites, or a lifetime that looks like other units.";
    GLASS_IN_GLASS: "glass_in_glass", "Glass inside other glass with an index outside of its own.";
    IGNORED: "ignored", "A parameter, object or option without an effect.";
    IMPLAUSIBLE_INDEX: "implausible_index", "Numbers that look like another quantity than an index, or like other units.";
    LONG_PATHS: "long_paths", "Paths that hardly ever end.";
    MANY_STEPS: "many_steps", "A medium through which rays take very many steps.";
    MESH_HOLES: "mesh_holes", "Spaces that a mesh of tetrahedra encloses and leaves empty.";
    MESH_OUTSIDE: "mesh_outside", "Elements of region 0 in a mesh of tetrahedra that are left out, because one of them is flat.";
    METER_FILM: "meter_film", "Channels or pixels in the film of a meter, which has none of its own.";
    METER_INTEGRATOR: "meter_integrator", "An integrator that meters use only in part.";
    METER_IN_THE_CLEAR: "meter_in_the_clear", "A meter where no medium attenuates light.";
    MISSING_LIGHT: "missing_light", "Light that the integrator does not find.";
    MODULATION: "modulation", "Modulated light with phases that look like other units, or in media without an index.";
    NARROW_VIEW: "narrow_view", "A field of view that looks like radians.";
    NOT_A_ROTATION: "not_a_rotation", "A transform that changes lengths where only rotations are possible.";
    NO_LIGHT_ENTERS: "no_light_enters", "A medium in an opaque hull.";
    NO_SENSOR: "no_sensor", "A scene without a camera.";
    NO_TEXTURE_COORDINATES: "no_texture_coordinates", "An image on a mesh without texture coordinates.";
    OTHER_DIALECT: "other_dialect", "A scene written for older versions of Mitsuba, or for other programs.";
    OVERLAPPING_MEDIA: "overlapping_media", "Shapes of different media that overlap in part.";
    POINT_SENSOR: "point_sensor", "A radiancemeter with more than one pixel.";
    REPLACED_SAMPLER: "replaced_sampler", "A sampler that another one replaces.";
    ROUNDED_SAMPLES: "rounded_samples", "Samples of an index whose rounding bends rays.";
    SAMPLE_COUNT: "sample_count", "A number of samples that is rounded up.";
    SEVERAL_CAMERAS: "several_cameras", "More than one camera.";
    SKIPPED_FACES: "skipped_faces", "Faces of a mesh with fewer than three corners.";
    SMALL_GRID: "small_grid", "A grid or table that ends inside the shape that it fills.";
    SOUND_FREQUENCIES: "sound_frequencies", "Sounds whose frequencies may differ.";
    SOUND_SAMPLES: "sound_samples", "Samples of sound that do not fit its frequency.";
    SUN_BELOW_HORIZON: "sun_below_horizon", "A sky at night.";
    TAGGED_WAVELENGTH: "tagged_wavelength", "A wavelength of tagged light that looks like other units.";
    THIN_BEAM: "thin_beam", "A beam without a width.";
    UNREFERENCED: "unreferenced", "Definitions to which nothing refers.";
}

/// Returns all checks, in the order of their names.
pub fn all() -> Vec<Lint> {
    let mut all = [ALL, transport::scene::lint::ALL].concat();
    all.sort();
    all
}

/// Returns the check of a name.
///
/// # Errors
/// Message with the known names.
pub fn named(name: &str) -> Result<Lint, String> {
    let all = all();
    if let Some(lint) = all.iter().find(|lint| lint.name == name) {
        return Ok(*lint);
    }
    let names: Vec<&str> = all.iter().map(|lint| lint.name).collect();
    let advice = suggest(name, names.iter().copied())
        .unwrap_or_else(|| format!("there are: {}", names.join(", ")));
    Err(format!("no check has the name '{name}': {advice}"))
}

/// Makes a warning of a check.
pub(crate) fn warning(lint: Lint, message: impl Into<String>) -> Diagnostic {
    Diagnostic::warning(message).of(lint)
}

/// Converts a problem of a scene to a diagnostic without a place.
pub(crate) fn of_scene(problem: &SceneProblem) -> Diagnostic {
    let message = problem.message.clone();
    let diagnostic = match problem.severity {
        ProblemSeverity::Error => Diagnostic::error(message),
        ProblemSeverity::Warning(lint) => warning(lint, message),
    };
    diagnostic.help(problem.help.clone())
}

/// Makes a note of a check.
pub(crate) fn note(lint: Lint, message: impl Into<String>) -> Diagnostic {
    Diagnostic::note(message).of(lint)
}
