//! Shapes.

use super::parameter::{TO_WORLD, boolean, float, integer, point, tensor, text, word};
use super::row::{many, one, own_plugin, plugin, role};
use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind::{Bsdf, Emitter, Medium, Phase, Sensor, Shape};

const COMMON: &[Parameter] = &[
    TO_WORLD,
    boolean("flip_normals", false, "true to reverse the normals"),
];

const MESH: &[Parameter] = &[
    text("filename", "file with the triangles").required(),
    FACE_NORMALS,
];

const FACE_NORMALS: Parameter = boolean(
    "face_normals",
    false,
    "true to shade each triangle by its own normal instead of the normals of its vertices",
);

const DISTANCES: &[Parameter] = &[
    text(
        "filename",
        "volume file of one channel; give filename or grid",
    ),
    tensor("grid", "distances, (z, y, x, 1), negative inside"),
    word(
        "normals",
        &["smooth", "analytic"],
        "accepted and ignored: the normal of a vertex is the mean over its triangles",
    ),
];

const CURVE: &[Parameter] = &[
    text("filename", "file with the control points").required(),
    float("silhouette_sampling_weight", "accepted and ignored").or(1.0),
];

const HAIR: &[Parameter] = &[
    text("filename", "file with the strands").required(),
    float("radius", "radius of all strands, with the scale of local z")
        .positive()
        .or(0.025),
    float("angle_threshold", "accepted and ignored").or(1.0),
    float("reduction", "accepted and ignored").or(0.0),
];

const ARRAYS: &[Parameter] = &[
    tensor("vertex_positions", "positions of vertices, (n, 3)").required(),
    tensor(
        "faces",
        "indices of vertices from 0, (m, 3), counter-clockwise when seen from the front",
    )
    .required(),
    tensor("vertex_texcoords", "texture coordinates, (n, 2)"),
    tensor(
        "vertex_normals",
        "normals for shading, (n, 3), of any length",
    ),
    tensor("vertex_color", "linear colours of vertices, (n, 3)"),
    FACE_NORMALS,
];

const FLIP: Parameter = boolean("flip_tex_coords", false, "true to replace v by 1 − v")
    .or_computed("true for obj and for corners in ply, else false");

const CHILDREN: &[Slot] = &[
    one(
        Bsdf,
        "The surface; without any, diffuse with reflectance ½, or black if it emits light.",
    ),
    one(Emitter, "An area light."),
    many(Sensor, "Irradiancemeters."),
    role(Medium, "interior", "Medium inside."),
    role(
        Medium,
        "exterior",
        "Medium outside; default: the medium of the surrounding shape.",
    ),
];

const LABELS: &[Parameter] = &[
    text(
        "filename",
        "volume file of labels, whole numbers ≥ 0; give filename or data",
    ),
    tensor("data", "labels, (z, y, x)"),
    text("dataset", "name of the array in the file"),
    text("axis_order", "order of the axes of an array"),
    word(
        "placement",
        &["centers", "nodes"],
        "placement of labels: at the centres of voxels",
    ),
    boolean(
        "use_grid_bbox",
        false,
        "true to use the box of a .vol file instead of the unit cube",
    ),
    TO_WORLD,
    word(
        "surface",
        &["voxels", "smooth"],
        "surface between labels of different index: the faces of voxels, or smoothed",
    ),
    boolean(
        "refraction",
        true,
        "true to refract and reflect light where the index jumps",
    ),
    tensor(
        "properties",
        "mu_a, mu_s, g, n of labels 0, 1, ...: (labels, 4); instead of media",
    ),
];

const TETRAHEDRA: &[Parameter] = &[
    text(
        "filename",
        "JMesh file with the arrays; give filename, or nodes, elements and regions",
    ),
    tensor("nodes", "positions of nodes, (n, 3)"),
    tensor(
        "elements",
        "four nodes of each tetrahedron, numbered from 0 or from 1: (m, 4), or (m, 5) with the region",
    ),
    tensor(
        "regions",
        "region of each tetrahedron, whole numbers ≥ 0: (m,)",
    ),
    TO_WORLD,
    boolean(
        "refraction",
        true,
        "true to refract and reflect light where the index jumps",
    ),
    tensor(
        "properties",
        "mu_a, mu_s, g, n of regions 0, 1, ...: (regions, 4); instead of media",
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
        "Medium outside and of label 0; default: the surrounding medium.",
    ),
    one(
        Phase,
        "The phase function of all rows of properties, instead of their g.",
    ),
    many(Sensor, "Irradiancemeters at the surface around all labels."),
];

const SPHERE: &[Parameter] = &[
    point("center", "centre, local units").or_triple([0.0, 0.0, 0.0]),
    float("radius", "radius, local units").positive().or(1.0),
];

const CYLINDER: &[Parameter] = &[
    point("p0", "first end of the axis").or_triple([0.0, 0.0, 0.0]),
    point("p1", "second end of the axis").or_triple([0.0, 0.0, 1.0]),
    float("radius", "radius, local units").positive().or(1.0),
    boolean("capped", false, "true to close the ends"),
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin(
        "sphere",
        "A sphere or ellipsoid.",
        &[SPHERE, COMMON],
        CHILDREN,
    ),
    plugin("cube", "The cube [-1, 1]³.", &[COMMON], CHILDREN),
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
        "The side of a cylinder, optionally with caps.",
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
        "Triangles in the scene itself.",
        &[ARRAYS, COMMON],
        CHILDREN,
    ),
    plugin(
        "serialized",
        "A mesh in Mitsuba's own format.",
        &[
            MESH,
            &[integer("shape_index", "number of the mesh in the file")
                .at_least(0.0)
                .or(0.0)],
            COMMON,
        ],
        CHILDREN,
    ),
    own_plugin(
        "gltf",
        "Triangles of all nodes of the scene in a glTF file.",
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
        "Balls swept along lines.",
        &[CURVE, COMMON],
        CHILDREN,
    ),
    own_plugin(
        "hair",
        "Strands of hair of Mitsuba 0.6: balls swept along lines.",
        &[HAIR, COMMON],
        CHILDREN,
    ),
    plugin(
        "sdfgrid",
        "The surface where distances on a grid over [0, 1]³ are zero.",
        &[DISTANCES, COMMON],
        CHILDREN,
    ),
    own_plugin(
        "labels",
        "A volume of labelled voxels with a medium for each label.",
        &[LABELS],
        LABEL_CHILDREN,
    ),
    own_plugin(
        "tetrahedra",
        "A mesh of tetrahedra with a medium for each region.",
        &[TETRAHEDRA],
        LABEL_CHILDREN,
    ),
    plugin(
        "merge",
        "Several shapes, with their own bsdfs and media.",
        &[],
        &[many(Shape, "The shapes.")],
    ),
    plugin(
        "shapegroup",
        "A group of shapes that instances copy.",
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
