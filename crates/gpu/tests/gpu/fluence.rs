//! Fluence, absorbed power and energy balance on a GPU, against the CPU.
//!
//! False alarms: 1e-3 for all comparisons of a test together, except for the standard deviation of
//! z, whose limits are a fixed claim. Seeds are fixed.

use crate::common::{gpu, load, on_cpu, on_gpu, options};
use crate::scenes::{beam, bent_cube, bent_labels, cube, random_labels};
use serde_json::Value;
use testkit::{Family, Rng, z_test};
use transport::render::{MeasureOptions, Measurement, Share};

const PARTICLES: u64 = 1 << 15;
/// Smallest effective number of particles of a bin whose z is nearly normal.
const MIN_EFFECTIVE: f64 = 100.0;
/// Fewest bins that tell the standard deviation of z to 2 %.
const MIN_BINS: usize = 1000;

/// Comparisons of one scene or of several.
struct Comparisons {
    family: Family,
    zs: Vec<f64>,
}

impl Comparisons {
    fn new() -> Self {
        Comparisons {
            family: Family::new(1e-3),
            zs: Vec::new(),
        }
    }

    /// Compares all readings and the balance of a scene.
    fn compare(&mut self, name: &str, scene: &Value, options: &MeasureOptions) {
        let gpu = gpu().expect("tests ask first");
        let loaded = load(scene);
        let cpu = on_cpu(&loaded, options);
        let other = MeasureOptions {
            seed: options.seed + 1000,
            ..*options
        };
        let gpu = on_gpu(&gpu, &loaded, &other).unwrap();
        assert_eq!(gpu.stats.lost, 0, "{name}");
        self.compare_balances(name, &cpu, &gpu);
        for (a, b) in cpu.readings[0].iter().zip(&gpu.readings[0]) {
            assert_eq!((&a.name, &a.axes), (&b.name, &b.axes));
            // Leave out bins with nothing but rounding errors of faces.
            let floor = 1e-9 * a.mean.iter().fold(0.0, |most: f64, mean| most.max(*mean));
            // Treat both alike: bins that one run has chosen are brighter in that run.
            let effective = |i: usize| a.effective[i] + b.effective[i];
            let is_sure = |i: &usize| effective(*i) > 2.0 * MIN_EFFECTIVE && a.mean[*i] > floor;
            for i in (0..a.mean.len()).filter(is_sure) {
                let z = z_test::two_sample_z(b.mean[i], b.error[i], a.mean[i], a.error[i]);
                let name = format!("{name}, {} {i}: z = {z:.2}", a.name);
                self.family.push(name, z_test::p_value(z));
                self.zs.push(z);
            }
        }
    }

    fn compare_balances(&mut self, name: &str, a: &Measurement, b: &Measurement) {
        let shares = |m: &Measurement| [m.balance.media, m.balance.escaped, m.balance.cut];
        for (i, (a, b)) in shares(a).into_iter().zip(shares(b)).enumerate() {
            let z = z_test::two_sample_z(b.mean, b.error, a.mean, a.error);
            let name = format!("{name}, balance {i}: z = {z:.2}");
            self.family.push(name, z_test::p_value(z));
        }
        let Share { mean, error } = b.balance.residual;
        let limit = 5.0 * error + 1e-4 * b.balance.emitted;
        assert!(mean.abs() < limit, "{name}: residual {mean} ± {error}");
    }

    /// Checks all comparisons. If there are enough bins, also checks that errors are as large as
    /// differences.
    fn check(self) {
        let n = self.zs.len() as f64;
        let mean = self.zs.iter().sum::<f64>() / n;
        let squares = self.zs.iter().map(|z| (z - mean).powi(2));
        let deviation = (squares.sum::<f64>() / (n - 1.0)).sqrt();
        println!("{n} bins: z {mean:.4} ± {deviation:.4}");
        self.family.check().unwrap();
        assert!(self.zs.len() > MIN_BINS, "{n}");
        assert!((0.95..1.05).contains(&deviation), "{deviation}");
    }
}

#[test]
fn cubes() {
    if gpu().is_none() {
        return;
    }
    let mut comparisons = Comparisons::new();
    for (name, refracts) in [("refracting", true), ("matched", false)] {
        comparisons.compare(name, &cube(refracts), &options(PARTICLES, 1));
    }
    comparisons.check();
}

#[test]
fn random_label_volumes() {
    if gpu().is_none() {
        return;
    }
    let (mut rng, mut comparisons) = (Rng::new(71), Comparisons::new());
    for number in 0..6 {
        let scene = random_labels(&mut rng, number);
        let options = MeasureOptions {
            max_depth: (number == 4).then_some(9),
            ..options(PARTICLES, number)
        };
        comparisons.compare(&format!("scene {number}"), &scene, &options);
    }
    comparisons.check();
}

#[test]
fn curved_rays() {
    if gpu().is_none() {
        return;
    }
    let mut comparisons = Comparisons::new();
    for (name, faces) in [("clear faces", "dielectric"), ("no faces", "null")] {
        let scene = bent_cube(0.1, faces, 8.0, beam(0.6));
        comparisons.compare(name, &scene, &options(PARTICLES, 3));
    }
    let labels = bent_labels(&mut Rng::new(72));
    comparisons.compare("labels", &labels, &options(PARTICLES, 4));
    comparisons.check();
}
