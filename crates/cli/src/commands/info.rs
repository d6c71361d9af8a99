//! `morgana info`.

use crate::args::SceneArgs;
use crate::failure::Failure;
use crate::layers::Naming;
use crate::load::{file_name, load};
use crate::numbers::{bytes, percent, plain};
use eikonal::Uniqueness;
use glam::DVec3;
use io::Loaded;
use io::assemble::{Needs, Walls};
use io::diagnostic::Style;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::process::ExitCode;
use transport::Scene;
use transport::medium::Texture;
use transport::meter::Tally;
use transport::path::lead_in;
use transport::render::{Options, memory};
use transport::scene::MediumId;
use transport::sensor::Sensor;

/// Describes a scene.
pub fn info(args: &SceneArgs) -> Result<ExitCode, Failure> {
    let loaded = load(args, None, None)?;
    let mut text = String::new();
    describe(&mut text, args, &loaded).map_err(|e| Failure::Runtime(e.to_string()))?;
    let mut stdout = std::io::stdout();
    let style = Style::detect(stdout.is_terminal());
    text.push_str(&loaded.warnings.render(style));
    stdout.write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn describe(out: &mut String, args: &SceneArgs, loaded: &Loaded) -> std::fmt::Result {
    let scene = loaded.scene();
    writeln!(out, "{}", file_name(&args.path))?;
    writeln!(out, "  hash         {}", loaded.hash)?;
    match loaded.instruments.is_empty() {
        true => picture(out, loaded)?,
        false => meters(out, loaded)?,
    }
    writeln!(
        out,
        "  tolerance    {:e} of a ray's length",
        scene.tolerance().get()
    )?;
    if loaded.instruments.is_empty() {
        if Walls::of(scene).dielectric.is_some() {
            writeln!(out, "  branches     through up to {}", reach(scene))?;
        }
        writeln!(out, "  sensor       {}", sensor(scene))?;
    }
    writeln!(out, "  objects      {}", scene.objects().len())?;
    writeln!(out, "\nemitters     {}", scene.emitters().len())?;
    emitters(out, loaded)?;
    writeln!(out, "\nmedia        {}", scene.media().len())?;
    for id in 0..scene.media().len() {
        medium(out, loaded, id)?;
    }
    writeln!(out)
}

/// What measures in place of a camera.
fn meters(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let channels = loaded.channel_names.join(" ");
    writeln!(
        out,
        "  sampling     {} particles{}, {channels}",
        loaded.samples,
        instants(loaded)
    )?;
    for instrument in &loaded.instruments {
        let cells = instrument.meter.cells();
        let memory = Tally::memory(cells * loaded.channel_names.len());
        let (name, memory) = (&instrument.name, bytes(memory));
        writeln!(out, "  meter        {name}: {cells} bins, {memory}")?;
    }
    Ok(())
}

/// The film, and how it is filled.
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
    writeln!(
        out,
        "  sampling     {} samples per pixel{}, integrator {}",
        loaded.samples,
        instants(loaded),
        loaded.integrator.name()
    )
}

/// Over how many instants of a period of sound samples are spread.
fn instants(loaded: &Loaded) -> String {
    match loaded.scene().instants() {
        1 => String::new(),
        n => format!(" at {n} phases of the sound"),
    }
}

/// How light is told apart, and the bytes that all films take while they are rendered.
fn film_layers(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let scene = loaded.scene();
    let mut options = Options {
        decomposition: loaded.layering.decomposition,
        reweight: loaded.reweight,
        ..Options::new(loaded.integrator, loaded.samples, 0)
    };
    if let Some(naming) = Naming::of(loaded) {
        writeln!(out, "               {}", naming.describe())?;
        let around = scene.around();
        let outside = (0..scene.emitters().len()).any(|i| lead_in(scene, i) > 0.0);
        if options.decomposition.length.is_some() && outside {
            writeln!(
                out,
                "               light from outside counts from the ball of radius {} around {}",
                plain(around.radius),
                point(around.center)
            )?;
        }
    }
    let image = bytes(memory(scene.film(), &options));
    options.strategies = true;
    let strategies = match loaded.integrator.splats() {
        true => format!(
            "; up to {} with --strategies",
            bytes(memory(scene.film(), &options))
        ),
        false => String::new(),
    };
    writeln!(out, "               {image}{strategies}")
}

fn sensor(scene: &Scene) -> String {
    let kind = match scene.sensor() {
        Sensor::Perspective(_) => "perspective",
        Sensor::ThinLens(_) => "thinlens",
        Sensor::Orthographic(_) => "orthographic",
        Sensor::Absent(_) => "none (meters)",
        Sensor::Telecentric(_) => "telecentric",
    };
    let place = point(scene.sensor().position());
    let medium = scene.sensor_medium();
    let name = &scene.medium(medium).name;
    let n = scene.n(medium, scene.sensor().position());
    format!("{kind} at {place}, in '{name}' (n = {})", plain(n))
}

fn emitters(out: &mut String, loaded: &Loaded) -> std::fmt::Result {
    let walls = Walls::of(loaded.scene());
    for emitter in loaded.scene().emitters() {
        if !loaded.instruments.is_empty() {
            writeln!(out, "  {}", emitter.kind())?;
            continue;
        }
        let needs = Needs::of(&loaded.integrator, emitter.is_delta());
        let found = found(needs, &walls);
        writeln!(out, "  {:<12} found {found}", emitter.kind())?;
    }
    Ok(())
}

/// What finds an emitter's light, and how much of it.
fn found(needs: Needs, walls: &Walls) -> String {
    let (by, edge) = match needs {
        Needs::Nothing => return "by connections and by chance: complete".into(),
        Needs::FromEmitter => ("by connections", "on its way from the emitter"),
        Needs::ToSensor => ("from the emitter", "on its way to the sensor"),
        Needs::One => ("from both ends", "on every part of its way"),
    };
    let k = walls.reflections;
    let reflected = match (walls.dielectric, walls.mirror) {
        (None, None) => return format!("{by}, along all branches: complete"),
        (Some(_), None) => partially(k),
        (None, Some(_)) => "by mirrors".into(),
        (Some(_), Some(_)) => format!("by mirrors or {}", partially(k)),
    };
    format!("{by}: complete but for light that is reflected {reflected} {edge}")
}

fn partially(reflections: u32) -> String {
    match reflections {
        0 => "partially".into(),
        1 => "partially more than once".into(),
        k => format!("partially more than {k} times"),
    }
}

/// Through how many reflections at smooth dielectrics branches are looked for.
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
    let wavelengths = loaded.groups.iter();
    let indices = wavelengths.map(|s| s.n(id, DVec3::ZERO));
    let (low, high) = indices.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), n| {
        (low.min(n), high.max(n))
    });
    if medium.index.is_constant() {
        let n = span((low, high), 1.0);
        writeln!(out, "    index      {n}: straight rays")?;
    } else {
        let first = match low < high {
            true => format!(", at {}", loaded.channel_names[0]),
            false => String::new(),
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
            "    branches   {}",
            certificate(region.uniqueness.as_ref())
        )?;
    }
    if medium.is_transparent() {
        return writeln!(out, "    clear");
    }
    let groups = loaded.groups.iter().enumerate();
    let groups = groups.map(|(group, s)| (s.medium(id), s.film().lanes_of(group)));
    let all = |texture: fn(&transport::medium::Medium) -> &Texture| {
        range(
            groups
                .clone()
                .map(|(medium, lanes)| (texture(medium), lanes)),
        )
    };
    let sigma = all(|m| &m.sigma_t);
    writeln!(
        out,
        "    extinction {} per unit length",
        span(sigma, medium.scale)
    )?;
    writeln!(out, "    albedo     {}", span(all(|m| &m.albedo), 1.0))?;
    match medium.memory() {
        0 => Ok(()),
        n => writeln!(out, "    grids      {}", bytes(n)),
    }
}

/// Smallest and largest value over all groups of channels, of which so many count.
fn range<'a>(textures: impl Iterator<Item = (&'a Texture, usize)>) -> (f64, f64) {
    textures.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (texture, lanes)| {
            let (a, b) = match texture {
                Texture::Uniform(v) => {
                    let used = &v.0[..lanes];
                    let low = used.iter().copied().fold(f64::INFINITY, f64::min);
                    (low, used.iter().copied().fold(f64::NEG_INFINITY, f64::max))
                }
                Texture::Grid(grid) => grid.range(),
            };
            (low.min(a), high.max(b))
        },
    )
}

fn span((low, high): (f64, f64), scale: f64) -> String {
    let (low, high) = (plain(low * scale), plain(high * scale));
    if low == high {
        low
    } else {
        format!("{low} to {high}")
    }
}

/// Whether several rays may connect two points of the medium, and why.
fn certificate(uniqueness: Option<&Uniqueness>) -> String {
    let Some(uniqueness) = uniqueness else {
        return "not certified: the medium is not one closed convex shape".into();
    };
    let bounds = uniqueness.bounds();
    let longest = uniqueness.longest_ray();
    if !longest.is_finite() {
        return format!(
            "not certified: rays may be arbitrarily long (κD ≥ 2 with κ = {})",
            plain(bounds.kappa())
        );
    }
    // Klingenberg's criterion, theory §5.
    let curvature = 2.0 * bounds.neg_hess_ln_n() / bounds.n2_min;
    let used = bounds.n_max() * longest * curvature.sqrt() / std::f64::consts::PI;
    let ray = format!("longest ray {}", plain(longest));
    if uniqueness.whole_medium() {
        format!(
            "unique between any two points ({ray}, {} of the bound)",
            percent(used)
        )
    } else {
        format!(
            "not certified for the medium as a whole ({ray}, {} of the bound); near points may be",
            percent(used)
        )
    }
}

fn point(x: DVec3) -> String {
    let [x, y, z] = x.to_array().map(plain);
    format!("({x}, {y}, {z})")
}
