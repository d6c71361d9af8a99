//! Derivatives of a loss with respect to the parameters of one field.

use super::reverse::IndexSink;
use crate::field::{Field, IndexDerivative};
use glam::DVec3;

/// Sums of derivatives with respect to the field of one region. [`Field::parameter_derivative`]
/// converts them to derivatives with respect to its parameters.
#[derive(Clone, Debug)]
pub struct ParameterDerivative<'a, R> {
    region: R,
    field: &'a Field,
    /// Sums of derivatives.
    pub values: Vec<f64>,
}

impl<'a, R> ParameterDerivative<'a, R> {
    /// Creates sums of zero, for the `field` of a `region`.
    pub fn new(region: R, field: &'a Field) -> Self {
        ParameterDerivative {
            region,
            field,
            values: vec![0.0; field.sum_count()],
        }
    }
}

impl<R: PartialEq> IndexSink<R> for ParameterDerivative<'_, R> {
    fn add(&mut self, region: R, x: DVec3, by: IndexDerivative) {
        if region == self.region {
            self.field.add_parameter_derivative(x, by, &mut self.values);
        }
    }
}
