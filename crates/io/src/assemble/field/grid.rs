//! Indices sampled on a grid, or computed from samples of a density or a pressure.

use super::super::content::{Content, ContentHasher, SPLINES};
use super::super::context::Context;
use super::super::described::disperses;
use super::super::index_grid::{IndexGrid, Law};
use super::super::sound_record::{FactSource, SeriesRecord, SoundRecord};
use super::super::volume_source::{SOURCE, Source, read, read_series};
use super::super::{placed_grid, units};
use super::condense;
use super::oscillating::{Amplitudes, in_place, oscillating};
use super::rounding::Rounding;
use super::wave::{RequestedSound, Wave, only};
use super::{air, placed};
use crate::diagnostic::lints;
use crate::query::Query;
use crate::scene::{ObjectDescription, Value};
use crate::volume::{Sample, Volume};
use eikonal::field::{Bspline, FieldError, NoiseShares, Placement, Scaled};
use eikonal::{Aabb, Field, Shown};

/// Minimum plausible index. No transparent matter has a smaller index, so a smaller value comes
/// from wrong units.
const MIN_INDEX: f64 = 0.9;

/// Samples of a grid, in single precision if the file has that, so that they need no more memory
/// than the file.
enum Samples {
    Single(Volume<f32>),
    Double(Volume<f64>),
}

/// Evaluates an expression for either precision.
macro_rules! each {
    ($samples:expr, $v:ident => $e:expr) => {
        match $samples {
            Samples::Single($v) => $e,
            Samples::Double($v) => $e,
        }
    };
}

/// Reads the samples. Numbers that are not single precision in the file are read in double
/// precision. Rounding n to single precision would hide contrasts of 1e-6.
fn samples(object: &ObjectDescription, context: &mut Context) -> (Option<Samples>, Source) {
    let (volume, source) = read::<f32>(object, context);
    match volume {
        Some(single) if !single.element().is_single() => {
            drop(single);
            let (volume, source) = read::<f64>(object, context);
            (volume.map(Samples::Double), source)
        }
        volume => (volume.map(Samples::Single), source),
    }
}

impl Samples {
    /// Returns the least and the largest sample, if there are any.
    fn range(&self) -> Option<[f64; 2]> {
        each!(self, v => units::range(v.data()))
    }

    /// Returns the rounding of the samples.
    fn rounding(&self) -> Rounding {
        each!(self, v => {
            let data = v.data();
            Rounding::of(v.element(), data.len(), |i| data[i].wide())
        })
    }
}

/// Builds the field of a volume of type `bspline`, `gladstone_dale` or `pressure`. Samples are
/// interpolated by tricubic B-splines, in the image of the unit cube or of the file's own box under
/// `to_world`. All wavelengths of the film share the spline of the first.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    let requested = (object.plugin == "pressure").then(|| {
        let mut query = Query::new(object, context.diagnostics);
        RequestedSound::of(&mut query)
    });
    let requested = requested.flatten();
    // Sound of one frequency has its own field.
    if let Some(RequestedSound::Wave(wave)) = &requested {
        let known = RequestedSound::parameters(requested.as_ref());
        return sound(wave, known, object, context);
    }
    let disperses = object.plugin == "gladstone_dale" && disperses(object);
    let first = context.channels.wavelength(0).filter(|_| disperses);
    let grid = context.once(
        |assets| &mut assets.index_grids,
        object.number,
        |context| IndexGrid::build(requested.as_ref(), first, object, context),
    )?;
    let nm = disperses.then(|| context.wavelength()).flatten();
    let field = match (grid.law, nm) {
        (Some(law), Some(nm)) if Some(nm) != first => grid.at(nm, &law, object, context)?,
        _ => Bspline::clone(&grid.spline).into(),
    };
    placed(field, grid.rest, object, context)
}

impl IndexGrid {
    /// Builds the grid of a volume, or shares an equal one. `nm` is the wavelength of a law that
    /// depends on the wavelength of the channel.
    fn build(
        requested: Option<&RequestedSound>,
        nm: Option<f64>,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<Self> {
        // Read the samples.
        let known = RequestedSound::parameters(requested);
        let (samples, source) = match requested {
            Some(RequestedSound::Frame(number)) => frame(*number, object, context),
            _ => samples(object, context),
        };
        // Read the law and the smoothing.
        let mut query = Query::new(object, context.diagnostics);
        known.iter().for_each(|name| _ = query.has(name));
        // Assume a known placement if the file could not be read: it may state the placement.
        let says = samples
            .as_ref()
            .is_none_or(|s| each!(s, v => v.frame().is_some()));
        let law = rest(says, object, nm, &mut query);
        let smoothing = smoothing(&mut query);
        let may_condense = query.boolean("condense");
        query.finish(&[]);
        let samples = samples?;
        let (channels, size) = each!(&samples, v => (v.channels(), v.size()));
        if channels != 1 {
            let message =
                format!("a refractive index must have one channel, but the file has {channels}");
            context.error_at(&object.location, message);
            return None;
        }
        // Determine noise and plausibility of the samples.
        let rounding = samples.rounding();
        let factor = law.as_ref().map_or(1.0, |law| law.slope.abs());
        let noise = match smoothing {
            Smoothing::None => 0.0,
            Smoothing::Noise(deviation) => factor * deviation,
            Smoothing::Auto => factor * rounding.deviation,
        };
        let range = samples.range();
        warn_about_units(range, law.as_ref(), object, context);
        context.grids.push(placed_grid::Placed::new(
            placed_grid::Quantity::Index,
            source.to_world,
            &object.location,
        ));
        let placement = source.placement;
        let (bounds, rest) = in_place(source.to_world);
        if let Some(law) = &law {
            each!(&samples, v => check(law, v.data().iter().map(|q| q.wide()), object, context)?);
        }
        // Build the field, or share an equal one.
        let index = |q| law.as_ref().map_or(q, |law| law.index(q));
        let rounded = factor * rounding.deviation;
        let condensing = range.filter(|_| may_condense);
        let tolerance = condensing.map(|range| condense::tolerance(range.map(index), rounded));
        let grid = Grid {
            size,
            bounds,
            placement,
            noise,
            tolerance,
        };
        let content = grid.content(&samples, law.as_ref());
        let field = SPLINES.try_get(content, || grid.field(samples, index));
        let field = context.accept(&object.location, field)?;
        context.assets.held.push(field.clone());
        // Report the reduction and the noise of the samples.
        if let Some(tolerance) = tolerance.filter(|_| field.dims() != size) {
            condense::note(size, &field, tolerance, object, context);
        }
        if smoothing == Smoothing::None {
            let shares = field.noise_shares(rounded);
            warn_of_noise(shares, rounding, object, context);
        }
        Some(IndexGrid {
            spline: field,
            rest,
            law,
            range,
        })
    }

    /// Returns the index at a wavelength in nm, from the grid with `law` at another one; `None`
    /// after an error.
    fn at(
        &self,
        nm: f64,
        law: &Law,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> Option<Field> {
        let mut query = Query::new(object, context.diagnostics);
        let own = self::law(object, Some(nm), &mut query)?;
        check(&own, self.range.into_iter().flatten(), object, context)?;
        // With `scale` 0, the index is constant.
        if law.slope == 0.0 {
            return Some(Bspline::clone(&self.spline).into());
        }
        let field = Scaled::excess(Bspline::clone(&self.spline), law.n0, own.slope / law.slope);
        context.accept(&object.location, field).map(Field::from)
    }
}

/// Placement of samples, with the allowed deviation of the field from them.
struct Grid {
    size: [usize; 3],
    bounds: Aabb,
    placement: Placement,
    /// Standard deviation of the noise of n.
    noise: f64,
    /// Maximum change of n² by a reduction of the samples.
    tolerance: Option<f64>,
}

impl Grid {
    /// Returns the hash of everything on which the field of samples depends.
    fn content(&self, samples: &Samples, law: Option<&Law>) -> Content {
        let Grid {
            size,
            bounds,
            placement,
            noise,
            tolerance,
        } = self;
        let law = law.map(|law| [law.n0, law.slope, law.reference]);
        let is_nodes = f64::from(u8::from(*placement == Placement::Nodes));
        let hasher = ContentHasher::default()
            .doubles(&size.map(|n| n as f64))
            .vectors(&[bounds.min, bounds.max])
            .doubles(&[is_nodes, *noise])
            .doubles(tolerance.as_slice())
            .doubles(law.as_ref().map_or(&[], |law| &law[..]));
        match samples {
            Samples::Single(v) => hasher.singles(v.data()).finish(),
            Samples::Double(v) => hasher.doubles(v.data()).finish(),
        }
    }

    /// Builds the field of an index that follows from samples, with the fewest samples that the
    /// tolerance allows.
    fn field(&self, samples: Samples, index: impl Fn(f64) -> f64) -> Result<Bspline, FieldError> {
        let &Grid {
            size,
            bounds,
            placement,
            noise,
            tolerance,
        } = self;
        if let Some(tolerance) = tolerance.filter(|_| noise == 0.0) {
            let fewer = each!(&samples, v => {
                Bspline::from_fewer(size, bounds, placement, v.data(), &index, tolerance)
            });
            if let Some(fewer) = fewer {
                return Ok(fewer);
            }
        }
        let field = match samples {
            Samples::Single(v) => {
                Bspline::from_vec(size, bounds, placement, v.into_data(), index, noise)?
            }
            Samples::Double(v) => {
                let mut data = v.into_data();
                data.iter_mut().for_each(|q| *q = index(*q));
                Bspline::smoothed(size, bounds, placement, &data, noise)?
            }
        };
        let smooth = tolerance.filter(|_| noise > 0.0);
        Ok(smooth
            .and_then(|tolerance| field.condensed(tolerance))
            .unwrap_or(field))
    }
}

/// Reads the remaining parameters of a volume. `says` is true if its file states the placement of
/// the samples.
fn rest(says: bool, object: &ObjectDescription, nm: Option<f64>, query: &mut Query) -> Option<Law> {
    for known in SOURCE {
        query.has(known);
    }
    if !query.has("placement") && !says {
        let message = "a grid of the index needs 'placement': \"centers\" if samples \
                       sit at voxel centres, \"nodes\" if the outermost lie on the bounds";
        query.error("filename", message);
    }
    law(object, nm, query)
}

/// Reads the samples of one frame of a time series.
fn frame(
    number: usize,
    object: &ObjectDescription,
    context: &mut Context,
) -> (Option<Samples>, Source) {
    let (series, source) = read_series(object, context, &mut |shape| only(number, shape));
    let samples = series.map(|series| {
        context.sounds.push(SoundRecord {
            series: Some(SeriesRecord {
                frames: series.shape.frames,
                first: number,
                used: 1,
                time_step: series.shape.time_step.map(|step| (step, FactSource::File)),
                residual: None,
            }),
            ..source.record(object, series.sums.size())
        });
        Samples::Double(series.sums)
    });
    (samples, source)
}

/// Builds the field of sound with one frequency. `known` lists the parameters that `wave` was read
/// from.
fn sound(
    wave: &Wave,
    known: &[&str],
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Field> {
    let mut form = None;
    let (series, source) = read_series(object, context, &mut |shape| {
        let found = wave.form(shape)?;
        let sums = found.sums();
        form = Some(found);
        Ok(sums)
    });
    let mut query = Query::new(object, context.diagnostics);
    known.iter().for_each(|name| _ = query.has(name));
    let says = series.as_ref().is_none_or(|s| s.sums.frame().is_some());
    let law = rest(says, object, None, &mut query);
    query.finish(&[]);
    let (series, law) = (series?, law?);
    let (size, of_file) = (series.sums.size(), series.shape.time_step);
    let found = wave.found(&form?, series);
    for warning in found
        .series
        .iter()
        .flat_map(|record| wave.warnings(record, of_file))
    {
        let warning = lints::warning(lints::SOUND_SAMPLES, warning.message)
            .help(warning.help.map(String::from));
        context.diagnostics.push(warning.at(&object.location));
    }
    let amplitudes = Amplitudes {
        pressure: found.pressure,
        record: SoundRecord {
            series: found.series,
            ..source.record(object, size)
        },
        frequency: wave.frequency,
        n0: law.n0,
        slope: law.slope,
        wavelength: wave.wavelength,
        elasto_optic: wave.elasto_optic,
    };
    oscillating(amplitudes, object, context)
}

/// Smoothing of samples by the spline.
#[derive(Clone, Copy, PartialEq)]
enum Smoothing {
    None,
    /// Smoothing by the rounding of the samples.
    Auto,
    /// Smoothing for noise of this standard deviation, in the unit of the samples.
    Noise(f64),
}

/// Reads `smoothing`: a word, or a standard deviation.
fn smoothing(query: &mut Query) -> Smoothing {
    let name = "smoothing";
    if !query.has(name) {
        return Smoothing::None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name);
    if property.is_some_and(|p| matches!(p.value, Value::String(_))) {
        match query.word(name) {
            "auto" => Smoothing::Auto,
            _ => Smoothing::None,
        }
    } else {
        match query.float(name) {
            0.0 => Smoothing::None,
            deviation => Smoothing::Noise(deviation),
        }
    }
}

/// Maximum relative contributions of rounding to first and second derivatives without a warning.
const MAX_NOISE: [f64; 2] = [1e-3, 0.1];

/// Warns if rounding of the samples contributes too much to the derivatives of the index.
fn warn_of_noise(
    shares: NoiseShares,
    rounding: Rounding,
    object: &ObjectDescription,
    context: &mut Context,
) {
    if shares.first <= MAX_NOISE[0] && shares.second <= MAX_NOISE[1] {
        return;
    }
    let percent = |share: f64| match 100.0 * share {
        p if p < 10.0 => format!("{p:.2} %"),
        p => format!("{p:.0} %"),
    };
    let message = format!(
        "the samples are rounded to {}, which on a grid this fine makes up {} of the gradient of the index, by which \
         rays bend, {} of its second derivatives, which make focusing and brightness, and {} of its fourth, by which \
         steps are chosen",
        rounding.to,
        percent(shares.first),
        percent(shares.second),
        percent(shares.fourth)
    );
    let help = "give the samples in float64, or as contrasts (morgana convert --contrast), or set 'smoothing' to \
                \"auto\"";
    let warning = lints::warning(lints::ROUNDED_SAMPLES, message).at(&object.location);
    context.diagnostics.push(warning.help(help.to_owned()));
}

/// Reads the law of the samples, or `None` if the samples are the index itself. `nm` is the
/// wavelength of the channel if it has one.
fn law(object: &ObjectDescription, nm: Option<f64>, q: &mut Query) -> Option<Law> {
    let law = match object.plugin.as_str() {
        "gladstone_dale" => Law {
            n0: q.float("n0"),
            slope: air::constant(nm, q),
            reference: q.float("reference"),
        },
        "pressure" => Law {
            n0: q.float("n0"),
            slope: dn_dp(q),
            reference: q.float("reference"),
        },
        _ if q.has("scale") || q.has("offset") => Law {
            n0: q.float("offset"),
            slope: 1.0,
            reference: 0.0,
        },
        _ => return None,
    };
    let scale = q.float("scale");
    Some(Law {
        slope: law.slope * scale,
        ..law
    })
}

/// Reads the change of the index with pressure, per pascal.
pub(super) fn dn_dp(q: &mut Query) -> f64 {
    q.float("dn_dp")
}

/// Reports a sample that gives no valid index.
fn check(
    law: &Law,
    mut samples: impl Iterator<Item = f64>,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<()> {
    let bad = samples.find(|q| {
        let n = law.index(*q);
        !n.is_finite() || n < MIN_INDEX
    });
    let Some(q) = bad else {
        return Some(());
    };
    let message = format!(
        "a sample of {q:e} makes an index of {}: check the units of the file, and 'scale'",
        Shown::rounded(law.index(q))
    );
    context.error_at(&object.location, message);
    None
}

/// Warns about samples that are probably another quantity than declared.
fn warn_about_units(
    range: Option<[f64; 2]>,
    law: Option<&Law>,
    object: &ObjectDescription,
    context: &mut Context,
) {
    let Some(samples) = range else {
        return;
    };
    let [a, b] = samples.map(|q| law.map_or(q, |law| law.index(q)));
    let range = [a.min(b), a.max(b)];
    let [least, most] = range;
    let found = match (object.plugin.as_str(), law) {
        ("gladstone_dale", Some(law)) => units::of_gas(range, law.n0).map(|warning| {
            let message = format!("the densities make indices from {least:.9} to {most:.9}: {warning}");
            (message, "check the units of the file, and 'scale'")
        }),
        ("pressure", Some(law)) => units::of_pressure(range, law.n0).map(|warning| {
            let message = format!("the pressures make indices from {least:.6} to {most:.6}: {warning}");
            (message, "check the units of the file, 'dn_dp' and 'scale'")
        }),
        _ => units::taken_for_index(range).map(|(what, advice)| {
            let message = format!(
                "the samples are taken for an index of refraction, but range from {} to {}: they look like {what}",
                Shown::rounded(least),
                Shown::rounded(most)
            );
            (message, advice)
        }),
    };
    if let Some((message, advice)) = found {
        let warning = lints::warning(lints::IMPLAUSIBLE_INDEX, message).help(String::from(advice));
        context.diagnostics.push(warning.at(&object.location));
    }
}
