//! Sampled edges and connections, compared with closed forms.

use crate::common::{camera, container, fog, glass, parts, sky, vacuum};
use eikonal::connect::{InitialGuess, Pattern, RayFamily};
use eikonal::field::{Constant, Fisheye, LinearIndex, LinearSquare, Luneburg};
use eikonal::{Field, Solver, Tolerance};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::emitter::Emitter;
use morgana_transport::path::{
    Connection, ConnectionTarget, Edge, End, Sampling, Start, TransportMode, Vertex, Workspace,
    trace,
};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Cube, Disk, Sphere};
use morgana_transport::{Scene, Spectrum};

fn finish(parts: Parts) -> Scene {
    let tight = Parts {
        tolerance: Tolerance::new(1e-10),
        ..parts
    };
    Scene::new(tight).unwrap()
}

const SAMPLING: Sampling = Sampling {
    mode: TransportMode::Radiance,
    channel_pdf: Spectrum([1.0, 0.0, 0.0, 0.0]),
    extend: false,
    collides: true,
    spans: true,
    parts: false,
    forced: false,
    differentials: true,
    splitting: false,
};

fn edge(scene: &Scene, x: DVec3, direction: DVec3, seed: u64) -> Edge<'_> {
    sampled(scene, x, direction, SAMPLING, seed)
}

fn sampled(scene: &Scene, x: DVec3, direction: DVec3, sampling: Sampling, seed: u64) -> Edge<'_> {
    let start = Start::point(x, direction.normalize(), scene.medium_at(x));
    let mut ws = Workspace::new(scene.tolerance());
    trace(
        scene,
        start,
        sampling,
        &mut Sampler::new(seed, 0, 0),
        &mut ws,
    )
}

fn connections(scene: &Scene, x: DVec3, y: DVec3) -> Vec<Connection> {
    let vertex = Vertex::Volume {
        x,
        direction: DVec3::Z,
        medium: scene.medium_at(x),
    };
    let end = ConnectionEnd::Point {
        position: y,
        surface: None,
    };
    let target = ConnectionTarget::emitter(scene, 0, end);
    let (mut sampler, mut ws) = (Sampler::new(0, 0, 0), Workspace::new(scene.tolerance()));
    ws.search = 1e-300;
    let found = Connection::each(
        scene,
        &vertex,
        &target,
        &mut sampler,
        &mut ws,
        |connection| Some(*connection),
    );
    found
        .into_iter()
        .map(|(connection, _)| connection)
        .collect()
}

fn luneburg_ball(sigma_t: f64) -> Scene {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let objects = vec![container(ball, Bsdf::Null)];
    let media = vec![vacuum(), fog(index, sigma_t, 0.5, 0.9)];
    finish(parts(
        objects,
        media,
        vec![sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ))
}

/// Edges with and without tangents agree, also through boundaries, except for the geometry term.
#[test]
fn edges_do_not_depend_on_their_neighbours() {
    let scene = luneburg_ball(0.7);
    let starts = [DVec3::new(-0.5, 0.3, 0.1), DVec3::new(-1.5, 0.3, 0.1)];
    for (seed, start) in (0..50).flat_map(|seed| starts.map(|start| (seed, start))) {
        let [with, without] = [true, false].map(|differentials| {
            let sampling = Sampling {
                differentials,
                ..SAMPLING
            };
            sampled(&scene, start, DVec3::new(1.0, -0.1, 0.2), sampling, seed)
        });
        assert!(with.connectable && with.geometry.geometry_term > 0.0);
        assert_eq!(without.geometry.geometry_term, 0.0);
        assert!(!without.connectable);
        assert!((with.length - without.length).abs() < 1e-12);
        assert_eq!(with.geometry.depth, without.geometry.depth);
        match (with.end, without.end) {
            (End::Collision(a), End::Collision(b)) => assert!(a.x.distance(b.x) < 1e-12),
            (End::Escaped { direction: a, .. }, End::Escaped { direction: b, .. }) => {
                assert!(a.distance(b) < 1e-12);
            }
            ends => panic!("{ends:?}"),
        }
    }
}

/// A connection inside a Luneburg ball has the directions, the Jacobian and the depth of the
/// harmonic orbit x(σ) = x₀ cos σ + v₀ sin σ. Chord directions and 1/d² would be far off.
#[test]
fn connections_follow_the_harmonic_orbit() {
    let scene = luneburg_ball(0.7);
    let (x, y) = (DVec3::new(-0.5, 0.3, 0.1), DVec3::new(0.4, 0.5, -0.2));
    let found = connections(&scene, x, y);
    assert_eq!(found.len(), 1);
    let connection = &found[0];
    let (n_x2, n_y2) = (2.0 - x.length_squared(), 2.0 - y.length_squared());
    // |v₀|² = n_x² with v₀ = (y − x cos σ)/sin σ is quadratic in cos σ.
    let (xy, both) = (x.dot(y), x.length_squared() + y.length_squared());
    let cos = 0.5 * (xy + (xy * xy - 2.0 * (both - 2.0)).sqrt());
    let (sin, sigma) = ((1.0 - cos * cos).sqrt(), cos.acos());
    let v = (y - x * cos) / sin;
    assert!((v.length_squared() - n_x2).abs() < 1e-7, "not an orbit");
    let arrival = v * cos - x * sin;
    assert!(connection.direction.distance(v.normalize()) < 1e-8);
    assert!(connection.emission.distance(-arrival.normalize()) < 1e-8);
    let j = n_x2 * sin * sin * v.normalize().dot(arrival.normalize());
    assert!((connection.geometry.geometry_term * j * n_y2 - 1.0).abs() < 1e-7);
    assert!((connection.geometry.density(1.0, connection.n_end) * j - 1.0).abs() < 1e-7);
    let steps = 20_000;
    let speed = |s: f64| (v * s.cos() - x * s.sin()).length();
    let h = sigma / steps as f64;
    let length: f64 = (0..steps).map(|i| speed((i as f64 + 0.5) * h) * h).sum();
    assert!((connection.geometry.depth[0] - 0.7 * length).abs() < 1e-7);
    // Check that the naive geometry term and direction are off by far more than any tolerance here.
    assert!((j / x.distance_squared(y) - 1.0).abs() > 0.05);
    assert!(connection.direction.angle_between(y - x) > 0.05);
}

/// The last arc before a boundary counts up to the boundary, not to the end of its step.
#[test]
fn an_edge_is_as_long_as_its_way() {
    let scene = luneburg_ball(1e-9);
    // Along the axis the ray is straight, and two units long inside.
    let edge = edge(&scene, -DVec3::Z * 3.0, DVec3::Z, 1);
    assert!(
        matches!(edge.end, End::Escaped { direction, .. } if direction.distance(DVec3::Z) < 1e-9)
    );
    assert!(
        (edge.geometry.depth[0] / 1e-9 - 2.0).abs() < 1e-8,
        "{}",
        edge.geometry.depth[0]
    );
    // Off the axis all rays cross at the far pole.
    let b: f64 = 0.6;
    let edge = self::edge(&scene, DVec3::new(b, 0.0, -3.0), DVec3::Z, 1);
    let mut inside = edge.spans.iter().filter(|s| s.medium == 1);
    let last = inside.next_back().unwrap();
    assert!(last.arc.position(last.theta_end).distance(DVec3::Z) < 1e-8);
}

/// n sin θ is constant through layers: a ray leaves a graded slab in its original direction,
/// whichever way it bent inside. Refraction computed from the chord inside would break this.
#[test]
fn refraction_uses_the_tangent_of_the_ray() {
    let slab = Cube::new(DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(50.0, 50.0, 0.5)),
        translation: DVec3::ZERO,
    });
    let index: Field = LinearIndex::new(1.5, DVec3::Z * 0.4, DVec3::ZERO)
        .unwrap()
        .into();
    let objects = vec![container(slab.unwrap(), glass())];
    let media = vec![vacuum(), fog(index, 0.0, 0.0, 0.0)];
    let scene = finish(parts(
        objects,
        media,
        vec![sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ));
    let direction = DVec3::new(0.6, 0.2, 0.7).normalize();
    let mut straight_through = 0;
    for seed in 0..40 {
        let edge = edge(&scene, -DVec3::Z * 2.0, direction, seed);
        let End::Escaped { direction: out, .. } = edge.end else {
            panic!("{:?}", edge.end)
        };
        let same_side = DVec3::new(out.x, out.y, out.z.abs());
        assert!(same_side.distance(direction) < 1e-8, "{out}");
        straight_through += u32::from(edge.geometry.events == 2 && out.z > 0.0);
    }
    assert!(straight_through > 20);
}

/// Occlusion is tested along the curved ray: a disc on the chord does not block it, while a disc on
/// the arc does.
#[test]
fn occlusion_follows_the_arc() {
    let index: Field = LinearSquare::new(1.5, DVec3::Y, DVec3::ZERO)
        .unwrap()
        .into();
    let (x, y) = (-DVec3::X, DVec3::X);
    // The ray is a parabola in σ, symmetric about x = 0. Its apex lies at the height that the
    // solver finds.
    let with_disc = |center: Option<DVec3>| {
        let cube = Cube::new(DAffine3::from_scale(DVec3::splat(1.5))).unwrap();
        let mut objects = vec![container(cube, Bsdf::Null)];
        objects.extend(center.map(|center| {
            let to_world = DAffine3 {
                matrix3: DMat3::from_rotation_y(std::f64::consts::FRAC_PI_2) * 0.05,
                translation: center,
            };
            Object {
                name: "stop".into(),
                shape: Disk::new(to_world).unwrap().into(),
                bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
                sides: None,
                emitter: None,
            }
        }));
        let media = vec![vacuum(), fog(index.clone(), 0.0, 0.0, 0.0)];
        let light = Emitter::Point {
            position: y,
            intensity: Spectrum::ONE,
        };
        finish(parts(
            objects,
            media,
            vec![light],
            camera(DVec3::Z * 4.0, DVec3::ZERO),
        ))
    };
    let open = connections(&with_disc(None), x, y);
    assert_eq!(open.len(), 1);
    // dx/dσ is constant: half way in σ the ray is at x = 0, below the chord by a σ²/8 with a = ½.
    let sigma = (y.x - x.x) / (1.5 * open[0].direction.x);
    let sag = 0.5 * sigma.powi(2) / 8.0;
    assert!(sag > 0.1);
    assert_eq!(
        connections(&with_disc(Some(DVec3::ZERO)), x, y).len(),
        1,
        "blocked by the chord"
    );
    assert_eq!(
        connections(&with_disc(Some(-DVec3::Y * sag)), x, y).len(),
        0,
        "not blocked by the arc"
    );
}

/// The ray of the closed form reaches every point of a focused beam, however close to the focus.
#[test]
fn a_beam_is_connected_up_to_its_focus() {
    use morgana_transport::emitter::{BeamProfile, Collimated};
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let profile = BeamProfile::Disc { radius: 0.8 };
    let beam = Collimated::new(-DVec3::Z * 2.0, DVec3::Z, profile, Spectrum::ONE);
    let end = ConnectionEnd::Plane {
        through: beam.origin(),
        direction: DVec3::Z,
        beam: true,
    };
    let objects = vec![container(ball, Bsdf::Null)];
    let media = vec![vacuum(), fog(index, 0.3, 1.0, 0.0)];
    let sensor = camera(DVec3::X * 4.0, DVec3::ZERO);
    let scene = Scene::new(parts(
        objects,
        media,
        vec![Emitter::Collimated(beam)],
        sensor,
    ))
    .unwrap();
    let mut ws = Workspace::new(scene.tolerance());
    let mut sampler = Sampler::new(0, 0, 0);
    let mut missing = Vec::new();
    for before_focus in [1.0, 0.3, 0.1, 0.03, 0.01, 0.003] {
        for impact in [0.05, 0.25, 0.5, 0.75] {
            let start = DVec3::new(
                0.6 * impact,
                0.8 * impact,
                -(1.0f64 - impact * impact).sqrt(),
            );
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 - before_focus).sin_cos();
            let x = start * cos + DVec3::Z * sin;
            let v = (DVec3::Z * cos - start * sin).normalize();
            let vertex = Vertex::Volume {
                x,
                direction: DVec3::X,
                medium: 1,
            };
            let target = ConnectionTarget::emitter(&scene, 0, end);
            let near =
                |connection: &Connection| (connection.direction.distance(-v) < 1e-3).then_some(());
            let found = Connection::each(&scene, &vertex, &target, &mut sampler, &mut ws, near);
            if found.is_empty() {
                missing.push((before_focus, impact));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "{missing:?} of {:?}",
        ws.stats.connections
    );
}

/// Connections use closed forms where nothing bends rays. They agree with the solver's shooting,
/// also through boundaries that are index-matched only by declaration.
#[test]
fn straight_connections_are_those_of_the_solver() {
    let cube = Cube::new(DAffine3::IDENTITY).unwrap();
    let scene = finish(parts(
        vec![container(cube, Bsdf::Null)],
        vec![vacuum(), fog(Constant::new(1.3), 0.7, 0.5, 0.0)],
        vec![sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ));
    assert!(scene.is_straight());
    let ends = [
        (DVec3::new(0.1, 0.2, -0.3), DVec3::new(-0.5, 0.6, 0.4), 0),
        (DVec3::new(0.1, 0.2, -0.3), DVec3::new(2.0, 1.0, 0.5), 1),
        (DVec3::new(-3.0, 0.3, 0.2), DVec3::new(1.7, -0.6, 0.9), 2),
    ];
    for (x, y, crossings) in ends {
        let found = connections(&scene, x, y);
        assert_eq!(found.len(), 1);
        let start = InitialGuess {
            family: RayFamily::Point {
                x,
                direction: (y - x).normalize(),
            },
            region: scene.medium_at(x),
            optical_length: x.distance(y) * scene.n(scene.medium_at(x), x),
            pattern: Pattern::REFRACT,
        };
        let mut solver = Solver::new(scene.tolerance());
        let ray = solver.solve(&scene, &start, y).unwrap();
        let events = solver.pieces().iter().filter_map(|p| p.event);
        assert_eq!(events.clone().count(), crossings);
        let jump: f64 = events
            .map(|e| e.after.length() / e.before.length())
            .product();
        let n = scene.n(scene.medium_at(y), y);
        let geometry = jump / (ray.jacobian * n * n);
        let connection = &found[0];
        assert!(connection.direction.distance(ray.direction_out) < 1e-9);
        assert!((connection.optical_length - ray.optical_length).abs() < 1e-8);
        assert!(
            (connection.geometry.geometry_term / geometry - 1.0).abs() < 1e-8,
            "{crossings}"
        );
        let depth = morgana_transport::path::transmittance(&scene, solver.pieces());
        assert!((connection.geometry.depth.exp_neg()[0] - depth[0]).abs() < 1e-8);
    }
    // Connect to a target closer to a boundary than the offset of rays.
    let found = connections(&scene, DVec3::X * 3.0, DVec3::X * (1.0 - 1e-11));
    assert!(found[0].transmittance()[0].is_finite());
    assert!((found[0].geometry.geometry_term * 4.0 * 1.3 - 1.0).abs() < 1e-8);
}

/// A ray that circles in a fisheye would continue for ever beyond a collision. It is traced for 32
/// radii of the scene, wherever it collides, because densities of distances are taken over this
/// length.
#[test]
fn extensions_of_rays_that_circle_end() {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let index = Fisheye::new(1.5, DVec3::ZERO, 0.2).unwrap();
    let scene = Scene::new(parts(
        vec![container(ball, Bsdf::Null)],
        vec![vacuum(), fog(index, 0.01, 0.5, 0.0)],
        vec![sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ))
    .unwrap();
    let sampling = Sampling {
        extend: true,
        forced: true,
        ..SAMPLING
    };
    let limit = 32.0 * scene.around().radius;
    let (mut early, mut late) = (0, 0);
    let mut ends = Vec::new();
    for seed in 0..40 {
        let edge = sampled(&scene, DVec3::X * 0.2, DVec3::Y, sampling, seed);
        assert!(matches!(edge.end, End::Collision(_)) && edge.forcing == Spectrum::ONE);
        let end = edge.lead().last().unwrap().length_after();
        assert!((limit..limit + 1.0).contains(&end), "{end}");
        early += u32::from(edge.length < end);
        late += u32::from(edge.length > end);
        ends.push(end);
    }
    assert!(early > 5 && late > 5, "{early} {late}");
    assert!(ends.iter().all(|end| *end == ends[0]));
}
