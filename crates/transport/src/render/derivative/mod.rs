//! Derivatives of images and of what meters read: a pass over samples or particles, in which each path is worth what the weights of
//! what it adds to say.
//!
//! Theory: docs/theory.md#derivatives-of-light.

mod batches;
mod index;
mod readings;

pub use index::{IndexDerivativeOptions, IndexDerivatives, check_indices, index_derivatives};
pub use readings::{MeterDerivativeOptions, ReadingFunctional, meter_derivatives};

use super::source::{SampledRay, Source, finite};
use super::splats::splat;
use super::{Handle, Prepared, RenderOptions, prepare};
use crate::Spectrum;
use crate::derivative::{DerivativeError, Plan, RadiometricParameter, Sums, Tape};
use crate::film::{Decomposition, LightParts};
use crate::integrator::{Contribution, Integrator, PathFinds};
use crate::observe::fold::Folded;
use crate::renderer::Renderer;
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use batches::{BatchMoments, Part, Units, check_room, derivatives_of};

/// Changes the seed, so that a render of the same seed is independent.
const SEED: u64 = 0x5DEE_CE66_D1CE_4E5B;

/// The derivative of a loss by one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivative {
    /// Length along each axis: those of the [functionals](ReadingFunctional::Each), if there are several, then
    /// those of the [parameter](RadiometricParameter::shape); the last is that of channels.
    pub shape: Vec<usize>,
    /// Values, the last axis running fastest.
    pub values: Vec<f64>,
    /// Their standard errors, from batches of samples.
    pub errors: Vec<f64>,
}

/// Derivatives, and what happened meanwhile.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// One for each parameter, in their order.
    pub by: Vec<Derivative>,
    /// What happened.
    pub stats: Stats,
}

/// How derivatives of an image are taken.
#[derive(Clone, Debug)]
pub struct DerivativeOptions<'a> {
    /// Which paths are followed: those of an integrator that does not [blur](Integrator::blurs).
    pub integrator: Integrator,
    /// Samples per pixel, and the seed. A render of the same seed is independent of the derivatives, as losses
    /// that are not linear need it.
    pub samples: u64,
    /// See `samples`.
    pub seed: u64,
    /// How light is told apart, if weights do.
    pub decomposition: Decomposition,
    /// Whether light that comes straight from an emitter is left out of the image.
    pub hide_emitters: bool,
    /// What light is differentiated by.
    pub parameters: &'a [RadiometricParameter],
    /// The derivative of the loss by each value of the image: for each [layer](Decomposition::layers), row by row, channels interleaved.
    pub weights: &'a [f64],
}

/// The derivatives of Σ weight × image by parameters, unbiased, on the current thread pool. `scenes` are those of
/// [`render`](super::render()). `None` if the handle has ended it before it was complete. Equal seeds give equal bits, for any number of threads.
///
/// # Errors
/// Parameters that a scene does not have derivatives by, Stokes parameters, integrators that blur, weights that do not fit or are not finite, fewer than
/// two samples.
///
/// # Panics
/// As [`State::new`](super::State::new).
pub fn derivatives(
    scenes: &[Scene],
    options: &DerivativeOptions,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    if let Some(parts) = options.decomposition.parts {
        return Err(match parts {
            LightParts::Stokes => DerivativeError::Polarized,
            LightParts::Sidebands(_) => DerivativeError::Tagged,
        });
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

/// Finds out whether light that an integrator finds, or that meters read, has derivatives by parameters.
///
/// # Errors
/// What [`derivatives`] refuses of them.
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

/// The plan of each group of channels.
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

/// How an image would be rendered by the same paths.
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

/// Both ways of an edge that is split have factors of their own: one is followed at a time.
fn without_splitting(prepared: &Prepared) -> Prepared {
    let mut prepared = prepared.clone();
    prepared.first_vertex.splitting = false;
    prepared
}

/// Room for the derivatives of functionals, told apart along some axes.
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

/// The samples of one group of channels.
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

    /// Takes all samples, batch by batch. `None` if it was stopped.
    fn moments(&self, stats: &mut Stats) -> Result<Option<BatchMoments>, DerivativeError> {
        let replicate = self.source.replicates.size();
        let units = Units {
            count: self.options.samples / replicate,
            size: replicate,
            paths: self.pixels,
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

    /// Adds the sums over a range of samples of some pixels.
    fn part(&self, part: &Part, sums: &mut [f64]) -> Stats {
        let source = self.source;
        let (samples, pixels) = (&part.samples, part.of(self.pixels));
        let count = pixels.len() as u64 * (samples.end - samples.start);
        source.handle.count(count);
        let (mut ws, mut tape, mut found) =
            (source.workspace(), Folded::new(Tape::default()), Vec::new());
        let mut sums = Sums::new(source.scene, self.plan, sums);
        for pixel in pixels {
            for sample in samples.clone() {
                if source.is_stopped() {
                    return ws.stats();
                }
                let mut sampled = source.ray(pixel, sample);
                ws.stats.paths += 1;
                let (scene, channels) = (source.scene.at(sample), source.channels());
                let finds = PathFinds {
                    out: &mut found,
                    log: &mut tape,
                };
                let (ray, sampler) = (sampled.ray, &mut sampled.sampler);
                let integrator = &self.options.integrator;
                integrator.log(scene, ray, channels, sampler, &mut ws, finds);
                let not_finite = &mut ws.stats.not_finite;
                let worths = found.iter().map(|c| {
                    // Planted error "weights among strategies that count twice in derivatives, as if attached", found by morgana-transport/transport::derivatives::integrators::derivatives_by_bidirectional_path_tracing_are_those_by_path_tracing:
                    // finite(c.weighted() * c.weight, not_finite) * self.weights_of(c, pixel, &sampled)
                    finite(c.weighted(), not_finite) * self.weights_of(c, pixel, &sampled)
                });
                sums.add(0, &tape.fold, worths);
                found.clear();
                tape.fold.clear();
                tape.begin();
            }
        }
        ws.stats()
    }

    /// The weights of a contribution to the sample of a pixel.
    fn weights_of(&self, c: &Contribution, own: usize, sampled: &SampledRay) -> Spectrum {
        let layer = self.options.decomposition.layer(&c.path);
        if !self.source.shows(&c.path) {
            return Spectrum::ZERO;
        }
        let Some([s, t]) = c.image else {
            return self.weights(own, layer) * sampled.weight;
        };
        let moved = [s + sampled.offset[0], t + sampled.offset[1]];
        let mut sum = Spectrum::ZERO;
        splat(self.source, own, Some(moved), |pixel, filter| {
            // Planted error "derivatives of light on the film by the pixel that sampled it", found by morgana-transport/transport::derivatives::integrators::derivatives_by_light_tracing_are_those_by_path_tracing:
            // sum += self.weights(own + 0 * pixel, layer) * filter;
            sum += self.weights(pixel, layer) * filter;
        });
        sum
    }

    /// The weights of a pixel in a layer.
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
