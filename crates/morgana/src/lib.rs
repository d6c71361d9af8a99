#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

pub use eikonal::{Aabb, ConnectingRay, Failure, Field, Reference, Solver, Tolerance, Uniqueness};
pub use eikonal::{adjoint, certificate, connect, difference, field, interface, ray};
pub use glam;
pub use io::rendered::Picture;
pub use io::{Diagnostics, LoadOptions, Loaded, Run, load_scene};
pub use transport::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer, PhotonMapping, Vcm};
pub use transport::medium::Medium;
pub use transport::render::{MeasureOptions, Measurement, RenderOptions, Rendering};
pub use transport::scene::{BuildError, Object, SceneBuilder};
pub use transport::sensor::Camera;
pub use transport::{Bins, Film, Orientation, Scene, Spectrum, Stats, Stop};
pub use transport::{aov, attached, bsdf, derivative, emitter, film, integrator, medium, meter};
pub use transport::{
    moments, phase, polarization, render, renderer, sampling, scene, sensor, shape,
};
pub use transport::{sidebands, stats, texture, trace, volume};

/// Files: scenes, volumes, meshes and images.
pub mod files {
    pub use io::{FileError, Limits, Problem};
    pub use io::{LoadedField, assemble_field, json, schema, xml};
    pub use io::{arrays, image, mesh, volume};
}
