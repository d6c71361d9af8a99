//! Derivatives with respect to the parameters of fields (docs/theory.md#derivatives-of-rays).
//!
//! While rays are traced, derivatives are summed with respect to quantities that are available on
//! the ray, such as the coefficients of a spline. Afterwards [`Field::parameter_derivative`]
//! converts the sums to derivatives with respect to the parameters.

use super::analytic::{self, Analytic};
use super::{Bspline, Field};
use glam::DVec3;

/// Derivative of a loss with respect to n² and ∇n² at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IndexDerivative {
    /// Derivative with respect to n².
    pub n2: f64,
    /// Derivative with respect to ∇n².
    pub gradient: DVec3,
}

impl IndexDerivative {
    /// Returns the change of the loss for a change of n² and of ∇n².
    fn of(&self, n2: f64, gradient: DVec3) -> f64 {
        self.n2 * n2 + self.gradient.dot(gradient)
    }
}

/// Change of n² and ∇n² at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IndexChange {
    /// Change of n².
    pub n2: f64,
    /// Change of ∇n².
    pub gradient: DVec3,
}

impl std::ops::Add for IndexChange {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        IndexChange {
            n2: self.n2 + o.n2,
            gradient: self.gradient + o.gradient,
        }
    }
}

/// A parameter of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldParameter {
    /// Name, as in scenes. Names of parameters of a term of a sum begin with `terms[i].`.
    pub name: String,
    /// Shape of the values; empty for a single value.
    pub shape: Vec<usize>,
    /// Values, in rows.
    pub values: Vec<f64>,
}

impl FieldParameter {
    fn new(name: impl Into<String>, shape: &[usize], values: Vec<f64>) -> Self {
        FieldParameter {
            name: name.into(),
            shape: shape.to_vec(),
            values,
        }
    }

    /// Creates a parameter with one value, or with a vector.
    fn of(name: impl Into<String>, values: Vec<f64>) -> Self {
        let shape = [values.len()];
        let shape = if values.len() == 1 { &[] } else { &shape[..] };
        FieldParameter::new(name, shape, values)
    }
}

/// Evaluates an expression for a field with a built-in formula, and `$other` for all other fields.
macro_rules! analytic {
    ($self:expr, $f:ident => $e:expr, $other:expr) => {
        match $self {
            Field::LinearIndex($f) => $e,
            Field::LinearSquare($f) => $e,
            Field::Luneburg($f) => $e,
            Field::Selfoc($f) => $e,
            Field::Fisheye($f) => $e,
            Field::Gaussian($f) => $e,
            _ => $other,
        }
    };
}

/// Returns names and values of the parameters of a built-in formula.
fn named<A: Analytic>(field: &A) -> Vec<FieldParameter> {
    let numbers = field.numbers();
    let mut rest = &numbers[..];
    let each = A::PARAMETERS.iter().map(|(name, count)| {
        let (own, others) = rest.split_at(*count);
        rest = others;
        FieldParameter::of(*name, own.to_vec())
    });
    each.collect()
}

/// Returns the number of parameter values of a field.
fn count<A: Analytic>(_: &A) -> usize {
    analytic::count::<A>()
}

/// Returns the shape of the samples of a grid, z first.
fn shape(grid: &Bspline) -> [usize; 3] {
    let [x, y, z] = grid.dims();
    [z, y, x]
}

/// Converts derivatives with respect to coefficients of n² to derivatives with respect to the
/// samples of n.
fn by_samples(grid: &Bspline, by: Vec<f64>) -> Vec<f64> {
    let by_squares = grid.sample_derivative(by).into_iter();
    let indices = grid.samples().into_iter();
    by_squares
        .zip(indices)
        .map(|(by, n)| by * 2.0 * n)
        .collect()
}

/// Converts changes of the samples of n to changes of coefficients of n²: the transpose of
/// `by_samples`.
fn of_samples(grid: &Bspline, change: &[f64]) -> Vec<f64> {
    let indices = grid.samples().into_iter();
    let squares = change.iter().zip(indices).map(|(of, n)| of * 2.0 * n);
    grid.sample_change(&squares.collect::<Vec<_>>())
}

impl Field {
    /// Returns the grid that has its samples as the field's first parameters. Returns `None` if
    /// there is no such grid. The grid may be transformed or scaled, but not part of a sum.
    pub fn grid(&self) -> Option<&Bspline> {
        match self {
            Field::Bspline(f) => Some(f),
            Field::Affine(f) => f.inner().grid(),
            Field::Scaled(f) => f.inner().grid(),
            _ => None,
        }
    }

    /// Returns the parameters with respect to which derivatives can be computed:
    ///
    /// | field | parameters |
    /// |---|---|
    /// | `Constant` | value |
    /// | `LinearIndex`, `LinearSquare` | n0, slope, origin |
    /// | `Luneburg` | n_exterior, center, radius |
    /// | `Selfoc` | n0, alpha, origin, direction (a unit vector) |
    /// | `Fisheye` | n0, center, radius |
    /// | `Gaussian` | n0, delta, center, width |
    /// | `Acoustic` | n0, origin, direction, reference (unit vectors); for each mode amplitude, wave_number, phase, time_phase |
    /// | `Bspline` | samples of n, (z, y, x), through which the spline passes |
    /// | `SampledSound` | n0; amplitude, (z, y, x, 2): real and imaginary parts, in index |
    /// | `Expression`, `IndexProfile` | named parameters that the formula uses; or the samples of the table, in index |
    /// | `Sum` | reference; parameters of its terms |
    /// | `Affine` | parameters of the transformed field; to_world, (3, 4): matrix and translation |
    /// | `Scaled` | parameters of the unscaled field; factor |
    ///
    /// A formula that is too long for its parameters to fit into registers has none.
    pub fn parameters(&self) -> Vec<FieldParameter> {
        match self {
            Field::Constant(f) => vec![FieldParameter::of("value", vec![f.n()])],
            Field::Acoustic(f) => {
                let each = f.parameters().into_iter();
                each.map(|(name, values)| FieldParameter::of(name, values))
                    .collect()
            }
            Field::Bspline(f) => vec![FieldParameter::new("samples", &shape(f), f.samples())],
            Field::SampledSound(f) => {
                let [z, y, x] = shape(f.instant());
                let wave = f.wave();
                let parts = wave.amplitude.iter().flatten().map(|v| f64::from(*v));
                let amplitude = parts.collect();
                vec![
                    FieldParameter::of("n0", vec![wave.n0]),
                    FieldParameter::new("amplitude", &[z, y, x, 2], amplitude),
                ]
            }
            Field::Expression(f) => of_formula(f.free()),
            Field::IndexProfile(f) => match f.table_values() {
                Some(values) => vec![FieldParameter::new("samples", &[values.len()], values)],
                None => of_formula(f.free()),
            },
            Field::Sum(f) => {
                let mut all = vec![FieldParameter::of("reference", vec![f.reference()])];
                for (i, term) in f.terms().enumerate() {
                    all.extend(within(&format!("terms[{i}]."), term));
                }
                all
            }
            Field::Affine(f) => {
                let rows = f.to_world_rows().to_vec();
                followed_by(f.inner(), FieldParameter::new("to_world", &[3, 4], rows))
            }
            Field::Scaled(f) => {
                followed_by(f.inner(), FieldParameter::of("factor", vec![f.factor()]))
            }
            _ => analytic!(self, f => named(f), Vec::new()),
        }
    }

    /// Returns the number of sums that derivatives need while rays are traced.
    pub fn sum_count(&self) -> usize {
        match self {
            Field::Constant(_) => 1,
            Field::Acoustic(f) => f.parameter_count(),
            Field::Bspline(f) => f.coefficient_count(),
            Field::SampledSound(f) => f.instant().coefficient_count(),
            Field::Expression(f) => f.free().map_or(0, |free| free.values().len()),
            Field::IndexProfile(f) => f.parameter_count(),
            Field::Sum(f) => 1 + f.terms().map(Field::sum_count).sum::<usize>(),
            Field::Affine(f) => f.inner().sum_count() + 12,
            Field::Scaled(f) => f.inner().sum_count() + 1,
            _ => analytic!(self, f => count(f), 0),
        }
    }

    /// Returns the number of values of all parameters.
    pub fn parameter_count(&self) -> usize {
        match self {
            Field::Bspline(f) => f.dims().iter().product(),
            Field::SampledSound(f) => 1 + 2 * f.wave().amplitude.len(),
            Field::IndexProfile(f) => match f.table_values() {
                Some(values) => values.len(),
                None => f.parameter_count(),
            },
            Field::Sum(f) => 1 + f.terms().map(Field::parameter_count).sum::<usize>(),
            Field::Affine(f) => f.inner().parameter_count() + 12,
            Field::Scaled(f) => f.inner().parameter_count() + 1,
            _ => self.sum_count(),
        }
    }

    /// Adds the derivatives of a loss to [`Field::sum_count`] sums, given its derivative with
    /// respect to n² and ∇n² at `x`.
    ///
    /// # Panics
    ///
    /// May panic if there are fewer sums.
    pub fn add_parameter_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        match self {
            Field::Constant(f) => into[0] += by.n2 * 2.0 * f.n(),
            Field::Acoustic(f) => f.add_parameter_derivative(x, by, into),
            Field::Bspline(f) => f.add_coefficient_derivative(x, by, into),
            Field::SampledSound(f) => f.instant().add_coefficient_derivative(x, by, into),
            Field::Expression(f) => f.add_parameter_derivative(x, by, into),
            Field::IndexProfile(f) => f.add_parameter_derivative(x, by, into),
            Field::Sum(f) => {
                let (reference, mut rest) = into.split_at_mut(1);
                let more = f.terms().count() as f64 - 1.0;
                reference[0] -= by.n2 * 2.0 * f.reference() * more;
                for term in f.terms() {
                    let (own, others) = rest.split_at_mut(term.sum_count());
                    term.add_parameter_derivative(x, by, own);
                    rest = others;
                }
            }
            Field::Affine(f) => {
                let (inner, map) = into.split_at_mut(f.inner().sum_count());
                f.add_map_derivative(x, by, map);
                let (x, by) = f.local_derivative(x, by);
                f.inner().add_parameter_derivative(x, by, inner);
            }
            Field::Scaled(f) => {
                let (inner, factor) = into.split_at_mut(f.inner().sum_count());
                let of_factor = f.by_factor(x);
                factor[0] += by.of(of_factor.n2, of_factor.gradient);
                let by = f.unscaled(x, by);
                f.inner().add_parameter_derivative(x, by, inner);
            }
            _ => analytic!(self, f => analytic::add_derivative(f, x, by, into), ()),
        }
    }

    /// Converts the [`Field::sum_count`] sums to derivatives with respect to the parameters, in
    /// their order.
    ///
    /// # Panics
    ///
    /// May panic if there are fewer sums.
    pub fn parameter_derivative(&self, sums: Vec<f64>) -> Vec<f64> {
        match self {
            Field::Bspline(f) => by_samples(f, sums),
            Field::SampledSound(f) => f.sample_derivative(&by_samples(f.instant(), sums)),
            Field::IndexProfile(f) => f.value_derivative(sums),
            Field::Sum(f) => {
                let (mut all, mut rest) = (vec![sums[0]], &sums[1..]);
                for term in f.terms() {
                    let (own, others) = rest.split_at(term.sum_count());
                    all.extend(term.parameter_derivative(own.to_vec()));
                    rest = others;
                }
                all
            }
            Field::Affine(f) => outside(f.inner(), sums),
            Field::Scaled(f) => outside(f.inner(), sums),
            _ => sums,
        }
    }

    /// Converts a change of the [`Field::parameter_count`] values to a change of the quantities
    /// that sums refer to: the transpose of [`Field::parameter_derivative`].
    ///
    /// # Panics
    ///
    /// May panic if there are fewer values.
    pub fn parameter_change(&self, change: &[f64]) -> Vec<f64> {
        match self {
            Field::Bspline(f) => of_samples(f, change),
            Field::SampledSound(f) => of_samples(f.instant(), &f.sample_change(change)),
            Field::IndexProfile(f) => f.coefficient_change(change),
            Field::Sum(f) => {
                let (mut all, mut rest) = (vec![change[0]], &change[1..]);
                for term in f.terms() {
                    let (own, others) = rest.split_at(term.parameter_count());
                    all.extend(term.parameter_change(own));
                    rest = others;
                }
                all
            }
            Field::Affine(f) => changed(f.inner(), change),
            Field::Scaled(f) => changed(f.inner(), change),
            _ => change.to_vec(),
        }
    }

    /// Returns the change of n² and ∇n² at `x` for a change from [`Field::parameter_change`]: the
    /// transpose of [`Field::add_parameter_derivative`].
    ///
    /// # Panics
    ///
    /// May panic if the change has fewer values than [`Field::sum_count`].
    pub fn index_change(&self, x: DVec3, change: &[f64]) -> IndexChange {
        match self {
            Field::Bspline(f) => f.coefficient_change(x, change),
            Field::SampledSound(f) => f.instant().coefficient_change(x, change),
            Field::Sum(f) => {
                let mut rest = &change[1..];
                let more = f.terms().count() as f64 - 1.0;
                let reference = IndexChange {
                    n2: -2.0 * f.reference() * more * change[0],
                    gradient: DVec3::ZERO,
                };
                f.terms().fold(reference, |sum, term| {
                    let (own, others) = rest.split_at(term.sum_count());
                    rest = others;
                    sum + term.index_change(x, own)
                })
            }
            Field::Affine(f) => {
                let (inner, map) = change.split_at(f.inner().sum_count());
                let local = f
                    .inner()
                    .index_change(f.to_local().transform_point3(x), inner);
                let turned = IndexChange {
                    gradient: f.to_local().matrix3.transpose() * local.gradient,
                    ..local
                };
                turned + by_columns(map, |by, into| f.add_map_derivative(x, by, into))
            }
            Field::Scaled(f) => {
                let (inner, factor) = change.split_at(f.inner().sum_count());
                let local = f.inner().index_change(x, inner);
                let of_factor = f.by_factor(x);
                let of_factor = IndexChange {
                    n2: of_factor.n2 * factor[0],
                    gradient: of_factor.gradient * factor[0],
                };
                f.change(x, local) + of_factor
            }
            _ => by_columns(change, |by, into| {
                self.add_parameter_derivative(x, by, into)
            }),
        }
    }
}

/// Returns the change of n² and ∇n² for a change of a few values, from the derivatives with respect
/// to them.
fn by_columns(change: &[f64], add: impl Fn(IndexDerivative, &mut [f64])) -> IndexChange {
    let of = |n2: f64, gradient: DVec3| {
        let mut sums = vec![0.0; change.len()];
        add(IndexDerivative { n2, gradient }, &mut sums);
        sums.iter().zip(change).map(|(by, of)| by * of).sum::<f64>()
    };
    IndexChange {
        n2: of(1.0, DVec3::ZERO),
        gradient: DVec3::from_array(DVec3::AXES.map(|axis| of(0.0, axis))),
    }
}

fn of_formula(free: Option<&super::formula::Free>) -> Vec<FieldParameter> {
    let parameters = free.into_iter().flat_map(|free| free.parameters());
    parameters
        .map(|(name, value)| FieldParameter::of(name, vec![value]))
        .collect()
}

/// Returns the parameters of a field, with a prefix before their names.
fn within(prefix: &str, field: &Field) -> impl Iterator<Item = FieldParameter> {
    let each = field.parameters().into_iter();
    each.map(move |p| FieldParameter {
        name: format!("{prefix}{}", p.name),
        ..p
    })
}

/// Returns the parameters of a wrapped field, followed by its wrapper's own parameter.
fn followed_by(inner: &Field, own: FieldParameter) -> Vec<FieldParameter> {
    let taken = inner.parameters().iter().any(|p| p.name == own.name);
    let prefix = if taken { "within." } else { "" };
    within(prefix, inner).chain([own]).collect()
}

/// Applies [`Field::parameter_derivative`] to a wrapped field; the wrapper's own sums come last.
fn outside(inner: &Field, mut sums: Vec<f64>) -> Vec<f64> {
    let own = sums.split_off(inner.sum_count());
    let mut all = inner.parameter_derivative(sums);
    all.extend(own);
    all
}

/// Applies [`Field::parameter_change`] to a wrapped field; the wrapper's own changes come last.
fn changed(inner: &Field, change: &[f64]) -> Vec<f64> {
    let (within, own) = change.split_at(inner.parameter_count());
    let mut all = inner.parameter_change(within);
    all.extend(own);
    all
}
