//! Derivatives of pictures by the refractive index of scattering media.

use crate::derivative::{Doubles, only, path};
use crate::errors;
use crate::limits::Limits;
use crate::numbers::array;
use crate::scene::Scene;
use crate::watch::watched;
use eikonal::Field as Index;
use io::Loaded;
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use std::ops::Range;
use transport::attached::IndexDerivativeError;
use transport::derivative::DerivativeError;
use transport::film::{Decomposition, LightParts, PartsFacts};
use transport::render::{IndexDerivativeOptions, check_indices, index_derivatives};

/// Parameter of a derivative: a medium, and the name of a parameter of its field, or `None` for
/// all.
struct Wanted<'n> {
    medium: usize,
    parameter: Option<&'n str>,
}

/// Computes derivatives of Σ weights × picture by indices. If `layered`, the sum is over all layers
/// in sequence.
///
/// `MEDIUM.ior` is all samples [z, y, x] of a grid, or all parameters of another field in a row.
/// `MEDIUM.ior.NAME` is one parameter.
///
/// Also returns the number of paths, the number of lost paths, and true if single batches of
/// samples contribute nearly all of the variance.
#[pyfunction]
pub fn differentiate_index<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    names: Vec<String>,
    weights: PyReadonlyArray1<'py, f64>,
    layered: bool,
    tick: Option<Py<PyAny>>,
) -> PyResult<(Vec<Doubles<'py>>, [u64; 2], bool)> {
    let loaded = &scene.get().loaded;
    let (wanted, media) = asked(loaded, &names)?;
    let options = IndexDerivativeOptions {
        samples: limits.samples.unwrap_or(loaded.samples),
        seed: limits.seed,
        weights: weights.as_slice()?,
        ..without_weights(loaded, &media, layered)?
    };
    let pool = limits.pool()?;
    let (found, interrupted) = watched(py, tick.as_ref(), None, |shared| {
        pool.install(|| index_derivatives(&loaded.groups, &options, &shared.handle))
    })?;
    let found = found.map_err(|e| refused(&e))?.filter(|_| !interrupted);
    let found = found.ok_or_else(|| PyKeyboardInterrupt::new_err(()))?;
    let each = wanted.iter().map(|wanted| {
        let place = media.iter().position(|id| *id == wanted.medium);
        let by = &found.by[place.unwrap_or_default()];
        let (shape, range) = part(
            &loaded.scene().medium(wanted.medium).index,
            wanted.parameter,
        )?;
        Ok((
            array(py, by.values[range.clone()].to_vec(), &shape)?,
            array(py, by.errors[range].to_vec(), &shape)?,
        ))
    });
    let each: PyResult<Vec<_>> = each.collect();
    let lost = found.stats.lost + found.stats.not_finite;
    Ok((each?, [found.stats.paths, lost], found.dominated))
}

/// Returns the options of the derivatives, without samples and weights.
fn without_weights<'a>(
    loaded: &Loaded,
    media: &'a [usize],
    layered: bool,
) -> PyResult<IndexDerivativeOptions<'a>> {
    if loaded.layering.decomposition.parts == Some(LightParts::Stokes) {
        return Err(errors::render(
            DerivativeError::Parts(PartsFacts::STOKES).to_string(),
        ));
    }
    let decomposition = if layered {
        loaded.layering.decomposition
    } else {
        Decomposition::default()
    };
    Ok(IndexDerivativeOptions {
        path: path(loaded)?,
        samples: 0,
        seed: 0,
        decomposition,
        hide_emitters: loaded.hide_emitters,
        media,
        weights: &[],
    })
}

/// Checks that pictures, or their layers, have derivatives by indices.
#[pyfunction]
pub fn check_index_derivatives(
    scene: Py<Scene>,
    names: Vec<String>,
    layered: bool,
) -> PyResult<()> {
    let loaded = &scene.get().loaded;
    let (wanted, media) = asked(loaded, &names)?;
    let options = without_weights(loaded, &media, layered)?;
    for of in &wanted {
        part(&loaded.scene().medium(of.medium).index, of.parameter)?;
    }
    check_indices(&loaded.groups, &options).map_err(|e| refused(&e))
}

/// Returns the parameters of some names, and the media of these parameters.
fn asked<'n>(loaded: &Loaded, names: &'n [String]) -> PyResult<(Vec<Wanted<'n>>, Vec<usize>)> {
    if !loaded.instruments.is_empty() {
        let message = "readings of meters have no derivatives by an index: paths jump from bin to bin and past edges of meters when they move; give the scene a camera";
        return Err(errors::render(message));
    }
    if loaded.is_dispersive() {
        let message = "where each wavelength has rays of its own, pictures have no derivatives by an index: render its channels one by one";
        return Err(errors::render(message));
    }
    if (1..names.len()).any(|i| names[..i].contains(&names[i])) {
        return Err(errors::render("a parameter is listed twice"));
    }
    let wanted = names.iter().map(|name| wanted(loaded, name));
    let wanted: Vec<Wanted> = wanted.collect::<PyResult<_>>()?;
    let mut media: Vec<usize> = wanted.iter().map(|w| w.medium).collect();
    media.sort_unstable();
    media.dedup();
    Ok((wanted, media))
}

/// Returns the parameter of a name such as `tissue.ior` or `tissue.ior.delta`.
fn wanted<'n>(loaded: &Loaded, name: &'n str) -> PyResult<Wanted<'n>> {
    let (medium, parameter) = match name.strip_suffix(".ior") {
        Some(medium) => (medium, None),
        None => {
            let (medium, parameter) = name.split_once(".ior.").unwrap_or((name, ""));
            (medium, Some(parameter))
        }
    };
    let media = loaded.scene().media().iter().map(|m| m.name.as_str());
    let medium = only(media, medium, "medium")?;
    Ok(Wanted { medium, parameter })
}

/// Returns the shape of a parameter of a field, or of all parameters, and the range of its numbers
/// among the numbers of all.
fn part(field: &Index, name: Option<&str>) -> PyResult<(Vec<usize>, Range<usize>)> {
    let Some(name) = name else {
        return Ok(match field.grid() {
            Some(grid) => {
                let [x, y, z] = grid.dims();
                (vec![z, y, x], 0..x * y * z)
            }
            None => (vec![field.parameter_count()], 0..field.parameter_count()),
        });
    };
    let mut first = 0;
    let all = field.parameters();
    for parameter in &all {
        let last = first + parameter.values.len();
        if parameter.name == name {
            return Ok((parameter.shape.clone(), first..last));
        }
        first = last;
    }
    let known: Vec<&str> = all.iter().map(|p| p.name.as_str()).collect();
    Err(errors::render(format!(
        "the index has no parameter '{name}': there are {}",
        known.join(", ")
    )))
}

fn refused(error: &IndexDerivativeError) -> PyErr {
    match error {
        IndexDerivativeError::Memory(_) => PyMemoryError::new_err(error.to_string()),
        _ => errors::render(error.to_string()),
    }
}
