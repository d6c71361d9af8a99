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
        Each command has its own options and examples: morgana trace --help."
)]
pub struct Args {
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands. `-h` shows the first example and the most used options, `--help` everything.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to images.
    #[command(after_long_help = "Examples:\n  \
        morgana render scenes/luneburg_fog.xml --spp 256 -o fog.exr -o fog.png\n  \
        morgana render scenes/luneburg_fog.xml --spp 1e4 --checkpoint fog.part --resume\n\n\
        Without -o, the command writes an EXR and a PNG file named after the scene to the current folder, or an NPZ \
        file if the scene has meters instead of a camera (docs/meters.md). Ctrl-C stops the render and writes its \
        result so far. The same seed always gives the same image, for any number of threads, and even if the render \
        was interrupted and resumed (docs/clusters.md).")]
    Render(Box<RenderArgs>),
    /// Merge the parts of a render.
    #[command(
        after_help = "Example:\n  morgana merge fog.0-of-2.part fog.1-of-2.part -o fog.exr -o fog.png",
        after_long_help = "Example:\n  \
        morgana merge fog.0-of-2.part fog.1-of-2.part -o fog.exr -o fog.png\n\n\
        morgana render --shard and --checkpoint write parts. The result equals a render in one piece, bit for bit. \
        With -o NAME.part, the result is a part again. The command reads the scene from the file that was rendered, or \
        from --scene. It refuses parts of different scenes, versions or settings, and parts that share samples."
    )]
    Merge(MergeArgs),
    /// List existing and missing parts of a render.
    #[command(after_help = "Examples:\n  \
        morgana status fog.0-of-2.part fog.1-of-2.part\n  \
        morgana status --missing fog.0-of-2.part\n\n\
        Exit status: 0 if all samples exist, 1 if some are missing. --missing prints the argument of Slurm's --array: \
        sbatch --array=$(morgana status --missing *.part) job.sh")]
    Status(StatusArgs),
    /// Describe a scene: media, emitters, unique connections, memory.
    #[command(after_help = "Example:\n  morgana info scenes/luneburg_fog.xml")]
    Info(InfoArgs),
    /// Trace rays through a scene, and write or draw their paths.
    #[command(
        after_help = "Example:\n  \
        morgana trace scenes/luneburg_fog.xml --from=-3,0,0 --direction 1,0,0 -o ray.svg",
        after_long_help = "Example:\n  \
        morgana trace scenes/luneburg_fog.xml --from=-3,0,0 --direction 1,0,0 \\\n    \
        --rays 15 --width 1.8 -o rays.svg\n\n\
        Rays pass index-matched boundaries, are refracted or totally reflected by smooth dielectrics, and are \
        reflected by smooth metals. They end at all other surfaces, and where they leave the scene. Nothing scatters \
        them. Without -o, the command prints CSV, with 10 significant digits; files have all digits."
    )]
    Trace(TraceArgs),
    /// Show images, readings of meters and scenes in the browser.
    #[command(after_help = "Examples:\n  \
        morgana view fog.exr\n  \
        morgana view path.exr bdpt.exr scenes/luneburg_fog.xml\n\n\
        The command prints the address of a page with a random token, which only this machine can reach. The page shows \
        values with their errors, compares images, and follows curved rays through a scene (docs/guides/viewer.md). \
        Ctrl-C ends the command.")]
    View(ViewArgs),
    /// Find the rays between two points of a scene.
    #[command(
        after_help = "Example:\n  \
        morgana connect scenes/luneburg_fog.xml --from=-0.5,0.2,0 --to 0.7,0,0.1\n\n\
        Exit status: 0 if a ray is found, 1 if none is found, 2 for bad input.",
        after_long_help = "Examples:\n  \
        morgana connect scenes/luneburg_fog.xml --from=-0.5,0.2,0 --to 0.7,0,0.1\n  \
        morgana connect scenes/aquarium_laser.xml --from=10,4,0 --to 30,12,5 --all --reflections 1\n\n\
        The command prints JSON. \"branches\" lists rays with their directions, lengths, transmittance per channel and \
        ray-tube Jacobian dA/dΩ. Without --all, it has only the primary branch, which is found from the direction of \
        the chord; with --all, every branch, the shortest optical path first. \"occluded\" says if an opaque or rough \
        surface blocks a branch; \"reflections\" is the number of reflections where the ray could have been refracted. \
        The search follows rays in some 1500 directions and may miss branches that graze an interface. \"failure\" and \
        \"occluded\" at the end describe the primary branch.\n\n\
        \"certified_unique\": true says that no second ray exists with up to --reflections such reflections. false says \
        that a second ray is possible.\n\n\
        Exit status: 0 if a ray is found, even if a surface blocks it; 1 if none is found; 2 for bad input."
    )]
    Connect(ConnectArgs),
    /// Draw figures: profiles, maps, histograms, sections, convergence.
    #[command(after_help = "Example:\n  \
        morgana plot profile with.exr without.exr --row 48 -o profile.svg\n\n\
        Each figure has its own example: morgana plot image --help.")]
    Plot(PlotArgs),
    /// Compare an image with a reference: errors and maps of differences.
    #[command(
        after_help = "Example:\n  morgana compare new.exr old.exr --image difference.png",
        after_long_help = "Examples:\n  \
        morgana compare new.exr old.exr --image difference.png\n  \
        morgana compare path.exr bdpt.exr --max-z 6 --max-relative-mse 0.01\n\n\
        Errors are computed from linear values, over all pixels and channels (docs/images.md). Exit status: 0 if no \
        limit is exceeded, 1 if one is exceeded, 2 if the images cannot be compared."
    )]
    Compare(CompareArgs),
    /// Convert an image to a PNG file for a screen.
    #[command(after_help = "Examples:\n  \
        morgana tonemap fog.exr -o fog.png\n  \
        morgana tonemap fog.exr --exposure 1.5 --tone-map filmic -o fog.png\n\n\
        morgana plot image draws false colours with a colour bar.")]
    Tonemap(TonemapArgs),
    /// Denoise an image with Open Image Denoise into another file.
    #[command(
        after_help = "Example:\n  morgana denoise fog.exr -o fog_denoised.exr -o fog_denoised.png",
        after_long_help = "Example:\n  \
        morgana denoise fog.exr -o fog_denoised.exr -o fog_denoised.png\n\n\
        The command runs the program oidnDenoise, which must be installed (https://www.openimagedenoise.org). If the \
        image has the layers albedo and sh_normal from an integrator aov, they guide the denoiser (docs/images.md). \
        Denoising adds an unknown bias: do not measure on a denoised image. The layer 'difference' of the EXR file is \
        (denoised - estimate) / standard error. It shows where the denoiser changed more than noise explains."
    )]
    Denoise(DenoiseArgs),
    /// Convert a volume to another format and describe it.
    #[command(
        after_help = "Example:\n  \
        morgana convert density.npy -o density.vti --axes xyz --spacing 0.1,0.1,0.2",
        after_long_help = "Examples:\n  \
        morgana convert density.npy -o density.vti --axes xyz --spacing 0.1,0.1,0.2\n  \
        morgana convert kwave.h5 -o pressure.nrrd --dataset p_final --axes zyx --resample 64x64x32\n\n\
        Extensions choose the formats: .vol, .npy, .npz, .h5 or .hdf5, .mat, .nrrd, .vti, .vtk, .jnii, .bnii \
        and .jdt (docs/scene-format.md). Numbers keep their type if the new format has it. The summary states whether values \
        are rounded and whether the position in space is kept."
    )]
    Convert(ConvertArgs),
    /// Check a scene without a render: every error, warning and note.
    #[command(after_help = "Examples:\n  \
        morgana check scenes/acousto_optic_tissue.xml -D sigma_t=0.2\n  \
        morgana check --mitsuba scenes/luneburg_fog.xml\n\n\
        The check reads data files, too. It lists every difference from Mitsuba 3. Exit status: 0 if the scene can be \
        used, 2 if not.")]
    Check(CheckArgs),
    /// Run an input file of MCX with MCX's options, and write MCX's files.
    #[command(
        disable_help_flag = true,
        after_help = "Example:\n  \
        morgana mcx -f input.json -n 1e6 -O F -F jnii\n\n\
        morgana mcx --help lists the options of MCX that the command takes (docs/guides/from-mcx.md). A link named mcx to \
        the program is this command, for programs that call MCX."
    )]
    Mcx {
        /// Options of MCX.
        #[arg(
            value_name = "OPTIONS",
            trailing_var_arg = true,
            allow_hyphen_values = true
        )]
        arguments: Vec<String>,
    },
    /// Write a scene in the format of Mitsuba 3.
    #[command(
        after_help = "Example:\n  morgana export old.xml -o new.xml",
        after_long_help = "Examples:\n  \
        morgana export old.xml -o new.xml\n  \
        morgana export scene.json -D albedo=0.5 -o scene.xml\n\n\
        Scenes of Mitsuba 0.5 and 0.6 and dictionaries in JSON become one XML file of Mitsuba 3, with the values of all \
        parameters; with -o FILE.json, a dictionary. Features that only morgana has, such as the 'ior' of a medium, \
        stay in the file, and Mitsuba refuses them; the command lists them. Names of data files are relative to the \
        new file."
    )]
    Export(ExportArgs),
    /// Print the schema of scenes for completion and checks in editors.
    #[command(after_help = "Examples:\n  \
        morgana schema > scene.schema.json\n  \
        morgana schema --format xsd > scene.xsd\n\n\
        A scene in JSON names its schema by \"$schema\": \"scene.schema.json\". For XML, see the settings of the editor \
        (docs/scene-format.md).")]
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
// clap takes the group of a struct with flattened fields as empty, and optional scenes as missing.
#[group(args = ["path"], multiple = true)]
pub struct SceneArgs {
    /// Scene file: .json, or XML.
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Set a parameter that the scene declares; may be repeated.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,
    /// Suppress the warnings of a check, by the name in brackets; may be repeated.
    #[arg(long, value_name = "CHECK", value_parser = io::diagnostic::lints::named, hide_short_help = true)]
    pub silence: Vec<Lint>,
    #[command(flatten)]
    pub memory: MemoryArgs,
}

/// Limit of memory.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub struct MemoryArgs {
    /// Limit of memory for each data file and for the film or the meters, for example 8G.
    ///
    /// K, M, G and T are powers of 1024. A data file may always take ten times its size plus 64M,
    /// even beyond this limit. Defaults: 2G per file; the system's memory for the film and the
    /// meters.
    #[arg(long, value_name = "SIZE", value_parser = size, hide_short_help = true)]
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
    pub scene: Option<SceneArgs>,
    /// List the GPUs of this machine.
    #[arg(long, exclusive = true)]
    pub devices: bool,
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

    /// Returns the commands in the help texts, joined at lines that end with a backslash.
    fn examples(command: &clap::Command) -> Vec<String> {
        let texts = [command.get_after_help(), command.get_after_long_help()];
        let texts = texts.into_iter().flatten().map(ToString::to_string);
        let help = texts.collect::<Vec<_>>().join("\n").replace("\\\n", " ");
        let examples = help.lines().filter_map(|l| l.strip_prefix("  "));
        examples
            .map(|l| l.split(" > ").next().unwrap_or(l).to_owned())
            .collect()
    }

    #[test]
    fn short_help_fits_a_small_terminal() {
        let mut long = Vec::new();
        let program = Args::command().term_width(80);
        program
            .get_subcommands()
            .for_each(|command| check_short_help(command, &mut long));
        assert!(long.is_empty(), "{}", long.join("\n"));
    }

    /// Checks that the short help of a command and of its subcommands names the long help if it
    /// hides options. Adds it to `long` if it has more than 25 lines.
    fn check_short_help(command: &clap::Command, long: &mut Vec<String>) {
        let short = command.clone().term_width(80).render_help().to_string();
        let lines = short.trim_end().lines().count();
        if lines > 25 {
            long.push(format!("{lines} lines:\n{short}"));
        }
        let mut arguments = command.get_arguments();
        if arguments.any(clap::Arg::is_hide_short_help_set) {
            assert!(short.contains("'--help'"), "{short}");
        }
        for command in command.get_subcommands() {
            check_short_help(command, long);
        }
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
