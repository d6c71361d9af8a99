//! Runs on a GPU: equal bytes, parts of runs, stopping, and scenes that GPUs cannot run.

use crate::common::{gpu, load, on_gpu, options};
use crate::scenes::{beam, bent_cube, cube};
use io::Run;
use io::device::DeviceChoice;
use morgana_gpu::Gpu;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::Arc;
use transport::device::DeviceRun;
use transport::render::{Handle, MeasureOptions, MeasureState, Measurement};

const PARTICLES: u64 = 1 << 13;

fn same_bits(a: &Measurement, b: &Measurement) {
    for (a, b) in a.readings[0].iter().zip(&b.readings[0]) {
        for i in 0..a.mean.len() {
            assert_eq!(a.mean[i].to_bits(), b.mean[i].to_bits(), "{} {i}", a.name);
            assert_eq!(a.error[i].to_bits(), b.error[i].to_bits(), "{} {i}", a.name);
        }
    }
    assert_eq!(a.balance, b.balance);
}

/// Measures a range of particles as a part of a whole.
fn part(gpu: &Arc<Gpu>, scene: &Value, first: u64, particles: u64) -> MeasureState {
    let loaded = load(scene);
    let meters = loaded.meters();
    let run = DeviceRun::new(gpu.clone(), Some(PARTICLES));
    let options = MeasureOptions {
        first,
        ..options(particles, 7)
    };
    let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
    let (handle, go_on) = (Handle::default(), |_: &MeasureState| {
        ControlFlow::Continue(())
    });
    let done = state.advance_on(
        Some(&run),
        &loaded.groups,
        &meters,
        &options,
        &handle,
        go_on,
    );
    done.unwrap();
    state
}

#[test]
fn bytes_do_not_depend_on_threads_or_parts() {
    let Some(gpu) = gpu() else { return };
    let scene = bent_cube(0.05, "dielectric", 3.0, beam(0.4));
    let loaded = load(&scene);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| on_gpu(&gpu, &loaded, &options(PARTICLES, 7)).unwrap())
    };
    let whole = on(1);
    same_bits(&whole, &on(3));
    // In two parts, the second first.
    let half = PARTICLES / 2;
    let mut state = part(&gpu, &scene, half, half);
    state.merge(&part(&gpu, &scene, 0, half)).unwrap();
    let merged = state.into_measurement(&loaded.groups, &loaded.meters());
    same_bits(&whole, &merged.unwrap());
}

/// The errors of a bin follow from the differences between batches; the number of particles does
/// not change what a bin's effective number of particles means.
#[test]
fn quality_is_that_of_particles() {
    let Some(gpu) = gpu() else { return };
    let loaded = load(&cube(true));
    let options = options(1 << 15, 1);
    let on_gpu = on_gpu(&gpu, &loaded, &options).unwrap();
    let on_cpu = crate::common::on_cpu(&loaded, &options);
    let (a, b) = (&on_cpu.readings[0][0], &on_gpu.readings[0][0]);
    let bright = (0..a.mean.len()).filter(|i| a.effective[*i] > 300.0);
    let ratios = |of: &dyn Fn(usize) -> f64| {
        let ratios: Vec<f64> = bright.clone().map(of).collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    };
    let error = ratios(&|i| b.error[i] / a.error[i]);
    let effective = ratios(&|i| b.effective[i] / a.effective[i]);
    println!("{error} {effective}");
    // 64 batches tell an error to 9 %; hundreds of bins average over it.
    assert!((0.97..1.03).contains(&error), "{error}");
    assert!((0.95..1.10).contains(&effective), "{effective}");
}

#[test]
fn a_raised_stop_ends_a_run_within_a_pass() {
    let Some(gpu) = gpu() else { return };
    let loaded = load(&cube(true));
    let meters = loaded.meters();
    let run = DeviceRun::new(gpu, Some(1 << 30));
    let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
    let handle = Handle::default();
    handle.end_now();
    let go_on = |_: &MeasureState| ControlFlow::Continue(());
    let options = options(1 << 30, 1);
    let done = state.advance_on(
        Some(&run),
        &loaded.groups,
        &meters,
        &options,
        &handle,
        go_on,
    );
    done.unwrap();
    assert_eq!(state.done().count(), 0);
}

/// Change of a scene.
type Change = fn(&mut Value);

/// Returns the reason why a GPU cannot run a changed scene.
fn refusal(change: Change) -> String {
    let mut scene = cube(true);
    change(&mut scene);
    let loaded = load(&scene);
    let refused = Run::new(&loaded).check_device();
    refused.unwrap_err().to_string()
}

#[test]
fn scenes_that_gpus_cannot_run_are_refused_with_the_reason() {
    let cases: [(&str, Change); 7] = [
        (
            "it has 2 meters, and a GPU serves one fluencemeter: remove the others, such as detectors",
            |s| s["second"] = s["cells"].clone(),
        ),
        ("its fluencemeter measures modulated light", |s| {
            s["cells"]["modulation_frequencies"] = json!([1e8]);
            s["cells"]["metres_per_unit"] = json!(0.01);
        }),
        (
            "the cells of its fluencemeter are not the voxels: give the meter the size and place of the volume",
            |s| s["cells"]["to_world"] = json!([]),
        ),
        (
            "it needs one label volume, or one cube, and no other shape",
            |s| s["ball"] = json!({"type": "sphere", "center": [0, 0, 5]}),
        ),
        (
            "its phase function is neither isotropic nor Henyey–Greenstein",
            |s| s["tissue"]["interior"]["phase"] = json!({"type": "rayleigh"}),
        ),
        (
            "its index varies, but is not sampled on a grid (bspline)",
            |s| {
                s["tissue"]["interior"]["ior"] =
                    json!({"type": "gaussian", "n0": 1.4, "delta": 0.1, "width": 0.5})
            },
        ),
        (
            "its index varies by 3.0e-6 of itself, which single precision loses below 1e-5",
            |s| *s = bent_cube(4e-6, "null", 1.0, beam(0.5)),
        ),
    ];
    for (reason, change) in cases {
        let expected = format!("a GPU cannot run this scene: {reason}; the CPU can");
        assert_eq!(refusal(change), expected);
    }
}

#[test]
fn devices_are_named() {
    let named = |text: &str| text.parse::<DeviceChoice>();
    assert_eq!(named("cpu"), Ok(DeviceChoice::Cpu));
    assert_eq!(named("gpu"), Ok(DeviceChoice::Gpu(0)));
    assert_eq!(named("gpu:3"), Ok(DeviceChoice::Gpu(3)));
    assert_eq!(named("auto"), Ok(DeviceChoice::Auto));
    for wrong in ["", "GPU", "gpu:", "gpu:-1", "gpu1", "cpu:0", "cuda"] {
        assert!(named(wrong).is_err(), "{wrong}");
    }
    assert!(morgana_gpu::open(99).is_err());
}
