//! Parameters and renders without derivatives, which are refused with a message.

use super::setup::Finish;
use super::*;

#[test]
fn what_has_no_derivative_is_refused() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::One);
    let refused = |setup: &Setup, parameter, weights: &[f64], samples| {
        try_by(setup.scene(), &[parameter], samples, weights)
            .unwrap_err()
            .to_string()
    };
    let clear = Setup {
        extinction: vec![[0.0, 1.0]],
        ..setup.clone()
    };
    let message = refused(
        &clear,
        RadiometricParameter::Scattering(HAZE),
        &weights(),
        4,
    );
    assert!(
        message.contains("sigma_t of 'haze' is zero") && message.contains("sigma_a"),
        "{message}"
    );
    assert!(
        try_by(
            clear.scene(),
            &[RadiometricParameter::Absorption(HAZE)],
            4,
            &weights()
        )
        .is_ok()
    );
    let black = Setup {
        reflectance: vec![[0.5, 0.0]],
        ..setup.clone()
    };
    let message = refused(
        &black,
        RadiometricParameter::Colour(WALL, Tint::Reflectance),
        &weights(),
        4,
    );
    assert!(
        message.contains("reflectance of 'wall' is zero"),
        "{message}"
    );
    let message = refused(
        &setup,
        RadiometricParameter::Colour(0, Tint::Reflectance),
        &weights(),
        4,
    );
    assert!(message.contains("'ball' has no reflectance"), "{message}");
    let mirror = Setup {
        finish: Finish::Mirror,
        ..setup.clone()
    };
    let message = refused(
        &mirror,
        RadiometricParameter::Colour(WALL, Tint::Reflectance),
        &weights(),
        4,
    );
    assert!(
        message.contains("'wall' has no reflectance")
            && message.contains("ask for wall.specular_reflectance"),
        "{message}"
    );
    let message = refused(&setup, RadiometricParameter::MeanCosine(0), &weights(), 4);
    assert!(message.contains("phase function of 'ambient'"), "{message}");
    let message = refused(
        &setup,
        RadiometricParameter::Emission(0),
        &weights()[1..],
        4,
    );
    assert!(message.contains("expected 32 weights"), "{message}");
    let message = refused(
        &setup,
        RadiometricParameter::Emission(0),
        &[f64::NAN; 32],
        4,
    );
    assert!(message.contains("weight 0 is not finite"), "{message}");
    let message = refused(&setup, RadiometricParameter::Emission(0), &weights(), 1);
    assert!(message.contains("at least two samples"), "{message}");
    let twice = [RadiometricParameter::Emission(0); 2];
    assert_eq!(
        try_by(setup.scene(), &twice, 4, &weights()).unwrap_err(),
        DerivativeError::Twice
    );
}
