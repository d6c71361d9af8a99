//! Checks that a scene has derivatives by the index: no contribution of a path may be discontinuous
//! when the path's vertices move (docs/theory.md#derivatives-by-the-index-behind-scattering).

use super::{IndexDerivativeError, boundaries};
use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::emitter::{Emitter, Environment};
use crate::scene::{AMBIENT, MediumId, Object, Scene};
use crate::shape::Shape;
use crate::texture::Texture;
use crate::volume::{VolumeGrid, VolumeTexture};
use eikonal::connect::World;
use glam::DVec3;

/// Number of points on each side of a panel at which the panel must be dark.
const PLACES: usize = 1 << 14;

/// Checks that a scene has derivatives by the index of its media; samples have `channels` channels.
/// `counted` names the option by which the image depends on the number of events of paths.
pub(crate) fn check(
    scene: &Scene,
    channels: usize,
    counted: Option<&'static str>,
) -> Result<(), IndexDerivativeError> {
    if scene.instants() > 1 {
        return Err(IndexDerivativeError::Period);
    }
    if scene.is_divided() {
        return Err(IndexDerivativeError::Labels);
    }
    for id in 0..scene.media().len() {
        check_medium(scene, id)?;
    }
    let ambient = scene.medium(AMBIENT);
    if !ambient.is_transparent() || !scene.field(AMBIENT).is_constant() {
        return Err(IndexDerivativeError::Surroundings);
    }
    for emitter in scene.emitters() {
        check_emitter(emitter)?;
    }
    for (number, object) in scene.objects().iter().enumerate() {
        check_object(scene, number, object)?;
    }
    boundaries::check(scene, channels, counted)
}

fn check_medium(scene: &Scene, id: MediumId) -> Result<(), IndexDerivativeError> {
    let medium = scene.medium(id);
    let name = || medium.name.clone();
    if medium.emission.is_some() {
        return Err(IndexDerivativeError::Volumes);
    }
    if !medium.phase.is_uniform() {
        return Err(IndexDerivativeError::Phase(name()));
    }
    for (what, texture) in [("extinction", &medium.sigma_t), ("albedo", &medium.albedo)] {
        if matches!(texture, VolumeTexture::Grid(grid) if !grid.is_continuous()) {
            return Err(IndexDerivativeError::Voxels { what, name: name() });
        }
    }
    match &medium.sigma_t {
        VolumeTexture::Grid(grid) if !grid.is_dark_around() && !covers(grid, scene, id) => {
            Err(IndexDerivativeError::Ends(name()))
        }
        _ => Ok(()),
    }
}

/// Returns true if a grid covers all shapes of a medium.
fn covers(grid: &VolumeGrid, scene: &Scene, medium: MediumId) -> bool {
    let mut own = scene
        .objects()
        .iter()
        .filter(|o| o.interior() == Some(medium));
    let is_covered = |object: &Object| {
        let corners = match &object.shape {
            Shape::Cube(cube) => cube.corners(),
            shape => shape.aabb().corners(),
        };
        corners.into_iter().all(|x| grid.contains(x))
    };
    own.all(is_covered)
}

fn check_emitter(emitter: &Emitter) -> Result<(), IndexDerivativeError> {
    let sharp = |instead| {
        let kind = emitter.kind();
        Err(IndexDerivativeError::Sharp { kind, instead })
    };
    match emitter {
        Emitter::Environment(Environment::Constant(_) | Environment::Image(_)) => Ok(()),
        Emitter::Textured(_) => Ok(()),
        Emitter::Volume(_) => Err(IndexDerivativeError::Volumes),
        Emitter::Area { .. } => sharp("give it a bitmap that is dark at its edge"),
        _ => sharp("use constant, envmap, or a rectangle with a bitmap that is dark at its edge"),
    }
}

fn check_object(scene: &Scene, number: usize, object: &Object) -> Result<(), IndexDerivativeError> {
    if let Some(emitter) = object.emitter {
        return check_panel(scene, number, object, &scene.emitters()[emitter]);
    }
    match object.bsdf {
        Bsdf::Null => Ok(()),
        // Edges would turn rays discontinuously.
        Bsdf::Dielectric(_) if matches!(object.shape, Shape::Sphere(_)) => Ok(()),
        _ => Err(IndexDerivativeError::Surface(object.name.clone())),
    }
}

/// Checks that no path sees the edge of a panel.
fn check_panel(
    scene: &Scene,
    number: usize,
    object: &Object,
    emitter: &Emitter,
) -> Result<(), IndexDerivativeError> {
    let refuse = |why| {
        let name = object.name.clone();
        Err(IndexDerivativeError::Panel { name, why })
    };
    if !matches!(object.shape, Shape::Rectangle(_)) {
        return refuse("is no rectangle");
    }
    let is_black = match &object.bsdf {
        Bsdf::Diffuse(diffuse) => {
            matches!(diffuse.reflectance(), Texture::Uniform(of) if of.is_zero())
        }
        _ => false,
    };
    if !is_black {
        return refuse("must be black: give it a diffuse bsdf of reflectance 0");
    }
    let texture = match emitter {
        Emitter::Textured(area) => area.texture(),
        _ => return refuse("must emit a bitmap"),
    };
    if !matches!(texture, Texture::Bitmap(bitmap) if bitmap.is_continuous()) {
        return refuse("must emit a bitmap that is interpolated");
    }
    if !is_dark_around(&object.shape, texture) {
        return refuse("must be dark at its edge, where its light would jump");
    }
    if scene.emitters().len() > 1 {
        return refuse("must be the only light: it would hide others behind its edge");
    }
    let plane = object.shape.sample_area([0.5; 2]);
    let is_before = |x: DVec3| plane.normal.dot(x - plane.position) > 0.0;
    let others = scene.objects().iter().enumerate();
    let mut others = others.filter(|(i, _)| *i != number);
    let all_before = others.all(|(_, other)| {
        let ends = other.shape.aabb();
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { ends.max } else { ends.min }[axis];
            DVec3::new(pick(0), pick(1), pick(2))
        };
        (0..8).all(|i| is_before(corner(i)))
    });
    if !all_before {
        return refuse(
            "must have all other objects before it: it would hide what is behind its edge",
        );
    }
    Ok(())
}

/// Returns true if a texture is dark along the sides of a rectangle.
fn is_dark_around(shape: &Shape, texture: &Texture) -> bool {
    let at = |u: [f64; 2]| texture.at(&shape.site_of(&shape.sample_area(u)));
    (0..=PLACES).all(|i| {
        let t = i as f64 / PLACES as f64;
        let sides = [[0.0, t], [1.0, t], [t, 0.0], [t, 1.0]];
        sides.into_iter().all(|u| at(u) == Spectrum::ZERO)
    })
}
