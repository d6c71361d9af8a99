//! Deliberate differences from Mitsuba 3.9.1: the rows of `docs/mitsuba.md`.

/// Deliberate difference from Mitsuba.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Difference {
    /// Topic, as in the first column of `docs/mitsuba.md`.
    pub topic: &'static str,
    /// Behaviour of morgana and of Mitsuba.
    pub text: &'static str,
}

macro_rules! differences {
    ($($name:ident: $topic:literal, $text:literal;)*) => {
        $(pub(crate) const $name: Difference = Difference { topic: $topic, text: $text };)*

        impl Difference {
            /// List of all differences.
            pub const ALL: &'static [Difference] = &[$($name),*];
        }
    };
}

differences! {
    AOV: "aov", "quantities of surfaces are those of the first one on the curved ray that is no null boundary, and distances start at the camera; Mitsuba's are those of the first of any kind, from near_clip on";
    BECKMANN: "beckmann", "masking is Smith's in closed form; Mitsuba's fit is up to 0.35 % off";
    BLEND: "blendbsdf", "a mixture with a mirror (conductor, plastic) is what its parts are; Mitsuba adds the mirror's probability to the other's density, and is some percent off";
    BORDER: "border", "pixels at the edge also collect samples from just outside the image, as with sample_border in Mitsuba, which is off there by default";
    BUMPS: "bump and normal maps", "smooth interfaces keep their normals under bumpmap and normalmap, and mirrors are neither flipped nor dimmed; Mitsuba turns, flips and dims all";
    CHECKERBOARD: "checkerboard", "as a number it has color0 where it has it as a colour; Mitsuba swaps the two";
    CLEAR_GLASS: "clear glass", "a dielectric without an interior encloses clear matter; in Mitsuba the medium around it continues inside";
    CLIPPING: "clipping", "near_clip and far_clip cut nothing; Mitsuba's camera would not see all (0.01 and 10000 by default)";
    CONSTANT_EXTINCTION: "constant extinction", "a heterogeneous medium with the same sigma_t everywhere fills its shape; in Mitsuba it ends at the cube [0, 1]³";
    CURVES: "curves", "curves are triangles, 24 around a tube, and visible from within; Mitsuba's are round, and are seen from outside only";
    DEPTH: "depth", "passing null, mask or thindielectric is no bounce for max_depth; Mitsuba counts some of them";
    DIRECT_SAMPLES: "direct", "the light of point, spot and directional emitters counts once, however many samples are taken of it; Mitsuba's direct adds them up";
    EXTERIOR: "exterior", "without an exterior the medium around a shape lies outside it; in Mitsuba nothing does";
    EXT_IOR: "ext_ior", "without an ext_ior the index outside is that of the medium there, 1 if that is empty; Mitsuba takes air, 1.000277";
    FORMAT: "format", "files are written as the command line says, in 32 bits; file_format and component_format are ignored";
    HIDE_EMITTERS: "hide_emitters", "no light comes straight from emitters, whose surfaces stay; Mitsuba shows what lies behind these";
    MASK: "mask", "light is found at surfaces of which a share is clear; Mitsuba's path drops it where the ray then passes, unless the scene has an environment: its volpath does not";
    MESH_NORMALS: "mesh normals", "light passes smooth interfaces of meshes by the normals of the triangles; Mitsuba's by those interpolated between the vertices, unless face_normals is true";
    MESH_SIDES: "mesh sides", "closed meshes that are wound inside out are flipped; Mitsuba leaves them";
    MOMENT: "moment", "second moments are those of the film's channels, per sample or per replicate of samples; Mitsuba's are those of X, Y and Z of each sample";
    NESTED_INTEGRATORS: "nested integrators", "of several nested integrators the first renders; Mitsuba's write the images of all";
    PATH_MEDIA: "path in media", "path and ptracer account for media; in Mitsuba only volpath and volpathmis do";
    PLASTIC: "plastic", "the base is up to 2 % brighter under a rough coat, 0.1 % under a smooth one: Mitsuba's mean reflectance from below is a coarse sum or a fit";
    POLARIZATION: "polarization", "except for the integrator stokes and meters with 'stokes', filters do not polarize: they let half of the light, or all, pass, as in Mitsuba's variants that are not polarized";
    PRINCIPLED_THIN: "principledthin", "facets of a sheet transmit to wherever a mirror image would be; Mitsuba leaves steep ones out, one way only";
    RADIANCEMETER: "radiancemeter", "a radiancemeter sees a cone that is 0.001° wide; Mitsuba's sees along one ray";
    ROTATED_GRID: "rotated grid", "a grid that is turned ends at its own cube; Mitsuba's fills the box around it that is parallel to the axes";
    ROTATE: "rotate", "a rotation is about an axis, whatever the length of the vector that gives it; Mitsuba shears where that is not 1";
    SAMPLE_COUNT: "sample_count", "64 samples per pixel unless the scene says otherwise; Mitsuba takes 4";
    SENSOR_MEDIUM: "sensor medium", "the sensor is in the medium around it; in Mitsuba it is in none unless it names one";
    SDFGRID: "sdfgrid", "the surface is triangles with corners on it, some twelve in a cell of the grid; Mitsuba's is curved, with normals to match";
    SPECTRA: "spectra", "blackbody, regular and irregular spectra are seen as lists are, and sigma_t may exceed 1; Mitsuba's films of colours cannot evaluate the former, and clip the latter to 1";
    SUNSKY: "sunsky", "the sky is an image whose rows are 0.35° apart, the sun a disc as bright all over, within 1 % of Mitsuba's; what would be negative is black";
    TEXTURED_SPHERE: "textured sphere", "a sphere whose radiance is a texture lights the scene as it looks; Mitsuba's, if turned, does not";
    TWO_SIDED: "twosided", "the side of a twosided mesh that is seen is told by its triangles; Mitsuba tells it by the normals of vertices, and lights edges where these lean away";
    VERTEX_COLOURS: "vertex colours", "whole numbers are decoded from sRGB; Mitsuba takes them as they are, 0 to 255";
    WRAP_MODE: "wrap_mode", "grids continue their outermost samples, whatever wrap_mode says; Mitsuba's repeat blends them with those of the opposite face, half a cell deep, and surfaces beyond the grid see it again";
}
