//! Sound of transducers, compared with closed forms of the Rayleigh integral. Amplitudes are in
//! units of ρcv.

use glam::{DMat3, DVec2, DVec3};
use morgana_io::transducer::{
    ArrayLayout, ElementArray, Places, SoundAperture, Transducer, TransducerError,
};
use std::f64::consts::{PI, TAU};

/// Wavelength of 1 MHz in water, in mm.
const WAVELENGTH: f64 = 1.5;

fn transducer(aperture: SoundAperture) -> Transducer {
    Transducer {
        aperture,
        wavelength: WAVELENGTH,
        pressure: 1.0,
    }
}

fn amplitude(transducer: &Transducer, place: DVec3) -> DVec2 {
    DVec2::from_array(transducer.amplitude(place).unwrap())
}

/// e^{−ikx}.
fn wave(x: f64) -> DVec2 {
    DVec2::from_angle(-TAU * x / WAVELENGTH)
}

/// On the axis of a disc of radius a the integral is e^{−ikz} − e^{−ik√(z² + a²)}, of magnitude 2|sin(k(√(z² + a²) − z)/2)|.
#[test]
fn axis_of_a_piston() {
    for diameter in [0.5, 6.0, 30.0, 100.0] {
        let piston = transducer(SoundAperture::Disc { diameter });
        let mut worst = 0.0_f64;
        for i in 0..60 {
            let z = 0.5 * WAVELENGTH * 1.15_f64.powi(i) * (1.0 + 1e-9);
            let exact = wave(z) - wave(z.hypot(0.5 * diameter));
            let found = amplitude(&piston, DVec3::Z * z);
            worst = worst.max((found - exact).length());
        }
        println!("piston of {diameter}: {worst:.1e}");
        assert!(worst < 1e-4, "{diameter}: {worst}");
    }
}

/// O'Neil, J. Acoust. Soc. Am. 21 (1949): on the axis of a bowl of radius of curvature R, R/(R − z) (e^{−ikz} − e^{−ikB}), B being the
/// distance from the rim; at the focus ikh e^{−ikR}, h being the depth of the bowl.
#[test]
fn axis_of_a_bowl() {
    for (radius, diameter) in [(20.0, 10.0), (30.0, 30.0), (25.0, 50.0)] {
        let bowl = transducer(SoundAperture::Bowl { radius, diameter });
        let depth = radius - (radius * radius - 0.25 * diameter * diameter).sqrt();
        let mut worst = 0.0_f64;
        for i in 0..80 {
            let z = radius * (0.06 + 0.0251 * f64::from(i));
            let rim = (z - depth).hypot(0.5 * diameter);
            if rim < 0.6 * WAVELENGTH || z < 0.6 * WAVELENGTH {
                continue;
            }
            let exact = (wave(z) - wave(rim)) * radius / (radius - z);
            worst = worst.max((amplitude(&bowl, DVec3::Z * z) - exact).length());
        }
        let gain = TAU * depth / WAVELENGTH;
        println!("bowl of {radius}, {diameter}: {worst:.1e} of a gain of {gain:.1}");
        assert!(worst < 1e-4 * gain, "{radius} {diameter}: {worst}");
        let focus = amplitude(&bowl, DVec3::Z * radius);
        let exact = DVec2::new(0.0, gain).rotate(wave(radius));
        assert!((focus - exact).length() < 1e-4 * gain, "{focus} {exact}");
    }
}

/// Far from a disc the pressure is πa²/(λr) 2J₁(x)/x, x = ka sin θ. At r = 10⁵ a²/λ the rest of the
/// near field is 1e-5.
#[test]
fn directivity_of_a_piston() {
    let a = 4.0;
    let piston = transducer(SoundAperture::Disc { diameter: 2.0 * a });
    let r = 1e5 * a * a / WAVELENGTH;
    for i in 0..60 {
        let (sin, cos) = (f64::from(i) * 0.025).sin_cos();
        let x = TAU * a * sin / WAVELENGTH;
        let directivity = if x == 0.0 { 1.0 } else { 2.0 * libm::j1(x) / x };
        let exact = PI * a * a / (WAVELENGTH * r) * directivity.abs();
        let azimuth = 0.1 * f64::from(i);
        let place = DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos) * r;
        let found = amplitude(&piston, place).length();
        let on_axis = PI * a * a / (WAVELENGTH * r);
        assert!(
            (found - exact).abs() < 3e-5 * on_axis,
            "{i}: {found} {exact}"
        );
    }
}

fn line(elements: usize) -> ElementArray {
    ElementArray {
        layout: ArrayLayout::Line { pitch: 1.1 },
        elements,
        width: 0.8,
        height: 2.0,
        lags: Vec::new(),
        weights: Vec::new(),
    }
}

/// Tests the far field of a line of N elements, in the plane of the line. The pressure of an
/// element is A/(λr) sin(u)/u with u = k w sin θ/2. The line multiplies it by sin(Nx)/sin(x), x = k
/// pitch (sin θ − sin θ₀)/2, if each element lags by k pitch sin θ₀.
#[test]
fn directivity_of_a_line() {
    let (elements, r) = (12, 1e7);
    let k = TAU / WAVELENGTH;
    for steered in [0.0, 0.3_f64] {
        let lag = |i| -k * 1.1 * steered.sin() * f64::from(i);
        let array = ElementArray {
            lags: (0..elements).map(lag).collect(),
            ..line(elements as usize)
        };
        let array = transducer(SoundAperture::ElementArray(array));
        for i in -55..56 {
            let (sin, cos) = (f64::from(i) * 0.027 + 1e-3).sin_cos();
            let u = 0.5 * k * 0.8 * sin;
            let x = 0.5 * k * 1.1 * (sin + steered.sin());
            let factor = (f64::from(elements) * x).sin() / x.sin() * u.sin() / u;
            let one = 0.8 * 2.0 / (WAVELENGTH * r);
            let found = amplitude(&array, DVec3::new(sin, 0.0, cos) * r).length();
            assert!(
                (found - one * factor.abs()).abs() < 1e-3 * one,
                "{steered} {i}"
            );
        }
    }
}

/// At the focus of delays, the sounds of all elements are in phase: their amplitudes add up.
/// Weights are factors.
#[test]
fn delays_bring_elements_into_phase() {
    let ring = ElementArray {
        layout: ArrayLayout::Ring { radius: 15.0 },
        ..line(40)
    };
    for (array, focus) in [
        (line(32), DVec3::new(3.0, 0.0, 20.0)),
        (ring, DVec3::new(2.0, -3.0, 1.0)),
    ] {
        let weights: Vec<f64> = (0..array.elements).map(|i| 0.1 * i as f64).collect();
        let array = ElementArray { weights, ..array }
            .focused(focus, WAVELENGTH)
            .unwrap();
        let alone = |i: usize| {
            let weight = |j| if i == j { array.weights[j] } else { 0.0 };
            let weights = (0..array.elements).map(weight).collect();
            let one = ElementArray {
                weights,
                ..array.clone()
            };
            amplitude(&transducer(SoundAperture::ElementArray(one)), focus).length()
        };
        let sum: f64 = (0..array.elements).map(alone).sum();
        let found = amplitude(&transducer(SoundAperture::ElementArray(array)), focus).length();
        // Elements are not points: the phase of their own sound is only approximately the phase of
        // their centre.
        assert!(
            found <= sum * (1.0 + 1e-9) && found > 0.995 * sum,
            "{found} {sum}"
        );
    }
}

/// Grids are interpolated from fewer positions, and agree with the sound at single positions.
#[test]
fn grids_are_their_places() {
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(0.2);
    let steps = [DVec3::X * 0.21, DVec3::Y * 0.2, DVec3::Z * 0.19].map(|step| turn * step);
    let places = Places {
        size: [41, 39, 40],
        first: DVec3::new(-4.0, -3.5, 14.0),
        steps,
    };
    for (aperture, tolerance) in [
        (
            SoundAperture::Bowl {
                radius: 20.0,
                diameter: 20.0,
            },
            1e-5,
        ),
        (SoundAperture::Disc { diameter: 12.0 }, 1e-5),
        (SoundAperture::ElementArray(line(8)), 1e-5),
    ] {
        let transducer = transducer(aperture);
        let grid = transducer.amplitudes(&places).unwrap();
        assert_eq!(grid.len(), places.count());
        let mut worst = 0.0_f64;
        for i in (0..grid.len()).step_by(997) {
            let there = amplitude(&transducer, places.at(i));
            worst = worst.max((there - DVec2::from_array(grid[i])).length());
        }
        println!("{worst:.1e}");
        assert!(worst < tolerance, "{worst}");
    }
}

#[test]
fn mistakes_are_named() {
    let refused = |aperture: SoundAperture, place: DVec3| {
        let found = transducer(aperture).amplitude(place);
        found.unwrap_err()
    };
    let far = DVec3::Z * 20.0;
    let message = |aperture| refused(aperture, far).to_string();
    let disc = |diameter| SoundAperture::Disc { diameter };
    assert!(message(disc(0.0)).contains("diameter must be positive"));
    assert!(message(disc(f64::NAN)).contains("diameter must be positive"));
    assert!(message(disc(1e6)).contains("too large for its wavelength"));
    let bowl = SoundAperture::Bowl {
        radius: 5.0,
        diameter: 11.0,
    };
    assert!(message(bowl).contains("at most twice its radius"));
    let wide = ElementArray {
        width: 1.2,
        ..line(4)
    };
    assert!(message(SoundAperture::ElementArray(wide)).contains("overlap"));
    let uneven = ElementArray {
        lags: vec![0.0],
        ..line(4)
    };
    assert!(
        message(SoundAperture::ElementArray(uneven)).contains("1 delays are given for 4 elements")
    );
    assert!(message(SoundAperture::ElementArray(line(0))).contains("at least one element"));
    for near in [DVec3::ZERO, DVec3::new(3.0, 0.0, 0.3)] {
        let error = refused(disc(10.0), near);
        assert!(matches!(error, TransducerError::TooNear { .. }), "{error}");
    }
    let many = Places {
        size: [2000; 3],
        first: far,
        steps: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| 0.1 * axis),
    };
    let error = transducer(SoundAperture::ElementArray(line(64)))
        .amplitudes(&many)
        .unwrap_err();
    assert!(
        matches!(error, TransducerError::TooMuchWork { .. }),
        "{error}"
    );
}
