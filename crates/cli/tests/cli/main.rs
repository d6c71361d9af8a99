//! Tests of the `morgana` program itself, on small scenes.

mod arrays;
mod auto;
mod compare;
mod connect;
mod convert;
#[cfg(unix)]
mod denoise;
mod errors;
mod export;
mod faults;
mod files;
mod frames;
mod info;
mod layers;
mod limits;
mod mcx;
mod measure;
mod parts;
mod photons;
mod plot;
mod preview;
mod render;
mod schema;
mod shell;
mod strategies;
mod support;
mod trace;
mod view;
