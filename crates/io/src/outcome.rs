//! Runs from their first sample to their result, for pictures and meters alike.

use crate::clock::Clock;
use crate::part::{Body, BodyRef};
use crate::run::{Refusal, Run};
use transport::render::{Handle, MeasureState, Measurement, Rendering, State};

/// Result of a run.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// A picture.
    Picture(Box<Rendering>),
    /// Readings of meters.
    Readings(Box<Measurement>),
}

impl Run<'_> {
    /// Returns true if the scene has meters instead of a camera.
    pub fn has_meters(&self) -> bool {
        !self.loaded.instruments.is_empty()
    }

    /// Starts a run without samples.
    ///
    /// # Errors
    /// Returns an error if meters do not fit into memory, or have no light to measure.
    pub fn start(&self) -> Result<Body, Refusal> {
        let scenes = &self.loaded.groups;
        Ok(if self.has_meters() {
            Body::Meters(MeasureState::new(scenes, &self.loaded.meters())?.into())
        } else {
            Body::Image(State::new(scenes, &self.options()).into())
        })
    }

    /// Returns true if `body` can contain samples of this run.
    pub fn fits(&self, body: &Body) -> bool {
        let scenes = &self.loaded.groups;
        match body {
            Body::Image(state) => !self.has_meters() && state.fits(scenes, &self.options()),
            Body::Meters(state) => self.has_meters() && state.fits(scenes, &self.loaded.meters()),
        }
    }

    /// Takes the missing samples on the current thread pool. After each pass it calls `on_pass`.
    /// The clock decides whether the run continues.
    ///
    /// # Errors
    /// Returns an error if meters have no light to measure.
    ///
    /// # Panics
    /// Panics if the samples do not [fit](Run::fits).
    pub fn advance(
        &self,
        body: &mut Body,
        handle: &Handle,
        clock: &mut Clock,
        mut on_pass: impl FnMut(BodyRef),
    ) -> Result<(), Refusal> {
        let scenes = &self.loaded.groups;
        match body {
            Body::Image(state) => state.advance(scenes, &self.options(), handle, |progress| {
                on_pass(BodyRef::Image(progress.state));
                clock.look(progress.done >= progress.total)
            }),
            Body::Meters(state) => {
                let (meters, options) = (self.loaded.meters(), self.measure_options());
                let device = self.device_run();
                state.advance_on(
                    device.as_ref(),
                    scenes,
                    &meters,
                    &options,
                    handle,
                    |state| {
                        on_pass(BodyRef::Meters(state));
                        clock.look(state.done().count() >= options.particles)
                    },
                )?;
            }
        }
        Ok(())
    }

    /// Converts samples to the result.
    ///
    /// # Errors
    /// Returns an error if meters have no light to measure.
    pub fn finish(&self, body: Body) -> Result<Outcome, Refusal> {
        let scenes = &self.loaded.groups;
        Ok(match body {
            Body::Image(state) => Outcome::Picture(state.into_rendering(scenes).into()),
            Body::Meters(state) => Outcome::Readings(
                state
                    .into_measurement(scenes, &self.loaded.meters())?
                    .into(),
            ),
        })
    }
}
