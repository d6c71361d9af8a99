//! Fluorescent light: excitation by the particles of other channels (docs/theory.md#fluorescence).

use super::Setup;
use crate::Spectrum;
use crate::medium::{Fluorescence, Medium};
use crate::path::{
    CellCollision, CellDetail, End, FreeFlightEvent, Observer, ParticleBalance, Start, WalkEvent,
    WalkRay, Workspace,
};
use crate::sampling::Sampler;
use crate::sampling::sphere::{uniform_sphere_pdf, uniform_sphere_sample};
use crate::scene::{CellVolume, MediumId, Scene};
use glam::DVec3;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Stream of the random numbers that choose the place of emission.
const STREAM: u64 = 2;

/// Particles of another channel that excite fluorescence.
#[derive(Clone, Debug)]
pub(super) struct Excitation<'a> {
    /// Number of the exciting channel in the film.
    channel: usize,
    setup: Arc<Setup<'a>>,
}

/// Fluorescence of two channels excites each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "fluorescence of channel {0} excites itself, directly or by other channels: let each channel excite channels of \
     longer wavelengths only"
)]
pub struct CyclicFluorescence(usize);

/// Adds to the setup of each channel the excitation of its fluorescence by other channels. `setups`
/// holds one setup per channel of the film.
///
/// # Errors
/// If channels excite each other.
pub(crate) fn with_excitations(
    setups: Vec<Setup<'_>>,
) -> Result<Vec<Arc<Setup<'_>>>, CyclicFluorescence> {
    let mut graph = Graph {
        known: vec![Progress::Unknown; setups.len()],
        setups,
    };
    let channels = 0..graph.setups.len();
    channels.map(|channel| graph.complete(channel)).collect()
}

/// Setups of all channels while excitations are added.
struct Graph<'a> {
    setups: Vec<Setup<'a>>,
    known: Vec<Progress<'a>>,
}

/// State of a channel's setup.
#[derive(Clone)]
enum Progress<'a> {
    Unknown,
    Begun,
    Complete(Arc<Setup<'a>>),
}

impl<'a> Graph<'a> {
    /// Returns the setup of a channel with its excitations.
    fn complete(&mut self, channel: usize) -> Result<Arc<Setup<'a>>, CyclicFluorescence> {
        match &self.known[channel] {
            Progress::Complete(setup) => return Ok(setup.clone()),
            Progress::Begun => return Err(CyclicFluorescence(channel)),
            Progress::Unknown => self.known[channel] = Progress::Begun,
        }
        let mut excitations = Vec::new();
        for exciting in 0..self.setups.len() {
            if self.setups[exciting].excites(channel) {
                let setup = self.complete(exciting)?;
                let unmeasured = Setup {
                    meters: &[],
                    ..Setup::clone(&setup)
                };
                excitations.push(Excitation {
                    channel: exciting,
                    setup: Arc::new(unmeasured),
                });
            }
        }
        let setup = Arc::new(Setup {
            excitations,
            fluorescent_channel: channel,
            ..self.setups[channel].clone()
        });
        self.known[channel] = Progress::Complete(setup.clone());
        Ok(setup)
    }
}

impl Setup<'_> {
    /// Returns true if light of this setup excites fluorescence in a channel of the film.
    fn excites(&self, channel: usize) -> bool {
        let mut all = self.scene.media().iter().flat_map(Medium::fluorescences);
        all.any(|fluorescence| fluorescence.power_yield(channel) > 0.0)
    }

    /// Returns the power of all emitters whose light can reach the meters: emitters of the setup
    /// itself, and emitters that excite its fluorescence.
    pub(crate) fn power_of_sources(&self) -> Spectrum {
        self.sum_over_sources(|setup| setup.emitted())
    }

    /// Returns the standard error of [`Setup::power_of_sources`].
    pub(crate) fn error_of_sources(&self) -> Spectrum {
        let variance = self.sum_over_sources(|setup| setup.emitted_error().map(|e| e * e));
        variance.map(f64::sqrt)
    }

    fn sum_over_sources(&self, value: impl Fn(&Setup) -> Spectrum) -> Spectrum {
        let mut exciting = BTreeMap::new();
        self.collect_excitations(&mut exciting);
        let values = exciting.into_values().map(&value);
        values.fold(value(self), |sum, v| sum + v)
    }

    /// Lists each channel that excites fluorescence directly or by other channels, with its setup.
    fn collect_excitations<'s>(&'s self, exciting: &mut BTreeMap<usize, &'s Self>) {
        for Excitation { channel, setup } in &self.excitations {
            if exciting.insert(*channel, setup).is_none() {
                setup.collect_excitations(exciting);
            }
        }
    }

    /// Follows a particle of one of the exciting channels, and then the fluorescent light that it
    /// causes. Returns the balance of the fluorescent light.
    pub(super) fn fluoresce(
        &self,
        number: u64,
        observer: &mut impl Observer,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> ParticleBalance {
        let none = ParticleBalance::default();
        // Choose an exciting channel.
        let count = self.excitations.len();
        let mut own = Sampler::new(sampler.next_1d().to_bits(), STREAM, number);
        let pick = (own.next_1d() * count as f64) as usize;
        let Some(excitation) = self.excitations.get(pick) else {
            return none;
        };
        // Follow its particle, and choose the place of emission among its collisions.
        let mut places = Places {
            channel: self.fluorescent_channel,
            power: 0.0,
            chosen: None,
            sampler: own,
        };
        (excitation.setup).follow(number, &mut places, sampler, ws);
        let Some(emission) = places.chosen else {
            return none;
        };
        // Emit the total power there.
        let power = places.power * count as f64;
        let ray = self.ray_of(number, &emission, power, &mut places.sampler);
        let balance = self.walk(number, ray, observer, sampler, ws);
        ParticleBalance {
            fluorescence: power,
            ..balance
        }
    }

    /// Samples the first ray of fluorescent light.
    fn ray_of(
        &self,
        number: u64,
        emission: &Emission,
        power: f64,
        sampler: &mut Sampler,
    ) -> WalkRay {
        let delay = emission.mean_delay * sampler.next_exponential();
        let direction = uniform_sphere_sample(sampler.next_2d());
        let medium = self.scene.at(number).medium_at(emission.x);
        let white = self.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)));
        WalkRay {
            start: Start::point(emission.x, direction, medium),
            pdf: uniform_sphere_pdf(),
            specular: false,
            throughput: white * power,
            depth: emission.depth,
            optical_length: emission.optical_length + delay,
        }
    }
}

/// Place where fluorescent light is emitted.
#[derive(Clone, Copy, Debug)]
struct Emission {
    x: DVec3,
    mean_delay: f64,
    /// Number of edges and specular events from the emitter.
    depth: u32,
    /// Optical path length from the emitter.
    optical_length: f64,
}

/// Observer of an exciting particle. It chooses one of the collisions with a probability in
/// proportion to the fluorescence that the collision causes.
struct Places {
    /// Number of the fluorescent channel in the film.
    channel: usize,
    /// Power of the fluorescence that all collisions so far cause.
    power: f64,
    chosen: Option<Emission>,
    sampler: Sampler,
}

impl Places {
    /// Adds a collision that absorbs the power `absorbed`.
    fn collide(
        &mut self,
        fluorescence: &Fluorescence,
        absorbed: f64,
        place: impl FnOnce() -> (DVec3, u32, f64),
    ) {
        let power = absorbed * fluorescence.power_yield(self.channel);
        if power <= 0.0 || !power.is_finite() {
            return;
        }
        self.power += power;
        // Planted error "fluorescence emitted at the last collision only", found by morgana-io/io::fluorescence::an_absorber_emits_where_light_is_absorbed:
        // if self.sampler.next_1d() >= 0.0 {
        if self.sampler.next_1d() * self.power < power {
            let (x, depth, optical_length) = place();
            self.chosen = Some(Emission {
                x,
                mean_delay: fluorescence.mean_delay(),
                depth,
                optical_length,
            });
        }
    }
}

/// Returns the fluorescence of a medium at a point.
fn at(scene: &Scene, medium: MediumId, x: DVec3) -> Option<&Fluorescence> {
    scene.medium(medium).fluorescence_at(x)
}

impl Observer for Places {
    fn arrive(&mut self, event: &WalkEvent, _ws: &mut Workspace) -> ControlFlow<()> {
        if let End::Collision(point) = event.edge.end
            && let Some(fluorescence) = at(event.scene, point.medium, point.x)
        {
            let absorption = point.rate * point.albedo(event.scene).map(|a| 1.0 - a);
            let absorbed = (event.path(&point) * absorption).sum();
            self.collide(fluorescence, absorbed, || {
                (point.x, event.depth, event.optical_length)
            });
        }
        ControlFlow::Continue(())
    }

    fn sees_free_flights(&self) -> bool {
        true
    }

    fn fly_freely(&mut self, event: &FreeFlightEvent) {
        let (ray, x) = (event.ray, event.flight.end);
        if let Some(fluorescence) = at(event.scene, ray.start.medium, x) {
            let absorbed = ray.throughput.sum() * (1.0 - event.flight.albedo());
            self.collide(fluorescence, absorbed, || {
                (x, ray.depth + 1, event.optical_length)
            });
        }
    }

    fn detail_in(&self, _volume: &CellVolume) -> CellDetail {
        CellDetail::Cells
    }

    fn collide_in_cell(&mut self, collision: &CellCollision) {
        let x = collision.x();
        if let Some(fluorescence) = at(collision.scene, collision.medium, x) {
            self.collide(fluorescence, collision.absorbed, || {
                (x, collision.depth, collision.optical_length)
            });
        }
    }
}
