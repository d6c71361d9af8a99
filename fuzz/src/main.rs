//! Tries hostile inputs on every reader of files, and renders the scenes among them: `fuzz
//! [--seconds S] [--seed N] [TARGET...]`.
//!
//! Each input is a random change of one in the corpus; the seed determines all inputs. An input
//! must not cause a panic, run for long, or take more memory than its size justifies. The first
//! input that does is kept in `target/fuzz` and ends the program with status 1. Move it to
//! `fuzz/corpus` once the mistake is fixed.

mod corpus;
mod mutation;
mod targets;
mod watch;

use mutation::Random;
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime};
use targets::{TARGETS, Target};

/// Options of the command line.
struct Wanted {
    /// Time for each target.
    time: Duration,
    seed: u64,
    targets: Vec<&'static Target>,
}

fn main() -> ExitCode {
    let wanted = match wanted(std::env::args().skip(1)) {
        Ok(wanted) => wanted,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    println!("seed {}, {:?} for each target", wanted.seed, wanted.time);
    for target in wanted.targets {
        run(target, wanted.time, wanted.seed);
    }
    ExitCode::SUCCESS
}

fn wanted(mut arguments: impl Iterator<Item = String>) -> Result<Wanted, String> {
    let usage = || "usage: fuzz [--seconds S] [--seed N] [TARGET...]".to_owned();
    let clock = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let mut wanted = Wanted {
        time: Duration::from_secs(10),
        seed: clock.map_or(0, |t| t.as_secs()),
        targets: Vec::new(),
    };
    while let Some(argument) = arguments.next() {
        let mut number = || {
            arguments
                .next()
                .and_then(|n| n.parse().ok())
                .ok_or_else(usage)
        };
        match argument.as_str() {
            "--seconds" => wanted.time = Duration::from_secs(number()?),
            "--seed" => wanted.seed = number()?,
            name => {
                let found = TARGETS.iter().find(|t| t.name == name);
                let names = || {
                    TARGETS
                        .iter()
                        .map(|t| t.name)
                        .collect::<Vec<_>>()
                        .join(", ")
                };
                wanted.targets.push(
                    found.ok_or_else(|| format!("no target '{name}'; there are {}", names()))?,
                );
            }
        }
    }
    if wanted.targets.is_empty() {
        wanted.targets = TARGETS.iter().collect();
    }
    Ok(wanted)
}

/// Tries the corpus of a target unchanged, then changed inputs until the time is over.
fn run(target: &Target, time: Duration, seed: u64) {
    let corpus = corpus::of(target);
    for input in &corpus {
        watch::attempt(target, input);
    }
    let started = Instant::now();
    let mut count = 0u64;
    while started.elapsed() < time {
        let mut random = Random::new(seed, target.name, count);
        let input = target.seal(mutation::mutated(&corpus, &mut random));
        watch::attempt(target, &input);
        count += 1;
    }
    println!(
        "{:10} {} in the corpus, {count} inputs",
        target.name,
        corpus.len()
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All corpora work, including inputs that once failed.
    #[test]
    fn the_corpora_and_a_few_inputs() {
        for target in TARGETS {
            run(target, Duration::from_millis(50), 1);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_inputs() {
        let corpus = vec![b"one two 3.5".to_vec(), vec![0; 100]];
        let input = |seed| mutation::mutated(&corpus, &mut Random::new(seed, "xml", 7));
        assert_eq!(input(1), input(1));
        assert_ne!(input(1), input(2));
    }
}
