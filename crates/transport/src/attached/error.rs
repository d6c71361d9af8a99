//! Errors of derivatives by an index.

/// Reason why derivatives by the refractive index of a medium cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IndexDerivativeError {
    /// The scene has no such medium.
    #[error("the scene has no medium number {0}")]
    Medium(usize),
    /// The field has no parameters.
    #[error("the index of '{0}' has no parameters to differentiate by")]
    Parameters(String),
    /// The field is uniform although its type allows variation.
    #[error(
        "the index of '{0}' is constant, so rays would step over its changes: start from a small delta"
    )]
    Even(String),
    /// The grid smooths its samples, or is stored with fewer.
    #[error(
        "the grid of the index of '{0}' smooths its samples, or is stored with fewer samples: leave 'smoothing' out, and set 'condense' to false"
    )]
    Smoothed(String),
    /// A medium is listed twice.
    #[error("a parameter is listed twice")]
    Twice,
    /// The medium's phase function varies.
    #[error(
        "derivatives by an index need a phase function that is equal everywhere and in all directions, but the phase function of '{0}' varies"
    )]
    Phase(String),
    /// The medium's extinction or albedo is discontinuous between voxels.
    #[error(
        "the {what} of '{name}' jumps from voxel to voxel, so scattered light would jump when rays move: give it a 'gridvolume' with filter_type 'trilinear'"
    )]
    Voxels {
        /// Name of the quantity.
        what: &'static str,
        /// Name of the medium.
        name: String,
    },
    /// The medium's extinction drops to zero at the end of its grid.
    #[error(
        "the grid of the extinction of '{0}' ends within its shapes, where the extinction would jump: let it cover them, or let its outermost samples be 0"
    )]
    Ends(String),
    /// The surroundings scatter or bend rays.
    #[error(
        "derivatives by an index need clear surroundings of constant index: put media that scatter or bend rays into a shape"
    )]
    Surroundings,
    /// The emitter's light is discontinuous.
    #[error(
        "the light of '{kind}' has sharp edges, and derivatives by an index miss the motion of edges: {instead}"
    )]
    Sharp {
        /// Kind of the emitter.
        kind: &'static str,
        /// Alternative to the emitter.
        instead: &'static str,
    },
    /// The surface would hide or scatter light.
    #[error(
        "derivatives by an index need surfaces without silhouettes, which '{0}' is not: only null boundaries of media, and smooth dielectric spheres and ellipsoids, \
         which are the boundary of a medium, have none"
    )]
    Surface(String),
    /// The boundary has an edge.
    #[error(
        "derivatives by an index need boundaries without edges, beyond which rays would miss them: '{0}' does not enclose a volume"
    )]
    Open(String),
    /// A smooth dielectric crosses another boundary.
    #[error(
        "derivatives by an index do not see the edge at which '{0}' and '{1}' cross, where refraction jumps: move them apart, or one into the other"
    )]
    Crossing(String, String),
    /// A tinted dielectric has a silhouette.
    #[error(
        "the light of '{0}' jumps at its silhouette, which derivatives by an index do not see: leave its specular_reflectance at 1"
    )]
    Tinted(String),
    /// The image depends on the number of events of paths, which is discontinuous at silhouettes.
    #[error(
        "rays that bend or are scattered meet '{name}' from outside, and where they graze it they have one event more, which derivatives by an index do not see: {what}"
    )]
    Counted {
        /// Name of the object.
        name: String,
        /// Option that depends on the number of events, and its alternative.
        what: &'static str,
    },
    /// Layers separate light by its optical length.
    #[error(
        "the time gate of light jumps when its optical length changes, which derivatives by an index do not see: give weights of the whole picture, or load the scene with layers by bounces alone"
    )]
    Gates,
    /// Layers separate light by another criterion.
    #[error(
        "derivatives by an index support layers by bounces, not by {0}: give weights of the whole picture"
    )]
    Layers(&'static str),
    /// The edge of a panel is visible.
    #[error("derivatives by an index do not see edges of light: the emitter '{name}' {why}")]
    Panel {
        /// Name of the object.
        name: String,
        /// Reason why the panel is refused.
        why: &'static str,
    },
    /// A volume emits light.
    #[error("derivatives by an index do not support volumes that emit light")]
    Volumes,
    /// The scene covers a period of sound.
    #[error("derivatives by an index need one instant of the sound, not a period")]
    Period,
    /// The scene has volumes of labels.
    #[error("derivatives by an index do not support volumes of labels")]
    Labels,
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
    /// There are too few samples.
    #[error("errors need at least two samples, or two replicates of samples: use more than {0}")]
    Samples(u64),
    /// The sums do not fit into memory.
    #[error("derivatives by {0} numbers do not fit into memory")]
    Memory(usize),
}
