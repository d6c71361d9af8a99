//! Values that determine the light of an emitter: one spectrum, the pixels of an image, or the
//! voxels of a volume.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use super::environment::Environment;
use super::environment_map::EnvironmentMap;
use super::slide::Slide;
use super::{Emitter, VolumeLight, each_spot};
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::texture::Texture;
use glam::DVec3;

/// Ray of the light of an emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittedRay {
    /// Index of the emitter.
    pub emitter: usize,
    /// End of the path, as a connection to the emitter samples it.
    pub end: ConnectionEnd,
    /// Position where the light starts.
    pub x: DVec3,
    /// Unit direction in which the light leaves; arbitrary for a point of a volume.
    pub direction: DVec3,
}

impl EmittedRay {
    /// Creates a ray from a point of a volume.
    pub fn within(emitter: usize, x: DVec3) -> Self {
        EmittedRay {
            emitter,
            end: ConnectionEnd::at(x),
            x,
            direction: DVec3::ZERO,
        }
    }
}

/// Values of an emitter.
#[derive(Debug)]
pub enum EmitterValues<'a> {
    /// Single spectrum: a radiance, an intensity, an irradiance or a power.
    One(Spectrum),
    /// Values of a texture: radiances, or factors of an intensity.
    Texture(&'a Texture),
    /// Radiances around the scene.
    Map(&'a EnvironmentMap),
    /// Radiances of the screen of a projector.
    Slide(&'a Slide),
    /// Irradiances on the aperture of a beam or a fibre: an image, and the irradiance where the
    /// image is one.
    Aperture(&'a Slide, Spectrum),
    /// Emission of a volume.
    Voxels(&'a VolumeLight),
}

impl Emitter {
    /// Returns the values that determine the light. An emitting medium has values of its own.
    pub fn values(&self) -> EmitterValues<'_> {
        each_spot!(self, e => e.values(), {
            Emitter::Point { intensity, .. } => EmitterValues::One(*intensity),
            Emitter::PointOnFace(point) => EmitterValues::One(point.intensity()),
            Emitter::Area { radiance, .. } => EmitterValues::One(*radiance),
            Emitter::Textured(area) => EmitterValues::Texture(area.texture()),
            Emitter::Directional { irradiance, .. } => EmitterValues::One(*irradiance),
            Emitter::Environment(Environment::Constant(radiance)) => EmitterValues::One(*radiance),
            Emitter::Environment(Environment::Image(map)) => EmitterValues::Map(map),
            Emitter::Environment(Environment::Disc(disc)) => EmitterValues::One(disc.scale()),
            Emitter::Collimated(beam) => match beam.aperture().slide() {
                Some(slide) => EmitterValues::Aperture(slide, beam.peak()),
                None => EmitterValues::One(beam.power()),
            },
            Emitter::Fiber(fiber) => match fiber.aperture().slide() {
                Some(slide) => EmitterValues::Aperture(slide, fiber.peak()),
                None => EmitterValues::One(fiber.power()),
            },
            Emitter::Volume(volume) => EmitterValues::Voxels(volume),
        })
    }
}

impl EmitterValues<'_> {
    /// Returns the lengths along each axis of the array of values. A single value has no axes; an
    /// image has rows and columns; voxels have z, y, x; a texture has [its own](Texture::shape).
    /// Returns `None` if the values of a texture are not numbered.
    pub fn shape(&self) -> Option<Vec<usize>> {
        match self {
            EmitterValues::One(_) => Some(Vec::new()),
            EmitterValues::Texture(texture) => texture.shape(),
            EmitterValues::Map(map) => Some(map.shape().to_vec()),
            EmitterValues::Slide(slide) | EmitterValues::Aperture(slide, _) => {
                Some(vec![slide.size[1], slide.size[0]])
            }
            EmitterValues::Voxels(volume) => Some(volume.shape()),
        }
    }

    /// Returns true if all values are positive in the first `channels` channels.
    pub fn are_positive(&self, channels: usize) -> bool {
        let is_positive = |value: Spectrum| value.0[..channels].iter().all(|c| *c > 0.0);
        match self {
            EmitterValues::One(value) => is_positive(*value),
            EmitterValues::Texture(texture) => texture.values().all(is_positive),
            EmitterValues::Map(map) => map.pixels().iter().copied().all(is_positive),
            EmitterValues::Slide(slide) => slide.pixels.iter().copied().all(is_positive),
            EmitterValues::Aperture(slide, peak) => {
                slide.pixels.iter().all(|pixel| is_positive(*pixel * *peak))
            }
            EmitterValues::Voxels(volume) => volume.is_positive(channels),
        }
    }

    /// Calls `see` with the index of each value that contributes along a ray of the emitter's
    /// light, and its weight. Returns the sum of weights times values, to which the light is
    /// proportional.
    pub fn at(&self, emitter: &Emitter, ray: &EmittedRay, see: impl FnMut(usize, f64)) -> Spectrum {
        let mut see = see;
        match self {
            EmitterValues::One(value) => {
                see(0, 1.0);
                *value
            }
            EmitterValues::Texture(texture) => {
                let site = match (emitter, &ray.end) {
                    (Emitter::Spot(spot), _) => spot.site(ray.direction),
                    (
                        _,
                        ConnectionEnd::Point {
                            surface: Some(OnSurface { site, .. }),
                            ..
                        },
                    ) => Some(*site),
                    _ => None,
                };
                let Some(site) = site else {
                    return Spectrum::ZERO;
                };
                texture.weights(&site, see);
                texture.at(&site)
            }
            EmitterValues::Map(map) => {
                map.weights(-ray.direction, see);
                map.radiance(-ray.direction)
            }
            EmitterValues::Slide(slide) => match emitter {
                Emitter::Projector(projector) => match projector.locate(ray.direction) {
                    Some((uv, _)) => {
                        slide.weights(uv, see);
                        slide.at(uv)
                    }
                    None => Spectrum::ZERO,
                },
                _ => Spectrum::ZERO,
            },
            EmitterValues::Aperture(slide, peak) => {
                let aperture = match emitter {
                    Emitter::Collimated(beam) => beam.aperture(),
                    Emitter::Fiber(fiber) => fiber.aperture(),
                    _ => return Spectrum::ZERO,
                };
                // Planted error "derivatives by pixels of a beam's image as if they were mirrored", found by morgana-transport/transport::derivatives::emitters::derivatives_by_values_of_emitters_are_differences:
                // let uv = aperture.locate(ray.x).map(|c| 1.0 - c);
                let uv = aperture.locate(ray.x);
                slide.weights(uv, see);
                slide.at(uv) * *peak
            }
            EmitterValues::Voxels(volume) => {
                volume.weights(ray.x, see);
                volume.radiance(ray.x)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Orientation;
    use crate::emitter::Projector;
    use crate::texture::{BitmapFilter, Wrap};
    use std::sync::Arc;

    fn pixels(count: usize) -> Vec<Spectrum> {
        let value = |i: usize| 0.5 + (i * 7 % 11) as f64;
        (0..count)
            .map(|i| Spectrum([value(i), value(i + 3), 1.0, 0.0]))
            .collect()
    }

    /// Tests that weights times values equal the light, to rounding, in all directions.
    #[test]
    fn light_is_the_sum_of_weights_times_values() {
        let map = Environment::image(5, 4, pixels(20), Orientation::IDENTITY);
        let mut all = vec![(Emitter::Environment(map.unwrap()), pixels(20))];
        for filter in [BitmapFilter::Bilinear, BitmapFilter::Nearest] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                let slide = Slide {
                    size: [5, 3],
                    pixels: pixels(15),
                    filter,
                    wrap,
                };
                let projector = Projector::new(DVec3::ZERO, Orientation::IDENTITY, 2.0, slide);
                let projector = Emitter::Projector(Arc::new(projector.unwrap()));
                all.push((projector, pixels(15)));
            }
        }
        for (emitter, pixels) in all {
            let values = emitter.values();
            let mut seen = 0;
            for i in 0..500 {
                let z = 1.0 - (f64::from(i) + 0.5) / 250.0;
                let (sin, turn) = ((1.0 - z * z).sqrt(), 2.4 * f64::from(i));
                let direction = DVec3::new(sin * turn.cos(), sin * turn.sin(), z);
                let ray = EmittedRay {
                    emitter: 0,
                    end: ConnectionEnd::at(DVec3::ZERO),
                    x: DVec3::ZERO,
                    direction,
                };
                let mut sum = Spectrum::ZERO;
                let light = values.at(&emitter, &ray, |i, weight| sum += pixels[i] * weight);
                seen += usize::from(!light.is_zero());
                for c in 0..Spectrum::CHANNELS {
                    assert!(
                        (light[c] - sum[c]).abs() < 1e-9,
                        "{direction} {light:?} {sum:?}"
                    );
                }
            }
            assert!(seen > 20, "{seen}");
        }
    }
}
