#![doc = include_str!("../README.md")]
#![warn(unreachable_pub, missing_debug_implementations)]

mod adapter;
mod layout;
mod walk;

pub use adapter::{Adapter, Gpu, OpenError, devices, open};
