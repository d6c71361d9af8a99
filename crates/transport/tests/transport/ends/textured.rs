//! Area lights with textures. Powers are compared with closed forms and sums over points, and
//! sampled points with their density.

use crate::ends::support::*;
use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::emitter::{Emitter, TexturedArea, TexturedError};
use morgana_transport::shape::{Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Site, Sphere, Uv};
use morgana_transport::texture::{
    Bitmap, BitmapFilter, Checkerboard, Texture, VertexColours, Wrap,
};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use testkit::{Family, Mass, Rng, Table, uniform_edges};

/// Pixels of an image, 4 across and 3 down.
const PIXELS: [f32; 12] = [1.0, 0.0, 3.0, 2.0, 0.5, 4.0, 1.5, 0.0, 2.0, 0.25, 5.0, 1.0];

fn picture(filter: BitmapFilter, wrap: Wrap, to_uv: DAffine2) -> Texture {
    let bitmap = Bitmap::new([4, 3], 1, PIXELS.to_vec(), filter, wrap, to_uv);
    Texture::Bitmap(Arc::new(bitmap.unwrap()))
}

fn board(colours: [Texture; 2], to_uv: DAffine2) -> Texture {
    Texture::Checkerboard(Arc::new(Checkerboard::new(colours, to_uv)))
}

fn grey(v: f64) -> Texture {
    Texture::Uniform(Spectrum::splat(v))
}

/// A rotation, scale, shear and translation.
fn slanted() -> DAffine2 {
    DAffine2::from_scale_angle_translation(DVec2::new(1.7, -2.3), 0.6, DVec2::new(0.2, 0.9))
        * DAffine2::from_cols(DVec2::X, DVec2::new(0.3, 1.0), DVec2::ZERO)
}

/// A rotation, translation and uniform scale.
fn similarity() -> DAffine3 {
    let turn = DMat3::from_axis_angle(axis(), 0.7);
    DAffine3::from_mat3_translation(turn * 1.3, DVec3::new(0.2, 0.4, -1.0))
}

fn area(shape: &Shape, texture: Texture) -> Emitter {
    Emitter::Textured(Arc::new(TexturedArea::new(0, shape, texture).unwrap()))
}

fn power(shape: &Shape, texture: Texture) -> f64 {
    area(shape, texture).power(&AROUND, |_| shape)[0] / PI
}

/// A fan of three triangles, not in one plane, with texture coordinates.
fn fan() -> Mesh {
    let corners = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::new(1.0, 1.5, 0.2),
        DVec3::new(-0.3, 1.0, 0.0),
        DVec3::new(-2.0, 0.1, 0.4),
    ];
    let uvs = vec![[0.1, 0.2], [1.4, 0.0], [0.9, 1.0], [0.2, 2.1], [-1.0, 0.3]];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]];
    Mesh::new(corners.to_vec(), triangles, Some(uvs)).unwrap()
}

fn rectangle() -> Shape {
    Rectangle::new(random_map(&mut Rng::new(5))).unwrap().into()
}

fn sphere() -> Shape {
    Sphere::new(similarity()).unwrap().into()
}

fn disk() -> Shape {
    Disk::new(random_map(&mut Rng::new(6))).unwrap().into()
}

fn can() -> Shape {
    Cylinder::new(similarity(), true).unwrap().into()
}

/// Mean over the unit square of nearest pixels with weights of rows or columns.
fn mean_of_pixels(weight: impl Fn([f64; 2], [f64; 2]) -> f64) -> f64 {
    let part = |i: usize| {
        let (x, y) = ((i % 4) as f64, (i / 4) as f64);
        let (u, v) = ([x / 4.0, (x + 1.0) / 4.0], [y / 3.0, (y + 1.0) / 3.0]);
        f64::from(PIXELS[i]) * weight(u, v)
    };
    (0..12).map(part).sum()
}

#[test]
fn powers_in_closed_form() {
    let (plain, nearest) = (DAffine2::IDENTITY, BitmapFilter::Nearest);
    let nearest = || picture(nearest, Wrap::Repeat, plain);
    let width = |[a, b]: [f64; 2]| b - a;
    let mean = mean_of_pixels(|u, v| width(u) * width(v));
    // Fractions of zones of a sphere between two angles from its pole, and of rings of a disk.
    let zone = |[a, b]: [f64; 2]| 0.5 * ((PI * a).cos() - (PI * b).cos());
    let ring = |[a, b]: [f64; 2]| b * b - a * a;
    // Four rows of pixels, linear between their latitudes, by the moments ∫ sin πv dv and ∫ v sin
    // πv dv.
    let rows = Bitmap::new(
        [1, 4],
        1,
        vec![1.0, 0.0, 2.0, 0.5],
        BitmapFilter::Bilinear,
        Wrap::Clamp,
        plain,
    );
    let rows = Texture::Bitmap(Arc::new(rows.unwrap()));
    let zeroth = |v: f64| -(PI * v).cos() / PI;
    let first = |v: f64| (PI * v).sin() / (PI * PI) - v * (PI * v).cos() / PI;
    let between = |[a, b]: [f64; 2], [p, q]: [f64; 2]| {
        let slope = (q - p) / (b - a);
        (p - slope * a) * (zeroth(b) - zeroth(a)) + slope * (first(b) - first(a))
    };
    let nodes = [0.0, 0.125, 0.375, 0.625, 0.875, 1.0];
    let values = [1.0, 1.0, 0.0, 2.0, 0.5, 0.5];
    let zones = (0..5).map(|k| between([nodes[k], nodes[k + 1]], [values[k], values[k + 1]]));
    let latitudes = 0.5 * PI * zones.sum::<f64>();
    let (side, cap) = (TAU * 1.69, PI * 1.69);
    let rings = mean_of_pixels(|u, v| ring(u) * width(v));
    // Pixels 1 and 3 at r = ¼ and ¾: 2∫ r L dr.
    let two = Bitmap::new(
        [2, 1],
        1,
        vec![1.0, 3.0],
        BitmapFilter::Bilinear,
        Wrap::Clamp,
        plain,
    );
    let two = Texture::Bitmap(Arc::new(two.unwrap()));
    let slope = |r: f64| 4.0 * r.powi(3) / 3.0;
    let linear = 1.0 / 16.0 + (slope(0.75) - slope(0.25)) * 2.0 + 3.0 * (1.0 - 9.0 / 16.0);
    let fields = board(
        [grey(1.0), grey(4.0)],
        DAffine2::from_scale(DVec2::new(3.0, 2.0)),
    );
    let cube: Shape = Cube::new(similarity()).unwrap().into();
    for (name, shape, texture, expected) in [
        ("checkered rectangle", rectangle(), fields.clone(), 2.5),
        ("checkered cube", cube, fields, 2.5),
        ("rectangle of pixels", rectangle(), nearest(), mean),
        (
            "smooth rectangle",
            rectangle(),
            picture(BitmapFilter::Bilinear, Wrap::Repeat, plain),
            mean,
        ),
        (
            "globe",
            sphere(),
            nearest(),
            mean_of_pixels(|u, v| width(u) * zone(v)),
        ),
        ("smooth globe", sphere(), rows, latitudes),
        ("disk of pixels", disk(), nearest(), rings),
        ("smooth disk", disk(), two, linear),
        (
            "can",
            can(),
            nearest(),
            (side * mean + 2.0 * cap * rings) / (side + 2.0 * cap),
        ),
    ] {
        let found = power(&shape, texture) / shape.area();
        assert!(
            (found / expected - 1.0).abs() < 1e-12,
            "{name}: {found}, not {expected}"
        );
    }
}

#[test]
fn colours_of_vertices_shine_with_their_mean_over_each_triangle() {
    let mesh = fan();
    let colour = |i: usize| 0.5 + i as f64 * 0.7;
    let areas = Shape::from(mesh.clone()).part_areas();
    let mean = |t: &[u32; 3]| t.iter().map(|i| colour(*i as usize)).sum::<f64>() / 3.0;
    let parts = mesh.triangles().iter().zip(&areas);
    let expected: f64 = parts.map(|(t, area)| mean(t) * area).sum();
    let colours = (0..5).map(|i| Spectrum::splat(colour(i))).collect();
    let texture = VertexColours::new(Arc::new(mesh.clone()), colours).unwrap();
    let found = power(&mesh.into(), Texture::Vertices(Arc::new(texture)));
    assert!(
        (found / expected - 1.0).abs() < 1e-13,
        "{found}, {expected}"
    );
}

/// Power by a sum over a grid of points of equal area. Its error is a fraction of the cells that
/// lines of the texture cross.
#[test]
fn powers_by_sums_over_points() {
    const N: usize = 1500;
    let nested = || {
        let smooth = picture(BitmapFilter::Bilinear, Wrap::Mirror, slanted());
        board([smooth, grey(0.3)], slanted().inverse())
    };
    let sharp = picture(BitmapFilter::Nearest, Wrap::Clamp, slanted());
    for shape in [rectangle(), sphere(), disk(), can(), fan().into()] {
        for texture in [nested(), sharp.clone()] {
            let at = |k: usize| (k as f64 + 0.5) / N as f64;
            let point = |i: usize| {
                let s = shape.sample_area([at(i % N), at(i / N)]);
                texture.number_at(&shape.site_of(&s)) / s.pdf
            };
            let sum = (0..N * N).map(point).sum::<f64>() / (N * N) as f64;
            let found = power(&shape, texture.clone());
            assert!(
                (found / sum - 1.0).abs() < 1e-3,
                "{shape:?}: {found}, sum {sum}"
            );
        }
    }
}

#[test]
fn points_have_the_density_that_is_stated() {
    let (texture, mut rng) = (
        picture(BitmapFilter::Bilinear, Wrap::Repeat, slanted()),
        Rng::new(8),
    );
    for shape in [rectangle(), sphere(), disk(), can(), fan().into()] {
        let emitter = area(&shape, texture.clone());
        for _ in 0..1000 {
            let u: [f64; 2] = rng.uniform();
            let sampled = emitter.sample_end(&AROUND, |_| &shape, u);
            let ConnectionEnd::Point {
                position,
                surface: Some(on),
            } = sampled.end
            else {
                panic!("{shape:?} is no surface");
            };
            assert_eq!(position, on.site.position);
            let (radiance, pdf) = emitter.on_surface(&shape, &on.site).unwrap();
            assert_eq!(radiance, texture.at(&on.site));
            assert!(
                (pdf / sampled.pdf - 1.0).abs() < 1e-9,
                "{shape:?}, {u:?}: {pdf}"
            );
        }
    }
}

/// Sampled points agree with their density over texture coordinates. Bins lie between the lines of
/// the emitter's table.
#[test]
fn points_follow_their_density() {
    const CELLS: usize = 128;
    let even = || uniform_edges(0.0, 1.0, CELLS);
    let polar = even().iter().map(|z| (1.0 - 2.0 * z).acos() / PI).collect();
    let radial = even().iter().map(|a| a.sqrt()).collect();
    type Place = fn([f64; 2]) -> (DVec3, f64);
    // Returns the local point, and the area per unit of the table before the shape is scaled.
    let flat: Place = |[u, v]| (DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0), 4.0);
    let ball: Place = |[u, v]| {
        let ((y, x), (sin, cos)) = ((u * TAU).sin_cos(), (v * PI).sin_cos());
        (DVec3::new(x * sin, y * sin, cos), TAU * PI * sin)
    };
    let round: Place = |[r, v]| {
        let (y, x) = (v * TAU).sin_cos();
        (DVec3::new(r * x, r * y, 0.0), TAU * r)
    };
    let map = similarity();
    let mut family = Family::new(FALSE_ALARM);
    for (name, shape, edges, place) in [
        (
            "rectangle",
            Rectangle::new(map).unwrap().into(),
            (even(), even()),
            flat,
        ),
        ("sphere", sphere(), (even(), polar), ball),
        (
            "disk",
            Disk::new(map).unwrap().into(),
            (radial, even()),
            round,
        ),
    ] {
        let emitter = area(
            &shape,
            picture(BitmapFilter::Bilinear, Wrap::Repeat, DAffine2::IDENTITY),
        );
        let site = |uv| Site {
            position: map.transform_point3(place(uv).0),
            uv: Uv::Plain(uv),
            primitive: 0,
        };
        let draw = |rng: &mut Rng| {
            let end = emitter.sample_end(&AROUND, |_: usize| -> &Shape { &shape }, rng.uniform());
            match end.end {
                ConnectionEnd::Point { surface, .. } => Some(surface?.site.uv.get()),
                ConnectionEnd::Plane { .. } => None,
            }
        };
        let pdf = |uv| {
            let (_, pdf) = emitter.on_surface(&shape, &site(uv)).unwrap();
            pdf * place(uv).1 * 1.69
        };
        let report = Table::new(edges.0, edges.1).test(9, 300_000, Mass::Exactly(1.0), draw, pdf);
        family.push(name, report.unwrap().p_value);
    }
    family.check().unwrap();
}

/// The table follows the light: weights of points vary far less than radiances.
#[test]
fn bright_parts_are_sampled_more_often() {
    let shape = rectangle();
    let emitter = area(&shape, board([grey(0.0), grey(1.0)], DAffine2::IDENTITY));
    let mut rng = Rng::new(10);
    let lit = (0..10_000).filter(|_| {
        let [a, b] = rng.uniform();
        emit(&emitter, std::slice::from_ref(&shape), [a, b, 0.5, 0.5]).is_some()
    });
    // Expect nineteen of twenty: a tenth of the samples is uniform, over the dark half too.
    let lit = lit.count();
    assert!((9_400..9_600).contains(&lit), "{lit}");
}

#[test]
fn lights_that_are_refused() {
    let refused = |shape: &Shape, texture| TexturedArea::new(0, shape, texture).unwrap_err();
    let nearest = || picture(BitmapFilter::Nearest, Wrap::Repeat, DAffine2::IDENTITY);
    let [_, ellipsoid, ..] = shapes();
    assert_eq!(refused(&ellipsoid, nearest()), TexturedError::Uneven);
    let squeezed = DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0));
    let tube = Cylinder::new(squeezed, false).unwrap().into();
    assert_eq!(refused(&tube, nearest()), TexturedError::Uneven);
    let mesh = fan();
    let bare = Mesh::new(mesh.positions().to_vec(), mesh.triangles().to_vec(), None).unwrap();
    assert_eq!(
        refused(&bare.into(), nearest()),
        TexturedError::NoCoordinates
    );
    let error = refused(&rectangle(), grey(-1.0));
    assert_eq!(error, TexturedError::Radiance { value: -1.0 });
    let many = DAffine2::from_scale(DVec2::splat(1e4));
    let fine = picture(BitmapFilter::Nearest, Wrap::Repeat, many);
    assert_eq!(refused(&rectangle(), fine), TexturedError::TooFine);
    let far = board(
        [grey(0.0), grey(1.0)],
        DAffine2::from_scale(DVec2::splat(1e300)),
    );
    assert_eq!(refused(&rectangle(), far), TexturedError::TooFine);
}
