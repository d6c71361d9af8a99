//! Description of a scene as text.

use super::{
    constant_index, diffraction, emission, emitted_power, extinction_and_albedo, film_memory,
    found, mean_cosine, sensor_kind,
};
use crate::load::file_name;
use crate::numbers::{count, percent, plain};
use eikonal::Uniqueness;
use glam::DVec3;
use io::assemble::{CondensedGrid, SoundRecord, SpecularSurfaces, steps_across};
use io::diagnostic::escaped;
use io::input::bytes;
use io::rendered::Naming;
use io::{Loaded, Run};
use std::fmt::Write as _;
use std::path::Path;
use transport::Scene;
use transport::path::lead_in;
use transport::scene::MediumId;

/// Returns the command's output without warnings.
pub fn describe(path: &Path, loaded: &Loaded) -> Result<String, std::fmt::Error> {
    let scene = loaded.scene();
    let mut text = String::new();
    let out = &mut text;
    writeln!(out, "{}", escaped(&file_name(path)))?;
    writeln!(out, "  hash         {}", loaded.hash)?;
    if loaded.instruments.is_empty() {
        picture(out, loaded)?
    } else {
        meters(out, loaded)?
    }
    writeln!(
        out,
        "  tolerance    {:e} of a ray's length{}",
        scene.tolerance().get(),
        if may_loosen(loaded) {
            ", or looser where noise hides it"
        } else {
            ""
        }
    )?;
    if loaded.instruments.is_empty() {
        if SpecularSurfaces::of(scene).dielectric.is_some() {
            writeln!(out, "  branches     through up to {}", reach(scene))?;
        }
        writeln!(out, "  sensor       {}", sensor(scene))?;
        if let Some(pixels) = diffracted(loaded) {
            writeln!(
                out,
                "  diffraction  half of the light within {pixels} pixels of its position"
            )?;
        }
    }
    writeln!(out, "  objects      {}", scene.objects().len())?;
    writeln!(out, "\nemitters     {}", scene.emitters().len())?;
    emitters(out, loaded)?;
    writeln!(out, "\nmedia        {}", scene.media().len())?;
    for id in 0..scene.media().len() {
        medium(out, loaded, id)?;
    }
    if !loaded.sounds.is_empty() {
        writeln!(out, "\nsounds       {}", loaded.sounds.len())?;
    }
    for record in &loaded.sounds {
        sound(out, record)?;
    }
    if !loaded.condensed.is_empty() {
        writeln!(
            out,
            "\ngrids that are finer than needed {}",
            loaded.condensed.len()
        )?;
    }
    for grid in &loaded.condensed {
        condensed(out, grid)?;
    }
    writeln!(out)?;
    Ok(text)
}

/// Writes the lines on a grid of the index that is held with fewer samples than its file has.
fn condensed(out: &mut String, grid: &CondensedGrid) -> std::fmt::Result {
    let of = grid
        .file
        .as_ref()
        .map_or(String::new(), |file| format!(" of {}", escaped(file)));
    let times = |[x, y, z]: [usize; 3]| format!("{x} × {y} × {z}");
    writeln!(out, "  {}{of}", grid.plugin)?;
    writeln!(
        out,
        "    samples    {}, stored as {}, which changes n² by at most {:.1e}",
        times(grid.size),
        times(grid.held),
        grid.tolerance
    )
}

/// Writes the lines on a volume of sound, with the source of each fact.
fn sound(out: &mut String, record: &SoundRecord) -> std::fmt::Result {
    let place = record.placed_by.name();
    match &record.file {
        Some(file) => writeln!(out, "  {} of {}", record.plugin, escaped(file))?,
        None => writeln!(out, "  {}", record.plugin)?,
    }
    let [x, y, z] = record.size;
    writeln!(
        out,
        "    grid       {x} × {y} × {z} ({})",
        record.sized_by().name()
    )?;
    writeln!(
        out,
        "    spacing    {} scene units ({place})",
        point(record.spacing())
    )?;
    writeln!(out, "    origin     {} ({place})", point(record.origin()))?;
    if let Some(frequency) = record.frequency {
        writeln!(out, "    frequency  {} Hz (scene)", plain(frequency))?;
    }
    let Some(series) = &record.series else {
        return Ok(());
    };
    if let Some((step, source)) = series.time_step {
        writeln!(out, "    time step  {} s ({})", plain(step), source.name())?;
    }
    let frames = format!("of {} ({})", series.frames, record.sized_by().name());
    match series.residual {
        None => writeln!(out, "    frame      {} {frames}", series.first),
        Some(residual) => {
            writeln!(out, "    frames     the last {} {frames}", series.used)?;
            writeln!(
                out,
                "    residual   {} of the pressure (root mean square)",
                percent(residual)
            )
        }
    }
}

/// Writes the lines on sampling and meters.
fn meters(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let channels = loaded.channel_names.join(" ");
    writeln!(
        out,
        "  sampling     {} particles{}, {channels}",
        loaded.samples,
        instants(loaded)
    )?;
    for (name, cells, memory) in super::meters(loaded) {
        writeln!(
            out,
            "  meter        {name}: {cells} bins, {}",
            bytes(memory as u64)
        )?;
    }
    let refusal = super::gpu_refusal(loaded);
    let gpu = refusal
        .as_deref()
        .unwrap_or("can run this scene: --device gpu");
    writeln!(out, "  GPU          {}", escaped(gpu))
}

/// Returns true if rays of a picture may be less accurate than the scene's tolerance.
fn may_loosen(loaded: &Loaded) -> bool {
    let options = Run::new(loaded).options();
    loaded.instruments.is_empty() && options.may_loosen() && !loaded.scene().is_straight()
}

fn picture(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let film = loaded.scene().film();
    writeln!(
        out,
        "  film         {} × {}, {}",
        film.width,
        film.height,
        loaded.channel_names.join(" ")
    )?;
    film_layers(out, loaded)?;
    if loaded.quantities.is_some() {
        let names = loaded.quantity_names.iter().map(|q| q.name.as_str());
        let names: Vec<_> = names.collect();
        writeln!(out, "  quantities   {}", names.join(" "))?;
    }
    writeln!(
        out,
        "  sampling     {} samples per pixel{}, integrator {}",
        loaded.samples,
        instants(loaded),
        loaded.integrator()
    )
}

/// Describes the number of instants of a period of sound over which samples are spread.
fn instants(loaded: &Loaded) -> String {
    match loaded.scene().instants() {
        1 => String::new(),
        n => format!(" at {n} phases of the sound"),
    }
}

/// Writes how light is separated, and the bytes of all films during a render.
fn film_layers(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let scene = loaded.scene();
    if let Some(naming) = Naming::of(loaded) {
        writeln!(out, "               {}", naming.describe())?;
        let around = scene.around();
        let outside = (0..scene.emitters().len()).any(|i| lead_in(scene, i) > 0.0);
        if loaded.layering.decomposition.length.is_some() && outside {
            writeln!(
                out,
                "               light from outside counts from the ball of radius {} around {}",
                plain(around.radius),
                point(around.center)
            )?;
        }
    }
    let (image, strategies) = film_memory(loaded);
    let strategies = strategies.map(|n| format!("; up to {} with --strategies", bytes(n as u64)));
    let strategies = strategies.unwrap_or_default();
    writeln!(out, "               {}{strategies}", bytes(image as u64))
}

fn emitters(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    for emitter in loaded.scene().emitters() {
        match found(loaded, emitter) {
            None => writeln!(out, "  {}", emitter.kind())?,
            Some((found, _)) => writeln!(out, "  {:<12} found {found}", emitter.kind())?,
        }
    }
    Ok(())
}

/// Describes the largest number of reflections at smooth dielectrics in the search for branches.
fn reach(scene: &Scene) -> String {
    let reach = scene.branch_reach();
    format!(
        "{} partial reflections, {} with total ones",
        reach.reflections, reach.bounces
    )
}

fn medium(out: &mut String, loaded: &Loaded, id: MediumId) -> std::fmt::Result {
    let scene = loaded.scene();
    let (medium, region) = (scene.medium(id), &scene.regions()[id]);
    let bounds = &region.bounds;
    writeln!(out, "  {}", medium.name)?;
    if region.aabb.is_empty() {
        return writeln!(
            out,
            "    reference index of optical path differences: no shape has this medium"
        );
    }
    let (low, high) = constant_index(loaded, id);
    if medium.index.is_constant() {
        let n = span(low, high);
        writeln!(out, "    index      {n}: straight rays")?;
    } else {
        let first = if low < high {
            format!(", at {}", loaded.channel_names[0])
        } else {
            String::new()
        };
        writeln!(
            out,
            "    index      {} to {} (bounds{first})",
            plain(bounds.n_min()),
            plain(bounds.n_max())
        )?;
        writeln!(
            out,
            "    max |∇ln n|  {} per unit length",
            plain(bounds.kappa())
        )?;
        writeln!(
            out,
            "    steps      about {} for a ray across",
            count(steps_across(scene, id))
        )?;
        writeln!(
            out,
            "    branches   {}",
            certificate(region.uniqueness.as_ref())
        )?;
    }
    if medium.is_transparent() {
        return writeln!(out, "    clear");
    }
    let [extinction, albedo] = extinction_and_albedo(loaded, id).map(|(low, high)| span(low, high));
    writeln!(out, "    extinction {extinction} per unit length")?;
    writeln!(out, "    albedo     {albedo}")?;
    if let Some((low, high)) = mean_cosine(loaded, id) {
        writeln!(out, "    mean cosine  {}", span(low, high))?;
    }
    if let Some((low, high)) = emission(loaded, id) {
        writeln!(out, "    emission   {}", span(low, high))?;
        if let Some([power, error]) = emitted_power(loaded, id) {
            let power = plain(power);
            if error > 0.0 {
                writeln!(
                    out,
                    "    emits      {power} ± {} W (estimated)",
                    plain(error)
                )?;
            } else {
                writeln!(out, "    emits      {power} W")?;
            }
        }
    }
    match medium.memory() {
        0 => Ok(()),
        n => writeln!(out, "    grids      {}", bytes(n as u64)),
    }
}

fn span(low: f64, high: f64) -> String {
    let (low, high) = (plain(low), plain(high));
    if low == high {
        low
    } else {
        format!("{low} to {high}")
    }
}

/// Describes whether several rays may connect two points of the medium, and how renders find them.
fn certificate(uniqueness: Option<&Uniqueness>) -> String {
    // Klingenberg's criterion, docs/theory.md#certificate.
    match uniqueness {
        Some(certified) if certified.whole_medium() => format!(
            "one ray between any two points, at most {} long (certified)",
            plain(certified.longest_ray())
        ),
        Some(partly) if partly.longest_ray().is_finite() => {
            "several rays may connect distant points: renders search for them".into()
        }
        _ => "several rays may connect two points: renders search for them".into(),
    }
}

fn sensor(scene: &Scene) -> String {
    let place = point(scene.sensor().position());
    let medium = scene.sensor_medium();
    let name = &scene.medium(medium).name;
    let n = scene.n(medium, scene.sensor().position());
    let kind = sensor_kind(scene);
    format!("{kind} at {place}, in '{name}' (n = {})", plain(n))
}

/// Describes how far the aperture spreads light in pixels, over all wavelengths.
fn diffracted(loaded: &Loaded) -> Option<String> {
    let medians = diffraction(loaded);
    let least = medians.iter().copied().reduce(f64::min)?;
    let most = medians.into_iter().reduce(f64::max)?;
    let (least, most) = (format!("{least:.2}"), format!("{most:.2}"));
    Some(if least == most {
        most
    } else {
        format!("{least} to {most}")
    })
}

fn point(x: DVec3) -> String {
    let [x, y, z] = x.to_array().map(plain);
    format!("({x}, {y}, {z})")
}
