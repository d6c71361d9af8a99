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
    AOV: "aov", "morgana measures quantities of surfaces at the first surface on the curved ray that is not a null boundary, and lengths from the camera; Mitsuba measures them at the first surface of any kind, and lengths from near_clip";
    BECKMANN: "beckmann", "morgana computes Smith's masking in closed form; Mitsuba's fit is up to 0.35 % off";
    BLEND: "blendbsdf", "a mixture with a mirror (conductor, plastic) reflects the weighted sum of its parts; Mitsuba adds the mirror's probability to the density of the other part, and is some percent off";
    BORDER: "border", "pixels at the edge also collect samples from just outside the image, as with sample_border in Mitsuba, whose default is false";
    BUMPS: "bump and normal maps", "under bumpmap and normalmap, smooth interfaces keep their normals, and mirrors are neither flipped nor dimmed; Mitsuba turns, flips and dims all of them";
    CHECKERBOARD: "checkerboard", "as a number, color0 applies to the same fields as it does as a colour; Mitsuba swaps the two colours";
    CLEAR_GLASS: "clear glass", "a dielectric without an interior encloses a clear medium; in Mitsuba the surrounding medium continues inside";
    CLIPPING: "clipping", "near_clip and far_clip clip nothing; Mitsuba's camera would not show everything in this scene (defaults: 0.01 and 10000)";
    CONSTANT_EXTINCTION: "constant extinction", "a heterogeneous medium with a constant sigma_t fills its shape; in Mitsuba it ends at the cube [0, 1]³";
    CURVES: "curves", "curves are triangles, 24 around a tube, and visible from inside; in Mitsuba they are round, and visible only from outside";
    DEPTH: "depth", "passing null, mask or thindielectric is not a bounce for max_depth; Mitsuba counts some of these passages";
    DIRECTIONAL_AREA: "directionalarea", "every integrator finds the light of a directionalarea; in Mitsuba only ptracer does";
    DIRECT_SAMPLES: "direct", "the light of point, spot and directional emitters counts once, for any number of emitter samples; Mitsuba's direct adds the samples up";
    EXTERIOR: "exterior", "without an exterior, the surrounding medium is outside a shape; in Mitsuba no medium is";
    EXT_IOR: "ext_ior", "without an ext_ior, the index outside is the index of the surrounding medium, 1 in empty space; Mitsuba uses air, 1.000277";
    FORMAT: "format", "the command line chooses the file format, with 32-bit numbers; morgana ignores file_format and component_format";
    HIDE_EMITTERS: "hide_emitters", "no light comes straight from emitters, but their surfaces stay visible; Mitsuba shows what lies behind them";
    MASK: "mask", "all light at a partly clear surface counts; Mitsuba's path drops this light if the ray then passes the surface, unless the scene has an environment (volpath does not drop it)";
    MESH_NORMALS: "mesh normals", "light passes smooth interfaces of meshes by the normals of the triangles; Mitsuba interpolates the normals of the vertices, unless face_normals is true";
    MESH_SIDES: "mesh sides", "morgana flips closed meshes that are wound inside out; Mitsuba does not";
    MOMENT: "moment", "second moments are moments of the film's channels, per sample or per replicate of samples; Mitsuba's are moments of X, Y and Z, per sample";
    NESTED_INTEGRATORS: "nested integrators", "the first of several nested integrators renders; Mitsuba writes the images of all";
    PATH_MEDIA: "path in media", "path and ptracer account for media; in Mitsuba only volpath and volpathmis do";
    PLASTIC: "plastic", "the base is up to 2 % brighter under a rough coat and 0.1 % under a smooth one: Mitsuba computes the mean reflectance from below by a coarse sum or a fit";
    POLARIZATION: "polarization", "except with the integrator stokes and meters with 'stokes', filters do not polarise: half or all of the light passes, as in Mitsuba's variants without polarisation";
    PRINCIPLED_THIN: "principledthin", "facets of a sheet transmit light towards the mirror image of every direction into which they reflect; Mitsuba leaves out steep facets, in one direction of light only";
    RADIANCEMETER: "radiancemeter", "a radiancemeter measures a cone that is 0.001° wide; in Mitsuba it measures along one ray";
    ROTATED_GRID: "rotated grid", "a rotated grid ends at its own cube; in Mitsuba it fills the box around this cube that is parallel to the axes";
    ROTATE: "rotate", "the length of a rotation's axis vector does not matter; in Mitsuba a length other than 1 shears";
    SAMPLE_COUNT: "sample_count", "the default is 64 samples per pixel; in Mitsuba it is 4";
    SENSOR_MEDIUM: "sensor medium", "the sensor is in the medium that surrounds it; in Mitsuba it is in no medium unless it names one";
    SDFGRID: "sdfgrid", "the surface consists of triangles with corners on the exact surface, about twelve in a cell of the grid; in Mitsuba the surface and its normals are curved";
    SPECTRA: "spectra", "blackbody, regular and irregular spectra become colours as lists do, and sigma_t may exceed 1; Mitsuba cannot evaluate these spectra in its rgb variants, and clips sigma_t to 1";
    SUNSKY: "sunsky", "the sky is an image whose rows are 0.35° apart, and the sun a uniformly bright disc, within 1 % of Mitsuba's; negative radiances become 0";
    TEXTURED_SPHERE: "textured sphere", "a sphere whose radiance is a texture lights the scene as it looks; in Mitsuba a rotated one does not";
    TWO_SIDED: "twosided", "triangles determine which side of a twosided mesh is visible; in Mitsuba the normals of vertices do, and light edges where these normals lean away";
    VERTEX_COLOURS: "vertex colours", "morgana decodes integers from sRGB; Mitsuba uses them unchanged, from 0 to 255";
    WRAP_MODE: "wrap_mode", "grids continue their outermost samples, whatever wrap_mode is; in Mitsuba repeat blends them with samples of the opposite face, half a cell deep, and surfaces beyond the grid see it again";
}
