//! Checks of the numbers of sensors.

use super::checks::Problems;
use crate::sensor::{Orthographic, Perspective, Sensor, Telecentric, ThinLens};
use eikonal::Shown;
use glam::DVec3;

/// Relative difference of aspect ratios that rounding may cause.
const ROUNDING: f64 = 1e-9;
/// Volume spanned by the axes of a map, relative to the product of their lengths, below which the
/// axes lie in a plane.
const MIN_VOLUME: f64 = 1e-9;

impl Problems {
    /// Checks a sensor. Its film, or its part of the film, has the given ratio of width to height.
    pub(super) fn sensor(&mut self, sensor: &Sensor, aspect: f64) {
        if let Sensor::Batch(batch) = sensor {
            let each = aspect / batch.sensors().len() as f64;
            batch.sensors().iter().for_each(|s| self.sensor(s, each));
            return;
        }
        self.map(sensor);
        match sensor {
            Sensor::Perspective(pinhole) => self.pinhole(pinhole, aspect),
            Sensor::ThinLens(lens) => self.lens(lens, aspect),
            Sensor::Orthographic(parallel) => self.parallel(parallel, aspect),
            Sensor::Telecentric(telecentric) => self.telecentric(telecentric, aspect),
            Sensor::Absent(_) | Sensor::Batch(_) => {}
        }
    }

    fn map(&mut self, sensor: &Sensor) {
        let map = sensor.to_world();
        let m = map.matrix3;
        let sides = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let is_flat = m.determinant().abs() <= MIN_VOLUME * sides.iter().product::<f64>();
        if !map.is_finite() || is_flat {
            let message = "must be finite and invertible".into();
            self.add("sensor".into(), Some("to_world"), message);
        }
    }

    fn pinhole(&mut self, pinhole: &Perspective, aspect: f64) {
        let [half_x, half_y] = pinhole.half();
        let before = self.count();
        self.field_of_view("sensor", half_x);
        if self.count() == before {
            self.aspect(half_x / half_y, aspect);
        }
    }

    /// Checks a field of view, given half the width of the image at unit distance.
    pub(super) fn field_of_view(&mut self, subject: &str, half_x: f64) {
        if !(half_x > 0.0 && half_x.is_finite()) {
            let degrees = Shown::rounded((2.0 * half_x.atan()).to_degrees());
            let message = format!("must be above 0 and below 180 degrees, but it is {degrees}");
            self.add(subject.into(), Some("fov_x"), message);
        }
    }

    fn lens(&mut self, lens: &ThinLens, aspect: f64) {
        self.pinhole(lens.pinhole(), aspect);
        self.length("sensor", "aperture_radius", lens.aperture_radius());
        self.length("sensor", "focus_distance", lens.focus_distance());
    }

    fn parallel(&mut self, parallel: &Orthographic, aspect: f64) {
        self.aspect(parallel.aspect(), aspect);
    }

    fn telecentric(&mut self, telecentric: &Telecentric, aspect: f64) {
        self.aspect(telecentric.aspect(), aspect);
        self.length("sensor", "stop", telecentric.stop_radius());
        let distance = telecentric.focus_distance();
        if !distance.is_finite() {
            let message = format!("must be finite, but it is {distance}");
            self.add("sensor".into(), Some("focus_distance"), message);
        }
    }

    /// Checks that the ratio of width to height equals the ratio of the film, if the film has a
    /// valid ratio.
    fn aspect(&mut self, aspect: f64, of_film: f64) {
        let is_same = (aspect / of_film - 1.0).abs() <= ROUNDING;
        if of_film > 0.0 && of_film.is_finite() && !is_same {
            let message = format!(
                "must be that of the film, {}, but it is {}",
                Shown(of_film),
                Shown(aspect)
            );
            self.add("sensor".into(), Some("aspect"), message);
        }
    }
}
