//! Whether what a scene asks for fits into memory: `check` and `render` must not differ.

use crate::failure::Failure;
use crate::numbers;
use io::rendered::Naming;
use io::{Limits, Loaded};
use transport::meter::Meter;
use transport::render::{MeasureError, MeasureState, Options, memory};

/// A film that does not fit into memory would end the program without a word.
pub fn check_film(loaded: &Loaded, options: &Options, limits: Limits) -> Result<(), Failure> {
    let film = loaded.scene().film();
    let bytes = memory(film, options);
    let needs = |more: String| {
        let (width, height) = (film.width, film.height);
        let layers = Naming::of(loaded).map(|n| format!(" with {}", n.describe()));
        let strategies = options.strategies.then_some(" with --strategies");
        Failure::Usage(format!(
            "a film of {width} × {height} pixels{}{} needs {} of memory{more}",
            layers.unwrap_or_default(),
            strategies.unwrap_or_default(),
            numbers::bytes(bytes)
        ))
    };
    match limits.memory {
        Some(most) if bytes as u64 > most => Err(needs(format!(
            ", more than the {} of --memory",
            numbers::bytes(usize::try_from(most).unwrap_or(usize::MAX))
        ))),
        _ => Vec::<u8>::new()
            .try_reserve_exact(bytes)
            .map_err(|_| needs(", more than this system has".into())),
    }
}

/// That meters fit into memory, and have light to measure.
pub fn check_meters(loaded: &Loaded) -> Result<(), Failure> {
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let state = MeasureState::new(&loaded.groups, &meters);
    state.map(drop).map_err(refused)
}

/// What to tell the user.
pub fn refused(error: MeasureError) -> Failure {
    Failure::Usage(error.to_string())
}
