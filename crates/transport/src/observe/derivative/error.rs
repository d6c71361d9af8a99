//! Why derivatives are not taken.

/// Why derivatives are not taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DerivativeError {
    /// What paths multiply by is zero: its derivative is that of light which no path finds.
    #[error(
        "{what} of '{name}' is zero somewhere, or in some channel, where no path finds what would come of more of it: start from a small value > 0{instead}"
    )]
    Zero {
        /// The quantity.
        what: &'static str,
        /// Of which medium or object.
        name: String,
        /// What else may be asked for.
        instead: &'static str,
    },
    /// A medium, object or emitter that the scene does not have.
    #[error("the scene has no {what} number {number}")]
    Missing {
        /// What.
        what: &'static str,
        /// Its number.
        number: usize,
    },
    /// A parameter that is listed twice.
    #[error("a parameter is listed twice")]
    Twice,
    /// A phase function without such a parameter.
    #[error(
        "the phase function of '{0}' has no mean cosine g to differentiate by: only hg has, also of labels and of voxels"
    )]
    Phase(String),
    /// A surface without such a colour.
    #[error(
        "'{name}' has no {what} to differentiate by: {}",
        colours(name, others)
    )]
    Colour {
        /// The colour.
        what: &'static str,
        /// Of which object.
        name: String,
        /// Colours by which its surface can be differentiated.
        others: Vec<&'static str>,
    },
    /// Colours of a texture whose values are not numbered.
    #[error(
        "{what} of '{name}' is that of a volume, or of textures within a texture, whose values have no numbers: derivatives are by one colour, a bitmap, a checkerboard of two colours, or the colours of a mesh"
    )]
    Texture {
        /// The colour.
        what: &'static str,
        /// Of which object.
        name: String,
    },
    /// An emitter that throws a texture whose values are not numbered.
    #[error(
        "what emitter number {0} throws is no image, but a volume's or that of textures within a texture: ask for its emission"
    )]
    Radiance(usize),
    /// An emitter that is black somewhere.
    #[error(
        "the light of emitter number {0} is zero somewhere, or in some channel, where no path finds what would come of more of it: start from a small value > 0"
    )]
    Dim(usize),
    /// Light that an integrator blurs.
    #[error("light that the integrator {0} blurs has no derivatives: take path, particle or bdpt")]
    Blurred(&'static str),
    /// Polarised light, and its Stokes parameters.
    #[error(
        "Stokes parameters have no derivatives: leave out the integrator stokes, and 'stokes' of meters"
    )]
    Polarized,
    /// Light told apart by what sound does to its phase.
    #[error(
        "sidebands of tagged light have no derivatives yet: leave the integrator tagged, and 'tagged' of meters, out"
    )]
    Tagged,
    /// Another number of weights than the image has values.
    #[error("expected {expected} weights, as many as there are values, found {found}")]
    Weights {
        /// As many as there are values.
        expected: usize,
        /// As many as were given.
        found: usize,
    },
    /// A weight that is not finite.
    #[error("weight {0} is not finite: the loss must have a derivative by every value")]
    NotFinite(usize),
    /// A meter that cannot measure in the scene.
    #[error("meter {number}: {field}: {message}")]
    Meter {
        /// Number of the meter, counted from 0.
        number: usize,
        /// The field that is wrong.
        field: &'static str,
        /// What it must be, and what it is.
        message: String,
    },
    /// A reading that meters do not have.
    #[error("the meters have no such reading")]
    Reading,
    /// No light.
    #[error("the scene emits no light: there is nothing to differentiate")]
    Dark,
    /// Too few samples.
    #[error("errors need at least two samples, or replicates of them: take more than {0}")]
    Samples(u64),
    /// Sums do not fit into memory.
    #[error("derivatives by {0} numbers do not fit into memory")]
    Memory(usize),
}

/// What can be asked for, or why nothing can.
fn colours(name: &str, others: &[&str]) -> String {
    if others.is_empty() {
        return "its bsdf is null, or principled with tints, or made of several of which each has another colour of that name, or two are mirrors; \
                or it is a phong or ward whose reflectances add up to more than 1"
            .into();
    }
    let each = others.iter().map(|other| format!("{name}.{other}"));
    format!("ask for {}", each.collect::<Vec<_>>().join(" or "))
}
