//! Indices given by formula and by table, compared with the equivalent fields and with closed forms
//! of rays, and the refusal of invalid formulas.

use crate::common::{self, Random, assert_jets_agree};
use glam::DVec3;
use morgana_eikonal::field::*;
use morgana_eikonal::ray::{Flow, Node};
use morgana_eikonal::{Aabb, Field, Tolerance, Work};
use std::time::Instant;

fn region() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0))
}

fn with(text: &str, quantity: Quantity, parameters: &[(&str, f64)]) -> Field {
    Formula::new(text, quantity, parameters).unwrap().into()
}

/// Pairs of a field type and two equivalent formulas: one in x, y, z, and one in a distance. Both
/// formulas round a few times more than the field does.
fn alike() -> Vec<(&'static str, Field, [Field; 2])> {
    let bump = [("n0", 1.33), ("delta", 0.08), ("w", 0.4)];
    let n = Quantity::Index;
    let square = Quantity::SquaredIndex;
    let o = DVec3::ZERO;
    vec![
        (
            "gaussian",
            Gaussian::new(1.33, 0.08, o, 0.4).unwrap().into(),
            [
                with("n0 + delta*exp(-(x^2 + y^2 + z^2)/(2*w^2))", n, &bump),
                with("n0 + delta*exp(-r^2/(2*w^2))", n, &bump),
            ],
        ),
        (
            "selfoc",
            Selfoc::new(1.6, 0.5, o, DVec3::Z).unwrap().into(),
            [
                with("1.6^2*(1 - 0.25*(x*x + y*y))", square, &[]),
                with("1.6^2*(1 - (rho/2)^2)", square, &[]),
            ],
        ),
        (
            "fisheye",
            Fisheye::new(2.0, o, 0.8).unwrap().into(),
            [
                with("2/(1 + (x^2 + y^2 + z^2)/R^2)", n, &[("R", 0.8)]),
                with("2/(1 + r^2/R^2)", n, &[("R", 0.8)]),
            ],
        ),
    ]
}

#[test]
fn formulas_are_the_fields_that_they_write_out() {
    let mut random = Random(5);
    for (_, field, formulas) in alike() {
        for _ in 0..200 {
            let x = random.point(&region());
            for formula in &formulas {
                assert_jets_agree(field.jet(x), formula.jet(x), 3e-13);
            }
        }
        for formula in &formulas {
            assert_jets_agree(field.jet(DVec3::ZERO), formula.jet(DVec3::ZERO), 3e-13);
        }
    }
}

/// Traces the ray from `x` along a direction over a span of σ. Returns its nodes.
fn nodes(field: &Field, x: DVec3, direction: DVec3, span: f64, tolerance: f64) -> Vec<Node<()>> {
    let node = Node::start(field, x, direction.normalize(), ());
    let mut flow = Flow::new(field, node, Tolerance::new(tolerance));
    let (mut nodes, mut left, mut work) = (vec![node], span, Work::default());
    while left > 1e-14 * span {
        left -= flow.advance(left, &mut work).arc.h();
        nodes.push(*flow.node());
    }
    nodes
}

/// Tests n² = n₀²(1 − α²ρ²), written with the coefficients of a catalogue. Across the axis the ray
/// oscillates as cos n₀ασ.
#[test]
fn rods_by_their_coefficients_bend_rays_to_sinusoids() {
    let (n0, alpha) = (1.6, 0.3);
    let coefficients = [("n00", n0 * n0), ("n10", -(n0 * alpha) * (n0 * alpha))];
    let field = with("n00 + n10*rho^2", Quantity::SquaredIndex, &coefficients);
    let start = DVec3::new(0.6, 0.2, 0.1);
    let direction = DVec3::new(0.1, -0.3, 1.0).normalize();
    let span = 12.0;
    let end = *nodes(&field, start, direction, span, 1e-11).last().unwrap();
    let v = direction * field.n(start);
    let (sin, cos) = (n0 * alpha * span).sin_cos();
    let along = start + v * span;
    let across = start * cos + v * (sin / (n0 * alpha));
    let exact = DVec3::new(across.x, across.y, along.z);
    assert!(end.x.distance(exact) < 1e-8, "{} for {exact}", end.x);
}

/// In Maxwell's fisheye of radius R all rays are closed circles with |x − c|² = R² + |c|².
#[test]
fn rays_in_a_fisheye_by_formula_are_closed_circles() {
    let field = with(
        "2/(1 + (x^2 + y^2 + z^2)/R^2)",
        Quantity::Index,
        &[("R", 0.8)],
    );
    let (start, direction) = (
        DVec3::new(0.5, 0.1, -0.2),
        DVec3::new(0.2, 1.0, 0.3).normalize(),
    );
    // The centre is c = start + s·normal in the plane of the ray, with |start − c|² = R² + |c|².
    let normal = start.reject_from_normalized(direction).normalize();
    let s = (0.64 + start.length_squared()) / (2.0 * start.dot(normal));
    let center = start - normal * s;
    let radius = (0.64 + center.length_squared()).sqrt();
    let nodes = nodes(&field, start, direction, 10.0, 1e-10);
    let off = |x: DVec3| (x.distance(center) - radius).abs();
    let worst = nodes.iter().map(|node| off(node.x)).fold(0.0, f64::max);
    assert!(worst < 1e-8, "{worst}");
    let angle = |node: &Node<()>| {
        let d = node.x - center;
        d.dot(-direction).atan2(d.dot(normal * s.signum()))
    };
    let turns = nodes
        .windows(2)
        .filter(|w| (angle(&w[0]) - angle(&w[1])).abs() > 3.0);
    assert!(turns.count() >= 1, "not once around");
}

/// Compares a table of the rod's index, over the distance from its axis, with the rod. The spline
/// is off by h⁴/384 of the fourth derivative of n, which is −3n₀α⁴ on the axis.
#[test]
fn tables_come_close_to_what_they_tabulate() {
    let rod: Field = Selfoc::new(1.6, 0.3, DVec3::ZERO, DVec3::Z).unwrap().into();
    let h = 0.05;
    let place = |i: i32| h * f64::from(i);
    let samples: Vec<[f64; 2]> = (0..=40)
        .map(|i| [place(i), rod.n(DVec3::X * place(i))])
        .collect();
    let table: Field = IndexProfile::table(Coordinate::Rho, 0.0, &samples)
        .unwrap()
        .into();
    let mut random = Random(7);
    for _ in 0..300 {
        let x = random.point(&region());
        let bound = 4.0 * h.powi(4) / 384.0 * 3.0 * 1.6 * 0.3f64.powi(4);
        assert!((table.n(x) - rod.n(x)).abs() < bound);
    }
    // Use heights instead of distances from the centre.
    let shifted: Vec<[f64; 2]> = samples.iter().map(|[u, n]| [u - 5.0, *n]).collect();
    let shifted: Field = IndexProfile::table(Coordinate::Rho, 5.0, &shifted)
        .unwrap()
        .into();
    let x = DVec3::new(0.7, 0.4, 3.0);
    assert_jets_agree(shifted.jet(x), table.jet(x), 1e-11);
}

/// Radius of the Earth and scale height of the exponential atmosphere, in metres, and n − 1 at the
/// ground.
const EARTH: [f64; 3] = [6_371_000.0, 8_000.0, 2.8e-4];
/// Top of the atmosphere for both rays and the integral, in metres above the ground.
const TOP: f64 = 160_000.0;

/// Returns the bending of a ray that reaches the ground at a zenith distance, in an exponential
/// atmosphere. It is an integral over the zenith distance along the ray (L. H. Auer and E. M.
/// Standish, Astron. J. 119, 2000, eq. 3). Bouguer's invariant n r sin ψ gives the height.
fn bending(zenith: f64) -> f64 {
    let [radius, height, contrast] = EARTH;
    let n = |h: f64| 1.0 + contrast * (-h / height).exp();
    let invariant = n(0.0) * zenith.sin();
    // Height where the ray has the zenith distance ψ: n(h)(R + h) = n(0) R sin ψ₀/sin ψ.
    let at = |psi: f64, mut h: f64| {
        for _ in 0..60 {
            let slope = -(n(h) - 1.0) / height;
            let excess = n(h) * (1.0 + h / radius) - invariant / psi.sin();
            h -= excess / (slope * (1.0 + h / radius) + n(h) / radius);
        }
        h
    };
    let top = (invariant / (n(TOP) * (1.0 + TOP / radius))).asin();
    let integrand = |psi: f64| {
        let h = at(psi, 1.0);
        let log_slope = -(n(h) - 1.0) / height * (radius + h) / n(h);
        -log_slope / (1.0 + log_slope)
    };
    simpson(integrand, [top, zenith])
}

/// Integrates by Simpson's rule. Doubling the number of pieces changes the result by less than
/// 1e-9.
fn simpson(f: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> f64 {
    let sum = |pieces: i32| {
        let h = (to - from) / f64::from(pieces);
        let weight = |i: i32| match i {
            0 => 1.0,
            i if i == pieces => 1.0,
            i => f64::from(2 + 2 * (i % 2)),
        };
        let terms = (0..=pieces).map(|i| weight(i) * f(from + h * f64::from(i)));
        terms.sum::<f64>() * h / 3.0
    };
    let (coarse, fine) = (sum(4000), sum(8000));
    assert!((coarse - fine).abs() < 1e-9 * fine.abs(), "{coarse} {fine}");
    fine
}

/// Returns the angle by which an atmosphere around the Earth bends a ray between the ground and the
/// top.
fn traced(field: &Field, zenith: f64) -> f64 {
    let [radius, ..] = EARTH;
    let direction = DVec3::new(zenith.sin(), 0.0, zenith.cos());
    let node = Node::start(field, DVec3::Z * radius, direction, ());
    let mut flow = Flow::new(field, node, Tolerance::new(1e-12));
    let (mut last, mut work) = (node, Work::default());
    let height = |x: DVec3| x.length() - radius;
    while height(flow.node().x) < TOP {
        last = *flow.node();
        flow.advance(5e3, &mut work);
    }
    // Beyond the top the bending is less than 1e-12.
    let end = if height(last.x) > TOP - 1.0 {
        last
    } else {
        *flow.node()
    };
    direction.cross(end.v.normalize()).length().asin()
}

/// Compares the refraction of rays with the integral, from the horizon to near the zenith. The
/// atmosphere is written as a formula, and as a table of heights every 100 m. Positions are about
/// 6.4e6 m, so that heights have a resolution of a nanometre, 1e-13 of the scale height. The slope
/// of a spline is off by h³/24 of the fourth derivative, 8e-8 of the slope itself.
#[test]
fn atmospheres_refract_as_the_refraction_integral_says() {
    let [radius, height, contrast] = EARTH;
    let numbers = [("R", radius), ("H", height), ("N", contrast)];
    let formula = with("1 + N*exp((R - r)/H)", Quantity::Index, &numbers);
    let place = |i: i32| 100.0 * f64::from(i);
    let sample = |i: i32| [place(i), 1.0 + contrast * (-place(i) / height).exp()];
    let samples: Vec<[f64; 2]> = (0..=1610).map(sample).collect();
    let table: Field = IndexProfile::table(Coordinate::R, radius, &samples)
        .unwrap()
        .into();
    for (name, field, tolerance) in [("formula", formula, 1e-9), ("table", table, 1e-7)] {
        for altitude in [0.0, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 45.0, 80.0f64] {
            let zenith = (90.0 - altitude).to_radians();
            let (found, exact) = (traced(&field, zenith), bending(zenith));
            let error = (found / exact - 1.0).abs();
            assert!(
                error < tolerance,
                "{name} at {altitude}°: {found} for {exact}"
            );
        }
    }
}

fn refusal(text: &str) -> (String, &str) {
    let error = Formula::new(text, Quantity::Index, &[("a", 2.0)]).unwrap_err();
    (error.to_string(), text.get(error.span).unwrap_or("nowhere"))
}

#[test]
fn what_is_no_formula_is_refused_where_it_is_wrong() {
    for (text, part, message) in [
        ("", "", "ends too early: expected a value"),
        ("1 +", "", "ends too early: expected a value"),
        ("1 + * x", "*", "expected a value, found '*'"),
        ("(1 + x", "", "ends too early: expected ')'"),
        ("1 + x)", ")", "expected an operator, found ')'"),
        ("2 x", "x", "expected an operator, found 'x'"),
        ("1.3 + b*x", "b", "unknown name 'b'"),
        ("1 + cis(x)", "cis", "unknown name 'cis'"),
        ("1 + a(x)", "a", "is not a function: write * to multiply"),
        ("1 + sin*x", "sin", "write its argument in parentheses"),
        ("atan2(x)", "atan2", "takes 2 arguments, not 1"),
        ("exp(x, y)", "exp", "takes 1 argument, not 2"),
        ("1 + abs(x)", "abs", "has a kink or a step"),
        ("x # y", "#", "unexpected character '#' in the formula"),
        ("1 + é", "é", "unexpected character 'é' in the formula"),
        ("1..2 + x", ".2", "expected an operator"),
        ("1e999 + x", "1e999", "'1e999' is not a number"),
        (".e3", ".e3", "'.e3' is not a number"),
        ("x + log(-1)", "log(-1)", "is not a finite number"),
        ("x + 1/(a - 2)", "x + 1/(a - 2)", "is not a finite number"),
        ("x^100000", "100000", "at most 1024"),
        ("9^9^9 + x", "9^9^9", "is not a finite number"),
    ] {
        let (found, at) = refusal(text);
        assert!(found.contains(message), "{text}: {found}");
        if !text.contains("1/(a") {
            assert_eq!(at, part, "{text}");
        }
    }
    let new = |parameters| {
        Formula::new("x + 1", Quantity::Index, parameters)
            .unwrap_err()
            .to_string()
    };
    assert!(new(&[("sin", 1.0)]).contains("it has a meaning in formulas"));
    assert!(new(&[("2b", 1.0)]).contains("names are made of letters"));
    let twice = new(&[("a", 1.0), ("b", 2.0), ("a", 3.0)]);
    assert_eq!(
        twice,
        "'a' cannot be the name of a parameter: another parameter has it"
    );
    assert!(new(&[("b", f64::NAN)]).contains("must be a finite number"));
}

#[test]
fn long_and_deep_formulas_are_refused_or_evaluated() {
    let deep = |open: &str, inner: &str, close: &str, levels: usize| {
        open.repeat(levels) + inner + &close.repeat(levels)
    };
    for (text, message) in [
        (deep("(", "x", ")", 2000), "nested too deeply"),
        (deep("-", "x", "", 4000), "nested too deeply"),
        (deep("x^", "x", "", 2000), "nested too deeply"),
        (deep("sin(", "x", ")", 800), "nested too deeply"),
        ("x+".repeat(8000), "at most 4096 characters"),
    ] {
        assert!(refusal(&text).0.contains(message), "{message}");
    }
    let sum: String = (0..300).map(|i| format!("+{i}*x^{}", i % 7)).collect();
    assert!(with(&sum, Quantity::Index, &[]).n(DVec3::X).is_finite());
    // Hundreds of different functions take a bounded time: bounding one cell or piece must end.
    for coordinate in ["z", "y*z"] {
        let long: String = (0..300)
            .map(|i| format!("+sin({i}*{coordinate})"))
            .collect();
        let field = with(&long, Quantity::Index, &[]);
        let start = Instant::now();
        assert!(field.length_scale(DVec3::ONE) > 0.0);
        assert!(start.elapsed().as_secs() < 20, "{coordinate}");
    }
    // Sums of products that cannot be shared need one register each, only until they are used.
    let nested = (0..40).fold("x".to_owned(), |inner, i| {
        format!("(y*{i} + sin({inner} + z))")
    });
    assert!(
        with(&nested, Quantity::Index, &[])
            .n(DVec3::ONE)
            .is_finite()
    );
}

#[test]
fn precedence_is_that_of_mathematics() {
    let x = DVec3::new(0.3, 1.7, -0.6);
    for (text, value) in [
        ("9 - 3 - 2 + 0*y*x", 4.0),
        ("16/4/2 + 0*x*y", 2.0),
        ("5 - -2^2 + 0*x*y", 9.0),
        ("2^3^2/64 + 0*x*y", 8.0),
        ("2**-1 + 0*x*y", 0.5),
        ("2·x × y", 2.0 * 0.3 * 1.7),
        ("pow(y, 2.5) + 0*x", 1.7f64.powf(2.5)),
        ("y^x", 1.7f64.powf(0.3)),
        ("2^x + 0*y", 2f64.powf(0.3)),
        ("π − ρ + 0*z", std::f64::consts::PI - x.truncate().length()),
        ("3 + atan2(z, x)", 3.0 + (-0.6f64).atan2(0.3)),
        ("erf(x) + cosh(z)", libm::erf(0.3) + 0.6f64.cosh()),
        ("1.5e0 + .5*x + 1.*y", 1.5 + 0.15 + 1.7),
    ] {
        let found = with(text, Quantity::Index, &[]).n(x);
        assert!((found - value).abs() < 1e-14, "{text}: {found} for {value}");
    }
}

/// Formulas of random parts never panic, and their bounds over a box hold at points of it.
#[test]
fn random_formulas_keep_their_bounds() {
    const PARTS: [&str; 40] = [
        "x", "y", "z", "r", "rho", "a", "2", "0.5", "1e-3", "pi", "+", "-", "*", "/", "^", "(",
        ")", ",", "^2", "^3", "^-1", "sqrt(", "exp(", "log(", "sin(", "cos(", "tan(", "asin(",
        "acos(", "atan(", "atan2(x,", "sinh(", "cosh(", "tanh(", "erf(", "pow(y,", "1 + ", "*x",
        "+ z", "- y",
    ];
    let mut random = Random(29);
    let (mut made, mut finite) = (0, 0);
    for trial in 0..40_000 {
        let count = 1 + (random.uniform() * 9.0) as usize;
        let part = |_| PARTS[(random.uniform() * PARTS.len() as f64) as usize];
        let mut text: String = (0..count).map(part).collect();
        let open = text
            .matches('(')
            .count()
            .saturating_sub(text.matches(')').count());
        text += &")".repeat(open);
        let Ok(formula) = Formula::new(&text, Quantity::SquaredIndex, &[("a", 1.5)]) else {
            continue;
        };
        made += 1;
        let field = Field::from(formula);
        let boxed = random.sub_box(&Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0)));
        let everywhere = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        for region in [boxed, everywhere] {
            let bounds = field.bounds(&region);
            for _ in 0..8 {
                let x = random.point(&boxed);
                let jet = field.jet(x);
                let (n2, grad) = (jet.n2, jet.grad.length());
                if !(n2.is_finite() && grad.is_finite() && jet.hess.is_finite()) {
                    continue;
                }
                finite += 1;
                let slack = 1e-9 * (1.0 + n2.abs() + grad + common::max_entry(jet.hess));
                let [low, _, high] = morgana_eikonal::bounds::symmetric_eigenvalues(jet.hess);
                let holds = bounds.n2_min <= n2 + slack
                    && bounds.n2_max >= n2 - slack
                    && bounds.grad_max >= grad - slack
                    && bounds.hess_min <= low + slack
                    && bounds.hess_max >= high - slack;
                assert!(holds, "{text} at {x} in {region:?}: {jet:?} but {bounds:?}");
            }
        }
        if trial % 200 == 0 {
            assert!(field.length_scale(DVec3::ONE) > 0.0, "{text}");
        }
    }
    assert!(made > 2000 && finite > 20_000, "{made} {finite}");
}
