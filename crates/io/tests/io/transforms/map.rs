//! A map that places all objects of a scene, and may be rounded.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use serde_json::{Value, json};

/// A rotation of the whole scene, optionally with a mirror and a uniform scale.
#[derive(Clone, Copy)]
pub struct Map {
    linear: DMat3,
    scale: f64,
    /// Digits after the point to which matrices are rounded.
    pub digits: Option<i32>,
}

pub const IDENTITY: Map = Map {
    linear: DMat3::IDENTITY,
    scale: 1.0,
    digits: None,
};

/// Three maps: a rotation, the rotation with a mirror, and the rotation with a scale.
pub fn maps() -> [(&'static str, Map); 3] {
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    let linear = DMat3::from_quat(DQuat::from_axis_angle(axis, 0.9));
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let rotation = Map { linear, ..IDENTITY };
    let mirrored = Map {
        linear: linear * mirror,
        ..rotation
    };
    let scaled = Map {
        scale: 2.5,
        ..rotation
    };
    [
        ("rotation", rotation),
        ("mirror", mirrored),
        ("scale", scaled),
    ]
}

impl Map {
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Growth of areas, by which intensities must grow to keep irradiances.
    pub fn area(&self) -> f64 {
        self.scale * self.scale
    }

    pub fn rounded(self, digits: i32) -> Self {
        Map {
            digits: Some(digits),
            ..self
        }
    }

    /// Transform of a skew object at the origin.
    pub fn turned(&self) -> Value {
        self.place([0.0; 3])
    }

    /// Transform of a skew object at a point.
    pub fn place(&self, at: [f64; 3]) -> Value {
        let askew = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 0.5).normalize(), 0.7);
        self.of(DAffine3::from_rotation_translation(askew, at.into()))
    }

    /// A point of the scene.
    pub fn point(&self, at: [f64; 3]) -> Value {
        let all = DAffine3::from_mat3(self.linear * self.scale);
        json!(all.transform_point3(at.into()).to_array())
    }

    /// Transform of a sensor or emitter at a point that faces the origin along +z.
    pub fn view(&self, from: [f64; 3]) -> Value {
        let from = DVec3::from(from);
        let ahead = -from.normalize();
        let left = DVec3::new(0.1, 1.0, 0.2).cross(ahead).normalize();
        let view = DMat3::from_cols(left, ahead.cross(left), ahead);
        self.of(DAffine3::from_mat3_translation(view, from))
    }

    /// Transform of the unit cube over the unit ball.
    pub fn unit_cube(&self) -> Value {
        let cube = DAffine3::from_scale(DVec3::splat(2.0))
            * DAffine3::from_translation(DVec3::splat(-0.5));
        self.of(cube)
    }

    fn of(&self, local: DAffine3) -> Value {
        let all = DAffine3::from_mat3(self.linear * self.scale) * local;
        let matrix = DMat4::from(all);
        let round = |v: f64| match self.digits {
            Some(digits) => (v * 10f64.powi(digits)).round() / 10f64.powi(digits),
            None => v,
        };
        let row = |i: usize| matrix.row(i).to_array().map(round);
        json!([row(0), row(1), row(2), row(3)])
    }
}
