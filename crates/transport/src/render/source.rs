//! Where the samples of a pixel come from.

use super::{Handle, Prepared, RenderOptions};
use crate::Spectrum;
use crate::film::Pixel;
use crate::integrator::Contribution;
use crate::path::Workspace;
use crate::renderer::Renderer;
use crate::sampling::{Purpose, Replicates, Sampler};
use crate::scene::Scene;
use crate::sensor::SensorRay;
use crate::stop::Stop;

/// The samples of one channel group.
pub(super) struct Source<'a> {
    pub scene: &'a Scene,
    pub renderer: Renderer,
    pub group: usize,
    pub prepared: Prepared,
    pub handle: &'a Handle,
    /// Whether what is under way is to be given up.
    pub stop: Stop,
    seed: u64,
}

impl<'a> Source<'a> {
    pub fn new(
        (scene, group): (&'a Scene, usize),
        options: &RenderOptions,
        prepared: Prepared,
        handle: &'a Handle,
    ) -> Self {
        Source {
            scene,
            renderer: options.renderer,
            group,
            prepared,
            handle,
            stop: handle.stop().clone(),
            // Each group's paths have an address space of their own.
            seed: options
                .seed
                .wrapping_add((group as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
        }
    }

    /// Number of channels in use.
    pub fn channels(&self) -> usize {
        self.scene.film().channels_of(self.group)
    }

    /// How its samples belong together.
    pub fn replicates(&self) -> Replicates {
        self.renderer.replicates(self.scene)
    }

    pub fn workspace(&self) -> Workspace {
        self.workspace_of(&self.prepared)
    }

    /// A workspace for samples to be taken that way.
    pub fn workspace_of(&self, prepared: &Prepared) -> Workspace {
        let mut ws = Workspace::new(self.scene.tolerance());
        ws.search = prepared.search;
        ws.rates = prepared.rates;
        ws.adjoint = prepared.adjoint.clone();
        ws.first_vertex = prepared.first_vertex;
        ws.stop = self.stop.clone();
        ws
    }

    /// Whether the pass under way is to be given up: what is found is worthless.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_raised()
    }

    /// Adds the contributions of one sample of a pixel to `out`.
    pub fn sample(
        &self,
        pixel: usize,
        sample: u64,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let (ray, mut sampler) = self.ray(pixel, sample);
        ws.stats.paths += 1;
        let state = (&mut sampler, ws);
        let scene = self.scene.at(sample);
        if let Renderer::Light(integrator) = &self.renderer {
            integrator.sample(scene, ray, self.channels(), state, out);
        }
    }

    /// The sensor ray of a sample of a pixel, and the random numbers after it.
    pub fn ray(&self, pixel: usize, sample: u64) -> (SensorRay, Sampler) {
        let mut sampler = self.sampler(pixel as u64, sample);
        let spec = self.scene.film();
        let [u, v] = sampler.next_2d_for(Purpose::Direction);
        let lens = sampler.next_2d_for(Purpose::Lens);
        let (column, row) = (pixel % spec.width, pixel / spec.width);
        let image = [
            (column as f64 + 0.5 + spec.filter.sample(u)) / spec.width as f64,
            (row as f64 + 0.5 + spec.filter.sample(v)) / spec.height as f64,
        ];
        (self.scene.sensor().ray(image, lens), sampler)
    }

    /// The random numbers of a sample of a pixel. Numbers beyond those of the pixels are for what they share.
    pub fn sampler(&self, pixel: u64, sample: u64) -> Sampler {
        Sampler::in_replicates(self.replicates(), [self.seed, pixel, sample])
    }
}

/// Adds a sample to a pixel, and returns it. One that is not finite is counted and scored zero.
pub(super) fn add(pixel: &mut Pixel, value: Spectrum, not_finite: &mut u64) -> Spectrum {
    let value = finite(value, not_finite);
    pixel.add(value);
    value
}

/// A sample, or zero if it is not finite in the single precision of images, which is counted.
pub(super) fn finite(value: Spectrum, not_finite: &mut u64) -> Spectrum {
    if value.0.iter().all(|v| v.abs() <= f64::from(f32::MAX)) {
        value
    } else {
        *not_finite += 1;
        Spectrum::ZERO
    }
}
