//! Scene for tests of derivatives.

use super::*;
use eikonal::field::Placement;
use glam::{DAffine2, DAffine3};
use morgana_transport::bsdf::{
    Bsdf, Conductor, Diffuse, Distribution, Mask, NormalMap, NormalSource, RoughConductor,
    Roughness,
};
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::{Medium, MediumLabel, MediumLabels};
use morgana_transport::phase::{Phase, PhaseByLabel};
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::{Mesh, Rectangle, Shape, Sphere};
use morgana_transport::texture::{
    Bitmap, BitmapFilter, Checkerboard, ScaledTexture, Texture, VertexColours, Wrap,
};
use morgana_transport::volume::{GridFilter, GridSamples, LabelGrid, VolumeGrid, VolumeTexture};
use std::sync::Arc;

/// Form of the haze's extinction and albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MadeOf {
    One,
    Labels,
    Voxels(GridFilter),
}

/// Support of the wall's colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Painted {
    /// A single colour for the whole wall.
    One,
    /// A single colour for the whole wall, which is a mesh.
    Mesh,
    /// 2 × 2 pixels.
    Pixels(BitmapFilter),
    /// 2 × 2 pixels, as a scaled image half as bright.
    Scaled,
    /// Both squares of a checkerboard.
    Squares,
    /// Colours at four vertices.
    Vertices,
    /// Colours of two triangles.
    Triangles,
}

/// Material of the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finish {
    Diffuse,
    /// A rough metal with this roughness.
    Metal(f64),
    Mirror,
    /// A diffuse wall with holes over a quarter of its area.
    Mask,
    /// A diffuse wall with leaning shading normals.
    Leaning,
}

/// A ball of haze in front of a wall, lit by a point light and a dim sky. Two channels.
#[derive(Clone, Debug)]
pub(super) struct Setup {
    pub index: Field,
    pub made_of: MadeOf,
    /// Extinction of each number, in both channels.
    pub extinction: Vec<[f64; 2]>,
    pub albedo: Vec<[f64; 2]>,
    /// Mean cosine of each number, if there are several.
    pub g: Vec<f64>,
    pub reflectance: Vec<[f64; 2]>,
    pub painted: Painted,
    pub finish: Finish,
    pub intensity: f64,
    pub sky: f64,
}

pub(super) fn two([a, b]: [f64; 2]) -> Spectrum {
    Spectrum([a, b, 0.0, 0.0])
}

impl Finish {
    fn bsdf(self, colours: Texture) -> Bsdf {
        let diffuse = |colours| Bsdf::Diffuse(Diffuse::new(colours).unwrap());
        let (eta, k) = (two([0.2, 1.1]), two([3.9, 2.3]));
        match self {
            Finish::Diffuse => diffuse(colours),
            Finish::Metal(alpha) => {
                let facets = Roughness::new(Distribution::Ggx, alpha).unwrap();
                Bsdf::RoughConductor(RoughConductor::new(facets, eta, k, colours).unwrap())
            }
            Finish::Mirror => Bsdf::Conductor(Conductor::new(eta, k, colours).unwrap()),
            Finish::Mask => Bsdf::Mask(Mask::new(Texture::from(0.75), diffuse(colours)).unwrap()),
            Finish::Leaning => {
                let normal = Texture::Uniform(Spectrum([0.65, 0.6, 0.95, 0.0]));
                let leaning = NormalSource::Normals(normal);
                let map = NormalMap::new(leaning, false, false, diffuse(colours));
                Bsdf::NormalMap(Box::new(map.unwrap()))
            }
        }
    }
}

/// A square of two triangles.
fn square(place: DAffine3) -> Arc<Mesh> {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let at = |[x, y]: [f64; 2]| place.transform_point3(DVec3::new(x, y, 0.0));
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    Arc::new(Mesh::new(corners.map(at).into(), triangles, None).unwrap())
}

impl Setup {
    pub fn new(index: impl Into<Field>, made_of: MadeOf) -> Self {
        let count = match made_of {
            MadeOf::One => 1,
            MadeOf::Labels => 2,
            MadeOf::Voxels(_) => 8,
        };
        let varied = |i: usize| 0.5 + 0.25 * (i * 5 % 8) as f64;
        Setup {
            index: index.into(),
            made_of,
            extinction: (0..count).map(|i| [varied(i), 1.5 * varied(i)]).collect(),
            albedo: (0..count).map(|i| [0.9 - 0.05 * i as f64, 0.7]).collect(),
            g: vec![0.4],
            reflectance: vec![[0.5, 0.8]],
            painted: Painted::One,
            finish: Finish::Diffuse,
            intensity: 20.0,
            sky: 0.25,
        }
    }

    pub fn labels() -> Arc<LabelGrid> {
        let cube =
            DAffine3::from_translation(DVec3::NEG_ONE) * DAffine3::from_scale(DVec3::splat(2.0));
        Arc::new(LabelGrid::new([2, 1, 2], vec![0, 1, 1, 0], cube).unwrap())
    }

    fn texture(&self, values: &[[f64; 2]]) -> VolumeTexture {
        let spectra: Vec<Spectrum> = values.iter().map(|v| two(*v)).collect();
        let cube =
            DAffine3::from_translation(DVec3::NEG_ONE) * DAffine3::from_scale(DVec3::splat(2.0));
        let grid = match self.made_of {
            MadeOf::One => return VolumeTexture::Uniform(spectra[0]),
            MadeOf::Labels => VolumeGrid::by_label(Self::labels(), &spectra, 2),
            MadeOf::Voxels(filter) => {
                let data = values.iter().flatten().map(|v| *v as f32).collect();
                let samples = GridSamples {
                    size: [2; 3],
                    channels: 2,
                    data,
                };
                VolumeGrid::new(samples, cube, Placement::Centers, filter, [0.0, 1e3])
            }
        };
        VolumeTexture::Grid(Arc::new(grid.unwrap()))
    }

    fn medium(&self) -> Medium {
        let label = |(i, (t, a)): (usize, (&[f64; 2], &[f64; 2]))| MediumLabel {
            name: i.to_string(),
            extinction: two(*t),
            absorption: two([t[0] * (1.0 - a[0]), t[1] * (1.0 - a[1])]),
            velocity: None,
            fluorescence: None,
        };
        let each = self.extinction.iter().zip(&self.albedo).enumerate();
        let labels = MediumLabels::new(Self::labels(), each.map(label).collect());
        Medium {
            name: "haze".into(),
            index: self.index.clone(),
            sigma_t: self.texture(&self.extinction),
            scale: 1.0,
            albedo: self.texture(&self.albedo),
            phase: self.phase(),
            emission: None,
            velocity: None,
            fluorescence: None,
            labels: labels.filter(|_| self.made_of == MadeOf::Labels),
        }
    }

    fn phase(&self) -> Phase {
        let hg = |g: &f64| Phase::henyey_greenstein(*g).unwrap();
        match (self.made_of, &self.g[..]) {
            (_, [one]) => hg(one),
            (MadeOf::Voxels(filter), all) => {
                let samples = GridSamples {
                    size: [2; 3],
                    channels: 1,
                    data: all.iter().map(|g| *g as f32).collect(),
                };
                let (cube, range) = (Self::labels().to_world(), [-0.99, 0.99]);
                let grid = VolumeGrid::new(samples, cube, Placement::Centers, filter, range);
                Phase::HenyeyGreensteinGrid(Arc::new(grid.unwrap()))
            }
            (_, all) => {
                let each = all.iter().map(hg).collect();
                let phases = PhaseByLabel::new(Self::labels(), each).unwrap();
                Phase::ByLabel(Box::new(phases))
            }
        }
    }

    /// Sets the colours of the wall.
    pub fn paint(&mut self, painted: Painted) {
        let count = match painted {
            Painted::One | Painted::Mesh => 1,
            Painted::Squares | Painted::Triangles => 2,
            Painted::Pixels(_) | Painted::Scaled | Painted::Vertices => 4,
        };
        self.painted = painted;
        self.reflectance = [[0.5, 0.8], [0.3, 0.4], [0.7, 0.2], [0.6, 0.5]][..count].to_vec();
    }

    fn wall(&self) -> (Shape, Texture) {
        let place = DAffine3::from_translation(DVec3::Z * 1.5)
            * DAffine3::from_rotation_y(std::f64::consts::PI)
            * DAffine3::from_scale(DVec3::splat(2.0));
        let rectangle = || Rectangle::new(place).unwrap().into();
        let bitmap = |scale: f64, filter| {
            let values = self.reflectance.iter().flatten();
            let data = values.map(|v| (scale * v) as f32).collect();
            let bitmap = Bitmap::new([2; 2], 2, data, filter, Wrap::Clamp, DAffine2::IDENTITY);
            Texture::Bitmap(Arc::new(bitmap.unwrap()))
        };
        let colours = || self.reflectance.iter().map(|v| two(*v)).collect();
        match self.painted {
            Painted::One => (rectangle(), two(self.reflectance[0]).into()),
            Painted::Mesh => (Shape::Mesh(square(place)), two(self.reflectance[0]).into()),
            Painted::Pixels(filter) => (rectangle(), bitmap(1.0, filter)),
            Painted::Scaled => {
                let dim = bitmap(0.5, BitmapFilter::Bilinear);
                let scaled = ScaledTexture::new(dim, Spectrum::splat(2.0));
                (rectangle(), Texture::Scaled(Arc::new(scaled)))
            }
            Painted::Squares => {
                let [a, b] = [0, 1].map(|i| two(self.reflectance[i]).into());
                let board = Checkerboard::new([a, b], DAffine2::IDENTITY);
                (rectangle(), Texture::Checkerboard(Arc::new(board)))
            }
            Painted::Vertices => {
                let mesh = square(place);
                let painted = VertexColours::new(mesh.clone(), colours()).unwrap();
                (Shape::Mesh(mesh), Texture::Vertices(Arc::new(painted)))
            }
            Painted::Triangles => {
                let mesh = square(place);
                let painted = VertexColours::of_triangles(mesh.clone(), colours()).unwrap();
                (Shape::Mesh(mesh), Texture::Vertices(Arc::new(painted)))
            }
        }
    }

    pub fn scene(&self) -> Scene {
        self.builder().build().unwrap()
    }

    pub fn builder(&self) -> SceneBuilder {
        let (shape, colours) = self.wall();
        let wall = Object::builder("wall", shape);
        let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
        Scene::builder()
            .film(4, 4)
            .channels(2)
            .camera(Camera::perspective([0.0, 0.0, -4.0], [0.0; 3], 30.0))
            .medium(self.medium())
            .object(Object::builder("ball", ball).interior("haze"))
            .object(wall.bsdf(self.finish.bsdf(colours)))
            .emitter(Emitter::point(
                [1.0, 1.0, -1.5],
                two([self.intensity, 0.5 * self.intensity]),
            ))
            .emitter(Emitter::constant(two([self.sky, self.sky])))
    }

    /// Returns the setup with a parameter changed by a step along `direction`, which has one entry
    /// per number and channel.
    pub fn changed(
        &self,
        parameter: RadiometricParameter,
        direction: &[[f64; 2]],
        step: f64,
    ) -> Self {
        let mut setup = self.clone();
        for (i, d) in direction.iter().enumerate() {
            for (c, d) in d.iter().enumerate() {
                let d = step * d;
                let (t, a) = match parameter {
                    RadiometricParameter::Colour(..) => {
                        setup.reflectance[i][c] += d;
                        continue;
                    }
                    RadiometricParameter::Emission(_) => {
                        // Change both channels alike.
                        setup.intensity *= if c == 0 { 1.0 + d } else { 1.0 };
                        continue;
                    }
                    RadiometricParameter::MeanCosine(_) => {
                        // Change both channels alike.
                        setup.g[i] += if c == 0 { d } else { 0.0 };
                        continue;
                    }
                    _ => (setup.extinction[i][c], setup.albedo[i][c]),
                };
                let (scattering, absorption) = (t * a, t * (1.0 - a));
                let of = |s: f64, a: f64| (s + a, s / (s + a));
                let (t, a) = match parameter {
                    RadiometricParameter::Extinction(_) => (t + d, a),
                    RadiometricParameter::Albedo(_) => (t, a + d),
                    RadiometricParameter::Absorption(_) => of(scattering, absorption + d),
                    _ => of(scattering + d, absorption),
                };
                (setup.extinction[i][c], setup.albedo[i][c]) = (t, a);
            }
        }
        setup
    }
}
