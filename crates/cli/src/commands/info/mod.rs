//! `morgana info`: facts about a scene, as text and as JSON.

mod json;
mod text;

use crate::args::InfoArgs;
use crate::command_error::CommandError;
use crate::load::load_as_it_is;
use crate::output::safe;
use glam::DVec3;
use io::assemble::SpecularSurfaces;
use io::device::GpuDescription;
use io::diagnostic::Style;
use io::input::bytes;
use io::{Loaded, Run};
use std::io::{IsTerminal, Write as _};
use std::process::ExitCode;
use transport::emitter::Emitter;
use transport::integrator::{Integrator, RequiredConnection};
use transport::medium::Medium;
use transport::render::memory;
use transport::scene::MediumId;
use transport::sensor::Sensor;
use transport::volume::VolumeTexture;
use transport::{Scene, Spectrum};

/// Describes a scene.
pub fn info(args: &InfoArgs) -> Result<ExitCode, CommandError> {
    let mut stdout = std::io::stdout();
    if args.devices {
        stdout.write_all(devices().as_bytes())?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some(scene) = &args.scene else {
        return Err(CommandError::Usage("give a scene, or --devices".into()));
    };
    let loaded = load_as_it_is(scene)?;
    let text = if args.json {
        format!("{:#}\n", json::describe(&scene.path, &loaded))
    } else {
        let style = Style::detect(stdout.is_terminal());
        let text = text::describe(&scene.path, &loaded);
        safe(&text.map_err(|e| CommandError::Runtime(e.to_string()))?)
            + &loaded.warnings.render(style)
            + &loaded.note_of_differences().render(style)
    };
    stdout.write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Lists the GPUs of this machine.
fn devices() -> String {
    let gpus = io::device::gpus();
    if !io::device::has_gpu_support() {
        return "this build cannot use GPUs: build it with the feature gpu\n".into();
    }
    if gpus.is_empty() {
        return "no GPU was found: install its Vulkan driver\n".into();
    }
    let line = |(number, gpu): (usize, &GpuDescription)| {
        let memory = bytes(gpu.memory);
        let text = format!(
            "gpu:{number}  {} ({}, {}, buffers up to {memory})",
            gpu.name, gpu.kind, gpu.driver
        );
        safe(&text) + "\n"
    };
    gpus.iter().enumerate().map(line).collect()
}

/// Returns the reason why a GPU cannot measure the scene; `None` if one can.
fn gpu_refusal(loaded: &Loaded) -> Option<String> {
    let refusal = Run::new(loaded).check_device().err();
    refusal.map(|refusal| refusal.to_string())
}

/// Returns the kind of camera.
fn sensor_kind(scene: &Scene) -> &'static str {
    match scene.sensor() {
        Sensor::Perspective(_) => "perspective",
        Sensor::ThinLens(_) => "thinlens",
        Sensor::Orthographic(_) => "orthographic",
        Sensor::Absent(_) => "none (meters)",
        Sensor::Telecentric(_) => "telecentric",
        Sensor::Batch(_) => "batch",
    }
}

/// Returns the median distance in pixels by which the sensor's aperture diffracts light, for each
/// group of channels with diffraction.
fn diffraction(loaded: &Loaded) -> Vec<f64> {
    let median = |scene: &Scene| {
        let film = scene.film();
        let size = film.window.map_or([film.width, film.height], |w| w.image);
        let index = scene.n(scene.sensor_medium(), scene.sensor().position());
        let spread = scene.sensor().point_spread()?;
        Some(spread.median(index, size.map(|pixels| pixels as f64)))
    };
    loaded.groups.iter().filter_map(median).collect()
}

/// Returns the bytes of all films during a render, without and with images of strategies. The
/// second number is `None` if the integrator has no strategies.
fn film_memory(loaded: &Loaded) -> (usize, Option<usize>) {
    let image = Run::new(loaded);
    let strategies = Run {
        strategies: true,
        ..image.clone()
    };
    let integrator = loaded.renderer.integrator();
    let has_strategies = integrator.is_some_and(Integrator::separates_strategies);
    (
        memory(loaded.scene(), &image.options()),
        has_strategies.then(|| memory(loaded.scene(), &strategies.options())),
    )
}

/// Returns name, number of cells and bytes of every meter.
fn meters(loaded: &Loaded) -> impl Iterator<Item = (&str, usize, usize)> {
    loaded.instruments.iter().map(|instrument| {
        let cells = instrument.meter.cells();
        let channels = loaded.channel_names.len();
        let memory = instrument.meter.memory(loaded.scene(), channels);
        (instrument.name.as_str(), cells, memory)
    })
}

/// Returns smallest and largest index of a medium with constant index, over the wavelengths.
fn constant_index(loaded: &Loaded, id: MediumId) -> (f64, f64) {
    let indices = loaded.groups.iter().map(|s| s.n(id, DVec3::ZERO));
    indices.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), n| {
        (low.min(n), high.max(n))
    })
}

/// Returns smallest and largest extinction and albedo of a medium, over all channels.
fn extinction_and_albedo(loaded: &Loaded, id: MediumId) -> [(f64, f64); 2] {
    let all = |texture: fn(&Medium) -> &VolumeTexture| {
        range(in_groups(loaded, id).map(|(medium, channels)| (texture(medium), channels)))
    };
    let scale = loaded.scene().medium(id).scale;
    let (low, high) = all(|m| &m.sigma_t);
    [(low * scale, high * scale), all(|m| &m.albedo)]
}

/// Returns smallest and largest mean cosine of scattering in a medium, over all channels; `None` if
/// the medium does not scatter, or if the mean cosine varies in space or with the direction.
fn mean_cosine(loaded: &Loaded, id: MediumId) -> Option<(f64, f64)> {
    let medium = loaded.scene().medium(id);
    if !medium.scatters() || !medium.phase.is_uniform() {
        return None;
    }
    let mut media = in_groups(loaded, id);
    media.try_fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (medium, _)| {
            let g = medium.phase.mean_cosine(DVec3::ZERO)?;
            Some((low.min(g), high.max(g)))
        },
    )
}

/// Returns smallest and largest emission of a medium, over all channels; `None` if it is dark.
fn emission(loaded: &Loaded, id: MediumId) -> Option<(f64, f64)> {
    let media = in_groups(loaded, id);
    let emissions: Option<Vec<_>> = media
        .map(|(medium, channels)| Some((medium.emission.as_ref()?, channels)))
        .collect();
    Some(range(emissions?.into_iter()))
}

/// Returns the power that a medium emits, summed over all channels, and its standard error; `None`
/// if it is dark.
fn emitted_power(loaded: &Loaded, id: MediumId) -> Option<[f64; 2]> {
    let mut sums = None;
    for (group, scene) in loaded.groups.iter().enumerate() {
        let used = scene.film().channels_of(group);
        let is_medium = |e: &&Emitter| matches!(e, Emitter::Volume(v) if v.medium() == Some(id));
        if let Some(Emitter::Volume(light)) = scene.emitters().iter().find(is_medium) {
            let [power, error] = sums.unwrap_or([0.0, 0.0]);
            let sum = |s: Spectrum| s.0[..used].iter().sum::<f64>();
            sums = Some([power + sum(light.power()), error + sum(light.power_error())]);
        }
    }
    sums
}

/// Returns a medium in each group of channels, with the group's number of channels.
fn in_groups(loaded: &Loaded, id: MediumId) -> impl Iterator<Item = (&Medium, usize)> {
    let groups = loaded.groups.iter().enumerate();
    groups.map(move |(group, s)| (s.medium(id), s.film().channels_of(group)))
}

/// Describes which estimators find an emitter's light, and which light they miss. The flag is true
/// if they miss none. Returns `None` for scenes with meters.
fn found(loaded: &Loaded, emitter: &Emitter) -> Option<(String, bool)> {
    let integrator = loaded.renderer.integrator();
    let required = integrator.map_or(RequiredConnection::Nothing, |i| i.requires(emitter.class()));
    let finds = || match integrator {
        Some(i) if i.blurs() => ("by photons: complete, but blurred".into(), true),
        _ => finds(required, &SpecularSurfaces::of(loaded.scene())),
    };
    loaded.instruments.is_empty().then(finds)
}

fn finds(required: RequiredConnection, surfaces: &SpecularSurfaces) -> (String, bool) {
    let (by, edge) = match required {
        RequiredConnection::Nothing => {
            return ("by connections and by random walks: complete".into(), true);
        }
        RequiredConnection::FromEmitter => ("by connections", "on its way from the emitter"),
        RequiredConnection::ToSensor => ("from the emitter", "on its way to the sensor"),
        RequiredConnection::Any => ("from both ends", "on every part of its way"),
    };
    let k = surfaces.reflections;
    let reflected = match (surfaces.dielectric, surfaces.mirror) {
        (None, None) => return (format!("{by}, along all branches: complete"), true),
        (Some(_), None) => partially(k),
        (None, Some(_)) => "by mirrors".into(),
        (Some(_), Some(_)) => format!("by mirrors or {}", partially(k)),
    };
    let but = format!("{by}: complete, except for light that is reflected {reflected} {edge}");
    (but, false)
}

fn partially(reflections: u32) -> String {
    match reflections {
        0 => "partially".into(),
        1 => "partially more than once".into(),
        k => format!("partially more than {k} times"),
    }
}

/// Returns smallest and largest value over all groups of channels. The number in each pair is the
/// group's number of channels.
fn range<'a>(textures: impl Iterator<Item = (&'a VolumeTexture, usize)>) -> (f64, f64) {
    textures.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (texture, channels)| {
            let (a, b) = match texture {
                VolumeTexture::Uniform(v) => {
                    let used = &v.0[..channels];
                    let low = used.iter().copied().fold(f64::INFINITY, f64::min);
                    (low, used.iter().copied().fold(f64::NEG_INFINITY, f64::max))
                }
                VolumeTexture::Grid(grid) => grid.range(),
            };
            (low.min(a), high.max(b))
        },
    )
}
