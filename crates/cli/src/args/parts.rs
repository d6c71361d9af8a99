//! Arguments of `morgana merge` and `morgana status`, and options for checkpoints and shards.

use super::values::{duration, shard};
use super::{MemoryArgs, OutputArgs};
use crate::shard::Shard;
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;

/// Checkpoints and shards of a render.
#[derive(Clone, Debug, ClapArgs)]
pub struct KeepArgs {
    /// Save the samples in this file, to continue with --resume.
    ///
    /// The command saves them periodically, when the render is interrupted (Ctrl-C, SIGTERM, or a
    /// closed terminal), and at its end.
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub checkpoint: Option<PathBuf>,
    /// Time between saves of the checkpoint or of a shard's part.
    #[arg(long, value_name = "DURATION", default_value = "1m", value_parser = duration, hide_short_help = true)]
    pub checkpoint_every: Duration,
    /// Continue from the checkpoint, or from the shard's part, if it exists.
    ///
    /// The result equals an uninterrupted render bit for bit. --spp may be larger than at first.
    #[arg(long, hide_short_help = true)]
    pub resume: bool,
    /// Render part I (0 to N − 1) of N parts of the samples, for morgana merge.
    ///
    /// The command writes a .part file. auto reads I and N from the variables of Slurm and AWS Batch
    /// arrays; auto/N reads only I.
    #[arg(long, value_name = "I/N", value_parser = shard, conflicts_with_all = ["checkpoint", "target_error"], hide_short_help = true)]
    pub shard: Option<Shard>,
}

/// `morgana merge`.
#[derive(Debug, ClapArgs)]
pub struct MergeArgs {
    /// Parts: shards of a render (.part), or checkpoints.
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    #[command(flatten)]
    pub outputs: OutputArgs,
    /// Scene file, if it has moved; its content must be equal.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Write the result even if samples are missing.
    #[arg(long)]
    pub partial: bool,
    #[command(flatten)]
    pub memory: MemoryArgs,
}

/// `morgana status`.
#[derive(Debug, ClapArgs)]
pub struct StatusArgs {
    /// Parts: shards of a render (.part), or checkpoints.
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Print only the numbers of missing or incomplete shards, as Slurm's --array expects them.
    #[arg(long, conflicts_with = "json")]
    pub missing: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
