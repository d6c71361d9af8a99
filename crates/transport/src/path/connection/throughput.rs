//! Transmission along a connection (docs/theory.md#declared-index-matches,
//! docs/theory.md#masks-and-panes).

use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::medium::Attenuation;
use crate::scene::{MediumId, Scene};
use eikonal::connect::{Event, Piece};
use eikonal::interface::Rule;
use eikonal::ray::Arc;

/// Transmission along all pieces of a ray: depth, factors and choices.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConnectionThroughput {
    /// Optical depth.
    pub depth: Spectrum,
    /// Factor of the smooth interfaces, Fresnel factors included.
    pub factor: Spectrum,
    /// Probability that a randomly sampled edge makes the same discrete choices.
    pub choice: f64,
    /// Number of refractions and reflections.
    pub events: u32,
    /// Number of reflections.
    pub reflections: u32,
    /// ∏ n_after/n_before over declared index matches, in the order in which the ray was followed.
    pub jump: f64,
}

impl ConnectionThroughput {
    /// Accumulates the throughput along the pieces of a ray.
    pub(super) fn new(scene: &Scene, pieces: &[Piece<MediumId>]) -> Self {
        let mut throughput = ConnectionThroughput {
            depth: Spectrum::ZERO,
            factor: Spectrum::ONE,
            choice: 1.0,
            events: 0,
            reflections: 0,
            jump: 1.0,
        };
        for piece in pieces {
            let medium = scene.medium(piece.region);
            let attenuation = Attenuation::new(medium, &piece.arc, piece.theta_end);
            let length = piece.arc.arc_length(piece.theta_end);
            throughput.depth += attenuation.depth(piece.theta_end, length);
            if let Some(event) = &piece.event {
                throughput.cross(scene, event, &piece.arc);
            }
        }
        throughput
    }

    fn cross(&mut self, scene: &Scene, event: &Event, arc: &Arc) {
        let (n_near, n_after) = (event.before.length(), event.after.length());
        match &scene.objects()[event.surface].bsdf {
            Bsdf::Dielectric(dielectric) => {
                let cos = event.normal.dot(event.before).abs() / n_near;
                let transmitted = event.rule == Rule::Refract;
                let (factor, probability) =
                    dielectric.crossing(cos, n_near, event.far_n, transmitted);
                self.factor *= factor * probability;
                self.choice *= probability;
                self.events += 1;
                self.reflections += u32::from(!transmitted);
            }
            bsdf => {
                self.jump *= n_after / n_near;
                if bsdf.is_partial() {
                    self.pass_partial(scene, event.surface, arc);
                }
            }
        }
    }

    /// Multiplies by the transmission of a mask or a pane between media. The object must be the
    /// first boundary that the arc meets.
    fn pass_partial(&mut self, scene: &Scene, object: usize, arc: &Arc) {
        let boundary = scene.first_boundary(arc, None);
        let met = boundary.filter(|(found, _)| *found == object);
        let through = met.and_then(|(_, intersection)| scene.through(object, &intersection, arc));
        if let Some(through) = through {
            self.factor *= through.factor * through.probability;
            self.choice *= through.probability;
        }
    }
}

/// Returns the fraction of the power in a ray tube that passes the media and interfaces along it.
pub fn transmittance(scene: &Scene, pieces: &[Piece<MediumId>]) -> Spectrum {
    let throughput = ConnectionThroughput::new(scene, pieces);
    throughput.depth.exp_neg() * throughput.factor
}
