//! Command-line arguments. This module checks each value on its own. [`crate::config`] checks
//! conditions on several values, on files or on the scene.

mod denoise;
mod figures;
mod frames;
mod images;
mod parts;
mod rays;
mod render;
mod values;
mod view;
mod volumes;

use clap::{Args as ClapArgs, Parser, Subcommand};
use std::path::PathBuf;
use transport::scene::Lint;

pub use denoise::DenoiseArgs;
pub use figures::{FigureArgs, PlotArgs};
pub use frames::{Frames, PLACEHOLDER};
pub use images::{CompareArgs, ToneArgs, TonemapArgs};
pub use parts::{KeepArgs, MergeArgs, StatusArgs};
pub use rays::{ConnectArgs, TraceArgs};
pub use render::{OutputArgs, RenderArgs};
use values::{define, scene_file, size};
pub use view::ViewArgs;
pub use volumes::ConvertArgs;

/// Renders light in media of continuously varying refractive index.
#[derive(Debug, Parser)]
#[command(
    name = "morgana",
    version,
    max_term_width = 100,
    arg_required_else_help = true,
    after_help = "Example:\n  morgana render scenes/luneburg_fog.xml -o fog.exr -o fog.png\n\n\
        Each command has examples of its own: morgana trace --help."
)]
pub struct Args {
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to images.
    #[command(after_help = "Example:\n  \
        morgana render scenes/luneburg_fog.xml --spp 256 -o fog.exr -o fog.png\n  \
        morgana render scenes/luneburg_fog.xml --spp 9999 --checkpoint fog.part --resume\n\n\
        Without -o, an EXR and a PNG file named after the scene are written to the current folder; \
        an NPZ file if the scene has meters in place of a camera (docs/meters.md). \
        Ctrl-C stops the render and writes what there is; the same seed always gives the same image, \
        whatever the number of threads, and however often it was interrupted and resumed (docs/clusters.md).")]
    Render(Box<RenderArgs>),
    /// Merge the parts of a render.
    #[command(after_help = "Example:\n  \
        morgana merge fog.0-of-2.part fog.1-of-2.part -o fog.exr -o fog.png\n\n\
        Parts come from morgana render --shard and --checkpoint. The result is that of a render in one piece, \
        bit for bit. With -o NAME.part, it is a part again. The scene is read from where it was rendered, or \
        from --scene; parts of other scenes, versions or settings are refused, and samples that two parts have.")]
    Merge(MergeArgs),
    /// List existing and missing parts of a render.
    #[command(after_help = "Examples:\n  \
        morgana status fog.0-of-2.part fog.1-of-2.part\n  \
        morgana status --missing fog.0-of-2.part\n\n\
        Exit status: 0 if all samples are there, 1 if not. With --missing, print what Slurm's --array takes: \
        sbatch --array=$(morgana status --missing *.part) job.sh")]
    Status(StatusArgs),
    /// Describe a scene: media, emitters, certificates of unique connections, memory.
    #[command(after_help = "Example:\n  morgana info scenes/luneburg_fog.xml")]
    Info(InfoArgs),
    /// Trace rays through a scene and write their paths as CSV, JSON or a plot.
    #[command(after_help = "Example:\n  \
        morgana trace scenes/luneburg_fog.xml --from=-3,0,0 --direction 1,0,0 \\\n    \
        --rays 15 --width 1.8 -o rays.svg\n\n\
        Rays pass index-matched boundaries, are refracted by smooth dielectrics (or totally reflected) \
        and reflected by smooth metals; they end at any other surface and where they leave the scene. \
        Nothing is scattered. Without -o, CSV goes to the standard output.")]
    Trace(TraceArgs),
    /// Show images, readings of meters and scenes in the browser.
    #[command(after_help = "Examples:\n  \
        morgana view fog.exr\n  \
        morgana view path.exr bdpt.exr scenes/luneburg_fog.xml\n\n\
        Prints the address of a page, which only this machine can reach and which holds a random token. The page shows \
        values with their errors, compares images, and follows curved rays through a scene (docs/guides/viewer.md). \
        Ctrl-C ends.")]
    View(ViewArgs),
    /// Find the rays between two points of a scene.
    #[command(after_help = "Examples:\n  \
        morgana connect scenes/luneburg_fog.xml --from=-0.5,0.2,0 --to 0.7,0,0.1\n  \
        morgana connect scenes/aquarium_laser.xml --from=10,4,0 --to 30,12,5 --all --reflections 1\n\n\
        Prints JSON: the primary branch, found from the direction of the chord, with its directions, \
        lengths, transmittance per channel and the ray-tube Jacobian dA/dΩ. With --all, every branch, \
        the shortest optical path first; \"primary\" says which one is found from the chord, \
        \"occluded\" whether an opaque or rough surface blocks it, \"reflections\" how often it is \
        reflected where it could have been refracted. The search follows rays in some 1500 directions; \
        branches that graze an interface may be missed. \"failure\" and \"occluded\" at the end are \
        those of the primary branch.\n\n\
        \"certified_unique\" says that no second ray can exist, reflected where it could have been refracted at most as often as \
        was asked for; false says that none is known not to. \
        That there is no ray is an answer, not an error.")]
    Connect(ConnectArgs),
    /// Draw figures of results: profiles, maps, histograms over time, sections of fluence, convergence.
    #[command(after_help = "Example:\n  \
        morgana plot profile with.exr without.exr --row 48 -o profile.svg\n\n\
        Each figure has an example of its own: morgana plot image --help.")]
    Plot(PlotArgs),
    /// Compare an image with a reference: errors, a map of visible differences, standard errors.
    #[command(after_help = "Examples:\n  \
        morgana compare new.exr old.exr --image difference.png\n  \
        morgana compare path.exr bdpt.exr --max-z 6 --max-relative-mse 0.01\n\n\
        Exit status: 0 if no limit is exceeded, 1 if one is, 2 if the images cannot be compared. Numbers are of \
        linear values, over all pixels and channels (docs/images.md).")]
    Compare(CompareArgs),
    /// Convert an image to a PNG file for a screen.
    #[command(after_help = "Examples:\n  \
        morgana tonemap fog.exr -o fog.png\n  \
        morgana tonemap fog.exr --exposure 1.5 --tone-map filmic -o fog.png\n\n\
        For false colours with a colour bar see morgana plot image.")]
    Tonemap(TonemapArgs),
    /// Denoise an image with Open Image Denoise into another file.
    #[command(after_help = "Example:\n  \
        morgana denoise fog.exr -o fog_denoised.exr -o fog_denoised.png\n\n\
        Runs the program oidnDenoise, which must be installed (https://www.openimagedenoise.org). The layers albedo and sh_normal \
        of the image guide it, if an integrator aov has put them there (docs/images.md). A denoised image is no estimate: its error \
        is not known. The layer 'difference' of the EXR file is (denoised - estimate) / standard error, and tells where more \
        was changed than noise explains.")]
    Denoise(DenoiseArgs),
    /// Convert a volume to another format and describe it.
    #[command(after_help = "Examples:\n  \
        morgana convert density.npy density.vti --axes xyz --spacing 0.1,0.1,0.2\n  \
        morgana convert kwave.h5 pressure.nrrd --dataset p_final --axes zyx --resample 64x64x32\n\n\
        Extensions choose the formats: .vol, .npy, .npz, .h5 or .hdf5, .mat, .nrrd, .vti and .vtk \
        (docs/scene-format.md). Numbers keep their type where the new format has it; if values are \
        rounded or the place in space is not kept, the summary says so.")]
    Convert(ConvertArgs),
    /// Check a scene without rendering it: every error, warning and note.
    #[command(after_help = "Example:\n  \
        morgana check scenes/acousto_optic_tissue.xml -D sigma_t=0.2\n  \
        morgana check --mitsuba scenes/luneburg_fog.xml\n\n\
        Data files are read, too. Exit status: 0 if the scene can be used, 2 if not.")]
    Check(CheckArgs),
    /// Write a scene in the format of Mitsuba 3.
    #[command(after_help = "Examples:\n  \
        morgana export old.xml -o new.xml\n  \
        morgana export scene.json -D albedo=0.5 -o scene.xml\n\n\
        Scenes of Mitsuba 0.5 and 0.6 and dictionaries in JSON become XML of Mitsuba 3 in one file, with the values \
        of all parameters; with -o FILE.json, a dictionary. What only morgana has, such as the 'ior' of a medium, \
        stays, and is listed: Mitsuba refuses it. Names of data files are those seen from the new file.")]
    Export(ExportArgs),
    /// Print the schema of scenes for completion and checks in editors.
    #[command(after_help = "Examples:\n  \
        morgana schema > scene.schema.json\n  \
        morgana schema --format xsd > scene.xsd\n\n\
        A scene in JSON names it by \"$schema\": \"scene.schema.json\"; editors of XML have a setting for it (docs/scene-format.md).")]
    Schema {
        /// Format: json for scenes in JSON, xsd for scenes in XML.
        #[arg(long, value_name = "FORMAT", default_value = "json", value_parser = ["json", "xsd"])]
        format: String,
    },
    /// Print a script that completes command lines in a shell.
    #[command(after_help = "Example:\n  \
        morgana completions bash > ~/.local/share/bash-completion/completions/morgana")]
    Completions {
        /// Shell.
        shell: clap_complete::Shell,
    },
    /// Write manual pages: morgana.1, and one for each command.
    #[command(after_help = "Example:\n  morgana man ~/.local/share/man/man1")]
    Man {
        /// Folder to write to.
        #[arg(value_name = "FOLDER")]
        folder: PathBuf,
    },
}

/// A scene file and its parameters.
#[derive(Clone, Debug, ClapArgs)]
pub struct SceneArgs {
    /// Scene file: .json, or XML.
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Set a parameter that the scene declares; may be repeated.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,
    /// Suppress the warnings of a check, by the name in brackets; may be repeated.
    #[arg(long, value_name = "CHECK", value_parser = io::diagnostic::lints::named)]
    pub silence: Vec<Lint>,
    #[command(flatten)]
    pub memory: MemoryArgs,
}

/// Limit of memory.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub struct MemoryArgs {
    /// Memory for each data file once it is read, whatever its size, and for the film or the
    /// meters, for example 8G (K, M, G and T are powers of 1024). A file may always take ten times
    /// its size plus 64M. Defaults: 2G per file; the system's memory for the film and the meters.
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub memory: Option<u64>,
}

impl MemoryArgs {
    /// Returns the limits for readers.
    pub fn limits(self) -> io::Limits {
        io::Limits {
            memory: self.memory,
        }
    }
}

/// `morgana info`.
#[derive(Debug, ClapArgs)]
pub struct InfoArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `morgana check`.
#[derive(Debug, ClapArgs)]
pub struct CheckArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Report the scene's features: shared with Mitsuba 3, rendered differently, and missing.
    #[arg(long)]
    pub mitsuba: bool,
}

/// `morgana export`.
#[derive(Debug, ClapArgs)]
pub struct ExportArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Scene file to write: .xml, or .json.
    #[arg(short, long, value_name = "FILE", value_parser = scene_file)]
    pub output: PathBuf,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    /// Returns the commands in a help text, joined at lines that end with a backslash.
    fn examples(command: &clap::Command) -> Vec<String> {
        let help = command.get_after_help().map(ToString::to_string);
        let help = help.unwrap_or_default().replace("\\\n", " ");
        let examples = help.lines().filter_map(|l| l.strip_prefix("  "));
        examples
            .map(|l| l.split(" > ").next().unwrap_or(l).to_owned())
            .collect()
    }

    #[test]
    fn every_command_has_examples_that_can_be_given() {
        check_examples(&Args::command(), "morgana");
    }

    /// Checks the examples of the command `called` and of its subcommands.
    fn check_examples(command: &clap::Command, called: &str) {
        let examples = examples(command);
        assert!(!examples.is_empty(), "{called}");
        for example in examples {
            assert!(example.starts_with(called), "{called}: {example}");
            if let Err(e) = Args::try_parse_from(example.split_whitespace()) {
                panic!("{example}: {e}");
            }
        }
        for command in command.get_subcommands() {
            check_examples(command, &format!("{called} {}", command.get_name()));
        }
    }
}
