//! Properties of bsdfs by which paths, connections and scenes treat them.

use super::{Bsdf, BsdfError};

/// Properties of a bsdf, equal at every point of a surface.
#[derive(Clone, Copy, Debug)]
struct Facts {
    /// True if no light passes from one side to the other.
    opaque: bool,
    /// True if every event is a delta.
    delta: bool,
    /// True if some light is reflected by a mirror.
    mirror: bool,
    /// True if some light passes undeflected: [`Bsdf::through`] returns how much.
    partial: bool,
    /// True if facets refract light between the media on the two sides.
    rough_interface: bool,
    /// True if light passes by the geometric normal alone.
    true_surface: bool,
    /// True if the bsdf, or a part of it, scatters by normals of its own.
    perturbs_normals: bool,
    /// True if the bsdf needs [`Surface::tangents`](super::Surface::tangents).
    tangents: bool,
    /// True if scattered light counts as unpolarised.
    depolarizes: bool,
    /// True if the matrices of reflections differ among channels.
    polarizes_by_channel: bool,
    /// True if a nested bsdf is a thin pane. The pane's matrix then applies to only some of the
    /// light that passes undeflected.
    holds_pane: bool,
}

impl Facts {
    const CLEAR: Facts = Facts {
        opaque: false,
        delta: false,
        mirror: false,
        partial: false,
        rough_interface: false,
        true_surface: false,
        perturbs_normals: false,
        tangents: false,
        depolarizes: true,
        polarizes_by_channel: false,
        holds_pane: false,
    };

    const OPAQUE: Facts = Facts {
        opaque: true,
        ..Facts::CLEAR
    };

    const INTERFACE: Facts = Facts {
        delta: true,
        true_surface: true,
        depolarizes: false,
        ..Facts::CLEAR
    };

    const METAL: Facts = Facts {
        depolarizes: false,
        polarizes_by_channel: true,
        ..Facts::OPAQUE
    };

    /// Combines the properties of the parts of an opaque surface.
    fn of_parts(parts: &[Bsdf]) -> Self {
        let mut facts = Facts {
            delta: true,
            depolarizes: false,
            ..Facts::OPAQUE
        };
        for part in parts {
            facts.holds_pane |= matches!(part, Bsdf::ThinDielectric(_));
            let part = part.facts();
            facts.delta &= part.delta;
            facts.mirror |= part.mirror;
            facts.perturbs_normals |= part.perturbs_normals;
            facts.tangents |= part.tangents;
            facts.depolarizes |= part.depolarizes;
            facts.polarizes_by_channel |= part.polarizes_by_channel;
            facts.holds_pane |= part.holds_pane;
        }
        facts
    }
}

impl Bsdf {
    /// Returns the properties of the bsdf.
    fn facts(&self) -> Facts {
        match self {
            Bsdf::Null | Bsdf::Dielectric(_) => Facts::INTERFACE,
            Bsdf::ThinDielectric(_) => Facts {
                partial: true,
                mirror: true,
                ..Facts::INTERFACE
            },
            Bsdf::Filter(_) => Facts {
                partial: true,
                tangents: true,
                ..Facts::INTERFACE
            },
            Bsdf::RoughDielectric(b) => Facts {
                rough_interface: true,
                depolarizes: false,
                tangents: b.is_anisotropic(),
                ..Facts::CLEAR
            },
            Bsdf::Diffuse(_) | Bsdf::RoughDiffuse(_) | Bsdf::RoughPlastic(_) => Facts::OPAQUE,
            Bsdf::Conductor(_) => Facts {
                delta: true,
                mirror: true,
                ..Facts::METAL
            },
            Bsdf::RoughConductor(b) => Facts {
                tangents: b.is_anisotropic(),
                ..Facts::METAL
            },
            Bsdf::Plastic(_) => Facts {
                mirror: true,
                ..Facts::OPAQUE
            },
            Bsdf::PolarizedPlastic(b) => Facts {
                tangents: b.is_anisotropic(),
                ..Facts::OPAQUE
            },
            Bsdf::GlossyDiffuse(b) => Facts {
                tangents: b.is_anisotropic(),
                ..Facts::OPAQUE
            },
            Bsdf::Principled(b) => Facts {
                opaque: !b.transmits(),
                rough_interface: b.transmits(),
                tangents: b.is_anisotropic(),
                ..Facts::CLEAR
            },
            Bsdf::PrincipledThin(b) => Facts {
                tangents: b.is_anisotropic(),
                ..Facts::CLEAR
            },
            Bsdf::Mask(_) => Facts {
                opaque: false,
                partial: true,
                ..Facts::of_parts(self.children())
            },
            Bsdf::NormalMap(b) => {
                let nested = b.nested().facts();
                Facts {
                    opaque: nested.opaque,
                    partial: nested.partial,
                    rough_interface: nested.rough_interface,
                    perturbs_normals: true,
                    tangents: true,
                    ..Facts::of_parts(self.children())
                }
            }
            Bsdf::Coating(b) => {
                let parts = Facts::of_parts(self.children());
                Facts {
                    delta: parts.delta && b.is_smooth(),
                    mirror: parts.mirror || b.is_smooth(),
                    depolarizes: true,
                    polarizes_by_channel: false,
                    ..parts
                }
            }
            Bsdf::Blend(_) => Facts {
                depolarizes: true,
                polarizes_by_channel: false,
                ..Facts::of_parts(self.children())
            },
            Bsdf::TwoSided(_) => Facts::of_parts(self.children()),
        }
    }

    /// Returns true if every event is a delta. Other bsdfs may have some delta events, too: a rough
    /// dielectric where its two indices match, and the coat of plastic. Use
    /// [`BsdfSample::delta`](super::BsdfSample::delta) for these.
    pub fn is_delta(&self) -> bool {
        self.facts().delta
    }

    /// Returns true if some light is reflected by a mirror, where connections do not look for it.
    pub fn is_mirror(&self) -> bool {
        self.facts().mirror
    }

    /// Returns true if some light passes undeflected: [`Bsdf::through`] returns how much.
    pub fn is_partial(&self) -> bool {
        self.facts().partial
    }

    /// Returns true if the bsdf needs [`Surface::tangents`](super::Surface::tangents).
    pub fn uses_tangents(&self) -> bool {
        self.facts().tangents
    }

    /// Returns true if the bsdf, or a part of it, scatters by normals of its own.
    pub(crate) fn perturbs_normals(&self) -> bool {
        self.facts().perturbs_normals
    }

    /// Returns true if light passes by the geometric normal alone, as connections through smooth
    /// interfaces require.
    pub(crate) fn keeps_true_surface(&self) -> bool {
        self.facts().true_surface
    }

    /// Returns true if light passes undeflected through a null boundary.
    pub fn is_null(&self) -> bool {
        matches!(self, Bsdf::Null)
    }

    /// Returns true if facets refract light between the media on the two sides.
    pub fn is_rough_interface(&self) -> bool {
        self.facts().rough_interface
    }

    /// Returns true if no light passes from one side to the other.
    pub fn is_opaque(&self) -> bool {
        self.facts().opaque
    }

    /// Returns true if scattered light counts as unpolarised.
    pub fn depolarizes(&self) -> bool {
        self.facts().depolarizes
    }

    /// Returns true if the matrices of reflections differ among channels.
    pub fn polarizes_by_channel(&self) -> bool {
        self.facts().polarizes_by_channel
    }

    /// Returns true if a nested bsdf is a thin pane. The pane's matrix then applies to only some of
    /// the light that passes undeflected.
    pub fn holds_pane(&self) -> bool {
        self.facts().holds_pane
    }

    /// Returns the bsdf if it is opaque and may be nested in an `outer` one.
    pub(super) fn opaque(self, outer: &'static str) -> Result<Self, BsdfError> {
        if self.is_opaque() {
            Ok(self)
        } else {
            Err(BsdfError::NotOpaque { outer })
        }
    }
}
