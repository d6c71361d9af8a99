//! Tagged light: requested sidebands and delays, and requirements on the sound in a scene
//! (docs/theory.md#tagged-light).

use super::channels::Channels;
use crate::query::Query;
use eikonal::field::Sound;
use transport::Scene;
use transport::scene::{ProblemSeverity, SceneProblem, Subject};
use transport::sidebands::Sidebands;

/// Largest plausible ratio of the wavelengths of sound and light. Ultrasound has about a thousand
/// times the wavelength of light; low tones in air stay below this ratio.
const MAX_WAVELENGTH_RATIO: f64 = 3e6;

/// Relative difference below which wavelengths or frequencies count as equal.
const PERIOD_TOLERANCE: f64 = 1e-9;

/// Reads the sidebands and delays that a plugin requests. They belong to light of its one
/// `wavelength`, so films of several wavelengths are refused.
pub(super) fn sidebands(q: &mut Query, channels: &Channels) -> Option<Sidebands> {
    if let Channels::Wavelengths { nm, .. } = channels
        && nm.len() > 1
    {
        let message =
            "tagged light has one wavelength, the film has several: list one in its 'wavelengths'";
        q.error("wavelength", message);
    }
    let wavelength = q.float("wavelength");
    let orders = q.integer("orders");
    let delays = q.integer("delays");
    Sidebands::new(wavelength, orders as u32, delays as u32)
}

/// Returns the problems of tagged light: no sound, several frequencies of sound, an unknown
/// displacement of the scatterers by the sound, or light whose wavelength is not shorter than the
/// sound's.
pub(super) fn problems(scene: &Scene, tagged: &[&Sidebands]) -> Vec<SceneProblem> {
    // Check that there is sound.
    let sounds = sounds(scene);
    if sounds.is_empty() {
        return vec![error(
            Subject::Sensor,
            "the scene requests tagged light, but no medium has sound".into(),
            "leave 'tagged' out, or give a medium an index with sound in it: a pressure is sound where it has a 'frequency'",
        )];
    }
    // Check each sound, and that all sounds have one frequency.
    let mut found: Vec<SceneProblem> = Vec::new();
    let mut frequency = None;
    let longest = tagged.iter().map(|sidebands| sidebands.wavelength());
    let longest = longest.fold(0.0, f64::max);
    for (i, (id, sound)) in sounds.iter().enumerate() {
        let name = &scene.media()[*id].name;
        let mut add = |message: String, help| {
            if !found.iter().any(|p| p.subject == Subject::Medium(*id)) {
                found.push(error(Subject::Medium(*id), message, help));
            }
        };
        if sound.elasto_optic.is_none() {
            add(
                format!(
                    "the displacement of scatterers by the sound in medium '{name}' is unknown"
                ),
                "give the volume of the sound 'elasto_optic', ρc² ∂n/∂p: 0.32 in water",
            );
        }
        if longest >= sound.wavelength {
            add(
                format!(
                    "tagged light of the wavelength {longest} is not shorter than the sound in medium '{name}', of the wavelength {}",
                    sound.wavelength
                ),
                "give the light's 'wavelength' in scene units: 532e-6 for green light where these are mm",
            );
        }
        let one = "tagged light needs one frequency of sound: give all sounds the same frequency";
        let mut earlier = sounds[..i].iter().filter(|(other, _)| other == id);
        if earlier.any(|(_, other)| differ(other.wavelength, sound.wavelength)) {
            add(
                format!("the sound in medium '{name}' has several wavelengths"),
                one,
            );
        }
        if let Some(hz) = sound.frequency {
            let first = *frequency.get_or_insert(hz);
            if differ(first, hz) {
                let message =
                    format!("the sound in medium '{name}' has {hz} Hz, another {first} Hz");
                add(message, one);
            }
        }
    }
    found
}

/// Returns a note about an assumption that the scene leaves open: sounds of different wavelengths
/// have one frequency.
pub(super) fn note(scene: &Scene) -> Option<String> {
    let sounds = sounds(scene);
    let (first, one) = sounds.first()?;
    let is_doubtful = |other: &Sound| {
        let is_told = one.frequency.is_some() && other.frequency.is_some();
        !is_told && differ(one.wavelength, other.wavelength)
    };
    let (second, other) = sounds.iter().find(|(_, other)| is_doubtful(other))?;
    let name = |id: &usize| &scene.media()[*id].name;
    Some(format!(
        "the sounds in media '{}' and '{}', of the wavelengths {} and {}, are assumed to have one frequency: give both a 'frequency' and a 'sound_speed' so that morgana can check this",
        name(first),
        name(second),
        one.wavelength,
        other.wavelength
    ))
}

/// Returns a warning that wavelengths of tagged light are probably not in scene units, because they
/// are far shorter than the wavelength of any sound.
pub(super) fn warning(scene: &Scene, tagged: &[&Sidebands]) -> Option<String> {
    let light = tagged.iter().map(|sidebands| sidebands.wavelength());
    let light = light.fold(f64::INFINITY, f64::min);
    let sound = sounds(scene).into_iter().map(|(_, sound)| sound.wavelength);
    let sound = sound.fold(f64::INFINITY, f64::min);
    (sound > MAX_WAVELENGTH_RATIO * light).then(|| {
        format!(
            "tagged light of the wavelength {light} is {:.0e} times shorter than the sound: the 'wavelength' is in scene units, \
             532e-6 for green light where these are mm",
            sound / light
        )
    })
}

/// Returns the sounds in all media, with the numbers of the media.
fn sounds(scene: &Scene) -> Vec<(usize, Sound)> {
    let media = scene.media().iter().enumerate();
    media
        .flat_map(|(id, medium)| medium.index.sounds().into_iter().map(move |s| (id, s)))
        .collect()
}

/// Returns true if two values differ by more than rounding.
fn differ(a: f64, b: f64) -> bool {
    (a - b).abs() > PERIOD_TOLERANCE * a
}

fn error(subject: Subject, message: String, help: &str) -> SceneProblem {
    SceneProblem {
        severity: ProblemSeverity::Error,
        subject,
        message,
        help: help.into(),
    }
}
