//! Beams, fibres and emitting volumes.

use super::*;

/// An emitter of a plugin with given contents, along +z from (0, 0, −3).
fn beam(plugin: &str, contents: &str) -> String {
    format!(
        "<emitter type=\"{plugin}\"><transform name=\"to_world\"><translate z=\"-3\"/></transform>{contents}</emitter>"
    )
}

const POWER: &str = "<float name=\"power\" value=\"1\"/>";
const CONE: &str = "<float name=\"cutoff_angle\" value=\"10\"/>";

#[test]
fn apertures_that_are_refused() {
    let float = |name: &str, value: f64| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let string = |name: &str, value: &str| format!("<string name=\"{name}\" value=\"{value}\"/>");
    let rectangle = "<string name=\"profile\" value=\"rectangle\"/>";
    let picture = "<texture name=\"texture\" type=\"checkerboard\"/>";
    for (plugin, contents, expected) in [
        ("collimated", String::new(), "power"),
        (
            "collimated",
            format!("{POWER}{}", float("irradiance", 1.0)),
            "give 'power' or 'irradiance' of the beam, not both",
        ),
        (
            "collimated",
            format!("{POWER}{rectangle}{}", float("width", -1.0)),
            "width",
        ),
        (
            "collimated",
            format!("{POWER}{rectangle}{picture}"),
            "a texture of type 'checkerboard' does not belong here",
        ),
        (
            "fiber",
            format!("{POWER}{CONE}{picture}"),
            "a texture needs the profile 'rectangle'",
        ),
        ("fiber", POWER.into(), "numerical_aperture"),
        (
            "fiber",
            format!("{POWER}{CONE}{}", float("numerical_aperture", 0.2)),
            "give the numerical aperture or the cutoff_angle, not both",
        ),
        (
            "fiber",
            format!("{POWER}{}", float("numerical_aperture", 1.2)),
            "the numerical aperture of the fibre is 1.2 times the index",
        ),
        (
            "fiber",
            format!("{POWER}{}", float("cutoff_angle", 181.0)),
            "cutoff_angle",
        ),
        (
            "fiber",
            format!(
                "{POWER}{}{}",
                float("cutoff_angle", 91.0),
                string("angular_profile", "lambertian")
            ),
            "cutoff_angle",
        ),
        (
            "fiber",
            format!("{POWER}{}", string("angular_profile", "angles")),
            "angles",
        ),
        (
            "fiber",
            format!(
                "{POWER}{}{}",
                string("angular_profile", "angles"),
                string("angles", "0, 200")
            ),
            "from 0 to 180 degrees, not 200",
        ),
        (
            "fiber",
            format!(
                "{POWER}{}{}",
                string("angular_profile", "slopes"),
                string("slopes", "0.1, 0.2")
            ),
            "needs the profile 'rectangle'",
        ),
        (
            "fiber",
            format!(
                "{POWER}{rectangle}{}{}",
                string("angular_profile", "slopes"),
                string("slopes", "0.1")
            ),
            "two standard deviations above 0",
        ),
        (
            "collimated",
            format!(
                "{POWER}{}{}",
                float("radius", 1.0),
                float("inner_radius", 1.0)
            ),
            "inner_radius",
        ),
        (
            "fiber",
            format!("{POWER}{CONE}{}", float("focus", 0.0)),
            "the focus must not lie in the aperture",
        ),
        ("fiber", CONE.into(), "power"),
        (
            "collimated",
            format!("{POWER}{}", float("radius", 1e-200)),
            "the aperture is too small or too large",
        ),
    ] {
        refused(&beam(plugin, &contents), &["scene.xml:", expected]);
    }
    let skewed =
        "<emitter type=\"collimated\"><transform name=\"to_world\"><scale x=\"2\"/></transform>";
    refused(
        &format!("{skewed}{rectangle}{POWER}</emitter>"),
        &["a rectangle of light can only be rotated"],
    );
}

#[test]
fn volumes_of_light() {
    let volume = |contents: &str| format!("<emitter type=\"volumelight\">{contents}</emitter>");
    let radiance = |value: f64| format!("<float name=\"radiance\" value=\"{value}\"/>");
    let power = |body: &str| {
        let loaded = load(&volume(body)).unwrap_or_else(|e| panic!("{e}"));
        let emitters = loaded.scene().emitters();
        let light = emitters.iter().find_map(|e| match e {
            Emitter::Volume(volume) => Some(volume.power()[0]),
            _ => None,
        });
        light.unwrap()
    };
    let placed = "<transform name=\"to_world\"><scale x=\"2\" y=\"1\" z=\"0.5\"/><translate x=\"7\"/></transform>";
    let expected = 4.0 * std::f64::consts::PI * 3.0;
    let constant = format!(
        "<volume name=\"radiance\" type=\"constvolume\"><float name=\"value\" value=\"3\"/>{placed}</volume>"
    );
    for body in [format!("{}{placed}", radiance(3.0)), constant.clone()] {
        assert!((power(&body) / expected - 1.0).abs() < 1e-12, "{body}");
        let given = power(&format!("{body}<float name=\"power\" value=\"5\"/>"));
        assert!((given / 5.0 - 1.0).abs() < 1e-12);
    }
    refused(
        &volume(&radiance(-1.0)),
        &["scene.xml:8:", "light must not be negative"],
    );
    assert_eq!(power(&radiance(0.0)), 0.0);
    refused(
        &volume(&format!(
            "{}<float name=\"power\" value=\"1\"/>",
            radiance(0.0)
        )),
        &[
            "scene.xml:8:",
            "black in a channel in which the light has power",
        ],
    );
    refused(&volume(&radiance(1e308)), &["scene.xml:8:"]);
    refused(
        &volume(&constant.replace("constvolume", "sellmeier")),
        &[
            "scene.xml:8:",
            "a volume of type 'sellmeier' does not belong here",
        ],
    );
    refused(
        &volume("<rgb name=\"radiance\" value=\"1, 0, 1\"/><float name=\"power\" value=\"1\"/>"),
        &["black in a channel in which the light has power"],
    );
    refused(
        &volume("<transform name=\"to_world\"><scale x=\"0\"/></transform>"),
        &["scale of zero"],
    );
    warned(
        &volume(&format!("{constant}{placed}")),
        "'to_world' has no effect",
    );
}

#[test]
fn apertures_that_draw_warnings() {
    let radius = "<float name=\"radius\" value=\"0.1\"/>";
    let rectangle =
        "<string name=\"profile\" value=\"rectangle\"/><float name=\"height\" value=\"1\"/>";
    warned(
        &beam("collimated", &format!("{POWER}{rectangle}{radius}")),
        "'radius' has no effect",
    );
    let medium = "<medium name=\"interior\" type=\"homogeneous\"/>";
    let ball = ball(medium).replace("<bsdf", "<float name=\"radius\" value=\"3\"/><bsdf");
    // The fibre is outside the ball on whose surface it ends.
    let loaded = load(&format!(
        "{ball}{}",
        beam("fiber", &format!("{POWER}{CONE}{radius}"))
    ));
    let warnings = loaded
        .unwrap_or_else(|e| panic!("{e}"))
        .warnings
        .to_string();
    assert!(!warnings.contains("fibre"), "{warnings}");
}

/// With `path`, only connections find it.
#[test]
fn narrow_fibres_are_not_for_paths() {
    let beam = |focus: f64| {
        let contents = format!(
            "{POWER}<float name=\"cutoff_angle\" value=\"0.01\"/><float name=\"radius\" value=\"0.5\"/><float name=\"focus\" value=\"{focus}\"/>"
        );
        beam("fiber", &contents)
    };
    let by = |integrator: &str, focus: f64| {
        format!("<integrator type=\"{integrator}\"/>{}", beam(focus))
    };
    warned(&by("path", 5.0), "so narrow that only about one connection");
    for body in [by("bdpt", 5.0), by("path", 500.0), beam(5.0)] {
        let loaded = load(&body).unwrap_or_else(|e| panic!("{e}"));
        let warnings = loaded.warnings.to_string();
        assert!(!warnings.contains("narrow"), "{warnings}");
    }
}

/// sin θ₀ = NA/n with the index of the medium in which the fibre ends.
#[test]
fn numerical_apertures_depend_on_the_index() {
    let aperture =
        "<float name=\"numerical_aperture\" value=\"0.5\"/><float name=\"radius\" value=\"0.1\"/>";
    let medium = "<medium name=\"interior\" type=\"homogeneous\"><float name=\"ior\" value=\"1.25\"/></medium>";
    for (radius, sin) in [(1.0, 0.5), (3.5, 0.4)] {
        let ball = ball(medium).replace(
            "<bsdf type=\"null\"/>",
            &format!("<float name=\"radius\" value=\"{radius}\"/><bsdf type=\"dielectric\"/>"),
        );
        let body = format!("{ball}{}", beam("fiber", &format!("{POWER}{aperture}")));
        let loaded = load(&body).unwrap_or_else(|e| panic!("{e}"));
        let emitters = loaded.scene().emitters();
        let fiber = emitters.iter().find_map(|e| match e {
            Emitter::Fiber(fiber) => Some(fiber),
            _ => None,
        });
        assert!((fiber.unwrap().sin() - sin).abs() < 1e-12);
    }
}
