//! Textures, compared with values of Mitsuba 3.9.1 (`scalar_rgb`) for equal images and coordinates,
//! and with closed forms.

use glam::{DAffine2, DAffine3, DMat2, DVec2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::shape::{Cube, Mesh, Shape, Site, Uv};
use morgana_transport::texture::{
    Bitmap, BitmapFilter, Checkerboard, ScaledTexture, Texture, TextureError, VertexColours, Wrap,
};
use std::sync::Arc;

fn at(texture: &Texture, u: f64, v: f64) -> f64 {
    let site = Site {
        uv: Uv::Plain([u, v]),
        ..Site::default()
    };
    texture.number_at(&site)
}

/// Two by two pixels, row by row.
fn bitmap(filter: BitmapFilter, wrap: Wrap, to_uv: DAffine2) -> Texture {
    let data = vec![0.1, 0.2, 0.3, 0.4];
    Texture::Bitmap(Arc::new(
        Bitmap::new([2, 2], 1, data, filter, wrap, to_uv).unwrap(),
    ))
}

const PLACES: [[f64; 2]; 6] = [
    [0.1, 0.2],
    [0.5, 0.5],
    [0.95, 0.3],
    [1.3, 0.6],
    [-0.2, -0.7],
    [2.6, 1.2],
];

#[test]
fn bitmaps_are_filtered_and_wrapped_as_in_mitsuba() {
    let table = [
        (
            BitmapFilter::Bilinear,
            Wrap::Repeat,
            [0.15, 0.25, 0.18, 0.25, 0.21, 0.19],
        ),
        (
            BitmapFilter::Nearest,
            Wrap::Repeat,
            [0.1, 0.4, 0.2, 0.3, 0.2, 0.2],
        ),
        (
            BitmapFilter::Bilinear,
            Wrap::Mirror,
            [0.1, 0.25, 0.22, 0.33, 0.28, 0.37],
        ),
        (
            BitmapFilter::Nearest,
            Wrap::Mirror,
            [0.1, 0.4, 0.2, 0.4, 0.3, 0.4],
        ),
        (
            BitmapFilter::Bilinear,
            Wrap::Clamp,
            [0.1, 0.25, 0.22, 0.34, 0.1, 0.4],
        ),
        (
            BitmapFilter::Nearest,
            Wrap::Clamp,
            [0.1, 0.4, 0.2, 0.4, 0.1, 0.4],
        ),
    ];
    for (filter, wrap, expected) in table {
        let texture = bitmap(filter, wrap, DAffine2::IDENTITY);
        for ([u, v], expected) in PLACES.into_iter().zip(expected) {
            let ours = at(&texture, u, v);
            let place = format!("{filter:?} {wrap:?} ({u}, {v})");
            assert!(
                (ours - expected).abs() < 1e-6,
                "{place}: {ours} against {expected}"
            );
        }
    }
}

#[test]
fn coordinates_are_mapped_first() {
    let to_uv = DAffine2::from_mat2_translation(
        DMat2::from_diagonal(DVec2::new(2.0, 3.0)),
        DVec2::new(0.25, 0.5),
    );
    let (filter, wrap) = (BitmapFilter::Bilinear, Wrap::Repeat);
    let mapped = at(&bitmap(filter, wrap, to_uv), 0.1, 0.2);
    let plain = at(&bitmap(filter, wrap, DAffine2::IDENTITY), 0.45, 1.1);
    assert!((mapped - plain).abs() < 1e-12 && (mapped - 0.2).abs() < 1e-6);
}

#[test]
fn coordinates_without_meaning_are_harmless() {
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for filter in [BitmapFilter::Bilinear, BitmapFilter::Nearest] {
            let texture = bitmap(filter, wrap, DAffine2::IDENTITY);
            for far in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e18] {
                assert!((0.1..=0.4001).contains(&at(&texture, far, 0.3)));
            }
        }
    }
}

#[test]
fn checkerboards_are_laid_as_in_mitsuba() {
    let colours = [0.1, 0.9].map(|v| Texture::Uniform(Spectrum::splat(v)));
    let board = Checkerboard::new(colours, DAffine2::IDENTITY);
    let board = Texture::Checkerboard(Arc::new(board));
    let table = [
        (0.1, 0.1, 0.1),
        (0.6, 0.1, 0.9),
        (0.1, 0.6, 0.9),
        (0.6, 0.6, 0.1),
        (1.1, 0.1, 0.1),
        (-0.1, 0.1, 0.9),
        (-0.1, -0.1, 0.1),
        (0.5, 0.1, 0.1),
    ];
    for (u, v, expected) in table {
        assert_eq!(at(&board, u, v), expected, "({u}, {v})");
    }
}

/// Compares coordinates on the faces of Mitsuba's cube, at the points where lines along the axes
/// through (0.3, −0.4, 0.6) leave it.
#[test]
fn cubes_have_mitsubas_coordinates() {
    let cube = Shape::from(Cube::new(DAffine3::IDENTITY).unwrap());
    let table = [
        (-DVec3::X, [0.3, 0.8]),
        (DVec3::X, [0.3, 0.2]),
        (-DVec3::Y, [0.8, 0.65]),
        (DVec3::Y, [0.35, 0.2]),
        (-DVec3::Z, [0.7, 0.65]),
        (DVec3::Z, [0.3, 0.65]),
    ];
    for (face, expected) in table {
        let inside = DVec3::new(0.3, -0.4, 0.6) * (DVec3::ONE - face.abs());
        let arc = eikonal::ray::Arc::line(inside + face * 3.0, -face, 3.0);
        let hit = cube.first_hit(&arc, 0.0, 1.0).unwrap();
        let uv = cube.site(&hit).uv.get();
        for k in 0..2 {
            assert!((uv[k] - expected[k]).abs() < 1e-12, "{face}: {uv:?}");
        }
    }
}

#[test]
fn colours_of_vertices_are_linear_over_triangles() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.5)];
    let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [1, 3, 2]], None).unwrap();
    let mesh = Arc::new(mesh);
    // The interpolation must reproduce a function that is linear in the position.
    let linear = |p: DVec3| 0.1 + 0.5 * p.x + 0.2 * p.y + 0.3 * p.z;
    let colours = corners.map(|p| Spectrum::splat(linear(p))).to_vec();
    let texture = VertexColours::new(mesh.clone(), colours).unwrap();
    let texture = Texture::Vertices(Arc::new(texture));
    for (primitive, weights) in [
        (0, [0.2, 0.5, 0.3]),
        (1, [0.6, 0.3, 0.1]),
        (1, [0.0, 1.0, 0.0]),
    ] {
        let triangle = mesh.triangles()[primitive as usize];
        let parts = triangle.iter().zip(weights);
        let position = parts.map(|(v, w)| corners[*v as usize] * w).sum();
        let site = Site {
            position,
            primitive,
            ..Site::default()
        };
        assert!((texture.number_at(&site) - linear(position)).abs() < 1e-14);
    }
    let few = VertexColours::new(mesh, vec![Spectrum::ONE]).unwrap_err();
    assert_eq!(
        few,
        TextureError::Count {
            expected: 4,
            found: 1
        }
    );
}

#[test]
fn images_that_are_refused() {
    let (filter, to_uv) = ((BitmapFilter::Nearest, Wrap::Clamp), DAffine2::IDENTITY);
    let make = |size, channels, data: Vec<f32>| {
        Bitmap::new(size, channels, data, filter.0, filter.1, to_uv)
    };
    let error = make([2, 1], 1, vec![0.0; 3]).unwrap_err();
    assert_eq!(
        error,
        TextureError::Count {
            expected: 2,
            found: 3
        }
    );
    assert_eq!(make([0, 1], 1, vec![]).unwrap_err(), TextureError::Empty);
    assert_eq!(
        make([1, 1], 5, vec![0.0; 5]).unwrap_err(),
        TextureError::Empty
    );
    let error = make([1, 2], 1, vec![0.0, f32::NAN]).unwrap_err();
    assert_eq!(error, TextureError::NotFinite { index: 1 });
}

/// A scaled texture has scaled values and slopes.
#[test]
fn multiples_have_multiples_of_values_and_slopes() {
    let plain = bitmap(BitmapFilter::Bilinear, Wrap::Repeat, DAffine2::IDENTITY);
    let factor = Spectrum::splat(3.0);
    let scaled = Texture::Scaled(Arc::new(ScaledTexture::new(plain.clone(), factor)));
    for [u, v] in PLACES {
        let site = Site {
            uv: Uv::Plain([u, v]),
            ..Site::default()
        };
        assert!((at(&scaled, u, v) - 3.0 * at(&plain, u, v)).abs() < 1e-15);
        let slopes = [&scaled, &plain].map(|texture| texture.gradient_at(&site));
        assert!((slopes[0] - 3.0 * slopes[1]).length() < 1e-12);
    }
    let most = scaled.numbers().fold(0.0, f64::max);
    assert!((most - 1.2).abs() < 1e-6);
}
