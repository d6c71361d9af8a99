//! Names of the checks that warn.

use std::fmt;

/// A check that warns of unintended input. Users silence warnings by the name of the check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lint {
    /// Name, such as `no_emitter`.
    pub name: &'static str,
    /// Description of the finding, in one line.
    pub help: &'static str,
}

/// Displays the name.
impl fmt::Display for Lint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Defines constants of [`Lint`], and `ALL` with all of them.
#[macro_export]
macro_rules! lints {
    ($($constant:ident: $name:literal, $help:literal;)*) => {
        $(
            #[doc = $help]
            pub const $constant: $crate::scene::Lint = $crate::scene::Lint { name: $name, help: $help };
        )*

        /// All checks of this module.
        pub const ALL: &[$crate::scene::Lint] = &[$($constant),*];
    };
}

lints! {
    BEAM_ACROSS_MEDIA: "beam_across_media", "A beam that starts partly outside the medium of its centre.";
    FAINT_INTERFACE: "faint_interface", "A rough interface between nearly equal indices.";
    INDEX_JUMP: "index_jump", "A boundary declared index-matched at which the index jumps.";
    NO_EMITTER: "no_emitter", "A scene without light.";
    OPEN_SHAPE: "open_shape", "A medium inside a shape that encloses no volume.";
    SOUND_WAVELENGTH: "sound_wavelength", "Sound whose wavelength and medium differ a thousandfold.";
}
