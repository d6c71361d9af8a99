//! The compiled part of the Python package `morgana`: scenes, renders, fields and rays as Python
//! classes. Everything that Python does equally well, such as progress bars, is in
//! `python/morgana`.

mod connect;
mod denoise;
mod derivative;
mod dict;
mod ends;
mod errors;
mod field;
mod finished;
mod grad;
mod image;
mod index_derivative;
mod limits;
mod measure;
mod numbers;
mod parameters;
mod part;
mod render;
mod run;
mod scene;
mod tagging;
mod trace;
mod view;
mod volume;
mod watch;

use pyo3::prelude::*;

/// The compiled part of morgana.
#[pymodule]
mod _morgana {
    #[pymodule_export]
    use crate::connect::{Ray, connect};
    #[pymodule_export]
    use crate::denoise::denoise;
    #[pymodule_export]
    use crate::derivative::{check_derivatives, differentiate, jacobian};
    #[pymodule_export]
    use crate::ends::Ends;
    #[pymodule_export]
    use crate::field::{Field, load_field};
    #[pymodule_export]
    use crate::grad::{follow_rays, pull_back, push_forward, sum_of_squares};
    #[pymodule_export]
    use crate::image::{compare_images, encode_png, exposure, read_image, write_image};
    #[pymodule_export]
    use crate::index_derivative::{check_index_derivatives, differentiate_index};
    #[pymodule_export]
    use crate::measure::{Measured, read_measurement, write_arrays};
    #[pymodule_export]
    use crate::numbers::refuse_masked;
    #[pymodule_export]
    use crate::parameters::{scene_parameters, scene_with_values};
    #[pymodule_export]
    use crate::part::{Parts, render_part};
    #[pymodule_export]
    use crate::render::Rendered;
    #[pymodule_export]
    use crate::run::{devices, render};
    #[pymodule_export]
    use crate::scene::{Scene, export_dict, export_file, load_dict, load_file};
    #[pymodule_export]
    use crate::tagging::{order_shares, phase_correlation};
    #[pymodule_export]
    use crate::trace::{Traced, trace};
    #[pymodule_export]
    use crate::view::Viewer;
    #[pymodule_export]
    use crate::volume::write_volume;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
