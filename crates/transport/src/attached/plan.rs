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
    /// Where the sums begin of the parameters of each, and the number of all.
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
            let medium = scene.medium(id);
            check_field(&medium.name, &medium.index)?;
            if plan.of_medium[id].replace(next).is_some() {
                return Err(IndexDerivativeError::Twice);
            }
            next += medium.index.parameter_count();
            plan.starts.push(next);
        }
        Ok(plan)
    }

    /// Number of all parameters.
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
            field.add_parameter_derivative(x, by, &mut sums[start..][..field.parameter_count()]);
        }
    }

    /// Sums by samples of n in place of those by coefficients of grids, medium by medium.
    pub(crate) fn by_samples(&self, scene: &Scene, sums: &[f64]) -> Vec<f64> {
        let mut all = Vec::with_capacity(sums.len());
        for (&id, bounds) in self.media.iter().zip(self.starts.windows(2)) {
            let own = sums[bounds[0]..bounds[1]].to_vec();
            match scene.medium(id).index.grid() {
                Some(grid) => all.extend(grid.index_sample_derivative(own)),
                None => all.extend(own),
            }
        }
        all
    }

    /// Length along each axis of the derivative by each medium: [z, y, x] of samples, or the number of parameters.
    pub(crate) fn shapes(&self, scene: &Scene) -> Vec<Vec<usize>> {
        let shape = |&id: &MediumId| {
            let field = &scene.medium(id).index;
            match field.grid() {
                Some(grid) => grid.dims().into_iter().rev().collect(),
                None => vec![field.parameter_count()],
            }
        };
        self.media.iter().map(shape).collect()
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
    let is_even = field.is_constant() && field.parameter_count() > 1 && field.grid().is_none();
    if is_even {
        return Err(IndexDerivativeError::Even(name.into()));
    }
    Ok(())
}
