//! Condensed grids: grids of the index finer than their field are stored with fewer samples, as far
//! as rounding permits.

use glam::DVec3;
use morgana_io::element::Element;
use morgana_io::volume::{Volume, write};
use morgana_io::{LoadOptions, Loaded};
use std::path::Path;

const SIDE: usize = 112;

fn samples(index: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let at = |i: usize| 2.0 * i as f64 / (SIDE - 1) as f64 - 1.0;
    let place = |i: usize| DVec3::new(at(i % SIDE), at(i / SIDE % SIDE), at(i / SIDE / SIDE));
    (0..SIDE.pow(3)).map(|i| index(place(i))).collect()
}

/// A function that is smooth on the scale of the cube of half-width 1.
fn bump(x: DVec3) -> f64 {
    1.3 + 0.01 * (-2.0 * x.length_squared()).exp()
}

fn load(folder: &Path, samples: Vec<f64>, element: Element, more: &str) -> Loaded {
    let volume = Volume::new([SIDE; 3], 1, samples).unwrap();
    write(&folder.join("n.npy"), &volume.with_element(element), "n").unwrap();
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
           <shape type="cube"><bsdf type="null"/><medium type="transparent" name="interior">
             <volume name="ior" type="bspline"><string name="filename" value="n.npy"/>
               <string name="axis_order" value="zyx"/><string name="placement" value="nodes"/>
               <transform name="to_world"><translate value="-0.5"/><scale value="2"/></transform>{more}
           </volume></medium></shape></scene>"#
    );
    let path = folder.join("scene.xml");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Index field of the medium in the cube.
fn field(loaded: &Loaded) -> &eikonal::Field {
    let media = loaded.scene().media();
    let bent = media.iter().find(|m| !m.index.is_constant());
    &bent.expect("the cube's").index
}

#[test]
fn fewer_samples_hold_a_smooth_index() {
    let folder = tempfile::tempdir().unwrap();
    let all = load(
        folder.path(),
        samples(bump),
        Element::F32,
        r#"<boolean name="condense" value="false"/>"#,
    );
    assert!(all.condensed.is_empty());
    let loaded = load(folder.path(), samples(bump), Element::F32, "");
    let [grid] = &loaded.condensed[..] else {
        panic!("{:?}", loaded.condensed);
    };
    assert_eq!(
        (grid.size, grid.file.as_deref()),
        ([SIDE; 3], Some("n.npy"))
    );
    assert_eq!(grid.held, [29; 3]);
    // 2.5 units of 2⁻²³ in n.
    assert!(
        (grid.tolerance / 7.8e-7 - 1.0).abs() < 0.05,
        "{}",
        grid.tolerance
    );
    let (fine, held) = (field(&all), field(&loaded));
    assert!(40 * held.memory() < fine.memory());
    for i in 0..1000 {
        let t = f64::from(i);
        let x = DVec3::new((0.7 * t).sin(), (1.1 * t).sin(), (1.3 * t).cos());
        assert!((fine.n2(x) - held.n2(x)).abs() < 8e-7, "{x}");
    }
    // Double-precision samples carry more information.
    let double = load(folder.path(), samples(bump), Element::F64, "");
    assert!(double.condensed.is_empty(), "{:?}", double.condensed);
}

#[test]
fn grids_stay_where_samples_say_more() {
    let folder = tempfile::tempdir().unwrap();
    let ripples = |x: DVec3| bump(x) + 1e-6 * (90.0 * (x.x + x.y + x.z)).sin();
    let loaded = load(folder.path(), samples(ripples), Element::F64, "");
    assert!(loaded.condensed.is_empty(), "{:?}", loaded.condensed);
    // Decimals are not smooth to the accuracy of single precision.
    let decimals = samples(|x| (bump(x) * 1e4).round() / 1e4);
    let loaded = load(folder.path(), decimals, Element::F64, "");
    assert!(loaded.condensed.is_empty(), "{:?}", loaded.condensed);
}
