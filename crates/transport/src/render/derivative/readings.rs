//! Derivatives of meters' readings.

use super::batches::{Part, Units, derivatives_of};
use super::{Derivatives, SEED, blank, check_weights};
use crate::derivative::{DerivativeError, Plan, RadiometricParameter, Sums};
use crate::film::PartsFacts;
use crate::meter::{Functionals, Meter, MeterProblem, Near, Reading, ReadingAxis, Setup};
use crate::path::Workspace;
use crate::render::{Handle, MeasureError, MeasureOptions, measure, seed_of_group};
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use std::ops::ControlFlow;

/// Functional of meters' readings that is differentiated.
#[derive(Clone, Copy, Debug)]
pub enum ReadingFunctional<'a> {
    /// Σ weight × reading. For each meter and each of its [readings](Meter::readings), the weights
    /// are the derivative of the loss by each bin and channel; an empty list leaves the reading
    /// out.
    Weighted(&'a [Vec<Vec<f64>>]),
    /// Each bin of one reading of a meter: the rows of a Jacobian. The axes of the reading precede
    /// the axes of parameters.
    Each {
        /// Index of the meter.
        meter: usize,
        /// Index of the reading.
        reading: usize,
    },
}

/// Options of the derivatives of meters' readings.
#[derive(Clone, Debug)]
pub struct MeterDerivativeOptions<'a> {
    /// Number of particles for each group of channels.
    pub particles: u64,
    /// Seed. A measurement with the same seed is independent of the derivatives.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
    /// Parameters by which readings are differentiated.
    pub parameters: &'a [RadiometricParameter],
    /// Functional that is differentiated.
    pub of: ReadingFunctional<'a>,
}

/// Computes unbiased derivatives of readings, or of a loss of readings, by parameters, on the
/// current thread pool. `scenes` and `meters` are as for [`measure`](crate::render::measure()).
/// Returns `None` if the handle has ended the computation early. Equal seeds give equal bits, for
/// any number of threads.
///
/// # Errors
/// Returns the errors of [`derivatives`](super::derivatives). Also fails if a meter does not fit
/// the scene, or if the reading does not exist.
///
/// # Panics
/// If there are no scenes.
pub fn meter_derivatives(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeterDerivativeOptions,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    if meters.iter().any(|meter| meter.sidebands().is_some()) {
        return Err(DerivativeError::Parts(PartsFacts::SIDEBANDS));
    }
    if meters.iter().any(Meter::has_stokes) {
        return Err(DerivativeError::Parts(PartsFacts::STOKES));
    }
    let scene = scenes.first().expect(NO_SCENE);
    if scene.fluoresces() {
        return Err(DerivativeError::Fluorescence);
    }
    check_meters(meters, scene)?;
    let film = scene.film();
    let rows = rows(meters, options.of, film.channels)?;
    let mut found = Derivatives {
        by: blank(scenes, options.parameters, &rows)?,
        stats: Stats::default(),
    };
    let near = match readings_near(scenes, meters, options, handle)? {
        Some(_) if handle.is_given_up() => return Ok(None),
        near => near,
    };
    let max_depth = options.max_depth.unwrap_or(u32::MAX);
    for (group, scene) in scenes.iter().enumerate() {
        let channels = film.channels_of(group);
        let plan = Plan::new(scene, options.parameters, channels)?;
        let setup = Setup::new(scene, meters, channels, max_depth, options.rr_depth);
        if setup.is_dark() {
            return Err(DerivativeError::Dark);
        }
        let first = group * film.group_size;
        let near = Near {
            readings: near.as_deref(),
            first_channel: first,
            channels: film.channels,
        };
        let wanted = match options.of {
            ReadingFunctional::Weighted(weights) => setup.weighted(weights, near),
            ReadingFunctional::Each { meter, reading } => setup.each_bin(meter, reading, near),
        };
        let pass = Pass {
            setup: &setup,
            plan: &plan,
            wanted: &wanted,
            seed: seed_of_group(options.seed ^ SEED, group),
            handle,
        };
        let units = Units {
            count: options.particles,
            size: 1,
            paths: 1,
            sums: wanted.count() * plan.stride(),
            values: wanted.count() * plan.len(),
        };
        let stats = &mut found.stats;
        let moments = units.moments(
            handle,
            stats,
            |part, sums| pass.part(part, sums),
            |sums, values| derivatives_of(&plan, sums, values),
        )?;
        let Some(moments) = moments else {
            return Ok(None);
        };
        moments.enter(&plan, first, &mut found.by);
    }
    Ok(Some(found))
}

/// Measures the readings near which amplitudes and phases are linear, by as many particles and with
/// the seed of a measurement. Returns `None` if only derivatives of sums are wanted.
fn readings_near(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeterDerivativeOptions,
    handle: &Handle,
) -> Result<Option<Vec<Vec<Reading>>>, DerivativeError> {
    let is_linear = match options.of {
        ReadingFunctional::Each { meter, reading } => meters[meter].is_linear(reading),
        ReadingFunctional::Weighted(weights) => {
            meters.iter().zip(weights).all(|(meter, weights)| {
                let mut weights = weights.iter().enumerate();
                weights.all(|(reading, weights)| weights.is_empty() || meter.is_linear(reading))
            })
        }
    };
    if is_linear {
        return Ok(None);
    }
    let measured = MeasureOptions {
        first: 0,
        particles: options.particles,
        seed: options.seed,
        max_depth: options.max_depth,
        rr_depth: options.rr_depth,
    };
    let found = measure(scenes, meters, &measured, &handle.uncounted(), |_| {
        ControlFlow::Continue(())
    });
    match found {
        Ok(measurement) => Ok(Some(measurement.readings)),
        Err(MeasureError::Memory(bytes)) => Err(DerivativeError::Memory(bytes / size_of::<f64>())),
        Err(MeasureError::Dark) => Err(DerivativeError::Dark),
        Err(MeasureError::SharedPaths | MeasureError::CyclicFluorescence(_)) => {
            Err(DerivativeError::Fluorescence)
        }
        Err(MeasureError::Device(_)) => unreachable!("no device takes part"),
        Err(MeasureError::Meter { number, problem }) => Err(DerivativeError::Meter {
            number,
            field: problem.field,
            message: problem.message,
        }),
    }
}

/// Particles of one group of channels.
struct Pass<'a> {
    setup: &'a Setup<'a>,
    plan: &'a Plan,
    wanted: &'a Functionals,
    seed: u64,
    handle: &'a Handle,
}

impl Pass<'_> {
    /// Adds the sums over some of the particles of a batch.
    fn part(&self, part: &Part, sums: &mut [f64]) -> Stats {
        let (first, last) = (part.samples.start, part.samples.end);
        let own = part.of((last - first) as usize);
        self.handle.count(own.len() as u64);
        let scene = self.setup.scene();
        let mut ws = Workspace::new(scene.tolerance());
        ws.stop = self.handle.stop().clone();
        let mut sums = Sums::new(scene, self.plan, sums);
        let particles = first + own.start as u64..first + own.end as u64;
        let (setup, wanted) = (self.setup, self.wanted);
        setup.differentiate(self.seed, particles, wanted, &mut sums, &mut ws);
        ws.stats()
    }
}

fn check_meters(meters: &[Meter], scene: &Scene) -> Result<(), DerivativeError> {
    for (number, meter) in meters.iter().enumerate() {
        if let Err(MeterProblem { field, message }) = meter.check(scene) {
            return Err(DerivativeError::Meter {
                number,
                field,
                message,
            });
        }
    }
    Ok(())
}

/// Checks the functional. Returns the lengths of the axes of its values.
fn rows(
    meters: &[Meter],
    of: ReadingFunctional,
    channels: usize,
) -> Result<Vec<usize>, DerivativeError> {
    match of {
        ReadingFunctional::Weighted(weights) => {
            check_readings(meters, weights, channels).map(|()| Vec::new())
        }
        ReadingFunctional::Each { meter, reading } => {
            let readings = meters.get(meter).map(Meter::readings);
            let reading = readings.and_then(|all| all.into_iter().nth(reading));
            reading
                .map(|(_, axes)| axes.iter().map(ReadingAxis::len).collect())
                .ok_or(DerivativeError::Reading)
        }
    }
}

fn check_readings(
    meters: &[Meter],
    weights: &[Vec<Vec<f64>>],
    channels: usize,
) -> Result<(), DerivativeError> {
    let readings = meters.iter().flat_map(Meter::readings);
    let all: Vec<usize> = readings
        .map(|(_, axes)| channels * axes.iter().map(ReadingAxis::len).product::<usize>())
        .collect();
    let found = weights.iter().flatten().count();
    if found != all.len() {
        let expected = all.len();
        return Err(DerivativeError::Weights { expected, found });
    }
    for (expected, weights) in all.into_iter().zip(weights.iter().flatten()) {
        if !weights.is_empty() {
            check_weights(weights, expected)?;
        }
    }
    Ok(())
}
