//! The factors of the matrix, and the scene of each combination.

use crate::agreement::compare::Effort;
use crate::common::{container, glass, sky, vacuum};
use eikonal::field::{
    Acoustic, AcousticMode, Bspline, Constant, Fisheye, Gaussian, LinearIndex, LinearSquare,
    Luneburg, Placement, Selfoc, Sum,
};
use eikonal::{Aabb, Field, Tolerance};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter, Environment, Spot};
use morgana_transport::film::Filter;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::{FilmSpec, Object, Parts};
use morgana_transport::sensor::{Orthographic, Perspective, Sensor, ThinLens};
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Orientation, Spectrum};
use std::f64::consts::TAU;

macro_rules! factor {
    ($(#[$doc:meta])* $name:ident { $($level:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name { $($level),+ }
        impl $name {
            pub const ALL: &[$name] = &[$($name::$level),+];
        }
    };
}

factor! {
    /// Refractive index of the ball in the middle of every scene.
    Index {
        Constant, Linear, LinearSquare, Luneburg, Selfoc, Fisheye, Gaussian, Acoustic0,
        Acoustic3, Grid, Sum,
    }
}
factor! {
    /// Emitter of the scene.
    Light { Point, Area, Beam, Sky, SkyImage, Spot, Directional }
}
factor! {
    /// Contents of the ball: fog that scatters isotropically or forwards, homogeneous or not, or
    /// only a small white ball.
    Matter { Fog, Forward, Cloud, ForwardCloud, Ball }
}
factor! {
    /// Wall of the ball.
    Wall { Matched, Glass }
}
factor! {
    /// Sensor and its place.
    View { Pinhole, Lens, Parallel, PinholeInside }
}

/// A scene of the matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Case {
    pub index: Index,
    pub light: Light,
    pub matter: Matter,
    pub wall: Wall,
    pub view: View,
}

impl Case {
    /// Effort for `particle` where the other estimators use `effort`; `None` if it is not compared.
    ///
    /// Where light reaches the surroundings of the sensor inside fog, a particle that is scattered
    /// close to a pinhole contributes 1/r², which has infinite variance. Fog that scatters forwards
    /// sends few particles to the sensor: a lobe of g = 0.9 covers 1/400 of all directions. At the
    /// effort of the others, a batch could lack all of the particles that carry the light, and its
    /// mean would be far from normal.
    pub fn particle_effort(&self, effort: Effort) -> Option<Effort> {
        if self.view == View::PinholeInside && self.matter != Matter::Ball {
            return None;
        }
        Some(if self.scatters_forward() {
            effort.times(20)
        } else {
            effort
        })
    }

    fn scatters_forward(&self) -> bool {
        matches!(self.matter, Matter::Forward | Matter::ForwardCloud)
    }

    pub fn parts(&self) -> Parts {
        let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
        let wall = match self.wall {
            Wall::Matched => Bsdf::Null,
            Wall::Glass => glass(),
        };
        let mut objects = vec![container(ball, wall)];
        if self.matter == Matter::Ball {
            let place = DVec3::new(0.1, -0.05, 0.0);
            objects.push(diffuse(Sphere::around(place, 0.35).unwrap()));
        }
        let emitter = self.emitter(&mut objects);
        Parts {
            partitions: Vec::new(),
            objects,
            media: vec![vacuum(), self.medium()],
            emitters: vec![emitter],
            sensor: self.sensor(),
            film: FilmSpec {
                width: 4,
                height: 4,
                channels: 1,
                group_size: Spectrum::CHANNELS,
                filter: Filter::Tent { radius: 1.0 },
                window: None,
            },
            tolerance: Tolerance::new(1e-6),
            // Light with more reflections at a wall of index 1.3 is below a thousandth.
            measured: eikonal::Aabb::EMPTY,
            reflections: match self.wall {
                Wall::Matched => 0,
                Wall::Glass => 2,
            },
        }
    }

    fn medium(&self) -> Medium {
        let (sigma_t, g) = match self.matter {
            Matter::Ball => (VolumeTexture::Uniform(Spectrum::ZERO), 0.0),
            Matter::Fog => (VolumeTexture::Uniform(Spectrum::splat(1.0)), 0.0),
            Matter::Forward => (VolumeTexture::Uniform(Spectrum::splat(1.5)), 0.9),
            Matter::Cloud => (cloud(), 0.0),
            Matter::ForwardCloud => (cloud(), 0.9),
        };
        Medium {
            name: "fog".into(),
            index: self.index.field(self.wall),
            sigma_t,
            scale: 1.0,
            albedo: VolumeTexture::Uniform(Spectrum::splat(0.8)),
            phase: Phase::henyey_greenstein(g).unwrap(),
            emission: None,
            velocity: None,
            fluorescence: None,
            labels: None,
        }
    }

    fn emitter(&self, objects: &mut Vec<Object>) -> Emitter {
        // Light fog that scatters forwards from behind, because few paths turn around in it.
        let light = DVec3::new(1.2, 1.4, if self.scatters_forward() { -2.0 } else { 1.6 });
        let down = -light.normalize();
        match self.light {
            Light::Point => Emitter::Point {
                position: light,
                intensity: Spectrum::splat(4.0),
            },
            Light::Spot => Emitter::Spot(Spot::new(light, down, Spectrum::splat(4.0), 0.5, 0.2)),
            Light::Area => {
                let mut light = diffuse(Rectangle::new(facing(light, down, 0.4)).unwrap());
                light.emitter = Some(0);
                objects.push(light);
                Emitter::Area {
                    object: objects.len() - 1,
                    radiance: Spectrum::splat(8.0),
                }
            }
            Light::Beam => Emitter::Collimated(Collimated::new(
                DVec3::new(-1.2, 0.3, light.z),
                DVec3::new(1.2, -0.2, -light.z).normalize(),
                BeamProfile::Disc { radius: 0.4 },
                Spectrum::splat(2.0),
            )),
            Light::Sky => sky(),
            Light::SkyImage => {
                let pixel = |i: usize| Spectrum::splat(0.2 + ((3 * i + 1) % 5) as f64 * 0.5);
                let pixels = (0..32).map(pixel).collect();
                Emitter::Environment(
                    Environment::image(8, 4, pixels, Orientation::IDENTITY).unwrap(),
                )
            }
            Light::Directional => Emitter::Directional {
                direction: down,
                irradiance: Spectrum::splat(1.0),
            },
        }
    }

    fn sensor(&self) -> Sensor {
        let outside = facing(DVec3::new(0.1, 0.2, 3.0), -DVec3::Z, 0.9);
        let fov = 34f64.to_radians();
        match self.view {
            View::Pinhole => Sensor::Perspective(Perspective::new(outside, fov, 1.0)),
            View::Lens => {
                let pinhole = Perspective::new(outside, fov, 1.0);
                Sensor::ThinLens(ThinLens::new(pinhole, 0.2, 2.8))
            }
            View::Parallel => Sensor::Orthographic(Orthographic::new(outside, 1.0)),
            View::PinholeInside => {
                let from = DVec3::new(0.1, 0.2, 0.75);
                let to = facing(from, (DVec3::new(0.1, -0.1, 0.0) - from).normalize(), 1.0);
                Sensor::Perspective(Perspective::new(to, 2.0 * fov, 1.0))
            }
        }
    }
}

impl Index {
    /// Index of the ball. Behind a matched wall the indices are close to those of the surrounding
    /// vacuum, where the type of field allows it; behind glass they are larger. No field focuses
    /// parallel light inside the ball: near a focus in fog, one kind of connections has infinite
    /// variance (strong lenses are in [`crate::branches`]).
    pub fn field(self, wall: Wall) -> Field {
        let glass = wall == Wall::Glass;
        let n = if glass { 1.3 } else { 1.05 };
        let (o, up) = (DVec3::ZERO, DVec3::new(0.6, 0.8, 0.0));
        match self {
            Index::Constant => Constant::new(n).into(),
            Index::Linear => LinearIndex::new(n, up * 0.2, o).unwrap().into(),
            Index::LinearSquare => LinearSquare::new(n, up * 0.4, o).unwrap().into(),
            Index::Luneburg => Luneburg::new(0.75 * n, o, 2.0).unwrap().into(),
            Index::Selfoc => Selfoc::new(1.2 * n, 0.5, o, up).unwrap().into(),
            Index::Fisheye => Fisheye::new(1.2 * n, o, 2.2).unwrap().into(),
            Index::Gaussian => Gaussian::new(n, 0.1, o, 0.4).unwrap().into(),
            Index::Acoustic0 => acoustic(n, 0),
            Index::Acoustic3 => acoustic(n, 3),
            Index::Grid => {
                let bounds = Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1));
                let wave = |x: DVec3| n + 0.05 * (2.0 * x.x).sin() + 0.08 * (x.y * 3.0 + x.z).cos();
                Bspline::from_fn([16; 3], bounds, Placement::Nodes, wave)
                    .unwrap()
                    .into()
            }
            Index::Sum => {
                let bump = Gaussian::new(n, 0.08, DVec3::X * 0.3, 0.4).unwrap();
                let ramp = LinearSquare::new(n, up * 0.2, o).unwrap();
                Sum::new(n, vec![bump.into(), ramp.into()]).unwrap().into()
            }
        }
    }
}

pub fn acoustic(n: f64, order: u16) -> Field {
    let mode = AcousticMode::new(0.01, order, TAU / 1.2, 0.0).unwrap();
    Acoustic::new(n, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode])
        .unwrap()
        .into()
}

pub fn diffuse(shape: impl Into<morgana_transport::shape::Shape>) -> Object {
    Object {
        name: "diffuse".into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.7)).unwrap()),
        sides: None,
        ..container(shape, Bsdf::Null)
    }
}

/// Returns a map whose local z axis points along `direction`, scaled.
pub fn facing(position: DVec3, direction: DVec3, scale: f64) -> DAffine3 {
    let left = DVec3::Y.cross(direction).normalize();
    let basis = DMat3::from_cols(left, direction.cross(left), direction);
    DAffine3 {
        matrix3: basis * scale,
        translation: position,
    }
}

/// Extinction on a grid of 3³ samples over the ball.
pub fn cloud() -> VolumeTexture {
    let data = (0..27)
        .map(|i| 0.3 + ((5 * i + 2) % 9) as f32 * 0.25)
        .collect();
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(2.0)),
        translation: -DVec3::ONE,
    };
    let samples = GridSamples {
        size: [3; 3],
        channels: 1,
        data,
    };
    let grid = VolumeGrid::new(
        samples,
        to_world,
        Placement::Nodes,
        GridFilter::Trilinear,
        [0.0, 10.0],
    );
    VolumeTexture::Grid(std::sync::Arc::new(grid.unwrap()))
}
