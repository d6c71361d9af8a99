//! Why derivatives by an index are not taken.

/// Why derivatives by the refractive index of a medium are not taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IndexDerivativeError {
    /// A medium that the scene does not have.
    #[error("the scene has no medium number {0}")]
    Medium(usize),
    /// A field without parameters.
    #[error("the index of '{0}' has no parameters to differentiate by")]
    Parameters(String),
    /// A field that is even although it need not be.
    #[error(
        "the index of '{0}' is the same everywhere, so that rays would step over what is differentiated: start from a small delta"
    )]
    Even(String),
    /// A grid that smooths its samples, or is held by fewer.
    #[error(
        "the grid of the index of '{0}' smooths its samples, or is held by fewer: leave 'smoothing' out, and set 'condense' to false"
    )]
    Smoothed(String),
    /// The same medium twice.
    #[error("a parameter is listed twice")]
    Twice,
    /// A medium whose phase function varies.
    #[error(
        "derivatives by an index need media whose phase function is the same everywhere, which that of '{0}' is not"
    )]
    Phase(String),
    /// A medium whose extinction or albedo jumps between voxels.
    #[error(
        "the {what} of '{name}' jumps from voxel to voxel, where what is scattered would jump when rays move: give it a 'gridvolume' with filter_type 'trilinear'"
    )]
    Voxels {
        /// The quantity.
        what: &'static str,
        /// The medium.
        name: String,
    },
    /// A medium whose extinction jumps to zero where its grid ends.
    #[error(
        "the grid of the extinction of '{0}' ends within its shapes, where the extinction would jump: let it cover them, or let its outermost samples be 0"
    )]
    Ends(String),
    /// The surroundings scatter or bend rays.
    #[error(
        "derivatives by an index need surroundings that are clear and of constant index: put what scatters or bends rays into a shape with a boundary"
    )]
    Surroundings,
    /// Light that jumps.
    #[error(
        "the light of '{kind}' jumps where rays move, which derivatives by an index do not see: {instead}"
    )]
    Sharp {
        /// Kind of the emitter.
        kind: &'static str,
        /// What may stand in its place.
        instead: &'static str,
    },
    /// A surface that would hide or scatter light.
    #[error(
        "derivatives by an index need surfaces without silhouettes, which '{0}' is not: only null boundaries of media, and smooth dielectric spheres and ellipsoids, \
         which are the boundary of a medium, have none"
    )]
    Surface(String),
    /// A boundary with an edge.
    #[error(
        "derivatives by an index need boundaries without edges, beyond which rays would miss them: '{0}' does not enclose a volume"
    )]
    Open(String),
    /// A smooth dielectric that crosses another boundary.
    #[error(
        "derivatives by an index do not see the edge at which '{0}' and '{1}' cross, where refraction jumps: move them apart, or one into the other"
    )]
    Crossing(String, String),
    /// A tinted dielectric with a silhouette.
    #[error(
        "the light of '{0}' jumps at its silhouette, which derivatives by an index do not see: leave its specular_reflectance at 1"
    )]
    Tinted(String),
    /// Paths are told apart by how many events they have, which jumps at silhouettes.
    #[error(
        "rays that bend or are scattered meet '{name}' from outside, and where they graze it they have one event more, which derivatives by an index do not see: {what}"
    )]
    Counted {
        /// The object.
        name: String,
        /// What depends on the number of events, and what may stand in its place.
        what: &'static str,
    },
    /// Light is told apart by its optical length.
    #[error(
        "the time gate into which light falls jumps when its optical length changes, which derivatives by an index do not see: give weights of the whole picture, or load the scene with layers by bounces alone"
    )]
    Gates,
    /// Light is told apart by something else.
    #[error(
        "derivatives by an index know layers by bounces, not by {0}: give weights of the whole picture"
    )]
    Layers(&'static str),
    /// A panel whose edge is seen.
    #[error("derivatives by an index do not see edges of light: the emitter '{name}' {why}")]
    Panel {
        /// The object.
        name: String,
        /// What it must be.
        why: &'static str,
    },
    /// Light that volumes emit.
    #[error("derivatives by an index do not know the light of volumes that emit")]
    Volumes,
    /// Moving sound.
    #[error("derivatives by an index need one instant of the sound, not a period")]
    Period,
    /// Volumes of labels.
    #[error("derivatives by an index do not know volumes of labels")]
    Labels,
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
    /// Too few samples.
    #[error("errors need at least two samples, or replicates of them: take more than {0}")]
    Samples(u64),
    /// Sums do not fit into memory.
    #[error("derivatives by {0} numbers do not fit into memory")]
    Memory(usize),
}
