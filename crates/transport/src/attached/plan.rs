//! By which numbers an index is differentiated, and where their sums lie.

use super::IndexDerivativeError;
use crate::scene::{MediumId, Scene};
use eikonal::Field;
use eikonal::field::IndexDerivative;
use glam::DVec3;

/// The media whose index is differentiated by its parameters, and where the sums of each begin.
#[derive(Clone, Debug)]
pub(crate) struct IndexPlan {
    media: Vec<MediumId>,
    /// Where the sums of each begin, and the number of all.
    starts: Vec<usize>,
    /// For each medium of the scene, where its sums are.
    of_medium: Vec<Option<usize>>,
}

impl IndexPlan {
    /// For media of a scene.
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

    /// Number of all sums.
    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Whether the index of a medium is differentiated.
    pub(crate) fn has(&self, medium: MediumId) -> bool {
        self.of_medium[medium].is_some()
    }

    /// Adds to the sums of a medium what a loss says of n² and ∇n² at a point.
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

    /// Derivatives by parameters from sums, medium by medium.
    pub(crate) fn by_parameters(&self, scene: &Scene, sums: &[f64]) -> Vec<f64> {
        let media = self.media.iter().zip(self.starts.windows(2));
        let each = media.flat_map(|(&id, bounds)| {
            let own = sums[bounds[0]..bounds[1]].to_vec();
            scene.medium(id).index.parameter_derivative(own)
        });
        each.collect()
    }

    /// Number of parameters of each medium.
    pub(crate) fn counts(&self, scene: &Scene) -> Vec<usize> {
        let count = |&id: &MediumId| scene.medium(id).index.parameter_count();
        self.media.iter().map(count).collect()
    }
}

/// Finds out whether a field has parameters that rays see.
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
