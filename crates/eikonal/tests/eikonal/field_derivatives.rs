//! Derivatives of every field, compared with finite differences, and properties of length scales.

use crate::common::{Case, Random, all_fields, max_entry, scale};
use glam::{DMat3, DVec3};
use morgana_eikonal::Field;

/// Returns the fourth-order central difference of `f` along `axis`.
fn difference<T>(f: impl Fn(DVec3) -> T, x: DVec3, axis: usize, h: f64) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let at = |steps: f64| f(x + DVec3::AXES[axis] * (steps * h));
    (at(1.0) - at(-1.0)) * (2.0 / (3.0 * h)) - (at(2.0) - at(-2.0)) * (1.0 / (12.0 * h))
}

fn points(case: &Case) -> Vec<DVec3> {
    let mut random = Random(7);
    let near = |x: &DVec3| *x + DVec3::new(1e-9, -2e-9, 0.5e-9);
    let special = case.special.iter().flat_map(|x| [*x, near(x)]);
    let inside = (0..300).map(|_| random.point(&case.region));
    special.chain(inside).collect()
}

fn check_point(case: &Case, x: DVec3) {
    let field: &Field = &case.field;
    let l = scale(field, x);
    let h = 1e-3 * l;
    let jet = field.jet(x);

    // Rounding costs 1e-16 n²/h = 1e-13 n²/l. Truncation costs h⁴/30 of the fifth derivative, below
    // 1e-11 n²/l⁵. The third derivative of a spline jumps, which costs up to h² times the jump in
    // the gradient and h times it in the Hessian.
    let (grad_tolerance, hess_tolerance) = if case.analytic {
        (1e-10, 1e-10)
    } else {
        (1e-6, 1e-3)
    };

    let (n2, grad) = field.gradient(x);
    let value_error = (field.n2(x) - jet.n2).abs().max((n2 - jet.n2).abs());
    assert!(
        value_error <= 1e-15 * jet.n2,
        "{}: values differ at {x}",
        case.name
    );
    let grad_error = (grad - jet.grad).length();
    assert!(
        grad_error <= 1e-13 * jet.n2 / l,
        "{}: gradients differ at {x}",
        case.name
    );
    assert_eq!(field.n(x), field.n2(x).sqrt());

    let grad_fd = DVec3::from_array([0, 1, 2].map(|i| difference(|p| field.n2(p), x, i, h)));
    let error = (grad_fd - jet.grad).length();
    assert!(
        error <= grad_tolerance * jet.n2 / l,
        "{}: gradient {} but differences {grad_fd} at {x}",
        case.name,
        jet.grad
    );

    let columns = [0, 1, 2].map(|i| difference(|p| field.gradient(p).1, x, i, h));
    let hess_fd = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let error = max_entry(hess_fd - jet.hess);
    assert!(
        error <= hess_tolerance * jet.n2 / (l * l),
        "{}: Hessian {} but differences {hess_fd} at {x}",
        case.name,
        jet.hess
    );
    let skew = max_entry(jet.hess - jet.hess.transpose());
    assert!(
        skew <= 1e-14 * jet.n2 / (l * l),
        "{}: Hessian not symmetric",
        case.name
    );
}

#[test]
fn derivatives_agree_with_differences() {
    for case in all_fields() {
        for x in points(&case) {
            check_point(&case, x);
        }
    }
}

/// Largest ratio of the length scale of a formula to the bound that rays use.
const MAX_RATIO: f64 = 1.6;

#[test]
fn length_scales_are_positive_and_lipschitz() {
    let mut random = Random(3);
    for case in all_fields() {
        let region = case.region.grown(case.region.diagonal());
        for _ in 0..300 {
            let (x, y) = (random.point(&region), random.point(&region));
            let (a, b) = (case.field.length_scale(x), case.field.length_scale(y));
            assert!(a > 0.0 && b > 0.0, "{}", case.name);
            if a.is_finite() || b.is_finite() {
                // Length scales of formulas and tables are bounds that change from cell to cell.
                let bounded = matches!(case.field, Field::Expression(_) | Field::IndexProfile(_));
                let ratio = if bounded { MAX_RATIO } else { 1.0 };
                let (shorter, longer) = (a.min(b), a.max(b));
                let most = ratio * (shorter + (x - y).length());
                assert!(longer <= most * (1.0 + 1e-12), "{}", case.name);
            }
        }
    }
}

#[test]
fn only_the_constant_field_is_constant() {
    for case in all_fields() {
        assert_eq!(case.field.is_constant(), case.name == "constant");
    }
}
