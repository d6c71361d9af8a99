//! Refractive-index fields. Each field supplies n², ∇n², Hess n² and conservative bounds over boxes
//! (docs/theory.md#fields).

mod acoustic;
mod acoustic_mode;
mod affine;
mod analytic;
mod axis;
mod bessel;
mod bessel_table;
mod bspline;
mod cells;
mod constant;
mod error;
mod expression;
mod fisheye;
mod formula;
mod gaussian;
mod length_cells;
mod lengths;
mod linear;
mod luneburg;
mod modulation;
mod parameters;
mod profile;
mod radial;
mod sampled_amplitude;
mod sampled_sound;
mod scaled;
mod selfoc;
mod sound;
mod sound_amplitude;
mod spline;
mod steepness;
mod sum;

pub use acoustic::Acoustic;
pub use acoustic_mode::AcousticMode;
pub use affine::Affine;
pub use bspline::{Bspline, NoiseShares, Placement, SplineCoefficients};
pub use constant::Constant;
pub use error::FieldError;
pub use expression::Expression;
pub use fisheye::Fisheye;
pub use formula::{Coordinate, Formula, FormulaError, FormulaErrorKind, Quantity};
pub use gaussian::Gaussian;
pub use linear::{LinearIndex, LinearSquare};
pub use luneburg::Luneburg;
pub use modulation::Modulation;
pub use parameters::{FieldParameter, IndexChange, IndexDerivative};
pub use profile::IndexProfile;
pub use sampled_sound::{SampledSound, SoundSamples};
pub use scaled::Scaled;
pub use selfoc::Selfoc;
pub use sound::Sound;
pub use sound_amplitude::SoundAmplitude;
pub use sum::Sum;

use crate::bounds::{Aabb, FieldBounds};
use formula::Domain;
use glam::{DMat3, DVec3};

/// Value and derivatives of n² at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// Square of the index, n².
    pub n2: f64,
    /// Gradient ∇n².
    pub grad: DVec3,
    /// Hessian Hess n² (symmetric).
    pub hess: DMat3,
}

impl Jet {
    /// Returns the jet of the constant field n² = `n2`.
    pub fn constant(n2: f64) -> Self {
        Jet {
            n2,
            grad: DVec3::ZERO,
            hess: DMat3::ZERO,
        }
    }

    /// Returns the jet of n² from n, ∇n and Hess n.
    pub(crate) fn from_index(n: f64, grad: DVec3, hess: DMat3) -> Self {
        Jet {
            n2: n * n,
            grad: grad * (2.0 * n),
            hess: (hess * n + outer(grad)) * 2.0,
        }
    }
}

/// Returns a⊗a.
fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

/// A refractive-index field, a smooth function of position in scene units.
#[derive(Clone, Debug)]
pub enum Field {
    /// A constant index.
    Constant(Constant),
    /// Index n linear in position.
    LinearIndex(LinearIndex),
    /// Squared index n² linear in position.
    LinearSquare(LinearSquare),
    /// The Luneburg lens.
    Luneburg(Luneburg),
    /// The radially graded rod.
    Selfoc(Selfoc),
    /// Maxwell's fisheye.
    Fisheye(Fisheye),
    /// A Gaussian bump.
    Gaussian(Gaussian),
    /// Cylindrical standing waves of sound.
    Acoustic(Acoustic),
    /// Samples on a grid, interpolated by tricubic B-splines.
    Bspline(Bspline),
    /// Sound sampled on a grid.
    SampledSound(Box<SampledSound>),
    /// A formula in three coordinates.
    Expression(Expression),
    /// A formula or a table in one coordinate.
    IndexProfile(IndexProfile),
    /// A superposition of fields.
    Sum(Sum),
    /// A field under an affine transform.
    Affine(Affine),
    /// A field at another wavelength.
    Scaled(Scaled),
}

/// Function that computes the bounds of a field over a box.
type BoundsOf = fn(&Field, &Aabb) -> FieldBounds;

/// Calls a method of the variant of a field.
macro_rules! each {
    ($self:expr, $f:ident => $e:expr) => {
        match $self {
            Field::Constant($f) => $e,
            Field::LinearIndex($f) => $e,
            Field::LinearSquare($f) => $e,
            Field::Luneburg($f) => $e,
            Field::Selfoc($f) => $e,
            Field::Fisheye($f) => $e,
            Field::Gaussian($f) => $e,
            Field::Acoustic($f) => $e,
            Field::Bspline($f) => $e,
            Field::SampledSound($f) => $e,
            Field::Expression($f) => $e,
            Field::IndexProfile($f) => $e,
            Field::Sum($f) => $e,
            Field::Affine($f) => $e,
            Field::Scaled($f) => $e,
        }
    };
}

/// Implements `From` for the type of each variant.
macro_rules! into_field {
    ($($name:ident),*) => {$(
        impl From<$name> for Field {
            fn from(field: $name) -> Self {
                Field::$name(field)
            }
        }
    )*};
}

into_field!(
    Constant,
    LinearIndex,
    LinearSquare,
    Luneburg,
    Selfoc,
    Fisheye,
    Gaussian,
    Acoustic,
    Bspline,
    Expression,
    IndexProfile,
    Sum,
    Affine,
    Scaled
);

/// Creates a constant field, a profile if the formula depends on one coordinate, otherwise an
/// expression. A profile is faster than an expression and has tighter bounds.
impl From<Formula> for Field {
    fn from(formula: Formula) -> Self {
        match (formula.constant(), formula.domain) {
            (Some(n2), _) if n2 > 0.0 => Constant::new(n2.sqrt()).into(),
            (_, Domain::Line(coordinate)) => IndexProfile::of_formula(formula, coordinate).into(),
            (_, Domain::Space) => Expression::new(formula).into(),
        }
    }
}

impl Field {
    /// Returns n² at `x`.
    #[inline]
    pub fn n2(&self, x: DVec3) -> f64 {
        match self {
            // Avoid a call: straight rays need this value very often.
            Field::Constant(f) => f.n2(x),
            _ => self.varying_n2(x),
        }
    }

    fn varying_n2(&self, x: DVec3) -> f64 {
        each!(self, f => f.n2(x))
    }

    /// Returns the index n at `x`; NaN where n² < 0.
    #[inline]
    pub fn n(&self, x: DVec3) -> f64 {
        match self {
            Field::Constant(f) => f.n(),
            _ => self.varying_n2(x).sqrt(),
        }
    }

    /// Returns n² and ∇n² at `x`.
    pub fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        each!(self, f => f.gradient(x))
    }

    /// Returns n², ∇n² and Hess n² at `x`.
    pub fn jet(&self, x: DVec3) -> Jet {
        each!(self, f => f.jet(x))
    }

    /// Returns conservative bounds over a box.
    pub fn bounds(&self, region: &Aabb) -> FieldBounds {
        each!(self, f => f.bounds(region))
    }

    /// Returns [`Field::bounds`]. A grid also stores them, so that copies of the field and fields
    /// that scale it need not compute them again.
    pub fn stored_bounds(&self, region: &Aabb) -> FieldBounds {
        let inner: BoundsOf = Field::stored_bounds;
        match self {
            Field::Bspline(f) => f.stored_bounds(region),
            Field::Sum(f) => f.bounds_by(region, inner),
            Field::Affine(f) => f.bounds_by(region, inner),
            Field::Scaled(f) => f.bounds_by(region, inner),
            _ => self.bounds(region),
        }
    }

    /// Returns the local length scale L, by which steps are chosen. The field turns rays no faster
    /// than once in L. The fifth derivative of rays with respect to σ is about n⁵L⁻⁴, so that L is
    /// long in weak fields. A step of a fraction of L cannot jump over a feature of the field. L is
    /// a 1-Lipschitz function of position, or a lower bound of one, and infinite for constant
    /// fields.
    pub fn length_scale(&self, x: DVec3) -> f64 {
        each!(self, f => f.length_scale(x))
    }

    /// Returns the length scale at `x` for a ray with velocity `v`: at least
    /// [`Field::length_scale`], and longer where the field hardly changes along `v`.
    pub(crate) fn step_scale(&self, x: DVec3, v: DVec3) -> f64 {
        match self {
            Field::Acoustic(f) => f.step_scale(v),
            Field::Sum(f) => f.step_scale(x, v),
            Field::Affine(f) => f.step_scale(x, v),
            Field::Scaled(f) => f.step_scale(x, v),
            _ => self.length_scale(x),
        }
    }

    /// Returns a lower bound of the span of σ over which the field around a ray is constant, so
    /// that the ray is straight. The ray leaves `x` with velocity `v` = dx/dσ. Returns zero where
    /// the field varies, or is not known to be constant.
    pub fn homogeneous_span(&self, x: DVec3, v: DVec3) -> f64 {
        match self {
            Field::Constant(_) => f64::INFINITY,
            Field::Bspline(f) => f.homogeneous_span(x, v),
            Field::SampledSound(f) => f.instant().homogeneous_span(x, v),
            Field::Sum(f) => f.homogeneous_span(x, v),
            Field::Affine(f) => f.homogeneous_span(x, v),
            Field::Scaled(f) => f.inner().homogeneous_span(x, v),
            _ => 0.0,
        }
    }

    /// Returns the span of σ along the line from `x` with velocity `v` that a quadrature with 15
    /// points resolves: it misses no feature of the samples, even if the feature is weak. Returns
    /// infinity for formulas, because their length scale shows their features.
    pub(crate) fn resolved_span(&self, x: DVec3, v: DVec3) -> f64 {
        match self {
            Field::Bspline(f) => f.resolved_span(v),
            Field::SampledSound(f) => f.instant().resolved_span(v),
            Field::Sum(f) => f.resolved_span(x, v),
            Field::Affine(f) => f.resolved_span(x, v),
            Field::Scaled(f) => f.inner().resolved_span(x, v),
            _ => f64::INFINITY,
        }
    }

    /// Returns the number of bytes held by samples and tables.
    pub fn memory(&self) -> usize {
        match self {
            Field::Acoustic(f) => f.memory(),
            Field::Bspline(f) => f.memory(),
            Field::SampledSound(f) => f.memory(),
            Field::Expression(f) => f.memory(),
            Field::IndexProfile(f) => f.memory(),
            Field::Sum(f) => f.memory(),
            Field::Affine(f) => f.memory(),
            Field::Scaled(f) => f.inner().memory(),
            _ => 0,
        }
    }

    /// Returns the coefficients of a tricubic B-spline, for programs that evaluate it elsewhere.
    /// Returns `None` unless the field is one, moved by any affine map.
    pub fn spline(&self) -> Option<SplineCoefficients> {
        match self {
            Field::Bspline(spline) => Some(spline.coefficients()),
            Field::Affine(field) => {
                let spline = field.inner().spline()?;
                Some(SplineCoefficients {
                    to_index: spline.to_index * field.to_local(),
                    ..spline
                })
            }
            _ => None,
        }
    }

    /// Returns true if the index is constant, so that rays are straight.
    #[inline]
    pub fn is_constant(&self) -> bool {
        matches!(self, Field::Constant(_)) || self.is_evened_out()
    }

    /// Returns true if the index of a composed field is constant, for example the index of a sum of
    /// constant fields.
    fn is_evened_out(&self) -> bool {
        each!(self, f => f.is_constant())
    }
}
