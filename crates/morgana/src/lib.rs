#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

pub use eikonal::{ConnectingRay, Field, Solver, Tolerance};
pub use eikonal::{connect, field, ray};
pub use glam;
pub use io::rendered::Picture;
pub use io::{Diagnostics, LoadOptions, Loaded, Run, load_scene};
pub use transport::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer, PhotonMapping, Vcm};
pub use transport::medium::Medium;
pub use transport::render::{MeasureOptions, Measurement, RenderOptions, Rendering};
pub use transport::scene::{BuildError, Object, SceneBuilder};
pub use transport::sensor::Camera;
pub use transport::{Film, Scene, Spectrum};
pub use transport::{aov, bsdf, emitter, film, integrator, medium, meter, phase, render, scene};
pub use transport::{sensor, shape, texture, trace};

/// Files: scenes, volumes, meshes and images.
pub mod files {
    pub use io::{FileError, Limits, Problem};
    pub use io::{LoadedField, assemble_field, json, schema, xml};
    pub use io::{arrays, image, mesh, volume};
}
