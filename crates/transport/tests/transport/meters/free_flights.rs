//! Free flights: uninterrupted flights are traced without edges, unless a meter keeps records.
//! Readings do not depend on it.

use crate::meters::support::*;
use eikonal::field::Constant;
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::{Medium, MediumLabel, MediumLabels};
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter, Reading};
use morgana_transport::render::Measurement;
use morgana_transport::scene::{CellMedia, Object, Partition, Parts, Sides};
use morgana_transport::shape::Mesh;
use morgana_transport::volume::{LabelGrid, VolumeGrid, VolumeTexture, VoxelMedia};
use morgana_transport::{Bins, Scene, Spectrum};
use std::sync::Arc;

/// A cube from −1 to 1, either of voxels with three labels, one of them clear, or of one label with
/// a small mesh inside.
fn cube(labelled: bool) -> Parts {
    let labels = (0..512u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 20) as u8 % 3);
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let grid = Arc::new(LabelGrid::new([8; 3], labels.collect(), to_world).unwrap());
    let label = |[extinction, absorption]: [f64; 2]| MediumLabel {
        name: format!("of extinction {extinction}"),
        extinction: Spectrum([extinction, 0.0, 0.0, 0.0]),
        absorption: Spectrum([absorption, 0.0, 0.0, 0.0]),
        velocity: None,
        fluorescence: None,
    };
    let labels = [[2.0, 0.3], [20.0, 1.0], [0.0, 0.0]].map(label);
    let by_label = |value: fn(&MediumLabel) -> f64| {
        let values = labels.each_ref().map(|l| Spectrum::splat(value(l)));
        let texture = VolumeGrid::by_label(grid.clone(), &values, 1).unwrap();
        VolumeTexture::Grid(Arc::new(texture))
    };
    let turbid = fog(Constant::new(1.3), 12.0, 0.9, 0.7);
    let medium = if labelled {
        Medium {
            sigma_t: by_label(|l| l.extinction[0]),
            albedo: by_label(|l| 1.0 - l.absorption[0] / l.extinction[0].max(1e-9)),
            labels: MediumLabels::new(grid.clone(), labels.to_vec()),
            ..turbid
        }
    } else {
        turbid
    };
    let hull = container(hull(), glass());
    let net = Object {
        sides: None,
        ..container(net(), Bsdf::Null)
    };
    let light = beam(
        DVec3::new(0.1, 0.2, -2.0),
        DVec3::new(0.1, 0.0, 1.0).normalize(),
        0.2,
    );
    parts(
        vec![hull, net],
        vec![vacuum(), medium],
        vec![light],
        nobody(),
    )
}

/// The cube from −1 to 1 as triangles: a grid of the scene locates triangles, but not an analytic
/// cube within its box.
pub fn hull() -> Mesh {
    let corner =
        |i: u32| DVec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| 2.0 * f64::from(b) - 1.0));
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh::new((0..8).map(corner).collect(), triangles.collect(), None).unwrap()
}

/// A mesh with enough triangles for the scene to use a grid.
pub fn net() -> Mesh {
    let corner = |i: u32| DVec3::new(f64::from(i % 10), f64::from(i / 10), f64::from(i * i % 7));
    let positions = (0..100).flat_map(|i| {
        let x = corner(i) * 0.05;
        [x, x + DVec3::X * 0.05, x + DVec3::new(0.01, 0.04, 0.02)]
    });
    let triangles = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Mesh::new(positions.collect(), triangles.collect(), None).unwrap()
}

fn meters() -> Vec<Meter> {
    let voxels = || {
        fluence(
            Coordinates::Cartesian,
            [7, 5, 6],
            scaled(DVec3::splat(1.8), DVec3::splat(-0.8)),
        )
    };
    let rings = scaled(DVec3::new(0.9, 0.9, 1.9), DVec3::Z * -1.0);
    let all = [
        voxels(),
        FluenceMeter {
            optical_length: Some(Bins {
                min: 0.0,
                max: 6.0,
                count: 5,
            }),
            weight_windows: true,
            ..voxels()
        },
        fluence(Coordinates::Cylindrical, [6, 1, 5], rings),
        FluenceMeter {
            estimator: Estimator::Collision,
            ..voxels()
        },
    ];
    all.map(Meter::Fluence).into()
}

/// Two layers of different index between z = −1, 0 and 1, divided by faces of voxels, which the
/// scene knows or not.
fn layers(known: bool) -> Parts {
    let corner = |i: u32| {
        let [x, y] = [i & 1, i >> 1 & 1].map(|b| 2.0 * f64::from(b) - 1.0);
        DVec3::new(x, y, f64::from(i >> 2) - 1.0)
    };
    // Normals point up in the middle, and outwards elsewhere.
    let sides = |low: u32| {
        let [a, b, c, d] = [low, low + 1, low + 3, low + 2];
        let wall = |p: u32, q: u32| [p, q, q + 4, p + 4];
        [wall(a, b), wall(b, c), wall(c, d), wall(d, a)]
    };
    let lower: Vec<[u32; 4]> = sides(0).into_iter().chain([[0, 2, 3, 1]]).collect();
    let upper: Vec<[u32; 4]> = sides(4).into_iter().chain([[8, 9, 11, 10]]).collect();
    let surface = |faces: &[[u32; 4]], [interior, exterior]: [usize; 2]| {
        let triangles = faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let mesh = Mesh::new((0..12).map(corner).collect(), triangles.collect(), None);
        Object {
            sides: Some(Sides { interior, exterior }),
            ..container(mesh.unwrap(), glass())
        }
    };
    let objects = vec![
        surface(&lower, [1, 0]),
        surface(&upper, [2, 0]),
        surface(&[[4, 5, 7, 6]], [1, 2]),
    ];
    let voxels = (0..128u8).map(|i| 1 + i / 64).collect();
    let voxels = LabelGrid::new([4, 4, 8], voxels, scaled(DVec3::splat(2.0), DVec3::NEG_ONE));
    let voxels = VoxelMedia::new(voxels.unwrap(), vec![1, 2]);
    let light = Emitter::point(DVec3::new(0.1, 0.2, -2.0), 1.0);
    let media = vec![
        vacuum(),
        fog(Constant::new(1.3), 12.0, 0.9, 0.7),
        fog(Constant::new(1.5), 5.0, 0.8, 0.0),
    ];
    let mut parts = parts(objects, media, vec![light], nobody());
    parts.partitions = vec![Partition {
        objects: 0..3,
        exterior: 0,
        cells: known.then(|| CellMedia::Voxels(Arc::new(voxels))),
    }];
    parts
}

/// Readings are equal where voxels tell which flights meet no face.
#[test]
fn voxels_know_where_their_faces_are() {
    let [known, found] = [true, false].map(|known| {
        let parts = layers(known);
        let scene = Scene::new(parts.clone()).unwrap();
        for (z, medium) in [(-1.01, 0), (-0.99, 1), (-0.01, 1), (0.01, 2), (0.99, 2)] {
            assert_eq!(scene.medium_at(DVec3::new(0.3, 0.2, z)), medium);
        }
        run(parts, &meters(), &options(3_000, 9))
    });
    assert_eq!(known.stats.edges, found.stats.edges);
    assert!(known.stats.edges > 5_000);
    for (a, b) in known
        .readings
        .iter()
        .flatten()
        .zip(found.readings.iter().flatten())
    {
        assert!(b.mean.iter().sum::<f64>() > 0.0);
        for (a, b) in a.mean.iter().zip(&b.mean) {
            assert!((a - b).abs() < 1e-9 * b.max(1e-3), "{a} {b}");
        }
    }
}

/// With common random numbers all readings agree to rounding. Absorption in labels is drawn at
/// random along edges, and agrees only in the mean: 3000 particles and fixed seeds show differences
/// of 1 %.
#[test]
fn free_flights_change_nothing() {
    for labelled in [false, true] {
        let parts = cube(labelled);
        let free = run(parts.clone(), &meters(), &options(3_000, 7));
        let mut exit = through(&parts.objects, 0, [1, 1], false);
        exit.most_records = Some(1);
        let with_records: Vec<Meter> = meters()
            .into_iter()
            .chain([Meter::Irradiance(exit)])
            .collect();
        let other = run(parts, &with_records, &options(3_000, 7));
        assert_eq!(free.stats.edges, other.stats.edges);
        let balance = |m: &Measurement| {
            let balance = &m.balance;
            [
                &balance.media,
                &balance.surfaces,
                &balance.escaped,
                &balance.cut,
            ]
            .map(|s| s.mean)
        };
        for (a, b) in balance(&free).into_iter().zip(balance(&other)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        for (readings, others) in free.readings.iter().zip(&other.readings) {
            for (a, b) in readings.iter().zip(others) {
                let total = |reading: &Reading| reading.mean.iter().sum::<f64>();
                assert!(total(b) > 0.0);
                // Along edges, absorption between labels is taken at random positions.
                if labelled && a.name == "absorbed" {
                    let ratio = total(a) / total(b);
                    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
                    continue;
                }
                for (a, b) in a.mean.iter().zip(&b.mean) {
                    assert!((a - b).abs() < 1e-9 * b.max(1e-3), "{a} {b}");
                }
            }
        }
    }
}
