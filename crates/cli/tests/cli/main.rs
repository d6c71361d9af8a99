//! Tests of the `morgana` program itself, on small scenes.

mod connect;
mod errors;
mod info;
mod layers;
mod limits;
mod photons;
mod render;
mod strategies;
mod support;
mod trace;
