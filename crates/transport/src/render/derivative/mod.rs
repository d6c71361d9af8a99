//! Derivatives of images and of meters' readings. A pass over samples or particles follows paths;
//! each path's contributions are weighted by the derivative of the loss.
//!
//! Theory: docs/theory.md#derivatives-of-light.

mod batches;
mod index;
mod readings;

pub use index::{IndexDerivativeOptions, IndexDerivatives, check_indices, index_derivatives};
pub use readings::{MeterDerivativeOptions, ReadingFunctional, meter_derivatives};

use super::source::{SampledRay, Source, finite};
use super::splats::{Place, splat};
use super::{Handle, Prepared, RenderOptions, prepare};
use crate::Spectrum;
use crate::derivative::{DerivativeError, Plan, RadiometricParameter, Sums, Tape};
use crate::film::{Decomposition, Footprint};
use crate::integrator::{Contribution, Integrator, PathFinds};
use crate::observe::fold::Folded;
use crate::renderer::Renderer;
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use batches::{BatchMoments, Part, Units, check_room, derivatives_of};

/// Constant that changes the seed, so that a render with the same seed is independent of the
/// derivatives.
const SEED: u64 = 0x5DEE_CE66_D1CE_4E5B;

/// Derivative of a loss by one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivative {
    /// Length along each axis: the axes of the [functionals](ReadingFunctional::Each), if there are
    /// several, then the axes of the [parameter](RadiometricParameter::shape). The last axis is the
    /// channel.
    pub shape: Vec<usize>,
    /// Values; the last axis varies fastest.
    pub values: Vec<f64>,
    /// Standard errors of the values, from batches of samples.
    pub errors: Vec<f64>,
}

/// Derivatives by several parameters, with counts of events.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// Derivatives in the order of the parameters.
    pub by: Vec<Derivative>,
    /// Counts of events and failures.
    pub stats: Stats,
}

/// Options of an image's derivatives.
#[derive(Clone, Debug)]
pub struct DerivativeOptions<'a> {
    /// Integrator whose paths are followed; it must not [blur](Integrator::blurs).
    pub integrator: Integrator,
    /// Samples per pixel.
    pub samples: u64,
    /// Seed. A render with the same seed is independent of the derivatives, as non-linear losses
    /// require.
    pub seed: u64,
    /// Separation of light into layers, if the weights differ by layer.
    pub decomposition: Decomposition,
    /// True if light that travels straight from an emitter is left out of the image.
    pub hide_emitters: bool,
    /// Parameters by which light is differentiated.
    pub parameters: &'a [RadiometricParameter],
    /// Derivative of the loss by each value of the image: for each [layer](Decomposition::layers),
    /// row by row, channels interleaved.
    pub weights: &'a [f64],
}

/// Computes unbiased derivatives of Σ weight × image by parameters, on the current thread pool.
/// `scenes` are the scenes of [`render`](super::render()). Returns `None` if the handle has ended
/// the computation early. Equal seeds give equal bits, for any number of threads.
///
/// # Errors
/// - A scene has no derivatives by a parameter.
/// - The decomposition has parts: Stokes parameters or sidebands.
/// - The integrator blurs light.
/// - The number of weights is wrong, or a weight is not finite.
/// - There are fewer than two samples.
///
/// # Panics
/// Panics like [`State::new`](super::State::new).
pub fn derivatives(
    scenes: &[Scene],
    options: &DerivativeOptions,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    if let Some(parts) = options.decomposition.parts {
        return Err(DerivativeError::Parts(parts.facts()));
    }
    if options.integrator.blurs() {
        return Err(DerivativeError::Blurred(options.integrator.name()));
    }
    let first = scenes.first().expect(NO_SCENE);
    options.decomposition.assert_fits(first.emitters().len());
    let film = first.film();
    let pixels = film.width * film.height;
    let expected = options.decomposition.layers() * pixels * film.channels;
    check_weights(options.weights, expected)?;
    let plans = plans(scenes, options.parameters)?;
    let render = render_options(options);
    let prepared = prepare(scenes, &render, None, handle);
    let mut found = Derivatives {
        by: blank(scenes, options.parameters, &[])?,
        stats: Stats::default(),
    };
    for (group, plan) in plans.iter().enumerate() {
        let prepared = without_splitting(&prepared[group]);
        let source = Source::new(&scenes[group], group, &render, prepared, handle);
        let Some(moments) = Pass::new(&source, plan, options).moments(&mut found.stats)? else {
            return Ok(None);
        };
        moments.enter(plan, group * film.group_size, &mut found.by);
    }
    Ok(Some(found))
}

/// Checks that an integrator's light, or meters' readings, have derivatives by parameters.
///
/// # Errors
/// Returns the errors of [`derivatives`] that concern parameters and integrators.
pub fn check_parameters(
    scenes: &[Scene],
    parameters: &[RadiometricParameter],
    integrator: Option<Integrator>,
) -> Result<(), DerivativeError> {
    if let Some(blurred) = integrator.filter(Integrator::blurs) {
        return Err(DerivativeError::Blurred(blurred.name()));
    }
    plans(scenes, parameters).map(|_| ())
}

/// Creates the plan of each group of channels.
fn plans(
    scenes: &[Scene],
    parameters: &[RadiometricParameter],
) -> Result<Vec<Plan>, DerivativeError> {
    let film = scenes[0].film();
    let groups = scenes.iter().enumerate();
    groups
        .map(|(group, scene)| Plan::new(scene, parameters, film.channels_of(group)))
        .collect()
}

fn check_weights(weights: &[f64], expected: usize) -> Result<(), DerivativeError> {
    let found = weights.len();
    if found != expected {
        return Err(DerivativeError::Weights { expected, found });
    }
    match weights.iter().position(|w| !w.is_finite()) {
        Some(i) => Err(DerivativeError::NotFinite(i)),
        None => Ok(()),
    }
}

/// Returns the options of a render of the image by the same paths.
fn render_options(options: &DerivativeOptions) -> RenderOptions {
    let renderer = Renderer::Light(options.integrator);
    RenderOptions {
        hide_emitters: options.hide_emitters,
        decomposition: options.decomposition,
        // Planted error "derivatives of losses that are not linear by the random numbers of the image", found by morgana-transport/transport::derivatives::identities::a_loss_that_is_not_linear_has_a_derivative_without_bias:
        // ..RenderOptions::new(renderer, options.samples, options.seed)
        ..RenderOptions::new(renderer, options.samples, options.seed ^ SEED)
    }
}

/// Turns off splitting: the two branches of a split edge have different factors, and only one
/// branch is followed at a time.
fn without_splitting(prepared: &Prepared) -> Prepared {
    let mut prepared = prepared.clone();
    prepared.first_vertex.splitting = false;
    prepared
}

/// Creates zero derivatives. `rows` gives the axes of the functionals.
fn blank(
    scenes: &[Scene],
    parameters: &[RadiometricParameter],
    rows: &[usize],
) -> Result<Vec<Derivative>, DerivativeError> {
    let channels = scenes[0].film().channels;
    let shape = |parameter: &RadiometricParameter| {
        [rows, &parameter.shape(&scenes[0]), &[channels]].concat()
    };
    let shapes: Vec<Vec<usize>> = parameters.iter().map(shape).collect();
    let count = |shape: &Vec<usize>| shape.iter().fold(1, |n: usize, m| n.saturating_mul(*m));
    let all = shapes.iter().map(count).fold(0, usize::saturating_add);
    check_room(all)?;
    let of = |shape: Vec<usize>| {
        let zeros = vec![0.0; count(&shape)];
        Derivative {
            shape,
            values: zeros.clone(),
            errors: zeros,
        }
    };
    Ok(shapes.into_iter().map(of).collect())
}

/// Samples of one group of channels.
struct Pass<'a> {
    source: &'a Source<'a>,
    plan: &'a Plan,
    options: &'a DerivativeOptions<'a>,
    pixels: usize,
}

impl<'a> Pass<'a> {
    fn new(source: &'a Source<'a>, plan: &'a Plan, options: &'a DerivativeOptions<'a>) -> Self {
        let film = source.scene.film();
        Pass {
            source,
            plan,
            options,
            pixels: film.width * film.height,
        }
    }

    /// Takes all samples, batch by batch. Returns `None` if it was stopped.
    fn moments(&self, stats: &mut Stats) -> Result<Option<BatchMoments>, DerivativeError> {
        let replicate = self.source.replicates.size();
        let units = Units {
            count: self.options.samples / replicate,
            size: replicate,
            paths: self.source.cells.count(),
            sums: self.plan.stride(),
            values: self.plan.len(),
        };
        units.moments(
            self.source.handle,
            stats,
            |part, sums| self.part(part, sums),
            |sums, values| derivatives_of(self.plan, sums, values),
        )
    }

    /// Adds the sums over a part: a range of samples of some pixels.
    fn part(&self, part: &Part, sums: &mut [f64]) -> Stats {
        let source = self.source;
        let (samples, cells) = (&part.samples, part.of(source.cells.count()));
        let pixels = source.cells.pixels_among(cells.clone()) as u64;
        source.handle.count(pixels * (samples.end - samples.start));
        let (mut ws, mut tape, mut found) =
            (source.workspace(), Folded::new(Tape::default()), Vec::new());
        let mut sums = Sums::new(source.scene, self.plan, sums);
        let integrator = &self.options.integrator;
        let placed = source.placed(samples.clone());
        for cell in cells {
            for (sample, footprint) in &placed {
                if source.is_stopped() {
                    return ws.stats();
                }
                if !(integrator.splats() || source.cells.counts(footprint, cell)) {
                    continue;
                }
                let mut sampled = source.ray(cell, sample);
                ws.stats.paths += 1;
                let (scene, channels) = (source.scene.at(sample.number), source.channels());
                let finds = PathFinds {
                    out: &mut found,
                    log: &mut tape,
                };
                let (ray, sampler) = (sampled.ray, &mut sampled.sampler);
                integrator.log(scene, ray, channels, sampler, &mut ws, finds);
                let not_finite = &mut ws.stats.not_finite;
                let worths = found.iter().map(|c| {
                    // Planted error "weights among strategies that count twice in derivatives, as if attached", found by morgana-transport/transport::derivatives::integrators::derivatives_by_bidirectional_path_tracing_are_those_by_path_tracing:
                    // finite(c.weighted() * c.weight, not_finite) * self.weights_of(c, cell, footprint, &sampled)
                    finite(c.weighted(), not_finite) * self.weights_of(c, cell, footprint, &sampled)
                });
                sums.add(0, &tape.fold, worths);
                found.clear();
                tape.fold.clear();
                tape.begin();
            }
        }
        ws.stats()
    }

    /// Returns the weights of a contribution to the sample of a cell with a footprint.
    fn weights_of(
        &self,
        c: &Contribution,
        cell: usize,
        footprint: &Footprint,
        sampled: &SampledRay,
    ) -> Spectrum {
        let layer = self.options.decomposition.layer(&c.path);
        if !self.source.shows(&c.path) {
            return Spectrum::ZERO;
        }
        let moved = |[s, t]: [f64; 2]| [s + sampled.offset[0], t + sampled.offset[1]];
        let place = Place::of(cell, c.image.map(moved));
        let mut sum = Spectrum::ZERO;
        splat(self.source, footprint, place, |pixel, filter| {
            // Planted error "derivatives of light on the film by the pixel that sampled it", found by morgana-transport/transport::derivatives::integrators::derivatives_by_light_tracing_are_those_by_path_tracing:
            // sum += self.weights(cell.min(self.pixels - 1) + 0 * pixel, layer) * filter;
            sum += self.weights(pixel, layer) * filter;
        });
        sum
    }

    /// Returns the weights of a pixel in a layer.
    fn weights(&self, pixel: usize, layer: usize) -> Spectrum {
        let film = self.source.scene.film();
        let first = (layer * self.pixels + pixel) * film.channels;
        let first = first + self.source.group * film.group_size;
        let used = self.source.channels();
        let weight = |c: usize| {
            if c < used {
                self.options.weights[first + c]
            } else {
                0.0
            }
        };
        Spectrum(std::array::from_fn(weight))
    }
}
