//! Differences of two images, pixel by pixel.

use super::{Failure, bad, not_found};
use crate::picture::{Picture, Plane};
use crate::server::{Request, Response};
use io::compare::compare;
use io::compare::flip::flip;
use io::image::{ImageLayers, RgbImage};
use std::sync::{Arc, Mutex, PoisonError};

/// Differences, with a cache of the last request: a page requests channels one after another.
#[derive(Debug, Default)]
pub(super) struct Differences(Mutex<Option<(Question, Answer)>>);

/// Parameters of a request.
#[derive(Debug)]
struct Question {
    pictures: [Arc<Picture>; 2],
    layers: [String; 2],
    kind: String,
    exposure: String,
}

/// Planes by the names of their channels.
type Answer = Vec<(String, Plane)>;

impl PartialEq for Question {
    fn eq(&self, other: &Self) -> bool {
        let mut pictures = self.pictures.iter().zip(&other.pictures);
        pictures.all(|(a, b)| Arc::ptr_eq(a, b))
            && (&self.layers, &self.kind, &self.exposure)
                == (&other.layers, &other.kind, &other.exposure)
    }
}

impl Differences {
    /// Responds to `kind=z`, differences of a `channel` divided by their standard errors, or to
    /// `kind=flip`, visible differences with both images brightened by `exposure` stops. The images
    /// are `layer` of the first picture and `reference_layer` of the second.
    pub(super) fn answer(
        &self,
        pictures: [Arc<Picture>; 2],
        request: &Request,
    ) -> Result<Response, Failure> {
        let question = Question {
            pictures,
            layers: ["layer", "reference_layer"].map(|name| request.parameter(name).to_owned()),
            kind: request.parameter("kind").to_owned(),
            exposure: request.parameter("exposure").to_owned(),
        };
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let answer = match last.take() {
            Some((known, answer)) if known == question => answer,
            _ => question.answer()?,
        };
        let channel = request.parameter("channel");
        let found = answer
            .iter()
            .find(|(name, _)| name == channel || channel.is_empty());
        let plane = found.map(|(_, plane)| plane.clone());
        *last = Some((question, answer));
        let plane = plane.ok_or_else(|| not_found("channel"))?;
        let all = 0..plane.len();
        Ok(Response::shared_floats(plane, all))
    }
}

impl Question {
    fn answer(&self) -> Result<Answer, Failure> {
        let image = |i: usize| self.pictures[i].focused(&self.layers[i]).map_err(bad);
        let [a, b] = overlapping([image(0)?, image(1)?]);
        match self.kind.as_str() {
            "z" => {
                let unknown = || bad("standard errors are unknown: both images need variances");
                let z = compare(&a, &b, 1).map_err(bad)?.z.ok_or_else(unknown)?;
                let planes = z.channels.into_iter();
                Ok(planes.map(|(name, z)| (name, Arc::new(z))).collect())
            }
            "flip" => {
                let exposure: f64 = self.exposure.parse().map_err(bad)?;
                let shown = |image| exposed(image, exposure);
                let map = flip(&shown(&a), &shown(&b)).map_err(bad)?;
                Ok(vec![("FLIP".into(), Arc::new(map))])
            }
            kind => Err(bad(format!("'{kind}' is no difference: z or flip"))),
        }
    }
}

/// Returns the parts of two images that overlap if their top left corners do.
fn overlapping(images: [ImageLayers; 2]) -> [ImageLayers; 2] {
    let [a, b] = &images;
    let size = [a.width.min(b.width), a.height.min(b.height)];
    images.map(|image| cropped(image, size))
}

/// Returns the part of an image at its top left.
fn cropped(mut image: ImageLayers, [width, height]: [usize; 2]) -> ImageLayers {
    if [image.width, image.height] == [width, height] {
        return image;
    }
    let channels = image
        .layers
        .iter_mut()
        .flat_map(|layer| &mut layer.channels);
    for (_, values) in channels {
        let rows = values.chunks(image.width.max(1)).take(height);
        *values = rows.flat_map(|row| &row[..width]).copied().collect();
    }
    (image.width, image.height) = (width, height);
    image
}

/// Returns an image for a screen, before clipping of bright values.
fn exposed(image: &ImageLayers, stops: f64) -> RgbImage {
    let gain = stops.exp2() as f32;
    let mut shown = image.on_screen().unwrap_or_default();
    shown.pixels.iter_mut().flatten().for_each(|v| *v *= gain);
    shown
}
