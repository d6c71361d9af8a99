//! Shapes.

use super::parameter::{TO_WORLD, boolean, float, integer, point, tensor, text, word};
use super::row::{many, one, own_plugin, plugin, role};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Bsdf, Emitter, Medium, Sensor, Shape};

const COMMON: &[Parameter] = &[
    TO_WORLD,
    boolean("flip_normals", false, "turns the normals to the other side"),
];

const MESH: &[Parameter] = &[
    text("filename", "the file with the triangles").required(),
    FACE_NORMALS,
];

const FACE_NORMALS: Parameter = boolean(
    "face_normals",
    false,
    "whether each triangle is shaded by its own normal, not by those of its corners",
);

const DISTANCES: &[Parameter] = &[
    text("filename", "a volume file of one channel; this or grid"),
    tensor("grid", "distances, (z, y, x, 1), negative inside"),
    word(
        "normals",
        &["smooth", "analytic"],
        "accepted and ignored: they are means of those of the triangles around",
    ),
];

const CURVE: &[Parameter] = &[
    text("filename", "the file with the control points").required(),
    float("silhouette_sampling_weight", "accepted and ignored").or(1.0),
];

const HAIR: &[Parameter] = &[
    text("filename", "the file with the strands").required(),
    float("radius", "of all strands, scaled as local z is")
        .positive()
        .or(0.025),
    float("angle_threshold", "accepted and ignored").or(1.0),
    float("reduction", "accepted and ignored").or(0.0),
];

const ARRAYS: &[Parameter] = &[
    tensor("vertex_positions", "positions, (n, 3)").required(),
    tensor(
        "faces",
        "numbers of vertices from 0, (m, 3), counter-clockwise when seen from the front",
    )
    .required(),
    tensor("vertex_texcoords", "texture coordinates, (n, 2)"),
    tensor(
        "vertex_normals",
        "normals for shading, (n, 3), of any length",
    ),
    tensor("vertex_color", "linear colours, (n, 3)"),
    FACE_NORMALS,
];

const FLIP: Parameter = boolean("flip_tex_coords", false, "whether v becomes 1 − v")
    .or_computed("true for obj and for corners in ply, else false");

const CHILDREN: &[Slot] = &[
    one(
        Bsdf,
        "The surface; without any, diffuse with reflectance ½, or black if it emits light.",
    ),
    one(Emitter, "An area light."),
    many(Sensor, "Irradiancemeters."),
    role(Medium, "interior", "The medium inside."),
    role(
        Medium,
        "exterior",
        "The medium outside; that of the shape around it if it is not given.",
    ),
];

const LABELS: &[Parameter] = &[
    text(
        "filename",
        "a volume file of labels, whole numbers ≥ 0; this or data",
    ),
    tensor("data", "the labels, (z, y, x)"),
    text("dataset", "which of the file's arrays"),
    text(
        "axis_order",
        "which axis of an array runs along which axis of space",
    ),
    word(
        "placement",
        &["centers", "nodes"],
        "labels are those of voxels: centers",
    ),
    boolean(
        "use_grid_bbox",
        false,
        "whether the box of a .vol file takes the place of the unit cube",
    ),
    TO_WORLD,
    word(
        "surface",
        &["voxels", "smooth"],
        "where labels of different index meet: at the faces of voxels, or smoothed",
    ),
    boolean(
        "refraction",
        true,
        "whether light is refracted and reflected where the index jumps",
    ),
    tensor(
        "properties",
        "mu_a, mu_s, g, n of labels 0, 1, ...: (labels, 4); in place of media",
    ),
];

const LABEL_CHILDREN: &[Slot] = &[
    many(
        Medium,
        "The media, named by their labels: \"1\", or \"2, 5-7\".",
    ),
    role(
        Medium,
        "exterior",
        "The medium outside and of label 0; that around if it is not given.",
    ),
    many(Sensor, "Irradiancemeters at the surface around all labels."),
];

const SPHERE: &[Parameter] = &[
    point("center", "local units").or_triple([0.0, 0.0, 0.0]),
    float("radius", "local units").positive().or(1.0),
];

const CYLINDER: &[Parameter] = &[
    point("p0", "one end of the axis").or_triple([0.0, 0.0, 0.0]),
    point("p1", "the other end").or_triple([0.0, 0.0, 1.0]),
    float("radius", "local units").positive().or(1.0),
    boolean("capped", false, "whether the ends are closed"),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "sphere",
        "A sphere or ellipsoid.",
        &[SPHERE, COMMON],
        CHILDREN,
    ),
    plugin("cube", "[-1, 1]³.", &[COMMON], CHILDREN),
    plugin(
        "rectangle",
        "[-1, 1]² at z = 0, facing +z.",
        &[COMMON],
        CHILDREN,
    ),
    plugin(
        "disk",
        "The unit disk at z = 0, facing +z.",
        &[COMMON],
        CHILDREN,
    ),
    plugin(
        "cylinder",
        "The side of a cylinder, with caps if wanted.",
        &[CYLINDER, COMMON],
        CHILDREN,
    ),
    plugin(
        "obj",
        "Triangles of an OBJ file.",
        &[MESH, &[FLIP], COMMON],
        CHILDREN,
    ),
    plugin(
        "ply",
        "Triangles of a PLY file.",
        &[MESH, &[FLIP], COMMON],
        CHILDREN,
    ),
    own_plugin(
        "mesh",
        "Triangles that the scene itself holds.",
        &[ARRAYS, COMMON],
        CHILDREN,
    ),
    plugin(
        "serialized",
        "A mesh of Mitsuba's own format.",
        &[
            MESH,
            &[integer("shape_index", "which of the file's meshes")
                .at_least(0.0)
                .or(0.0)],
            COMMON,
        ],
        CHILDREN,
    ),
    own_plugin(
        "gltf",
        "Triangles of all nodes of a glTF file's scene.",
        &[MESH, COMMON],
        CHILDREN,
    ),
    plugin(
        "bsplinecurve",
        "Open tubes along cubic B-splines.",
        &[CURVE, COMMON],
        CHILDREN,
    ),
    plugin(
        "linearcurve",
        "Balls that are swept along lines.",
        &[CURVE, COMMON],
        CHILDREN,
    ),
    own_plugin(
        "hair",
        "Strands of hair of Mitsuba 0.6: balls that are swept along lines.",
        &[HAIR, COMMON],
        CHILDREN,
    ),
    plugin(
        "sdfgrid",
        "Where distances on a grid over [0, 1]³ are zero.",
        &[DISTANCES, COMMON],
        CHILDREN,
    ),
    own_plugin(
        "labels",
        "A volume of labelled voxels, each label a medium.",
        &[LABELS],
        LABEL_CHILDREN,
    ),
    plugin(
        "merge",
        "Shapes, which stay what they are.",
        &[],
        &[many(Shape, "The shapes.")],
    ),
    plugin(
        "shapegroup",
        "Shapes that instances copy.",
        &[],
        &[many(Shape, "The shapes.")],
    ),
    plugin(
        "instance",
        "A copy of a group.",
        &[&[TO_WORLD]],
        &[one(Shape, "The shapegroup.")],
    ),
];
