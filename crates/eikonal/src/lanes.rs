//! Which vector instructions are used.

use fearless_simd::{Level, Simd};

/// The vector instructions to use: the widest that this processor has, up to four lanes. With eight the
/// additions take less time and the moves between lanes more.
pub(crate) fn level() -> Level {
    let widest = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let widest = widest.as_avx2().map_or(widest, |avx2| avx2.level());
    widest
}
