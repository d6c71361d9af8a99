//! Films: size, filter, and how light is told apart.

use super::context::Context;
use crate::diagnostic::suggest;
use crate::query::{POSITIVE, Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Shown;
use std::ops::RangeInclusive;
use transport::Bins;
use transport::film::{Decomposition, Filter, SignedFilter};
use transport::scene::{FilmSpec, FilmWindow};

/// At most so many pixels along a side.
const LARGEST_SIDE: i64 = 1 << 16;
/// At most so many bins.
const MOST_BINS: f64 = 65536.0;
/// Parameters of Mitchell's filter: others have lobes without end.
const SHARES: RangeInclusive<f64> = -4.0..=4.0;
/// At most so many lobes of Lanczos' filter.
const MOST_LOBES: i64 = 16;
/// How closely the width must divide the range of bins, relative to a bin: a user's ten digits.
const DIVISION: f64 = 1e-6;

/// A film, and how it tells light apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilmParts {
    pub spec: FilmSpec,
    pub layering: Layering,
    pub reweight: bool,
}

/// How a film tells light apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layering {
    /// In optical length, whatever the file speaks of.
    pub decomposition: Decomposition,
    /// Speed of light in scene units per unit of time, if the file gives bins of time.
    pub speed_of_light: Option<f64>,
}

impl Layering {
    /// The bins in the units of the file.
    pub fn bins(&self) -> Option<Bins> {
        let speed = self.speed_of_light.unwrap_or(1.0);
        self.decomposition.length.map(|bins| Bins {
            min: bins.min / speed,
            max: bins.max / speed,
            ..bins
        })
    }
}

/// The film that an object describes, or that of no object.
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
    film.spec.width = q.integer_in("width", 1..=LARGEST_SIDE, 768) as usize;
    film.spec.height = q.integer_in("height", 1..=LARGEST_SIDE, 576) as usize;
    crop(&mut film.spec, &mut q);
    q.one_of("pixel_format", &["rgb", "luminance", "spectral"]);
    q.has("wavelengths");
    // Light from beyond the image's edge always counts.
    q.boolean_or("sample_border", true);
    // How files are written is the command's business; Mitsuba's scene files say it here.
    q.boolean_or("compensate", false);
    q.string_or("file_format", "openexr");
    q.string_or("component_format", "float32");
    film.layering = layering(&mut q);
    film.reweight = q.boolean_or("reweight", false);
    let filter = q.child(PluginKind::Rfilter).cloned();
    q.finish(&BOUNDS);
    if let Some(object) = filter {
        film.spec.filter = self::filter(&object, context);
    }
    film
}

/// Leaves of the film the part that is asked for.
fn crop(spec: &mut FilmSpec, q: &mut Query) {
    let image = [spec.width, spec.height];
    let mut side = |[offset, size]: [&str; 2], whole: usize| {
        let offset = q.integer_in(offset, 0..=whole as i64 - 1, 0) as usize;
        let left = whole.saturating_sub(offset).max(1);
        let size = q.integer_in(size, 1..=left as i64, left as i64) as usize;
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

fn filter(object: &ObjectDescription, context: &mut Context) -> Filter {
    let mut q = Query::new(object, context.diagnostics);
    let filter = match object.plugin.as_str() {
        "box" => Filter::Box,
        "tent" => Filter::Tent {
            radius: q.float_in("radius", POSITIVE, 1.0),
        },
        "gaussian" => Filter::Gaussian {
            stddev: q.float_in("stddev", POSITIVE, 0.5),
        },
        "mitchell" => {
            let [b, c] = ["B", "C"].map(|name| q.float_in(name, SHARES, 1.0 / 3.0));
            Filter::Signed(SignedFilter::cubic(b, c))
        }
        "catmullrom" => Filter::Signed(SignedFilter::cubic(0.0, 0.5)),
        "lanczos" => {
            let lobes = q.integer_in("lobes", 1..=MOST_LOBES, 3);
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

/// What light may be told apart by; the first and the last are one and the same.
const WAYS: [&str; 5] = ["length", "time", "bounce", "light", "transient"];
/// Parameters that only some of these need.
const BOUNDS: [&str; 5] = [
    "min_bound",
    "max_bound",
    "bin_width",
    "speed_of_light",
    "max_bounces",
];

fn layering(q: &mut Query) -> Layering {
    let mut layering = Layering::default();
    if !q.has("decomposition") {
        return layering;
    }
    let text = q.string("decomposition");
    let words: Vec<&str> = text.split(',').map(str::trim).collect();
    for (i, word) in words.iter().enumerate() {
        if !WAYS.contains(word) {
            let help = suggest(word, WAYS).unwrap_or_else(|| {
                format!(
                    "it is a list of: {}, separated by commas",
                    WAYS[..4].join(", ")
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
        let message = "length and time are one: time is length over 'speed_of_light'";
        q.error("decomposition", message);
    }
    if by_time {
        layering.speed_of_light = Some(q.float_in("speed_of_light", POSITIVE, None));
    }
    if by_length || by_time {
        layering.decomposition.length = bins(q, layering.speed_of_light.unwrap_or(1.0));
    }
    if has("bounce") {
        let most = q.integer_in(
            "max_bounces",
            0..=i64::from(Decomposition::MOST_BOUNCES),
            None,
        );
        layering.decomposition.bounces = Some(most as u32);
    }
    if has("light") {
        // How many there are is settled when all are known.
        layering.decomposition.emitters = Some(0);
    }
    layering
}

/// Bins of length from bounds that are given in other units, of which `unit` is the length.
pub(super) fn bins(q: &mut Query, unit: f64) -> Option<Bins> {
    let min = q.float_or("min_bound", 0.0);
    let max = q.float_in("max_bound", .., None);
    let width = q.float_in("bin_width", POSITIVE, None);
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
    if ratio > MOST_BINS {
        let message = format!(
            "these are {} bins; at most {MOST_BINS} are possible",
            Shown::rounded(ratio)
        );
        q.error("bin_width", message);
        return None;
    }
    let count = ratio.round().max(1.0);
    if (ratio - count).abs() > DIVISION {
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
