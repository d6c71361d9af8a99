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

/// All that this processor has.
#[cfg(test)]
pub(crate) fn all() -> Vec<Level> {
    let widest = Level::new();
    let mut all = vec![Level::baseline(), widest];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        let narrower = [
            widest.as_sse2().map(|l| l.level()),
            widest.as_sse4_2().map(|l| l.level()),
            widest.as_avx2().map(|l| l.level()),
        ];
        all.extend(narrower.into_iter().flatten());
    }
    all
}
