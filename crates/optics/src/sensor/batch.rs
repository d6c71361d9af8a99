//! Several sensors side by side on one film.

use super::{Sensor, SensorRay};

/// Sensors that each see a column of the image; all columns are equally wide. Nothing connects to
/// these sensors. They serve estimators that only trace rays from the sensor.
#[derive(Clone, Debug)]
pub struct Batch {
    sensors: Vec<Sensor>,
}

impl Batch {
    /// Creates the batch from sensors from left to right; `None` without any.
    pub fn new(sensors: Vec<Sensor>) -> Option<Self> {
        (!sensors.is_empty()).then_some(Batch { sensors })
    }

    pub(super) fn ray(&self, [s, t]: [f64; 2], lens: [f64; 2]) -> SensorRay {
        let count = self.sensors.len();
        let across = s * count as f64;
        // Clamp the column, because filters extend beyond the image.
        let column = (across.max(0.0) as usize).min(count - 1);
        self.sensors[column].ray([across - column as f64, t], lens)
    }

    /// Returns the sensors, from left to right.
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    pub(super) fn first(&self) -> &Sensor {
        &self.sensors[0]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Perspective;
    use super::*;
    use glam::{DAffine3, DVec3};

    #[test]
    fn each_sees_a_column() {
        let at = |x: f64| {
            let frame = DAffine3::from_translation(DVec3::X * x);
            Sensor::Perspective(Perspective::new(frame, 0.8, 0.5))
        };
        let batch = Batch::new(vec![at(0.0), at(5.0)]).unwrap();
        for (s, own, x) in [
            (0.1, 0.2, 0.0),
            (0.75, 0.5, 5.0),
            (1.05, 1.1, 5.0),
            (-0.1, -0.2, 0.0),
        ] {
            let ray = batch.ray([s, 0.3], [0.5; 2]);
            let alone = at(x).ray([own, 0.3], [0.5; 2]);
            assert!(ray.origin.distance(alone.origin) < 1e-12);
            assert!(ray.direction.distance(alone.direction) < 1e-12);
        }
        assert!(Batch::new(Vec::new()).is_none());
    }
}
