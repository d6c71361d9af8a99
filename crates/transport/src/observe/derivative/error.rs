//! Errors of derivatives.

use crate::film::PartsFacts;

/// Reason why derivatives cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DerivativeError {
    /// A factor of paths is zero. Its derivative would come from light that no path finds.
    #[error(
        "{what} of '{name}' is zero somewhere, or in some channel, where no path finds the effect of a change: start from a small value > 0{instead}"
    )]
    Zero {
        /// Quantity that is zero.
        what: &'static str,
        /// Name of the medium or object.
        name: String,
        /// Alternative that the message suggests.
        instead: &'static str,
    },
    /// The scene has no such medium, object or emitter.
    #[error("the scene has no {what} number {number}")]
    Missing {
        /// Kind of the missing part.
        what: &'static str,
        /// Number of the missing part.
        number: usize,
    },
    /// A parameter is listed twice.
    #[error("a parameter is listed twice")]
    Twice,
    /// The phase function has no such parameter.
    #[error(
        "the phase function of '{0}' has no mean cosine g to differentiate by: only hg has, also of labels and of voxels"
    )]
    Phase(String),
    /// The medium has no voxels of labels.
    #[error(
        "'{0}' has no voxels of labels to differentiate by: leave 'voxels' out of the name, or give 'labels' a surface of voxels"
    )]
    NoVoxels(String),
    /// Coefficients are requested by voxel and by label.
    #[error(
        "coefficients of '{0}' are requested by voxel and by label: request them by voxel, and add up the voxels of a label"
    )]
    VoxelsAndLabels(String),
    /// The extinction of the medium depends on the direction.
    #[error(
        "'{0}' has flakes (sggx), whose extinction depends on the direction: of such media, only the albedo has derivatives"
    )]
    Flakes(String),
    /// The surface has no such colour.
    #[error(
        "'{name}' has no {what} to differentiate by: {}",
        colours(name, others)
    )]
    Colour {
        /// Name of the colour.
        what: &'static str,
        /// Name of the object.
        name: String,
        /// Colours of the surface that have derivatives.
        others: Vec<&'static str>,
    },
    /// The colour is a texture whose values are not numbered.
    #[error(
        "{what} of '{name}' is a volume or a nested texture: derivatives support one colour, a bitmap, a checkerboard of two colours, or the colours of a mesh"
    )]
    Texture {
        /// Name of the colour.
        what: &'static str,
        /// Name of the object.
        name: String,
    },
    /// The emitter projects a texture whose values are not numbered.
    #[error(
        "the texture of emitter number {0} is a volume or a nested texture: request its emission instead"
    )]
    Radiance(usize),
    /// The emitter has values of zero.
    #[error(
        "the light of emitter number {0} is zero somewhere, or in some channel, where no path finds the effect of a change: start from a small value > 0"
    )]
    Dim(usize),
    /// The integrator blurs light.
    #[error(
        "the integrator {0} blurs light, which then has no derivatives: use path, particle or bdpt"
    )]
    Blurred(&'static str),
    /// The light is separated into parts, such as its Stokes parameters.
    #[error(
        "{} have no derivatives: leave out the integrator {plugin}, and '{plugin}' of meters",
        .0.name,
        plugin = .0.integrator
    )]
    Parts(PartsFacts),
    /// The number of weights differs from the number of values.
    #[error("expected {expected} weights, as many as there are values, found {found}")]
    Weights {
        /// Number of values.
        expected: usize,
        /// Number of weights given.
        found: usize,
    },
    /// A weight is not finite.
    #[error("weight {0} is not finite: the loss must have a derivative by every value")]
    NotFinite(usize),
    /// A meter cannot measure in the scene.
    #[error("meter {number}: {field}: {message}")]
    Meter {
        /// Number of the meter, counted from 0.
        number: usize,
        /// Invalid field.
        field: &'static str,
        /// Description of the valid values and of the value given.
        message: String,
    },
    /// The meters have no such reading.
    #[error("the meters have no such reading")]
    Reading,
    /// The scene emits no light.
    #[error(
        "the scene emits no light, so there is nothing to differentiate: add an emitter, or make its light brighter than 0"
    )]
    Dark,
    /// A medium fluoresces.
    #[error("morgana has no derivatives of fluorescent light: remove the fluorescence")]
    Fluorescence,
    /// There are too few samples.
    #[error("errors need at least two samples, or two replicates of samples: use more than {0}")]
    Samples(u64),
    /// The sums do not fit into memory.
    #[error("derivatives by {0} numbers do not fit into memory")]
    Memory(usize),
}

/// Suggests other colours, or explains why there is none.
fn colours(name: &str, others: &[&str]) -> String {
    if others.is_empty() {
        return "its bsdf is null, or principled with tints, or made of several of which each has another colour of that name, or two are mirrors; \
                or it is a phong or ward whose reflectances add up to more than 1"
            .into();
    }
    let each = others.iter().map(|other| format!("{name}.{other}"));
    format!("ask for {}", each.collect::<Vec<_>>().join(" or "))
}
