//! Indices sampled on a grid, or following from samples of a density or a pressure.

use super::super::context::Context;
use super::super::texture::{SOURCE, Source, read};
use super::super::{reach, units};
use super::rounding::Rounding;
use super::wave::{Asked, Series, Wave};
use super::{air, placed};
use crate::diagnostic::Diagnostic;
use crate::error::Problem;
use crate::query::{INDEX, Query};
use crate::scene::{ObjectDescription, Value};
use crate::volume::{Sample, Volume};
use eikonal::field::{Bspline, NoiseShares, Placement, SampledSound, SoundSamples};
use eikonal::{Aabb, Field, Shown};
use glam::{DAffine3, DMat3, DVec3};

/// More than any liquid or gas has, in 1/Pa; water has 1.4e-10.
const LARGEST_DN_DP: f64 = 1e-6;
/// An index below this is a mistake of units: no matter that light passes has one.
const LEAST_INDEX: f64 = 0.9;

/// What a sample q says of the index: n = `n0` + `slope` (q − `reference`).
#[derive(Clone, Copy)]
struct Law {
    n0: f64,
    slope: f64,
    reference: f64,
}

/// The samples of a grid, in single precision if that holds what the file has: in no more memory than the file.
enum Samples {
    Single(Volume<f32>),
    Double(Volume<f64>),
}

/// Calls the same on either.
macro_rules! each {
    ($samples:expr, $v:ident => $e:expr) => {
        match $samples {
            Samples::Single($v) => $e,
            Samples::Double($v) => $e,
        }
    };
}

/// Reads the samples. Rounding of n to single would drown contrasts of 1e-6, so other numbers are read in double precision.
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
    /// Least and largest, if there are any.
    fn range(&self) -> Option<[f64; 2]> {
        each!(self, v => units::range(v.data().iter().map(|q| q.wide())))
    }

    /// One of the channels alone.
    fn only(self, channel: usize) -> Result<Self, Problem> {
        Ok(match self {
            Samples::Single(v) => Samples::Single(v.only(channel)?),
            Samples::Double(v) => Samples::Double(v.only(channel)?),
        })
    }

    /// What they were rounded to.
    fn rounding(&self) -> Rounding {
        each!(self, v => {
            let data = v.data();
            Rounding::of(v.element(), data.len(), |i| data[i].wide())
        })
    }
}

/// The field of a volume of type `bspline`, `gladstone_dale` or `pressure`: samples, interpolated by
/// tricubic B-splines, in the box that `to_world` makes of the unit cube or of the file's own box.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    let (samples, source) = samples(object, context);
    let nm = context.channels.wavelength(context.group);
    let mut query = Query::new(object, context.diagnostics);
    for known in SOURCE {
        query.has(known);
    }
    // A file that cannot be read may say it.
    let says = samples
        .as_ref()
        .is_none_or(|s| each!(s, v => v.frame().is_some()));
    if !query.has("placement") && !says {
        let message = "a grid of the index needs 'placement': \"centers\" if samples \
                       sit at voxel centres, \"nodes\" if the outermost lie on the bounds";
        query.error("filename", message);
    }
    let law = law(object, nm, &mut query);
    let smoothing = smoothing(&mut query);
    let asked = (object.plugin == "pressure").then(|| Asked::of(&mut query));
    let asked = asked.flatten();
    if matches!(asked, Some(Asked::Wave(_))) {
        for name in ["reference", "smoothing"] {
            if query.has(name) {
                let message = "of no use for sound of a frequency, which is an amplitude";
                query.error(name, message);
            }
        }
    }
    query.finish(&[]);
    let mut samples = samples?;
    match asked {
        None => {}
        Some(Asked::Frame(frame)) => {
            let only = samples.only(frame);
            samples = context.accept(&object.location, only)?;
        }
        Some(Asked::Wave(wave)) => return sound(&samples, &wave, law?, &source, object, context),
    }
    let (channels, size) = each!(&samples, v => (v.channels(), v.size()));
    if channels != 1 {
        let message = format!("a refractive index has one channel, this has {channels}");
        context.error_at(&object.location, message);
        return None;
    }
    let rounding = samples.rounding();
    let factor = law.as_ref().map_or(1.0, |law| law.slope.abs());
    let noise = match smoothing {
        Smoothing::None => 0.0,
        Smoothing::Noise(deviation) => factor * deviation,
        Smoothing::Auto => factor * rounding.deviation,
    };
    doubt_units(samples.range(), law.as_ref(), object, context);
    context.grids.push(reach::Placed::new(
        reach::Quantity::Index,
        source.to_world,
        &object.location,
    ));
    let placement = [Placement::Centers, Placement::Nodes][source.placement];
    let (bounds, rest) = in_place(source.to_world);
    if let Some(law) = &law {
        each!(&samples, v => check(law, v.data(), object, context)?);
    }
    let index = |q| law.as_ref().map_or(q, |law| law.index(q));
    let field = match samples {
        Samples::Single(v) => {
            Bspline::from_vec(size, bounds, placement, v.into_data(), index, noise)
        }
        Samples::Double(v) => {
            let mut data = v.into_data();
            data.iter_mut().for_each(|q| *q = index(*q));
            Bspline::smoothed(size, bounds, placement, &data, noise)
        }
    };
    let field = context.accept(&object.location, field)?;
    if smoothing == Smoothing::None {
        let shares = field.noise_shares(factor * rounding.deviation);
        warn_of_noise(shares, rounding, object, context);
    }
    placed(field.into(), rest, object, context)
}

/// The box of the samples, and the transform that it needs at run time: none if it is aligned with the axes.
fn in_place(map: DAffine3) -> (Aabb, Option<DAffine3>) {
    let diagonal = DMat3::from_diagonal(map.matrix3.diagonal());
    let aligned = map.matrix3 == diagonal && diagonal.diagonal().min_element() > 0.0;
    if aligned {
        let end = map.transform_point3(DVec3::ONE);
        (Aabb::new(map.translation, end), None)
    } else {
        (Aabb::new(DVec3::ZERO, DVec3::ONE), Some(map))
    }
}

/// The field of sound of a frequency that samples say.
fn sound(
    samples: &Samples,
    wave: &Wave,
    law: Law,
    source: &Source,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Field> {
    let (count, size, time_step) = each!(samples, v => (v.channels(), v.size(), v.time_step()));
    let at = |i: usize| each!(samples, v => v.data()[i].wide());
    let series = Series {
        count,
        time_step,
        at: &at,
        places: size.iter().product(),
    };
    let amplitudes = Amplitudes {
        pressure: wave.amplitudes(&series, object, context)?,
        size,
        placement: [Placement::Centers, Placement::Nodes][source.placement],
        to_world: source.to_world,
        n0: law.n0,
        slope: law.slope,
        wavelength: wave.wavelength,
    };
    oscillating(amplitudes, object, context)
}

/// Samples of sound of a frequency.
pub(super) struct Amplitudes {
    /// Real and imaginary parts of the pressure, Pa; x runs fastest.
    pub pressure: Vec<[f64; 2]>,
    /// Number of samples along x, y and z.
    pub size: [usize; 3],
    pub placement: Placement,
    /// From the unit cube, which they fill.
    pub to_world: DAffine3,
    /// Index without sound.
    pub n0: f64,
    /// Change of the index with the pressure.
    pub slope: f64,
    /// Of the sound, in the world.
    pub wavelength: f64,
}

/// The field of sound of a frequency.
pub(super) fn oscillating(
    samples: Amplitudes,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Field> {
    let in_index = |[re, im]: &[f64; 2]| [re, im].map(|v| (samples.slope * v) as f32);
    let amplitude: Vec<[f32; 2]> = samples.pressure.iter().map(in_index).collect();
    let most = amplitude.iter().map(|[re, im]| f64::from(re.hypot(*im)));
    let most = most.fold(0.0, f64::max);
    if let Some(doubt) = units::of_pressure([samples.n0 - most, samples.n0 + most], samples.n0) {
        let message = format!("the sound changes the index by up to {most:.3e}: {doubt}");
        let help = match object.plugin.as_str() {
            "transducer" => "check 'pressure' and 'dn_dp'",
            _ => "check the units of the file, 'dn_dp' and 'scale'",
        };
        let warning = Diagnostic::warning(message).help(help.to_owned());
        context.diagnostics.push(warning.at(&object.location));
    }
    let quantity = reach::Quantity::Index;
    let grid = reach::Placed::new(quantity, samples.to_world, &object.location);
    context.grids.push(grid);
    let (bounds, rest) = in_place(samples.to_world);
    let field = SampledSound::new(SoundSamples {
        size: samples.size,
        bounds,
        placement: samples.placement,
        amplitude,
        n0: samples.n0,
        wavelength: samples.wavelength
            / rest.map_or(1.0, |map| map.matrix3.determinant().abs().cbrt()),
        noise: 0.0,
    });
    let field = context.accept(&object.location, field)?;
    placed(field.into(), rest, object, context)
}

/// How far a spline may pass samples by.
#[derive(Clone, Copy, PartialEq)]
enum Smoothing {
    None,
    /// By the rounding that they show.
    Auto,
    /// By noise of this standard deviation, in the samples' unit.
    Noise(f64),
}

fn smoothing(query: &mut Query) -> Smoothing {
    let name = "smoothing";
    if !query.has(name) {
        return Smoothing::None;
    }
    let property = query.object().properties.iter().find(|p| p.name == name);
    if property.is_some_and(|p| matches!(p.value, Value::String(_))) {
        [Smoothing::None, Smoothing::Auto][query.one_of(name, &["none", "auto"])]
    } else {
        match query.float_in(name, 0.0.., 0.0) {
            0.0 => Smoothing::None,
            deviation => Smoothing::Noise(deviation),
        }
    }
}

/// Parts of first and of second derivatives that rounding may make up without a warning.
const MOST_NOISE: [f64; 2] = [1e-3, 0.1];

fn warn_of_noise(
    shares: NoiseShares,
    rounding: Rounding,
    object: &ObjectDescription,
    context: &mut Context,
) {
    if shares.first <= MOST_NOISE[0] && shares.second <= MOST_NOISE[1] {
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
    let warning = Diagnostic::warning(message).at(&object.location);
    context.diagnostics.push(warning.help(help.to_owned()));
}

/// What the samples say, unless they are the index as it is, at the wavelength `nm` of the channel if it has one.
fn law(object: &ObjectDescription, nm: Option<f64>, q: &mut Query) -> Option<Law> {
    let law = match object.plugin.as_str() {
        "gladstone_dale" => Law {
            n0: q.float_in("n0", INDEX, 1.0),
            slope: air::constant(nm, q),
            reference: q.float_or("reference", 0.0),
        },
        "pressure" => Law {
            n0: q.float_in("n0", INDEX, None),
            slope: dn_dp(q),
            reference: q.float_or("reference", 0.0),
        },
        _ if q.has("scale") || q.has("offset") => Law {
            n0: q.float_or("offset", 0.0),
            slope: 1.0,
            reference: 0.0,
        },
        _ => return None,
    };
    let scale = q.float_or("scale", 1.0);
    Some(Law {
        slope: law.slope * scale,
        ..law
    })
}

/// The change of the index with pressure, per pascal.
pub(super) fn dn_dp(q: &mut Query) -> f64 {
    q.float_in("dn_dp", -LARGEST_DN_DP..=LARGEST_DN_DP, None)
}

impl Law {
    fn index(&self, q: f64) -> f64 {
        self.n0 + self.slope * (q - self.reference)
    }
}

/// Reports a sample of which no index can come.
fn check<T: Sample>(
    law: &Law,
    samples: &[T],
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<()> {
    let bad = samples.iter().map(|q| q.wide()).find(|q| {
        let n = law.index(*q);
        !n.is_finite() || n < LEAST_INDEX
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

/// Warns of samples that are probably not what they are taken for.
fn doubt_units(
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
        ("gladstone_dale", Some(law)) => units::of_gas(range, law.n0).map(|doubt| {
            let message = format!("the densities make indices from {least:.9} to {most:.9}: {doubt}");
            (message, "check the units of the file, and 'scale'")
        }),
        ("pressure", Some(law)) => units::of_pressure(range, law.n0).map(|doubt| {
            let message = format!("the pressures make indices from {least:.6} to {most:.6}: {doubt}");
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
        let warning = Diagnostic::warning(message).help(String::from(advice));
        context.diagnostics.push(warning.at(&object.location));
    }
}
