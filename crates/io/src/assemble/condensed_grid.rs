//! A grid that is finer than its field, for those who ask.

/// A grid of the index that is held by fewer samples than it has, as they say the same.
#[derive(Clone, Debug, PartialEq)]
pub struct CondensedGrid {
    /// Type of the volume.
    pub plugin: String,
    /// Name of the file as the scene gives it; `None` if the scene holds the samples.
    pub file: Option<String>,
    /// Number of samples along x, y, z.
    pub size: [usize; 3],
    /// Number of samples that are held.
    pub held: [usize; 3],
    /// By how much n² may differ for this.
    pub tolerance: f64,
}
