//! Fluorescence: closed forms in infinite media, the places and times of emission, reciprocity,
//! chains of channels, and mistakes.
//!
//! Statistical tests compare at a family-wise false-alarm rate of 1e-3 each. Seeds are fixed.

use crate::common::{load_json, measure_json, measured};
use serde_json::{Value, json};
use testkit::z_test::{max_abs_z, two_sample_z};
use transport::meter::Reading;
use transport::render::Measurement;

const FAMILY: f64 = 1e-3;
/// Radius of a ball that represents an infinite medium.
const RADIUS: f64 = 300.0;
const INDEX: f64 = 1.4;

/// A spectrum with values at given wavelengths.
fn spectrum(pairs: &[(u32, f64)]) -> Value {
    json!({"type": "spectrum", "value": pairs})
}

/// Light of one wavelength in nm, of unit power, from a point.
fn light(nm: u32, position: [f64; 3], film: &[u32]) -> Value {
    let intensity = 0.25 / std::f64::consts::PI;
    let value = |other: &u32| (*other, if *other == nm { intensity } else { 0.0 });
    let values: Vec<(u32, f64)> = film.iter().map(value).collect();
    json!({"type": "point", "position": position, "intensity": spectrum(&values)})
}

fn film(nm: &[u32]) -> Value {
    let nm: Vec<String> = nm.iter().map(u32::to_string).collect();
    json!({"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": nm.join(", ")})
}

/// A reading of the first meter.
fn reading<'a>(found: &'a Measurement, name: &str) -> &'a Reading {
    let mut all = found.readings[0].iter();
    all.find(|r| r.name == name)
        .expect("the meter has this reading")
}

/// Values and errors of a channel of a reading.
fn channel(reading: &Reading, channel: usize, channels: usize) -> Vec<(f64, f64)> {
    let all = (channel..reading.mean.len()).step_by(channels);
    all.map(|i| (reading.mean[i], reading.error[i])).collect()
}

/// Media through which walks go by free flights, by voxels, and along curved rays.
fn containers(medium: &Value) -> [Value; 3] {
    let ball = json!({"type": "sphere", "radius": RADIUS, "bsdf": {"type": "null"}});
    let [mut plain, mut curved] = [ball.clone(), ball];
    plain["interior"] = medium.clone();
    curved["interior"] = medium.clone();
    curved["interior"]["ior"] = json!({"type": "linear", "n0": INDEX, "slope": [1e-4, 0.0, 0.0]});
    let corner = -RADIUS;
    let side = 2.0 * RADIUS;
    let labels = json!({
        "type": "labels", "data": [[[1, 2], [2, 1]], [[1, 1], [2, 2]]],
        "to_world": [{"scale": side}, {"translate": [corner, corner, corner]}],
        "1": medium, "2": medium,
    });
    [plain, labels, curved]
}

/// Absorption by gates of path length of light of 600 nm, and of its fluorescence at 700 nm. The
/// power absorbed up to an optical path length L is a chain of exponential delays, for any
/// scattering: absorption at 600 nm, lifetime, absorption at 700 nm.
#[test]
fn an_infinite_medium_fluoresces_as_in_closed_form() {
    let ([tissue, dye], tissue_at_700, mean_delay) = ([0.3, 0.5], 0.4, 2.5);
    let medium = json!({
        "type": "homogeneous",
        "sigma_s": 3.0, "sigma_a": spectrum(&[(600, tissue), (700, tissue_at_700)]), "ior": INDEX,
        "phase": {"type": "hg", "g": 0.6},
        "fluorophore_sigma_a": spectrum(&[(600, dye), (700, 0.0)]),
        "fluorescence_wavelengths": "700", "quantum_yields": "0.4",
        "lifetime": mean_delay / 299_792_458.0, "metres_per_unit": 1.0,
    });
    let photon_energy = 600.0 / 700.0;
    let power = dye / (tissue + dye) * 0.4 * photon_energy;
    let excitation = (tissue + dye) / INDEX;
    let rates = [excitation, 1.0 / mean_delay, tissue_at_700 / INDEX];
    let before = |length: f64| {
        let weight = |i: usize| {
            let others = (0..3).filter(|j| *j != i);
            others
                .map(|j| rates[j] / (rates[j] - rates[i]))
                .product::<f64>()
        };
        1.0 - (0..3)
            .map(|i| weight(i) * (-rates[i] * length).exp())
            .sum::<f64>()
    };
    let mut all = Vec::new();
    for (number, container) in containers(&medium).into_iter().enumerate() {
        let is_curved = number == 2;
        let scene = json!({
            "type": "scene", "integrator": {"type": "particle"},
            "light": light(600, [1.0, 2.0, -1.0], &[600, 700]),
            "body": container,
            "everywhere": {
                "type": "fluencemeter", "coordinates": "spherical", "nr": 1,
                "to_world": [{"scale": RADIUS}], "film": film(&[600, 700]),
                "min_bound": 0, "max_bound": 18, "bin_width": 2,
            },
        });
        let found = measure_json(&scene, 4_000, 7);
        assert_eq!(found.emitted.len(), 2);
        assert!(
            found.emitted.iter().all(|power| (power - 1.0).abs() < 1e-9),
            "{:?}",
            found.emitted
        );
        let walks = [found.stats.in_cells > 0, number == 1];
        assert_eq!(walks[0], walks[1], "walks through voxels");
        // Energy balance over both channels.
        let balance = &found.balance;
        let media = balance.media;
        all.push((media.mean - 1.0 - power) / media.error);
        all.push((balance.fluorescence.mean - power) / balance.fluorescence.error);
        all.push(balance.residual.mean / balance.residual.error);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
        let absorbed = reading(&found, "absorbed");
        let gates = channel(absorbed, 0, 2)
            .into_iter()
            .zip(channel(absorbed, 1, 2));
        for (gate, [(first, first_error), (second, error)]) in
            gates.map(|(a, b)| [a, b]).enumerate()
        {
            let ends = [2.0 * gate as f64, 2.0 * gate as f64 + 2.0];
            let exact = power * (before(ends[1]) - before(ends[0]));
            // The index varies along curved rays by 1e-4 of a unit: less than the errors.
            if !is_curved && gate < 5 {
                let direct = (-excitation * ends[0]).exp() - (-excitation * ends[1]).exp();
                all.push((first * volume - direct) / (first_error * volume));
            }
            all.push((second * volume - exact) / (error * volume));
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// Light that is absorbed where it is emitted shows the places of emission: in each layer of a
/// slab, the fluorescence is the fraction of the excitation's absorption that the yields give, also
/// where two labels have different fluorophores.
#[test]
fn an_absorber_emits_where_light_is_absorbed() {
    let medium = |dye: f64, quantum_yield: f64| {
        json!({
            "type": "homogeneous", "sigma_s": spectrum(&[(500, 4.0), (650, 0.0)]),
            "sigma_a": spectrum(&[(500, 0.3), (650, 1e4)]), "ior": 1.0,
            "fluorophore_sigma_a": spectrum(&[(500, dye), (650, 0.0)]),
            "fluorescence_wavelengths": "650", "quantum_yields": quantum_yield.to_string(),
        })
    };
    let dyes = [(0.2, 0.9), (0.5, 0.3)];
    let (first, second) = (medium(dyes[0].0, dyes[0].1), medium(dyes[1].0, dyes[1].1));
    let layer = |label: u32| vec![vec![label; 2]; 2];
    let mut all = Vec::new();
    for apart in [false, true] {
        let mut second = second.clone();
        if apart {
            second["ior"] = json!(1.2);
        }
        let scene = json!({
            "type": "scene", "integrator": {"type": "particle"},
            "beam": {
                "type": "collimated", "radius": 0.1,
                "irradiance": spectrum(&[(500, 1.0), (650, 0.0)]), "to_world": [{"translate": [0.1, 0.2, -2.0]}],
            },
            "slab": {
                "type": "labels", "data": [layer(1), layer(1), layer(2), layer(2)],
                "to_world": [{"translate": [-0.5, -0.5, 0]}, {"scale": [40, 40, 2]}],
                "1": first, "2": second,
            },
            "layers": {
                "type": "fluencemeter", "nx": 1, "ny": 1, "nz": 8,
                "to_world": [{"translate": [-0.5, -0.5, 0]}, {"scale": [40, 40, 2]}],
                "film": film(&[500, 650]),
            },
        });
        let found = measure_json(&scene, 20_000, 11);
        let absorbed = reading(&found, "absorbed");
        let [excitation, emission] = [channel(absorbed, 0, 2), channel(absorbed, 1, 2)];
        for (k, (a, b)) in excitation.iter().zip(&emission).enumerate() {
            let (dye, quantum_yield) = dyes[k / 4];
            let expected = dye / (dye + 0.3) * quantum_yield * 500.0 / 650.0;
            all.push(two_sample_z(expected * a.0, expected * a.1, b.0, b.1));
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// Reciprocity of a scene that is its own mirror image: the fluence at B of fluorescence that light
/// from A excites does not change if the coefficients at the two wavelengths are exchanged.
#[test]
fn source_and_detector_can_be_exchanged() {
    let coefficients = [[2.0, 0.05], [0.8, 0.2]];
    let at = |[k, l]: [usize; 2]| {
        let of = |i: usize| spectrum(&[(600, coefficients[k][i]), (700, coefficients[l][i])]);
        let [scattering, absorption] = [of(0), of(1)];
        let medium = json!({"type": "homogeneous", "sigma_s": scattering, "sigma_a": absorption, "ior": 1.0});
        let mut dyed = medium.clone();
        dyed["fluorophore_sigma_a"] = spectrum(&[(600, 0.3), (700, 0.3)]);
        dyed["fluorescence_wavelengths"] = json!("700");
        dyed["quantum_yields"] = json!("0.5");
        let scene = json!({
            "type": "scene", "integrator": {"type": "particle"},
            "light": light(600, [-0.9, 0.0, 0.0], &[600, 700]),
            "tissue": {"type": "sphere", "radius": 4, "bsdf": {"type": "null"}, "interior": medium},
            "dye": {"type": "sphere", "radius": 0.5, "bsdf": {"type": "null"}, "interior": dyed},
            "cell": {
                "type": "fluencemeter", "coordinates": "spherical", "nr": 1,
                "to_world": [{"scale": 0.35}, {"translate": [0.9, 0, 0]}], "film": film(&[600, 700]),
            },
        });
        let found = measure_json(&scene, 30_000, 3 + k as u64);
        channel(reading(&found, "fluence"), 1, 2)[0]
    };
    let [(a, a_error), (b, b_error)] = [at([0, 1]), at([1, 0])];
    assert!(a_error < 0.1 * a, "{a} ± {a_error}");
    max_abs_z(&[two_sample_z(a, a_error, b, b_error)], FAMILY).unwrap();
}

/// Fluorescence that excites further fluorescence: two exciting channels for the last one, one of
/// which is fluorescent itself. All light is absorbed, so that powers are known.
#[test]
fn fluorescence_excites_fluorescence() {
    let (tissue, dye) = ([0.4, 0.7, 0.9], [0.6, 0.3, 0.1]);
    let nm = [500, 600, 750];
    let of = |values: [f64; 3]| spectrum(&[0, 1, 2].map(|i| (nm[i], values[i])));
    let scene = json!({
        "type": "scene", "integrator": {"type": "particle"},
        "light": light(500, [0.0; 3], &nm),
        "ball": {
            "type": "sphere", "radius": RADIUS, "bsdf": {"type": "null"},
            "interior": {
                "type": "homogeneous", "sigma_s": 2.0, "sigma_a": of(tissue), "ior": 1.0,
                "fluorophore_sigma_a": of(dye),
                "fluorescence_wavelengths": "600, 750", "quantum_yields": "0.5, 0.4",
            },
        },
        // Channels in another order than wavelengths.
        "everywhere": {
            "type": "fluencemeter", "coordinates": "spherical", "nr": 1, "to_world": [{"scale": RADIUS}],
            "film": film(&[750, 500, 600]),
        },
    });
    let found = measure_json(&scene, 20_000, 5);
    let fraction = |i: usize| dye[i] / (dye[i] + tissue[i]);
    let at_600 = fraction(0) * 0.5 * 500.0 / 600.0;
    let at_750 = fraction(0) * 0.4 * 500.0 / 750.0 + at_600 * fraction(1) * 0.4 * 600.0 / 750.0;
    let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let absorbed = reading(&found, "absorbed");
    let zs = [(0, at_750), (1, 1.0), (2, at_600)].map(|(i, exact)| {
        let (mean, error) = channel(absorbed, i, 3)[0];
        assert!(error < 0.02 * mean, "{mean} ± {error}");
        (mean * volume - exact) / (error * volume)
    });
    max_abs_z(&zs, FAMILY).unwrap();
    assert!(
        found.emitted.iter().all(|power| (power - 1.0).abs() < 1e-9),
        "{:?}",
        found.emitted
    );
}

/// A scene of one medium with a fluorophore.
fn dyed(medium: &Value, meter: &Value) -> Value {
    let mut whole = json!({
        "type": "homogeneous", "sigma_s": 2.0, "sigma_a": 0.1, "ior": 1.0,
        "fluorophore_sigma_a": 0.3, "fluorescence_wavelengths": "700", "quantum_yields": "0.5",
    });
    let mut probe =
        json!({"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1, "film": film(&[600, 700])});
    for (object, changes) in [(&mut whole, medium), (&mut probe, meter)] {
        for (key, value) in changes.as_object().unwrap() {
            object[key] = value.clone();
        }
    }
    json!({
        "type": "scene", "integrator": {"type": "particle"}, "light": light(600, [0.5; 3], &[600, 700]),
        "cube": {"type": "cube", "bsdf": {"type": "null"}, "interior": whole}, "probe": probe,
    })
}

#[test]
fn mistakes_say_what_to_do() {
    let none = json!({});
    let cases = [
        (
            json!({"quantum_yields": "0.7, 0.6", "fluorescence_wavelengths": "650, 700"}),
            none.clone(),
            "in total at most 1",
        ),
        (
            json!({"quantum_yields": "-0.1"}),
            none.clone(),
            "at least 0",
        ),
        (
            json!({"quantum_yields": "0.1, 0.2"}),
            none.clone(),
            "there are 2 for 1",
        ),
        (
            json!({"fluorescence_wavelengths": "710"}),
            none.clone(),
            "600, 700 nm, but 710 nm is not",
        ),
        (
            json!({"lifetime": 4e-9}),
            none.clone(),
            "'lifetime' needs 'metres_per_unit'",
        ),
        (
            none.clone(),
            json!({"film": {"type": "hdrfilm", "pixel_format": "luminance"}}),
            "pixel_format",
        ),
        (
            json!({"phase": {"type": "sggx", "S": "1, 1, 1, 0, 0, 0"}}),
            none.clone(),
            "use a volume of labels",
        ),
    ];
    for (medium, meter, expected) in cases {
        let refused = load_json(&dyed(&medium, &meter))
            .expect_err(expected)
            .to_string();
        assert!(refused.contains(expected), "{refused}");
    }
    let mut alone = dyed(&none, &none);
    let medium = alone["cube"]["interior"].as_object_mut().unwrap();
    medium.remove("fluorophore_sigma_a");
    let refused = load_json(&alone).expect_err("an error").to_string();
    assert!(refused.contains("needs 'fluorophore_sigma_a'"), "{refused}");
    let mut picture = dyed(&none, &none);
    picture["probe"] = json!({"type": "perspective", "film": {"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": "600, 700"}});
    picture["integrator"] = json!({"type": "path"});
    let refused = load_json(&picture).expect_err("an error").to_string();
    assert!(
        refused.contains("pictures have no fluorescence"),
        "{refused}"
    );
}

#[test]
fn doubtful_fluorescence_is_reported() {
    let none = json!({});
    let cases = [
        (
            json!({"lifetime": 4, "metres_per_unit": 1e-3}),
            "write 4e-9",
        ),
        (
            json!({"fluorescence_wavelengths": "600"}),
            "nothing excites the fluorescence at 600 nm",
        ),
    ];
    for (medium, expected) in cases {
        let loaded =
            load_json(&dyed(&medium, &none)).unwrap_or_else(|problems| panic!("{problems}"));
        let warnings = loaded.warnings.to_string();
        assert!(warnings.contains(expected), "{warnings}");
    }
    let loaded = load_json(&dyed(&none, &none)).unwrap_or_else(|problems| panic!("{problems}"));
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
}

/// Meters refuse quantities that fluorescent light lacks.
#[test]
fn records_and_sidebands_are_refused() {
    let mut scene = dyed(&json!({}), &json!({}));
    scene["cube"]["probe"] =
        json!({"type": "irradiancemeter", "records": true, "film": film(&[600, 700])});
    scene.as_object_mut().unwrap().remove("probe");
    let loaded = load_json(&scene).unwrap_or_else(|problems| panic!("{problems}"));
    let found = measured(&loaded, 64, 1);
    let refused = found.expect_err("an error").to_string();
    assert!(
        refused.contains("no records of fluorescent light"),
        "{refused}"
    );
}
