//! Tests of the `morgana` program itself, on small scenes.

mod connect;
mod convert;
mod errors;
mod info;
mod layers;
mod limits;
mod measure;
mod photons;
mod plot;
mod render;
mod strategies;
mod support;
mod trace;
