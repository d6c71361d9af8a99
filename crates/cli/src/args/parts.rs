//! `morgana merge`, `morgana status`, and how renders are kept and divided.

use super::values::{duration, shard};
use super::{MemoryArgs, OutputArgs};
use crate::shard::Shard;
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;

/// How a render is kept in files, and divided among processes.
#[derive(Clone, Debug, ClapArgs)]
pub struct KeepArgs {
    /// Keep what was gathered in this file: from time to time, when the render is interrupted (Ctrl-C, SIGTERM, or a
    /// terminal that is closed), and at its end.
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Time between writing the checkpoint, or the part of a shard.
    #[arg(long, value_name = "DURATION", default_value = "1m", value_parser = duration)]
    pub checkpoint_every: Duration,
    /// Continue from the checkpoint, or from the part of a shard, if it exists: the result is that of a render that was not
    /// interrupted, bit for bit. More --spp than at first are fine.
    #[arg(long)]
    pub resume: bool,
    /// Take only part I, from 0 to N − 1, of N parts of the samples, and write a .part file for morgana merge. auto
    /// takes I and N from the variables of Slurm and AWS Batch arrays, auto/N only I.
    #[arg(long, value_name = "I/N", value_parser = shard, conflicts_with_all = ["checkpoint", "target_error"])]
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
    /// Where the scene is now, if it has moved. It must be the same.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Write what there is even if samples are missing.
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
    /// Print only the numbers of the shards that are missing or incomplete, as Slurm's --array takes them.
    #[arg(long, conflicts_with = "json")]
    pub missing: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}
