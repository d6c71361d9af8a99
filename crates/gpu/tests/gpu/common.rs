//! Scenes, and their measurement on either processor.

use io::{LoadOptions, Loaded};
use morgana_gpu::Gpu;
use serde_json::Value;
use std::fs;
use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};
use transport::device::DeviceRun;
use transport::render::{Handle, MeasureError, MeasureOptions, MeasureState, Measurement, measure};

/// Returns the GPU; `None` if there is none and tests may be skipped.
pub fn gpu() -> Option<Arc<Gpu>> {
    static GPU: OnceLock<Option<Arc<Gpu>>> = OnceLock::new();
    let open = || match morgana_gpu::open(0) {
        Ok(gpu) => Some(Arc::new(gpu)),
        Err(error) if std::env::var_os("MORGANA_ALL_TESTS").is_some() => panic!("{error}"),
        Err(error) => {
            eprintln!("NOT TESTED: {error}");
            None
        }
    };
    GPU.get_or_init(open).clone()
}

pub fn load(scene: &Value) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    io::load_scene(&path, &LoadOptions::default()).unwrap()
}

pub fn options(particles: u64, seed: u64) -> MeasureOptions {
    MeasureOptions {
        first: 0,
        particles,
        seed,
        max_depth: None,
        rr_depth: 5,
    }
}

/// Measures on the CPU.
pub fn on_cpu(loaded: &Loaded, options: &MeasureOptions) -> Measurement {
    let go_on = |_| ControlFlow::Continue(());
    let (meters, handle) = (loaded.meters(), Handle::default());
    measure(&loaded.groups, &meters, options, &handle, go_on).unwrap()
}

/// Measures on a GPU.
pub fn on_gpu(
    gpu: &Arc<Gpu>,
    loaded: &Loaded,
    options: &MeasureOptions,
) -> Result<Measurement, MeasureError> {
    let (meters, handle) = (loaded.meters(), Handle::default());
    let run = DeviceRun::new(gpu.clone(), Some(options.particles));
    let mut state = MeasureState::new(&loaded.groups, &meters)?;
    let go_on = |_: &MeasureState| ControlFlow::Continue(());
    state.advance_on(Some(&run), &loaded.groups, &meters, options, &handle, go_on)?;
    state.into_measurement(&loaded.groups, &meters)
}
