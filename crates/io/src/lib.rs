#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

pub mod arrays;
pub mod assemble;
pub mod atomic;
mod binary;
mod cie;
pub mod clock;
pub mod compare;
pub mod diagnostic;
mod draft;
pub mod element;
pub mod error;
pub mod features;
pub mod ies;
pub mod image;
pub mod input;
pub mod json;
pub mod loading;
pub mod lock;
pub mod mesh;
pub mod npy;
mod npz;
pub mod packed;
pub mod part;
pub mod query;
mod read;
pub mod rendered;
pub mod report;
pub mod run;
pub mod scene;
pub mod schema;
pub mod spd;
mod table;
mod temporary;
mod tissue;
pub mod transducer;
pub mod volume;
mod write;
pub mod xml;

pub use assemble::{
    Difference, LoadOptions, Loaded, LoadedField, assemble, assemble_field, load_scene,
};
pub use diagnostic::{Diagnostic, Diagnostics, Location, Severity};
pub use error::{FileError, Problem};
pub use input::Limits;
pub use query::Query;
pub use read::{is_json, read_scene};
pub use run::{Refusal, Run};
pub use scene::{
    FileRegistry, ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue,
};
pub use write::{WriteError, write_scene};
