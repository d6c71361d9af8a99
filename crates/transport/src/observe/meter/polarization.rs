//! Stokes vectors of particles (docs/theory.md#stokes-vectors).

use super::copies::Copies;
use crate::Spectrum;
use crate::observe::fold::Fold;
use crate::path::{Span, TransportMode, Vertex};
use crate::polarization::{StokesFold, StokesState, Transported};
use crate::scene::Scene;
use eikonal::ray::Arc;
use glam::DVec3;

/// Polarisation of a particle and of its waiting copies.
#[derive(Debug)]
pub(super) struct ParticleStokes<'a> {
    fold: StokesFold<'a>,
    /// Polarisation; `None` before the first edge.
    copies: Copies<Option<StokesState>>,
    /// Polarisation before the last surface.
    arriving: Option<StokesState>,
}

impl<'a> ParticleStokes<'a> {
    /// Creates the polarisation of particles with `channels` channels.
    pub(super) fn new(scene: &'a Scene, channels: usize) -> Self {
        ParticleStokes {
            fold: StokesFold::new(scene, channels),
            copies: Copies::new(None),
            arriving: None,
        }
    }

    /// Starts a particle in a scene at an instant.
    pub(super) fn start(&mut self, scene: &'a Scene) {
        self.fold.enter(scene);
        self.copies.start(|state| *state = None);
    }

    /// Continues with the next copy. The first one has the unpolarised light of an emitter in a
    /// direction.
    pub(super) fn resume(&mut self, direction: DVec3) {
        self.copies.resume();
        let state = &mut self.copies.current;
        state.get_or_insert_with(|| self.fold.unpolarized(direction));
        self.arriving = *state;
    }

    /// Divides the particle into `copies` copies; 0 ends it.
    pub(super) fn continue_walk(&mut self, copies: usize) {
        self.copies.continue_walk(copies);
    }

    /// Follows an arc up to θ.
    pub(super) fn fly(&mut self, arc: &Arc, theta: f64) {
        if let Some(state) = &mut self.copies.current {
            state.carry(arc, theta);
        }
        self.arriving = self.copies.current;
    }

    /// Passes or reflects at a surface between two arcs.
    pub(super) fn pass(&mut self, span: &Span, next: &Span) {
        if let Some(state) = &mut self.copies.current {
            self.fold.pass(state, span, next);
        }
    }

    /// Turns at a vertex, perhaps along a specular lobe.
    pub(super) fn turn(&mut self, vertex: &Vertex, direction: DVec3, specular: bool) {
        if let Some(state) = &mut self.copies.current {
            let mode = TransportMode::Importance;
            self.fold.turn(state, mode, vertex, direction, specular);
        }
    }

    /// Returns the Stokes parameters of light in the unit direction `k` beyond the last surface, or
    /// in front of it if the light `arrives` there. The first axis of the frame is perpendicular to
    /// `k` and to `up`.
    pub(super) fn at_surface(&self, k: DVec3, up: DVec3, arrives: bool) -> [Spectrum; 4] {
        let light = if arrives {
            &self.arriving
        } else {
            &self.copies.current
        };
        match light {
            Some(StokesState::Light(light)) => Transported::at_sensor(-k, up, 1).of(light),
            _ => [Spectrum::ZERO; 4],
        }
    }
}
