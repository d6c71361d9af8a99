//! Derivatives of images by the refractive index of media that scatter.
//!
//! Theory: docs/theory.md#derivatives-by-the-index-behind-scattering.

use super::batches::{BatchMoments, Part, Units, check_room};
use super::{Derivative, SEED, without_splitting};
use crate::Spectrum;
use crate::attached::{
    self, AttachedPath, AttachedWalk, IndexDerivativeError, IndexPlan, Majorants,
};
use crate::derivative::DerivativeError;
use crate::film::{Decomposition, PathFacts};
use crate::integrator::{Integrator, PathTracer};
use crate::render::source::{Source, finite};
use crate::render::{Handle, RenderOptions, prepare};
use crate::renderer::Renderer;
use crate::scene::{MediumId, Scene};
use crate::stats::Stats;
use eikonal::Tolerance;

/// Options of an image's derivatives by the index of media.
#[derive(Clone, Debug)]
pub struct IndexDerivativeOptions<'a> {
    /// Depth limits of paths.
    pub path: PathTracer,
    /// Samples per pixel.
    pub samples: u64,
    /// Seed. A render with the same seed is independent of the derivatives, as non-linear losses
    /// require.
    pub seed: u64,
    /// Separation of light into layers by bounces, if the weights differ by layer. Other layers are
    /// refused.
    pub decomposition: Decomposition,
    /// True if light that travels straight from an emitter is left out of the image.
    pub hide_emitters: bool,
    /// Media by whose index the image is differentiated.
    pub media: &'a [MediumId],
    /// Derivative of the loss by each value of the image: for each [layer](Decomposition::layers),
    /// row by row, channels interleaved.
    pub weights: &'a [f64],
}

/// Derivatives by the index of media, with counts of events.
#[derive(Clone, Debug)]
pub struct IndexDerivatives {
    /// Derivatives in the order of the media. Each holds the derivatives by all numbers of the
    /// medium's [parameters](eikonal::Field::parameters), in a row.
    pub by: Vec<Derivative>,
    /// Estimate of Σ weight × image from the same paths, and its standard error.
    pub value: (f64, f64),
    /// True if a few of many batches of samples cause nearly all of the scatter of a medium's
    /// derivatives. Neither means nor errors are reliable then: contributions of trapped rays have
    /// infinite variance (docs/theory.md#derivatives-by-the-index-behind-scattering).
    pub dominated: bool,
    /// Counts of events and failures.
    pub stats: Stats,
}

/// Computes unbiased derivatives of Σ weight × image by the index of media, on the current thread
/// pool. `scenes` are the scenes of [`render`](crate::render::render()), all with the same index.
/// Returns `None` if the handle has ended the computation early. Equal seeds give equal bits, for
/// any number of threads.
///
/// # Errors
/// - The contributions of paths are discontinuous when rays move.
/// - A field has no parameters.
/// - The number of weights is wrong, or a weight is not finite.
/// - There are fewer than two samples.
pub fn index_derivatives(
    scenes: &[Scene],
    options: &IndexDerivativeOptions,
    handle: &Handle,
) -> Result<Option<IndexDerivatives>, IndexDerivativeError> {
    let film = scenes[0].film();
    let plan = checked_plan(scenes, options)?;
    let layers = options.decomposition.layers();
    let expected = layers * film.width * film.height * film.channels;
    check_weights(options.weights, expected)?;
    check_room(plan.len()).map_err(|e| refused(&e))?;
    let renderer = Renderer::Light(Integrator::Path(options.path));
    let render = RenderOptions {
        hide_emitters: options.hide_emitters,
        decomposition: options.decomposition,
        ..RenderOptions::new(renderer, options.samples, options.seed ^ SEED)
    };
    let prepared = prepare(scenes, &render, None, handle);
    let mut found = blank(&scenes[0], &plan);
    for (group, scene) in scenes.iter().enumerate() {
        let tolerance = Tolerance::new(prepared[group].accuracy.tolerance);
        let prepared = without_splitting(&prepared[group]);
        let source = Source::new(scene, group, &render, prepared, handle);
        let pass = Pass {
            source: &source,
            plan: &plan,
            majorants: Majorants::new(scene, source.channels()),
            options,
            tolerance,
        };
        match pass.moments(&mut found.stats)? {
            Some(moments) => enter(&moments, &mut found),
            None => return Ok(None),
        }
    }
    Ok(Some(found))
}

/// Checks that images have derivatives by the index of media. Weights and samples are not checked.
///
/// # Errors
/// Returns the errors of [`index_derivatives`] that concern scenes, media and layers.
pub fn check_indices(
    scenes: &[Scene],
    options: &IndexDerivativeOptions,
) -> Result<(), IndexDerivativeError> {
    checked_plan(scenes, options).map(|_| ())
}

fn checked_plan(
    scenes: &[Scene],
    options: &IndexDerivativeOptions,
) -> Result<IndexPlan, IndexDerivativeError> {
    check_layers(&options.decomposition)?;
    let counted = counted(options);
    for (group, scene) in scenes.iter().enumerate() {
        attached::check(scene, scene.film().channels_of(group), counted)?;
    }
    IndexPlan::new(&scenes[0], options.media)
}

fn check_layers(decomposition: &Decomposition) -> Result<(), IndexDerivativeError> {
    if decomposition.length.is_some() {
        return Err(IndexDerivativeError::Gates);
    }
    if decomposition.emitters.is_some() {
        return Err(IndexDerivativeError::Layers("emitters"));
    }
    match decomposition.parts {
        Some(parts) => Err(IndexDerivativeError::Layers(parts.facts().name)),
        None => Ok(()),
    }
}

/// Returns the option that makes the image depend on the number of events of paths, if there is
/// one.
fn counted(options: &IndexDerivativeOptions) -> Option<&'static str> {
    if options.path.max_depth.is_some() {
        Some("max_depth counts them, so set it to -1")
    } else if options.decomposition.bounces.is_some() {
        Some("layers by bounces count them, so give weights of the whole picture")
    } else {
        options
            .hide_emitters
            .then_some("hide_emitters counts them, so show emitters")
    }
}

fn check_weights(weights: &[f64], expected: usize) -> Result<(), IndexDerivativeError> {
    let found = weights.len();
    if found != expected {
        return Err(IndexDerivativeError::Weights { expected, found });
    }
    match weights.iter().position(|w| !w.is_finite()) {
        Some(i) => Err(IndexDerivativeError::NotFinite(i)),
        None => Ok(()),
    }
}

/// Converts the errors that batches can have.
fn refused(error: &DerivativeError) -> IndexDerivativeError {
    match error {
        DerivativeError::Samples(size) => IndexDerivativeError::Samples(*size),
        DerivativeError::Memory(numbers) => IndexDerivativeError::Memory(*numbers),
        other => unreachable!("no error of batches: {other}"),
    }
}

/// Creates zero derivatives by all parameters.
fn blank(scene: &Scene, plan: &IndexPlan) -> IndexDerivatives {
    let of = |count| {
        let zeros = vec![0.0; count];
        Derivative {
            shape: vec![count],
            values: zeros.clone(),
            errors: zeros,
        }
    };
    IndexDerivatives {
        by: plan.counts(scene).into_iter().map(of).collect(),
        value: (0.0, 0.0),
        dominated: false,
        stats: Stats::default(),
    }
}

/// Adds the results of a group of channels. Errors of different groups are
/// independent.
fn enter(moments: &BatchMoments, into: &mut IndexDerivatives) {
    let add = |(value, error): (&mut f64, &mut f64), slot| {
        let (mean, own) = moments.mean(slot);
        *value += mean;
        *error = error.hypot(own);
    };
    let IndexDerivatives {
        by,
        value,
        dominated,
        ..
    } = into;
    let mut first = 1;
    for derivative in by.iter() {
        let slots = first..first + derivative.values.len();
        first = slots.end;
        *dominated |= moments.is_dominated(slots);
    }
    add((&mut value.0, &mut value.1), 0);
    let each = by
        .iter_mut()
        .flat_map(|d| d.values.iter_mut().zip(&mut d.errors));
    each.enumerate().for_each(|(i, both)| add(both, 1 + i));
}

/// Samples of one group of channels.
struct Pass<'a> {
    source: &'a Source<'a>,
    plan: &'a IndexPlan,
    majorants: Majorants,
    options: &'a IndexDerivativeOptions<'a>,
    tolerance: Tolerance,
}

impl Pass<'_> {
    /// Takes all samples, batch by batch. Returns `None` if it was stopped.
    fn moments(&self, stats: &mut Stats) -> Result<Option<BatchMoments>, IndexDerivativeError> {
        let replicate = self.source.replicates.size();
        let units = Units {
            count: self.options.samples / replicate,
            size: replicate,
            paths: self.source.cells.count(),
            sums: 1 + self.plan.len(),
            values: 1 + self.plan.counts(self.source.scene).iter().sum::<usize>(),
        };
        let moments = units.moments(
            self.source.handle,
            stats,
            |part, sums| self.part(part, sums),
            |sums, values| {
                let by_parameters = self.plan.by_parameters(self.source.scene, &sums[1..]);
                values[0] = sums[0];
                values[1..].copy_from_slice(&by_parameters);
            },
        );
        moments.map_err(|e| refused(&e))
    }

    fn pixels(&self) -> usize {
        let film = self.source.scene.film();
        film.width * film.height
    }

    /// Adds the sums of a part of the pixels: the contributions of paths, and their derivatives.
    fn part(&self, part: &Part, sums: &mut [f64]) -> Stats {
        let source = self.source;
        let (samples, cells) = (&part.samples, part.of(source.cells.count()));
        let pixels = source.cells.pixels_among(cells.clone()) as u64;
        source.handle.count(pixels * (samples.end - samples.start));
        let (mut stats, mut path) = (Stats::default(), AttachedPath::default());
        let limits = self.options.path;
        let walk = AttachedWalk {
            scene: source.scene,
            plan: self.plan,
            majorants: &self.majorants,
            tolerance: self.tolerance,
            channels: source.channels(),
            max_depth: limits.max_depth.unwrap_or(u32::MAX),
            rr_depth: limits.rr_depth,
        };
        let placed = source.placed(samples.clone());
        for cell in cells {
            for (sample, footprint) in &placed {
                if source.is_stopped() {
                    return stats;
                }
                if !source.cells.counts(footprint, cell) {
                    continue;
                }
                let mut sampled = source.ray(cell, sample);
                stats.paths += 1;
                walk.follow(sampled.ray, &mut sampled.sampler, &mut stats, &mut path);
                let Some((value, depth)) = path.found() else {
                    continue;
                };
                let facts = PathFacts {
                    optical_length: 0.0,
                    bounces: depth - 1,
                    emitter: 0,
                };
                if !source.shows(&facts) {
                    continue;
                }
                let layer = self.options.decomposition.layer(&facts);
                let mut weights = Spectrum::ZERO;
                source.cells.each_pixel(footprint, cell, |pixel, weight| {
                    weights += self.weights(pixel, layer) * weight;
                });
                sums[0] += (finite(value, &mut stats.not_finite) * weights).sum();
                let (plan, scene) = (self.plan, source.scene);
                walk.back(&path, weights, |medium, x, by| {
                    plan.add(scene, medium, x, by, &mut sums[1..]);
                });
            }
        }
        stats
    }

    /// Returns the weights of a pixel in a layer.
    fn weights(&self, pixel: usize, layer: usize) -> Spectrum {
        let film = self.source.scene.film();
        // Planted error "layers by bounces whose weights are those of the first", found by morgana-transport/transport::index_absorption:
        // let first = (layer * 0 + pixel) * film.channels;
        let first = (layer * self.pixels() + pixel) * film.channels;
        let first = first + self.source.group * film.group_size;
        let own = &self.options.weights[first..][..self.source.channels()];
        Spectrum(std::array::from_fn(|c| own.get(c).copied().unwrap_or(0.0)))
    }
}
