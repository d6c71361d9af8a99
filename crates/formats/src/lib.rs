#![doc = include_str!("../README.md")]
#![warn(unreachable_pub)]

pub mod atomic;
pub mod binary;
pub mod cie;
pub mod colour;
pub mod compare;
pub mod element;
pub mod error;
pub mod escape;
pub mod ies;
pub mod image;
pub mod input;
pub mod jdata;
pub mod lock;
pub mod mesh;
pub mod npy;
pub mod npz;
pub mod packed;
pub mod spd;
pub mod table;
pub mod temporary;
pub mod tensor;
pub mod volume;

pub use error::{FileError, Problem};
pub use input::Limits;
