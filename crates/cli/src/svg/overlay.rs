//! Rays drawn over a picture of the scene, as its camera sees them.
//!
//! The camera sees a point along the curved ray that connects the point to the camera, like the
//! light that the point scatters. Lines therefore lie on the beams of a picture.

use super::colour::RAY;
use crate::command_error::CommandError;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use eikonal::Solver;
use eikonal::connect::Piece;
use glam::DVec3;
use io::diagnostic::shown;
use io::image::png;
use std::fmt::Write;
use transport::Scene;
use transport::scene::MediumId;
use transport::sensor::Sensor;
use transport::trace::Path;

/// Number of points per ray: a line that is straight in the scene may be curved in the picture.
const PIECES: f64 = 200.0;
/// Width of lines, relative to the larger side of the picture.
const STROKE: f64 = 0.002;

/// Returns an SVG document with a picture (a PNG file) and the rays over it.
pub fn overlay(
    scene: &Scene,
    paths: &[Path],
    picture: &std::path::Path,
) -> Result<String, CommandError> {
    let camera = match scene.sensor() {
        Sensor::Perspective(_) | Sensor::ThinLens(_) => scene.sensor(),
        _ => {
            let message = "--overlay needs a perspective or thinlens camera";
            return Err(CommandError::Usage(message.into()));
        }
    };
    let size = size(scene, picture)?;
    let bytes = io::input::read(picture).map_err(|e| CommandError::Usage(e.to_string()))?;
    let mut eye = Eye {
        scene,
        camera,
        solver: Solver::new(scene.tolerance()),
    };
    let [width, height] = size;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<image width=\"{width}\" height=\"{height}\" \
         href=\"data:image/png;base64,{}\"/>\n<g fill=\"none\" stroke=\"{RAY}\" stroke-width=\"{:.2}\" \
         stroke-linejoin=\"round\" stroke-linecap=\"round\">\n",
        BASE64_STANDARD.encode(bytes),
        STROKE * width.max(height)
    );
    for line in paths.iter().flat_map(|path| eye.lines(path)) {
        let points = line
            .iter()
            .map(|[s, t]| format!("{:.2},{:.2}", s * width, t * height));
        let points: Vec<String> = points.collect();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "<polyline points=\"{}\"/>", points.join(" "));
    }
    out.push_str("</g>\n</svg>\n");
    Ok(out)
}

/// Returns width and height of a picture. Refuses a picture whose proportions differ from the
/// film's.
fn size(scene: &Scene, picture: &std::path::Path) -> Result<[f64; 2], CommandError> {
    let image = png::read(picture).map_err(|e| CommandError::Usage(e.to_string()))?;
    let film = scene.film();
    // The proportions determine a side up to a pixel.
    let [width, height] = [image.width, image.height].map(|n| n as f64);
    let expected = width * film.height as f64 / film.width as f64;
    if (height - expected).abs() > 1.0 {
        return Err(CommandError::Usage(format!(
            "{}: the picture has {width} x {height} pixels, but the proportions of the film are {} x {}",
            shown(picture),
            film.width,
            film.height
        )));
    }
    Ok([width, height])
}

struct Eye<'a> {
    scene: &'a Scene,
    camera: &'a Sensor,
    solver: Solver<MediumId>,
}

impl Eye<'_> {
    /// Returns the visible parts of a ray, as positions on the picture from (0, 0) to (1, 1).
    fn lines(&mut self, path: &Path) -> Vec<Vec<[f64; 2]>> {
        let mut lines = vec![Vec::new()];
        let longest = path.points.last().map_or(0.0, |p| p.arc_length) / PIECES;
        for pair in path.points.windows(2) {
            let pieces = ((pair[1].arc_length - pair[0].arc_length) / longest).ceil();
            // Use the midpoints of pieces, because the ends may lie on surfaces.
            for i in 0..pieces as usize {
                let x = pair[0].x.lerp(pair[1].x, (i as f64 + 0.5) / pieces);
                match self.place(x, pair[0].medium) {
                    Some(place) => lines.last_mut().into_iter().for_each(|l| l.push(place)),
                    None => lines.push(Vec::new()),
                }
            }
        }
        lines.retain(|line| line.len() > 1);
        lines
    }

    /// Returns the position at which the camera sees a point of a medium; `None` if the point is
    /// hidden or outside the picture.
    fn place(&mut self, x: DVec3, medium: MediumId) -> Option<[f64; 2]> {
        let eye = self.camera.position();
        let found = self.solver.connect(self.scene, x, medium, eye).ok()?;
        let arcs = self.solver.pieces().iter().map(Piece::ends);
        self.scene.visibility(arcs, [None; 2], 0.0)?;
        let film = self.scene.film();
        let [x, y] = film.position(self.camera.sense(eye, -found.direction_in)?.image);
        let place = [x / film.width as f64, y / film.height as f64];
        // Keep positions slightly outside: the frame clips the lines.
        place
            .iter()
            .all(|x| (-0.5..=1.5).contains(x))
            .then_some(place)
    }
}
