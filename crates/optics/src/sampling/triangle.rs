//! Uniform points of a triangle.

/// Samples barycentric coordinates (b₀, b₁) of a uniform point; b₂ = 1 − b₀ − b₁.
pub fn uniform_triangle_sample(u: [f64; 2]) -> [f64; 2] {
    let root = (1.0 - u[0]).sqrt();
    [1.0 - root, u[1] * root]
}

/// Inverts [`uniform_triangle_sample`]: returns the `u` that it maps to barycentric coordinates
/// (b₀, b₁) inside the triangle.
pub fn uniform_triangle_inverse(b: [f64; 2]) -> [f64; 2] {
    let root = 1.0 - b[0];
    let along = if root > 0.0 { b[1] / root } else { 0.0 };
    [1.0 - root * root, along]
}

/// Returns the density per unit of (b₀, b₁): 2 inside, 0 outside. Per unit area it is 1/area.
pub fn uniform_triangle_pdf(b: [f64; 2]) -> f64 {
    if b[0] >= 0.0 && b[1] >= 0.0 && b[0] + b[1] <= 1.0 {
        2.0
    } else {
        0.0
    }
}
