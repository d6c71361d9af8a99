#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

pub mod arrays;
pub mod assemble;
pub mod clock;
pub mod device;
pub mod diagnostic;
mod draft;
pub mod features;
pub mod json;
pub mod loading;
mod outcome;
pub mod parameters;
pub mod part;
pub mod query;
mod read;
pub mod rendered;
pub mod report;
pub mod run;
pub mod scene;
pub mod schema;
mod tissue;
pub mod transducer;
mod write;
pub mod xml;

pub use assemble::{
    Difference, LoadOptions, Loaded, LoadedField, assemble, assemble_field, load_described_scene,
    load_scene,
};
pub use diagnostic::{Diagnostic, Diagnostics, Location, Severity};
pub use formats::{
    FileError, Limits, Problem, atomic, compare, element, error, ies, image, input, jdata, lock,
    mesh, npy, packed, spd, volume,
};
use formats::{binary, cie, npz, table};
pub use outcome::Outcome;
pub use query::Query;
pub use read::{is_json, read_scene};
pub use run::{Refusal, Run};
pub use scene::{
    FileRegistry, ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue,
};
pub use write::{WriteError, write_scene};
