//! Stokes vectors of particles (docs/theory.md#stokes-vectors).

use crate::Spectrum;
use crate::observe::fold::Fold;
use crate::path::{Span, TransportMode, Vertex};
use crate::polarization::{StokesFold, StokesState, Transported};
use crate::scene::Scene;
use eikonal::ray::Arc;
use glam::DVec3;

/// Polarisation of a particle, and of its copies that wait to be followed.
#[derive(Debug)]
pub(super) struct ParticleStokes<'a> {
    fold: StokesFold<'a>,
    /// Copies, the last of which is followed next.
    waiting: Vec<StokesState>,
    current: StokesState,
    /// Before the last surface.
    arriving: StokesState,
}

impl<'a> ParticleStokes<'a> {
    /// For particles of a number of channels.
    pub(super) fn new(scene: &'a Scene, channels: usize) -> Self {
        let fold = StokesFold::new(scene, channels);
        let current = fold.unpolarized(DVec3::Z);
        ParticleStokes {
            fold,
            waiting: Vec::new(),
            current,
            arriving: current,
        }
    }

    /// Starts a particle in a scene at an instant.
    pub(super) fn start(&mut self, scene: &'a Scene) {
        self.fold.enter(scene);
        self.waiting.clear();
    }

    /// Goes on with the copy that was put aside last, or starts with the unpolarised light of an emitter in a direction.
    pub(super) fn resume(&mut self, direction: DVec3) {
        let next = self.waiting.pop();
        self.current = next.unwrap_or_else(|| self.fold.unpolarized(direction));
        self.arriving = self.current;
    }

    /// Puts copies of the particle aside.
    pub(super) fn go_on(&mut self, copies: usize) {
        self.waiting.extend((0..copies).map(|_| self.current));
    }

    /// Follows an arc up to θ.
    pub(super) fn fly(&mut self, arc: &Arc, theta: f64) {
        self.current.carry(arc, theta);
        self.arriving = self.current;
    }

    /// Passes a surface between two arcs, or is reflected there.
    pub(super) fn pass(&mut self, span: &Span, next: &Span) {
        self.fold.pass(&mut self.current, span, next);
    }

    /// Turns at a vertex, perhaps along a specular lobe.
    pub(super) fn turn(&mut self, vertex: &Vertex, direction: DVec3, specular: bool) {
        let mode = TransportMode::Importance;
        self.fold
            .turn(&mut self.current, mode, vertex, direction, specular);
    }

    /// Stokes parameters of light in the unit direction `k` beyond the last surface, or in front of it if the light `arrives` there. The
    /// first axis of the frame is perpendicular to k and to `up`.
    pub(super) fn at_surface(&self, k: DVec3, up: DVec3, arrives: bool) -> [Spectrum; 4] {
        let light = if arrives {
            &self.arriving
        } else {
            &self.current
        };
        match light {
            StokesState::Light(light) => Transported::at_sensor(-k, up, 1).of(light),
            StokesState::Sensor(_) => [Spectrum::ZERO; 4],
        }
    }
}
