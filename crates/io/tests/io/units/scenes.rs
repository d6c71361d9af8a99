//! Parts of scenes with scalable lengths: `0.4@1` is a length of 0.4, `0.3@-1` an extinction, `5@2`
//! an area or a power.

/// An image of a few pixels by a camera of a kind with further parameters.
pub fn camera(kind: &str, more: &str) -> String {
    format!(
        r#""sensor": {{"type": "{kind}", {more}
          "to_world": [{{"lookat": {{"origin": [0.3@1, 0.4@1, -4@1], "target": [0, 0, 0], "up": [0, 1, 0]}}}}],
          "film": {{"type": "hdrfilm", "width": 4, "height": 3}}}}"#
    )
}

pub fn pinhole() -> String {
    camera("perspective", r#""fov": 35,"#)
}

pub fn sky() -> &'static str {
    r#""sky": {"type": "constant", "radiance": 0.3}"#
}

pub const FLOOR: &str = r#""floor": {"type": "rectangle", "to_world": [{"scale": 3@1}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"translate": [0, -1.5@1, 0]}]}"#;

/// A box of haze with an index, on a floor.
pub fn haze(ior: &str) -> String {
    format!(
        r#"{FLOOR}, "haze": {{"type": "cube", "to_world": [{{"scale": 1@1}}], "bsdf": {{"type": "null"}}, "interior": {{
          "type": "homogeneous", "sigma_t": 0.3@-1, "albedo": 0.9, "ior": {ior}}}}}"#
    )
}

pub const SAMPLES: &str =
    "[[[1.1, 1.3, 1.2, 1.1], [1.4, 1.2, 1.3, 1.1], [1.2, 1.1, 1.2, 1.3], [1.1, 1.3, 1.2, 1.4]],
  [[1.3, 1.2, 1.1, 1.3], [1.2, 1.4, 1.2, 1.1], [1.3, 1.2, 1.4, 1.2], [1.2, 1.1, 1.3, 1.2]],
  [[1.2, 1.1, 1.3, 1.2], [1.1, 1.3, 1.2, 1.4], [1.4, 1.2, 1.1, 1.3], [1.3, 1.2, 1.1, 1.2]],
  [[1.1, 1.2, 1.2, 1.3], [1.3, 1.1, 1.2, 1.2], [1.2, 1.3, 1.2, 1.1], [1.4, 1.1, 1.3, 1.2]]]";

pub fn spline() -> String {
    format!(
        r#"{{"type": "bspline", "data": {SAMPLES}, "placement": "nodes", "to_world": [{{"translate": [-0.5, -0.5, -0.5]}}, {{"scale": 2@1}}]}}"#
    )
}

/// Indices, one for each plugin and notation.
pub fn fields() -> Vec<(&'static str, String)> {
    let in_box =
        r#""placement": "nodes", "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2@1}]"#;
    let sound = r#""dn_dp": 1e-7, "frequency": 1e6, "sound_speed": 500000@1, "time_phase": 0.3"#;
    vec![
        ("constant", r#"{"type": "constant", "value": 1.2}"#.to_owned()),
        ("linear", r#"{"type": "linear", "n0": 1.3, "slope": [0.1@-1, 0.05@-1, 0]}"#.to_owned()),
        (
            "linear_square",
            r#"{"type": "linear_square", "n0": 1.3, "slope": [0.1@-1, 0.05@-1, 0], "origin": [0.1@1, 0, 0]}"#.to_owned(),
        ),
        ("luneburg", r#"{"type": "luneburg", "radius": 2@1, "center": [0.1@1, 0, 0]}"#.to_owned()),
        ("selfoc", r#"{"type": "selfoc", "n0": 1.5, "alpha": 0.3@-1, "direction": [1, 0, 0.5]}"#.to_owned()),
        ("fisheye", r#"{"type": "fisheye", "radius": 2@1}"#.to_owned()),
        (
            "gaussian",
            r#"{"type": "gaussian", "n0": 1, "delta": 0.2, "width": 0.4@1, "center": [0.1@1, 0, 0]}"#.to_owned(),
        ),
        (
            "acoustic",
            r#"{"type": "acoustic", "n0": 1.33, "amplitude": 0.01, "order": 1, "wave_number": 3@-1}"#.to_owned(),
        ),
        (
            "mode",
            format!(
                r#"{{"type": "acoustic", "n0": 1.33, "direction": [1, 0, 0],
                  "a": {{"type": "mode", "pressure": 1e5, {sound}}}, "b": {{"type": "mode", "amplitude": 0.005, "order": 2, "wave_number": 2@-1}}}}"#
            ),
        ),
        (
            "expression",
            r#"{"type": "expression", "n": "1.2 + 0.1*exp(-(r/w)^2) + 0.02*sin(x/w)*y/w", "w": 0.5@1}"#.to_owned(),
        ),
        (
            "expression of the square",
            r#"{"type": "expression", "n2": "1.5 + 0.1/(1 + rho^2/w^2) + 0.1*z/w", "w": 2@1}"#.to_owned(),
        ),
        (
            "profile",
            r#"{"type": "profile", "coordinate": "r", "data": [[0@1, 1.4], [0.5@1, 1.3], [1@1, 1.25], [1.8@1, 1.2]]}"#.to_owned(),
        ),
        (
            "profile along an axis",
            r#"{"type": "profile", "coordinate": "y", "data": [[-1@1, 1.4], [0.5@1, 1.3], [1@1, 1.25]]}"#.to_owned(),
        ),
        (
            "standard_atmosphere",
            r#"{"type": "standard_atmosphere", "metres_per_unit": 2000@-1, "constant": 0.09, "to_world": [{"translate": [0, 0, -1@1]}]}"#.to_owned(),
        ),
        ("bspline", spline()),
        (
            "gladstone_dale",
            format!(r#"{{"type": "gladstone_dale", "data": {SAMPLES}, "constant": 0.09, {in_box}}}"#),
        ),
        (
            "pressure",
            format!(r#"{{"type": "pressure", "n0": 1.3, "dn_dp": 1e-7, "scale": 1e6, "data": {SAMPLES}, {in_box}}}"#),
        ),
        (
            "transducer",
            format!(
                r#"{{"type": "transducer", "aperture": "piston", "diameter": 1@1, "origin": [0, 0, -2@1], "pressure": 1e5, "n0": 1.33, {sound},
                  "min": [-0.9@1, -0.9@1, -0.9@1], "max": [0.9@1, 0.9@1, 0.9@1], "spacing": 0.1@1}}"#
            ),
        ),
        (
            "sum",
            r#"{"type": "sum", "reference": 1.3, "a": {"type": "gaussian", "n0": 1.3, "delta": 0.1, "width": 0.4@1},
              "b": {"type": "linear", "n0": 1.3, "slope": [0.1@-1, 0, 0]}}"#.to_owned(),
        ),
    ]
}

pub fn power(more: &str, kind: &str) -> String {
    format!(
        r#""light": {{"type": "{kind}", "power": 3@2, {more} "to_world": [{{"lookat": {{"origin": [0.2@1, 3@1, -1@1], "target": [0, 0, 0], "up": [0, 0, 1]}}}}]}}"#
    )
}

/// Emitters, each of which lights the scene alone.
pub fn emitters() -> Vec<(&'static str, String)> {
    let above = r#""to_world": [{"lookat": {"origin": [0.2@1, 3@1, -1@1], "target": [0, 0, 0], "up": [0, 0, 1]}}]"#;
    let slide = r#"{"type": "bitmap", "raw": true, "data": [[[0.5], [1]], [[0.2], [0.7]]]}"#;
    let inside = r#""to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 0.8@1}]"#;
    vec![
        ("point", r#""light": {"type": "point", "position": [0.2@1, 3@1, -1@1], "intensity": 5@2}"#.to_owned()),
        ("point inside", r#""light": {"type": "point", "position": [0.2@1, 0.3@1, -0.1@1], "intensity": 5@2}"#.to_owned()),
        ("spot", format!(r#""light": {{"type": "spot", "intensity": 5@2, {above}}}"#)),
        ("projector", format!(r#""light": {{"type": "projector", "fov": 40, "irradiance": 5@2, {above}}}"#)),
        (
            "projector of a slide",
            format!(r#""light": {{"type": "projector", "fov": 40, "irradiance": {slide}, "scale": 5@2, {above}}}"#),
        ),
        ("directional", r#""light": {"type": "directional", "direction": [0.3, -1, 0.2], "irradiance": 2}"#.to_owned()),
        ("constant", r#""light": {"type": "constant"}"#.to_owned()),
        ("sunsky", r#""light": {"type": "sunsky", "sun_direction": [0.3, 1, -0.2], "sun_scale": 0.01, "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}]}"#.to_owned()),
        ("collimated", power(r#""radius": 0.4@1,"#, "collimated")),
        ("collimated, gaussian", power(r#""profile": "gaussian", "radius": 0.3@1,"#, "collimated")),
        ("collimated, rectangle", power(r#""profile": "rectangle", "width": 0.3@1, "height": 0.5@1,"#, "collimated")),
        ("fiber", power(r#""radius": 0.4@1, "cutoff_angle": 20,"#, "fiber")),
        ("fiber, focused", power(r#""radius": 0.4@1, "numerical_aperture": 0.3, "focus": 2@1, "angular_profile": "gaussian","#, "fiber")),
        ("volumelight", format!(r#""light": {{"type": "volumelight", "radiance": 2@-1, {inside}}}"#)),
        ("volumelight of a power", format!(r#""light": {{"type": "volumelight", "power": 9@2, {inside}}}"#)),
        (
            "volumelight of samples",
            format!(r#""light": {{"type": "volumelight", "power": 9@2, "radiance": {{"type": "gridvolume", "data": {SAMPLES}, {inside}}}}}"#),
        ),
        (
            "area",
            r#""light": {"type": "sphere", "center": [0.2@1, 3@1, -1@1], "radius": 0.3@1, "emitter": {"type": "area", "radiance": 20}}"#.to_owned(),
        ),
        (
            "directionalarea",
            r#""light": {"type": "disk", "emitter": {"type": "directionalarea", "radiance": 20},
                "to_world": [{"scale": [0.4@1, 0.4@1, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0.2@1, 3@1, 0]}]}"#.to_owned(),
        ),
    ]
}

/// Shapes with the placeholder `INSIDE` for their surface and medium.
pub fn shapes() -> Vec<(&'static str, &'static str)> {
    vec![
        (
            "sphere",
            r#""type": "sphere", "center": [0.1@1, 0, 0], "radius": 0.9@1, INSIDE"#,
        ),
        (
            "cube",
            r#""type": "cube", "to_world": [{"rotate": {"axis": [1, 2, 3], "angle": 30}}, {"scale": 0.8@1}], INSIDE"#,
        ),
        (
            "cylinder",
            r#""type": "cylinder", "p0": [0, -0.8@1, 0], "p1": [0, 0.8@1, 0.1@1], "radius": 0.7@1, "capped": true, INSIDE"#,
        ),
        (
            "mesh",
            r#""type": "mesh", "vertex_positions": [[0.9@1, 0, -0.7@1], [-0.9@1, 0, -0.7@1], [0, 0.9@1, 0.7@1], [0, -0.9@1, 0.7@1]],
              "faces": [[0, 1, 2], [1, 0, 3], [0, 2, 3], [1, 3, 2]], INSIDE"#,
        ),
        (
            "sdfgrid",
            r#""type": "sdfgrid", "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2@1}], "grid": [
              [[[1], [1], [1]], [[1], [0.5], [1]], [[1], [1], [1]]], [[[1], [0.5], [1]], [[0.5], [-0.5], [0.5]], [[1], [0.5], [1]]],
              [[[1], [1], [1]], [[1], [0.5], [1]], [[1], [1], [1]]]], INSIDE"#,
        ),
    ]
}

/// Surfaces and contents.
pub const INSIDES: [(&str, &str); 3] = [
    (
        "haze",
        r#""bsdf": {"type": "null"}, "interior": {"type": "homogeneous", "sigma_t": 0.7@-1, "albedo": 0.9,
          "ior": {"type": "gaussian", "n0": 1, "delta": 0.2, "width": 0.4@1}}"#,
    ),
    (
        "glass",
        r#""bsdf": {"type": "dielectric"}, "interior": {"type": "transparent", "ior": {"type": "linear", "n0": 1.4, "slope": [0.1@-1, 0, 0]}}"#,
    ),
    ("plaster", r#""bsdf": {"type": "diffuse"}"#),
];

pub fn lit() -> String {
    format!(
        "{}, {FLOOR}, {}, {}",
        pinhole(),
        sky(),
        power(r#""radius": 0.4@1,"#, "collimated")
    )
}
