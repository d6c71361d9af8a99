//! Parameters by which an index is differentiated, and the layout of their sums.

use super::IndexDerivativeError;
use crate::scene::{MediumId, Scene};
use eikonal::Field;
use eikonal::field::IndexDerivative;
use glam::DVec3;

/// Media whose index is differentiated by its parameters, and the layout of their sums.
#[derive(Clone, Debug)]
pub(crate) struct IndexPlan {
    media: Vec<MediumId>,
    /// Start of each medium's sums, and the total number.
    starts: Vec<usize>,
    /// Index in `starts` of each medium of the scene.
    of_medium: Vec<Option<usize>>,
}

impl IndexPlan {
    /// Creates the layout for media of a scene.
    pub(crate) fn new(scene: &Scene, media: &[MediumId]) -> Result<Self, IndexDerivativeError> {
        let mut plan = IndexPlan {
            media: media.to_vec(),
            starts: vec![0],
            of_medium: vec![None; scene.media().len()],
        };
        let mut next = 0;
        for &id in media {
            let medium = scene.media().get(id);
            let medium = medium.ok_or(IndexDerivativeError::Medium(id))?;
            check_field(&medium.name, &medium.index)?;
            if plan.of_medium[id].replace(next).is_some() {
                return Err(IndexDerivativeError::Twice);
            }
            next += medium.index.sum_count();
            plan.starts.push(next);
        }
        Ok(plan)
    }

    /// Returns the number of sums.
    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Returns true if the index of a medium is differentiated.
    pub(crate) fn has(&self, medium: MediumId) -> bool {
        self.of_medium[medium].is_some()
    }

    /// Adds the derivatives of a loss by n² and ∇n² at a point to the sums of a medium.
    pub(crate) fn add(
        &self,
        scene: &Scene,
        medium: MediumId,
        x: DVec3,
        by: IndexDerivative,
        sums: &mut [f64],
    ) {
        if let Some(start) = self.of_medium[medium] {
            let field = &scene.medium(medium).index;
            field.add_parameter_derivative(x, by, &mut sums[start..][..field.sum_count()]);
        }
    }

    /// Computes derivatives by parameters from sums, medium by medium.
    pub(crate) fn by_parameters(&self, scene: &Scene, sums: &[f64]) -> Vec<f64> {
        let media = self.media.iter().zip(self.starts.windows(2));
        let each = media.flat_map(|(&id, bounds)| {
            let own = sums[bounds[0]..bounds[1]].to_vec();
            scene.medium(id).index.parameter_derivative(own)
        });
        each.collect()
    }

    /// Returns the number of parameters of each medium.
    pub(crate) fn counts(&self, scene: &Scene) -> Vec<usize> {
        let count = |&id: &MediumId| scene.medium(id).index.parameter_count();
        self.media.iter().map(count).collect()
    }
}

/// Checks that a field has parameters that affect rays.
fn check_field(name: &str, field: &Field) -> Result<(), IndexDerivativeError> {
    if field.parameter_count() == 0 {
        return Err(IndexDerivativeError::Parameters(name.into()));
    }
    if field.grid().is_some_and(|grid| !grid.interpolates()) {
        return Err(IndexDerivativeError::Smoothed(name.into()));
    }
    let is_even =
        field.is_constant() && !matches!(field, Field::Constant(_)) && field.grid().is_none();
    if is_even {
        return Err(IndexDerivativeError::Even(name.into()));
    }
    Ok(())
}
