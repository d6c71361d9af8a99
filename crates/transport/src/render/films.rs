//! Films of a render, and data about its pixels.

use super::accumulator::Accumulated;
use super::allocation::Allocation;
use super::prepared::Prepared;
use super::strategies::Strategies;
use super::target::{Target, Watch};
use super::{Debiased, Quantities, RenderOptions};
use crate::Spectrum;
use crate::aov::AovTracer;
use crate::film::{Decomposition, Film, FilmShape};
use crate::integrator::Integrator;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// Shapes of the films of a render.
struct Shapes {
    film: FilmShape,
    quantities: Option<FilmShape>,
    debiased: Option<FilmShape>,
}

impl Shapes {
    fn of(scene: &Scene, options: &RenderOptions) -> Self {
        options.decomposition.assert_fits(scene.emitters().len());
        let (spec, renderer) = (scene.film(), &options.renderer);
        let size = [spec.width, spec.height];
        let replicates = options.replicates();
        let noise = options.cells(spec).noise();
        let quantities = |tracer: &AovTracer| FilmShape {
            replicates,
            noise: Some(noise),
            ..FilmShape::plain(size, tracer.channels().count(), Spectrum::CHANNELS)
        };
        let blurs = renderer.integrator().is_some_and(Integrator::blurs);
        let (channels, group_size) = (
            renderer.channels(spec.channels),
            renderer.group_size(spec.group_size),
        );
        Shapes {
            film: FilmShape {
                replicates,
                decomposition: options.decomposition,
                sorts: options.reweight,
                noise: (!renderer.shares_paths()).then_some(noise),
                ..FilmShape::plain(size, channels, group_size)
            },
            quantities: options.quantities.as_ref().map(quantities),
            debiased: blurs.then(|| FilmShape::of_light(spec)),
        }
    }
}

/// Films of a render, and data about its pixels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Films {
    pub(super) film: Film,
    pub(super) quantities: Option<Quantities>,
    pub(super) strategies: Option<Strategies>,
    pub(super) debiased: Option<Debiased>,
    pub(super) watch: Option<Watch>,
    pub(super) allocation: Allocation,
}

impl Films {
    pub(super) fn new(scene: &Scene, options: &RenderOptions) -> Self {
        let shapes = Shapes::of(scene, options);
        Films {
            film: Film::of(shapes.film),
            quantities: shapes.quantities.map(Quantities::new),
            strategies: options.strategies.then(Strategies::default),
            debiased: shapes.debiased.map(Debiased::new),
            watch: options.target.map(Watch::new),
            allocation: Allocation::new(scene, options),
        }
    }

    /// Returns true if a picture of this scene with these options has such films.
    pub(super) fn fits(&self, scene: &Scene, options: &RenderOptions) -> bool {
        // Compare bits, so that an error of NaN equals itself.
        let bits = |target: Target| (target.error.to_bits(), target.measure);
        let watched = self.watch.as_ref().map(Watch::target).map(bits);
        let pixels = self.film.width() * self.film.height();
        let allocation = Allocation::new(scene, options);
        watched == options.target.map(bits)
            && self.allocation.fits(&allocation, pixels)
            && self.strategies.is_some() == options.strategies
            && self.has(&Shapes::of(scene, options))
    }

    /// Returns true if the films have these shapes.
    fn has(&self, shapes: &Shapes) -> bool {
        let fits = |film: Option<&Film>, shape: Option<FilmShape>| match (film, shape) {
            (Some(film), Some(shape)) => film.fits(&shape),
            (film, shape) => film.is_none() && shape.is_none(),
        };
        let plain = FilmShape {
            decomposition: Decomposition::default(),
            sorts: false,
            ..shapes.film
        };
        let mut strategies = self.strategies.iter().flat_map(Strategies::films);
        self.film.fits(&shapes.film)
            && fits(self.debiased.as_ref().map(|d| &d.film), shapes.debiased)
            && fits(self.quantities.as_ref().map(|q| &q.film), shapes.quantities)
            && strategies.all(|film| film.fits(&plain))
    }
}

impl Accumulated for Films {
    type Learnt = Prepared;

    fn is_like(&self, other: &Films) -> bool {
        let shapes = Shapes {
            film: self.film.shape(),
            debiased: self.debiased.as_ref().map(|d| d.film.shape()),
            quantities: self.quantities.as_ref().map(|q| q.film.shape()),
        };
        self.allocation.agrees(&other.allocation)
            && self.has(&shapes)
            && other.has(&shapes)
            && self.strategies.is_some() == other.strategies.is_some()
    }

    fn merge(&mut self, other: &Films) {
        self.film.merge(&other.film);
        self.allocation.adopt(&other.allocation);
        if let (Some(quantities), Some(other)) = (&mut self.quantities, &other.quantities) {
            quantities.merge(other);
        }
        if let (Some(strategies), Some(other)) = (&mut self.strategies, &other.strategies) {
            strategies.merge(other);
        }
        if let (Some(debiased), Some(other)) = (&mut self.debiased, &other.debiased) {
            debiased.film.merge(&other.film);
        }
    }
}
