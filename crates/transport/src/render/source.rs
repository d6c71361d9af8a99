//! Sources of the samples of pixels: sensor rays and random numbers.

use super::{Handle, Prepared, RenderOptions, seed_of_group};
use crate::Spectrum;
use crate::film::{Cells, Footprint, PathFacts};
use crate::integrator::{Contribution, Integrator};
use crate::path::{Bounds, Workspace};
use crate::photons::LightPaths;
use crate::sampling::{Purpose, Replicates, Sampler};
use crate::scene::Scene;
use crate::sensor::SensorRay;
use crate::stop::Stop;
use eikonal::Tolerance;
use std::ops::Range;

/// Default work after which a pilot takes no more samples, in the unit of
/// [`Stats::cost`](crate::stats::Stats::cost): about three seconds on one CPU core.
const PILOT_WORK: f64 = 5e7;

/// Number of the sample whose light subpaths determine the radius, beyond the numbers of all
/// renders.
pub(super) const PILOT_SAMPLE: u64 = 1 << 63;

/// Address of the random numbers that all cells of a sample share. No film has this many cells.
const ALL_CELLS: u64 = u64::MAX;

/// Source of the samples of one channel group.
pub(super) struct Source<'a> {
    pub scene: &'a Scene,
    pub group: usize,
    pub prepared: Prepared,
    pub handle: &'a Handle,
    /// Flag that aborts the current pass.
    pub stop: Stop,
    /// Work after which a pilot takes no more samples, in the unit of
    /// [`Stats::cost`](crate::stats::Stats::cost).
    pub pilot_work: f64,
    /// Kind of replicates into which samples are grouped.
    pub replicates: Replicates,
    /// Cells in which samples are taken.
    pub cells: Cells,
    /// True if paths without a bounce are left out.
    hides_emitters: bool,
    /// Index of the medium around the sensor.
    sensor_index: f64,
    seed: u64,
}

/// Sample of the whole image: one sample of each cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageSample {
    pub number: u64,
    /// Point in the cell on which the samples of all cells lie, if cells overlap.
    point: Option<[f64; 2]>,
}

/// Samples of a source that an integrator takes.
#[derive(Clone, Copy)]
pub(super) struct LightSamples<'s> {
    pub source: &'s Source<'s>,
    pub integrator: Integrator,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        group: usize,
        options: &RenderOptions,
        prepared: Prepared,
        handle: &'a Handle,
    ) -> Self {
        let position = scene.sensor().position();
        Source {
            scene,
            group,
            prepared,
            handle,
            stop: handle.stop().clone(),
            pilot_work: PILOT_WORK,
            replicates: options.replicates(),
            cells: options.cells(scene.film()),
            hides_emitters: options.hide_emitters,
            sensor_index: scene.n(scene.medium_of_sensor_ray(position), position),
            seed: seed_of_group(options.seed, group),
        }
    }

    /// Returns the number of channels in use.
    pub(super) fn channels(&self) -> usize {
        self.scene.film().channels_of(self.group)
    }

    /// Returns the samples that an integrator takes.
    pub(super) fn light(&self, integrator: Integrator) -> LightSamples<'_> {
        LightSamples {
            source: self,
            integrator,
        }
    }

    pub(super) fn workspace(&self) -> Workspace {
        self.workspace_of(&self.prepared)
    }

    /// Creates a workspace with the given results of pilots.
    pub(crate) fn workspace_of(&self, prepared: &Prepared) -> Workspace {
        let mut ws = Workspace::new(Tolerance::new(prepared.accuracy.tolerance));
        ws.search = prepared.search;
        ws.rates = prepared.rates;
        ws.strategies = prepared.strategies;
        ws.adjoint = prepared.adjoint.clone();
        ws.first_vertex = prepared.first_vertex;
        ws.stop = self.stop.clone();
        ws
    }

    /// Returns true if the current pass is aborted. Its results then have no meaning.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.is_raised()
    }

    /// Returns the sample with the given number.
    pub(super) fn image_sample(&self, number: u64) -> ImageSample {
        let point = || {
            let mut sampler = self.sampler(ALL_CELLS, number);
            self.cells.point(sampler.next_2d_for(Purpose::Direction)).0
        };
        ImageSample {
            number,
            point: self.cells.overlap().then(point),
        }
    }

    /// Returns the samples with the given numbers, and their footprints in the film's first cell.
    pub(super) fn placed(&self, numbers: Range<u64>) -> Vec<(ImageSample, Footprint)> {
        let placed = |number: u64| {
            let sample = self.image_sample(number);
            (sample, self.footprint(&sample))
        };
        numbers.map(placed).collect()
    }

    /// Returns the footprint of a sample in the film's first cell.
    pub(super) fn footprint(&self, sample: &ImageSample) -> Footprint {
        self.cells.footprint(sample.point.unwrap_or([0.5; 2]))
    }

    /// Samples the sensor ray of a sample of a cell.
    pub(super) fn ray(&self, cell: usize, sample: &ImageSample) -> SampledRay {
        let mut sampler = self.sampler(cell as u64, sample.number);
        let spec = self.scene.film();
        let (point, weight) = match sample.point {
            Some(point) => (point, 1.0),
            None => self.cells.point(sampler.next_2d_for(Purpose::Direction)),
        };
        let lens = sampler.next_2d_for(Purpose::Lens);
        let corner = self.cells.place(cell);
        let [s, t] = spec.image([0, 1].map(|axis| corner[axis] as f64 + point[axis]));
        let spread = self.scene.sensor().point_spread();
        let offset = spread.map(|spread| spread.offset(self.sensor_index, || sampler.next_2d()));
        let offset = offset.unwrap_or_default();
        SampledRay {
            ray: self
                .scene
                .sensor()
                .ray([s - offset[0], t - offset[1]], lens),
            offset,
            weight,
            sampler,
        }
    }

    /// Calls `follow` with the `count` light subpaths of a sample of the whole image. Their random
    /// numbers have addresses after the cells' addresses.
    pub(super) fn with_light_paths<T>(
        &self,
        sample: u64,
        bounds: Bounds,
        count: usize,
        follow: impl FnOnce(&LightPaths) -> T,
    ) -> T {
        let cells = self.cells.count() as u64;
        follow(&LightPaths {
            scene: self.scene.at(sample),
            stop: &self.stop,
            bounds,
            count,
            search: self.prepared.search,
            sampler: &|path| self.sampler(cells + path, sample),
        })
    }

    /// Returns true if light on a path with these facts belongs to the image.
    pub(super) fn shows(&self, path: &PathFacts) -> bool {
        !(self.hides_emitters && path.bounces == 0)
    }

    /// Returns the random numbers of a sample of a cell. Numbers beyond the cells are for subpaths
    /// that cells share.
    pub(super) fn sampler(&self, cell: u64, sample: u64) -> Sampler {
        Sampler::in_replicates(self.replicates, [self.seed, cell, sample])
    }
}

/// Sensor ray of a sample.
pub(super) struct SampledRay {
    pub ray: SensorRay,
    /// Offset of the sample's light from its geometric position on the image, in units of the
    /// image. It is zero unless the aperture diffracts.
    pub offset: [f64; 2],
    /// Weight of the sample: 1, unless it contributes to its own pixel only and the filter has
    /// negative lobes.
    pub weight: f64,
    /// Random numbers after the ray's.
    pub sampler: Sampler,
}

impl LightSamples<'_> {
    /// Adds the contributions of one sample of a cell to `out`.
    pub(super) fn take(
        &self,
        cell: usize,
        sample: &ImageSample,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let scene = self.source.scene.at(sample.number);
        let channels = self.source.channels();
        self.take_by(cell, sample, ws, out, |ray, sampler, ws, out| {
            self.integrator
                .sample(scene, ray, channels, sampler, ws, out);
        });
    }

    /// Adds the contributions of one sample of a pixel to `out`: for pilots.
    pub(super) fn take_pixel(
        &self,
        pixel: usize,
        sample: u64,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let sample = self.source.image_sample(sample);
        self.take(self.source.cells.of_pixel(pixel), &sample, ws, out);
    }

    /// Adds the contributions of one sample of a pixel to `out`, like [`take`](Self::take). The
    /// function `estimate` follows the sensor ray.
    pub(super) fn take_by(
        &self,
        cell: usize,
        sample: &ImageSample,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
        estimate: impl FnOnce(SensorRay, &mut Sampler, &mut Workspace, &mut Vec<Contribution>),
    ) {
        let source = self.source;
        let SampledRay {
            ray,
            offset,
            weight,
            mut sampler,
        } = source.ray(cell, sample);
        ws.stats.paths += 1;
        let first = out.len();
        estimate(ray, &mut sampler, ws, out);
        if source.hides_emitters {
            let found = out.split_off(first);
            out.extend(found.into_iter().filter(|c| source.shows(&c.path)));
        }
        let splats = out[first..].iter_mut().filter_map(|c| c.image.as_mut());
        splats.for_each(|[s, t]| {
            // Planted error "light subpaths that diffraction leaves where they arrive", found by morgana-transport/transport::diffraction::a_point_becomes_the_pattern_of_the_aperture:
            // *s += 0.0 * offset[0];
            *s += offset[0];
            *t += offset[1];
        });
        if weight != 1.0 {
            let own = out[first..].iter_mut().filter(|c| c.image.is_none());
            own.for_each(|c| {
                c.value *= weight;
                c.bias *= weight;
            });
        }
    }
}

/// Returns a sample, or zero if it is not finite in the single precision of images. Counts such
/// samples.
pub(super) fn finite(value: Spectrum, not_finite: &mut u64) -> Spectrum {
    if value.0.iter().all(|v| v.abs() <= f64::from(f32::MAX)) {
        value
    } else {
        *not_finite += 1;
        Spectrum::ZERO
    }
}
