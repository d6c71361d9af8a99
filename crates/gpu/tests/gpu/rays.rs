//! Curved rays in single precision, against double precision. Fluence of scattered light hardly
//! depends on how much rays bend; the lengths of single rays in voxels do.

use crate::common::{gpu, load, on_cpu, on_gpu, options};
use crate::scenes::{beam, bent_cube};
use transport::meter::Reading;

/// Largest difference of the length of a ray in a voxel, relative to the longest length. Steps of
/// half a voxel cause about 1e-4.
const MAX_DIFFERENCE: f64 = 1e-3;

/// Without scattering, the same particles start on both processors, so there is no noise.
#[test]
fn they_take_the_same_voxels() {
    let Some(gpu) = gpu() else { return };
    for contrast in [0.1, -0.05] {
        let loaded = load(&bent_cube(contrast, "null", 1e-9, beam(1e-4)));
        let options = options(4096, 5);
        let cpu = on_cpu(&loaded, &options);
        let gpu = on_gpu(&gpu, &loaded, &options).unwrap();
        let straight = load(&bent_cube(1e-4, "null", 1e-9, beam(1e-4)));
        let straight = on_cpu(&straight, &options);
        let (a, b, c) = (
            &cpu.readings[0][0],
            &gpu.readings[0][0],
            &straight.readings[0][0],
        );
        let largest = a.mean.iter().fold(0.0, |most: f64, mean| most.max(*mean));
        let difference = |other: &Reading| {
            let differences = (0..a.mean.len()).map(|i| (a.mean[i] - other.mean[i]).abs());
            differences.fold(0.0, f64::max) / largest
        };
        let (found, bending) = (difference(b), difference(c));
        println!("{contrast}: {found:.2e} of a voxel; bending moves light by {bending:.2}");
        assert!(bending > 0.2, "{bending}");
        assert!(found < MAX_DIFFERENCE, "{contrast}: {found}");
    }
}
