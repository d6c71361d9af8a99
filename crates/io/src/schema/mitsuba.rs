//! Plugins and parameters in which morgana and Mitsuba 3.9.1 differ.

use super::find;
use crate::scene::PluginKind;

/// Parameters and roles that Mitsuba has for no plugin of a kind.
const PARAMETERS: &[(PluginKind, &[&str])] = &[
    (PluginKind::Bsdf, &["ext_eta", "lossless"]),
    (
        PluginKind::Film,
        &[
            "bin_width",
            "decomposition",
            "max_bounces",
            "max_bound",
            "min_bound",
            "reweight",
            "speed_of_light",
            "wavelengths",
        ],
    ),
    (
        PluginKind::Integrator,
        &["reference_index", "reflections", "tolerance"],
    ),
    (
        PluginKind::Medium,
        &[
            "blood",
            "emission",
            "fat",
            "fluorescence_wavelengths",
            "fluorophore_sigma_a",
            "ior",
            "lifetime",
            "material",
            "melanin",
            "metres_per_unit",
            "number_density",
            "quantum_yields",
            "saturation",
            "sigma_a",
            "sigma_s",
            "tissue",
            "velocity",
            "volume_fraction",
            "water",
        ],
    ),
    (PluginKind::Phase, &["quantiles"]),
    (
        PluginKind::Sampler,
        &["adaptive", "bending", "phases", "replicate_size"],
    ),
    (
        PluginKind::Sensor,
        &[
            "aperture",
            "bin_width",
            "blade_angle",
            "blades",
            "center",
            "cosine_axis",
            "cosine_bins",
            "delays",
            "diffraction",
            "focus_point",
            "max_bound",
            "max_records",
            "metres_per_unit",
            "min_bound",
            "modulation_frequencies",
            "normalization",
            "nu",
            "numerical_aperture",
            "nv",
            "obscuration",
            "orders",
            "parts",
            "radius",
            "records",
            "stokes",
            "tagged",
            "vane_angle",
            "vane_width",
            "vanes",
            "wavelength",
            "weight_windows",
        ],
    ),
    (PluginKind::Shape, &["capped"]),
    (
        PluginKind::Volume,
        &["axis_order", "dataset", "offset", "placement", "scale"],
    ),
];

/// Parameters that Mitsuba has for other plugins of a kind, but not for these plugins.
const OF_OTHERS: &[(PluginKind, &str, &[&str])] = &[
    (PluginKind::Emitter, "envmap", &["data"]),
    (PluginKind::Emitter, "projector", &["fov_axis"]),
    (PluginKind::Integrator, "aov", &["max_depth", "rr_depth"]),
    (PluginKind::Integrator, "depth", &["max_depth", "rr_depth"]),
    (PluginKind::Integrator, "direct", &["rr_depth"]),
    (PluginKind::Integrator, "ptracer", &["block_size"]),
    (PluginKind::Sampler, "multijitter", &["strength"]),
    (PluginKind::Sampler, "stratified", &["strength"]),
];

const DERIVATIVES: &str =
    "render with 'path', and compute derivatives in Python by morgana.derivatives";
const MEASURED: &str = "tables of measured reflectances are not read: fit a 'principled' or a 'roughconductor' to them";
const ELLIPSOIDS: &str = "Gaussian splats are not read: media take their extinction from a 'gridvolume', and an ellipsoid is a 'sphere' whose to_world has a scale along each axis";

/// Plugins of Mitsuba 3.9.1 or earlier that morgana does not have, each with advice on substitutes.
const ABSENT: &[(PluginKind, &str, &str)] = &[
    (PluginKind::Bsdf, "measured", MEASURED),
    (PluginKind::Bsdf, "measured_polarized", MEASURED),
    (
        PluginKind::Bsdf,
        "hair",
        "hairs are not modelled: use 'roughplastic', or 'principled' with spec_trans, on curves",
    ),
    (
        PluginKind::Bsdf,
        "hk",
        "a thin scattering layer is a medium here: give a thin shape the bsdf 'null', or 'dielectric', and an interior",
    ),
    (
        PluginKind::Bsdf,
        "irawan",
        "woven cloth is not modelled: use 'roughdiffuse', or 'principled' with sheen",
    ),
    (
        PluginKind::Emitter,
        "timed_sunsky",
        "use 'sunsky', for one time; mean over times by several renders",
    ),
    (
        PluginKind::Film,
        "specfilm",
        "use 'hdrfilm' with the pixel_format 'spectral' and 'wavelengths', and add its channels with the response as weights",
    ),
    (PluginKind::Integrator, "prb", DERIVATIVES),
    (PluginKind::Integrator, "prb_basic", DERIVATIVES),
    (PluginKind::Integrator, "prbvolpath", DERIVATIVES),
    (PluginKind::Integrator, "prb_projective", DERIVATIVES),
    (PluginKind::Integrator, "direct_projective", DERIVATIVES),
    (
        PluginKind::Phase,
        "microflake",
        "use 'sggx': fibres along z have the S '1, 1, 0.01, 0, 0, 0'",
    ),
    (
        PluginKind::Phase,
        "kkay",
        "use 'sggx', whose flakes can be aligned like fibres",
    ),
    (
        PluginKind::Shape,
        "blender",
        "meshes from the memory of Blender are not read: export the scene, which writes them as 'ply' or 'serialized'",
    ),
    (PluginKind::Shape, "ellipsoids", ELLIPSOIDS),
    (PluginKind::Shape, "ellipsoidsmesh", ELLIPSOIDS),
    (
        PluginKind::Texture,
        "gridtexture",
        "lines of a grid are not modelled: use a 'bitmap' of one cell, which repeats",
    ),
    (
        PluginKind::Texture,
        "wireframe",
        "edges of triangles are not modelled: use a 'bitmap'",
    ),
    (
        PluginKind::Texture,
        "curvature",
        "curvature is not modelled: use a 'mesh_attribute' of the vertices",
    ),
];

/// Returns advice on a plugin that Mitsuba has and morgana does not: the plugins to use instead.
pub(crate) fn substitute(kind: PluginKind, name: &str) -> Option<&'static str> {
    let mut absent = ABSENT.iter();
    let row = absent.find(|(of, this, _)| *of == kind && *this == name)?;
    Some(row.2)
}

/// Returns advice on a plugin like [`substitute`], whatever the kind of the plugin.
pub(crate) fn substitute_of_any_kind(name: &str) -> Option<&'static str> {
    let row = ABSENT.iter().find(|(_, this, _)| *this == name)?;
    Some(row.2)
}

/// Returns true if Mitsuba has the plugin.
pub(crate) fn has_plugin(kind: PluginKind, name: &str) -> bool {
    find(kind, name).is_none_or(|plugin| plugin.in_mitsuba)
}

/// Returns true if Mitsuba's `plugin` has a parameter or a role `name`.
pub(crate) fn has_parameter(kind: PluginKind, plugin: &str, name: &str) -> bool {
    let mut others = OF_OTHERS.iter();
    let lacks =
        others.any(|(of, this, names)| *of == kind && *this == plugin && names.contains(&name));
    !lacks && !lists(PARAMETERS, kind, name)
}

fn lists(table: &[(PluginKind, &[&str])], kind: PluginKind, name: &str) -> bool {
    let mut rows = table.iter().filter(|(of, _)| *of == kind);
    rows.any(|(_, names)| names.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::plugins;

    #[test]
    fn plugins_that_are_missing_are_missing() {
        for (kind, name, _) in ABSENT {
            assert!(plugins(*kind).iter().all(|p| p.name != *name), "{name}");
        }
    }

    /// Add a new parameter to the tables above. If Mitsuba has it too, change only this number.
    #[test]
    fn parameters_that_mitsuba_has_are_counted() {
        let kinds = PluginKind::ALL.into_iter();
        let kinds = kinds.filter(|kind| *kind != PluginKind::Scene);
        let all = kinds.flat_map(|kind| plugins(kind).iter().map(move |plugin| (kind, plugin)));
        let shared = all.filter(|(kind, plugin)| has_plugin(*kind, plugin.name));
        let count = |(kind, plugin): (PluginKind, &crate::schema::Plugin)| {
            let names = plugin.parameters().map(|parameter| parameter.name);
            names
                .filter(|name| has_parameter(kind, plugin.name, name))
                .count()
        };
        assert_eq!(shared.map(count).sum::<usize>(), 353);
    }
}
