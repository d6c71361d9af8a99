//! Films: size, filter and decomposition of light.

use super::context::Context;
use crate::diagnostic::suggest;
use crate::query::{Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Shown;
use transport::Bins;
use transport::film::{Decomposition, Filter, SignedFilter};
use transport::scene::{FilmSpec, FilmWindow};

/// Maximum number of bins.
const MAX_BINS: f64 = 65536.0;
/// Tolerance with which the width must divide the range of bins, relative to a bin. It suits
/// numbers that users give with ten digits.
const DIVISION_TOLERANCE: f64 = 1e-6;

/// Film with its decomposition of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilmParts {
    pub spec: FilmSpec,
    pub layering: Layering,
    pub reweight: bool,
}

/// Decomposition of the light on a film into layers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layering {
    /// Decomposition with bins of optical length, even if the file gives bins of time.
    pub decomposition: Decomposition,
    /// Speed of light in scene units per unit of time, if the file gives bins of time.
    pub speed_of_light: Option<f64>,
}

impl Layering {
    /// Returns the bins in the units of the file.
    pub fn bins(&self) -> Option<Bins> {
        let speed = self.speed_of_light.unwrap_or(1.0);
        self.decomposition.length.map(|bins| Bins {
            min: bins.min / speed,
            max: bins.max / speed,
            ..bins
        })
    }
}

/// Builds the film that an object describes, or the default film without an object.
pub(super) fn build(object: Option<&ObjectDescription>, context: &mut Context) -> FilmParts {
    let mut film = FilmParts {
        spec: FilmSpec {
            width: 768,
            height: 576,
            channels: context.channels.count(),
            group_size: context.channels.group_size(),
            filter: Filter::Gaussian { stddev: 0.5 },
            window: None,
        },
        layering: Layering::default(),
        reweight: false,
    };
    let Some(object) = object else {
        return film;
    };
    if object.plugin != "hdrfilm" {
        unknown_plugin(object, context.diagnostics);
        return film;
    }
    let mut q = Query::new(object, context.diagnostics);
    film.spec.width = q.integer("width") as usize;
    film.spec.height = q.integer("height") as usize;
    crop(&mut film.spec, &mut q);
    q.word("pixel_format");
    q.has("wavelengths");
    // Light from beyond the edge of the image always counts.
    q.boolean("sample_border");
    // Accept parameters of Mitsuba's scene files. The command decides the format of image files.
    q.boolean("compensate");
    q.has("file_format");
    q.has("component_format");
    film.layering = layering(&mut q);
    film.reweight = q.boolean("reweight");
    let filter = q.child(PluginKind::Rfilter).cloned();
    q.finish(&BOUNDS);
    if let Some(object) = filter {
        film.spec.filter = self::filter(&object, context);
    }
    film
}

/// Restricts the film to the requested crop window.
fn crop(spec: &mut FilmSpec, q: &mut Query) {
    let image = [spec.width, spec.height];
    let mut side = |[offset, size]: [&str; 2], whole: usize| {
        let offset = q.integer_within(offset, 0..=whole as i64 - 1, 0) as usize;
        let left = whole.saturating_sub(offset).max(1);
        let size = q.integer_within(size, 1..=left as i64, left as i64) as usize;
        [offset, size]
    };
    let [x, width] = side(["crop_offset_x", "crop_width"], spec.width);
    let [y, height] = side(["crop_offset_y", "crop_height"], spec.height);
    if [width, height] != image {
        (spec.width, spec.height) = (width, height);
        spec.window = Some(FilmWindow {
            image,
            corner: [x as f64, y as f64],
        });
    }
}

/// Builds a reconstruction filter; a box after an error.
fn filter(object: &ObjectDescription, context: &mut Context) -> Filter {
    let mut q = Query::new(object, context.diagnostics);
    let filter = match object.plugin.as_str() {
        "box" => Filter::Box,
        "tent" => Filter::Tent {
            radius: q.float("radius"),
        },
        "gaussian" => Filter::Gaussian {
            stddev: q.float("stddev"),
        },
        "mitchell" => {
            let [b, c] = ["B", "C"].map(|name| q.float(name));
            Filter::Signed(SignedFilter::cubic(b, c))
        }
        "catmullrom" => Filter::Signed(SignedFilter::cubic(0.0, 0.5)),
        "lanczos" => {
            let lobes = q.integer("lobes");
            Filter::Signed(SignedFilter::lanczos(lobes as u8))
        }
        _ => {
            unknown_plugin(object, context.diagnostics);
            return Filter::Box;
        }
    };
    q.finish(&[]);
    filter
}

/// Ways to decompose light. `transient` means `length`.
const DECOMPOSITIONS: [&str; 5] = ["length", "time", "bounce", "light", "transient"];
/// Parameters that only some of the ways need.
const BOUNDS: [&str; 5] = [
    "min_bound",
    "max_bound",
    "bin_width",
    "speed_of_light",
    "max_bounces",
];

/// Reads the decomposition of light into layers.
fn layering(q: &mut Query) -> Layering {
    let mut layering = Layering::default();
    if !q.has("decomposition") {
        return layering;
    }
    let text = q.string("decomposition");
    let words: Vec<&str> = text.split(',').map(str::trim).collect();
    for (i, word) in words.iter().enumerate() {
        if !DECOMPOSITIONS.contains(word) {
            let help = suggest(word, DECOMPOSITIONS).unwrap_or_else(|| {
                format!(
                    "it is a list of: {}, separated by commas",
                    DECOMPOSITIONS[..4].join(", ")
                )
            });
            q.error(
                "decomposition",
                format!("light cannot be separated by '{word}'; {help}"),
            );
        } else if words[..i].contains(word) {
            q.error("decomposition", format!("'{word}' is there twice"));
        }
    }
    let has = |word| words.contains(&word);
    let (by_length, by_time) = (has("length") || has("transient"), has("time"));
    if by_time && by_length {
        let message = "give length or time, not both: time is length over 'speed_of_light'";
        q.error("decomposition", message);
    }
    if by_time {
        layering.speed_of_light = Some(q.float("speed_of_light"));
    }
    if by_length || by_time {
        layering.decomposition.length = bins(q, layering.speed_of_light.unwrap_or(1.0));
    }
    if has("bounce") {
        let most = q.integer("max_bounces");
        layering.decomposition.bounces = Some(most as u32);
    }
    if has("light") {
        // The number of emitters is filled in when all are known.
        layering.decomposition.emitters = Some(0);
    }
    layering
}

/// Reads bins of length whose bounds the file gives in another unit. `unit` is the length of that
/// unit.
pub(super) fn bins(q: &mut Query, unit: f64) -> Option<Bins> {
    let min = q.float("min_bound");
    let max = q.float("max_bound");
    let width = q.float("bin_width");
    if !(q.has("max_bound") && q.has("bin_width")) {
        return None;
    }
    if min >= max {
        let message = format!(
            "'max_bound' is {} but must be greater than 'min_bound', {}",
            Shown(max),
            Shown(min)
        );
        q.error("max_bound", message);
        return None;
    }
    let ratio = (max - min) / width;
    if ratio > MAX_BINS {
        let message = format!(
            "these are {} bins; at most {MAX_BINS} are possible",
            Shown::rounded(ratio)
        );
        q.error("bin_width", message);
        return None;
    }
    let count = ratio.round().max(1.0);
    if (ratio - count).abs() > DIVISION_TOLERANCE {
        let message = format!(
            "bins of {} do not fill the range from {} to {}: there would be {}; {count} of {} would",
            Shown(width),
            Shown(min),
            Shown(max),
            Shown::rounded(ratio),
            Shown((max - min) / count)
        );
        q.error("bin_width", message);
        return None;
    }
    Some(Bins {
        min: min * unit,
        max: max * unit,
        count: count as usize,
    })
}
