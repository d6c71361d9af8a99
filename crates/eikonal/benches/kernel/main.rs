//! Costs of rays and connections.
//!
//! ```text
//! cargo bench -p morgana-eikonal                    # everything, a few minutes
//! cargo bench -p morgana-eikonal -- connections     # one part: evaluation, precision, steps, connections, methods, accuracy
//! ```
//!
//! Wall times depend on the machine and on its load. Every table therefore gives *ratios* of times
//! measured in turn within one run. Absolute times stand beside the ratios for orientation only.
//!
//! The unit of the first table is the time of the multiply-adds that evaluating a tricubic spline
//! needs at least. Their rate is the one that the machine reaches in registers with the instruction
//! set of the build (SSE2 on x86-64 by default). Evaluation itself uses the instructions that the
//! processor has, whatever the build.

mod accuracy;
mod connections;
mod evaluation;
mod methods;
mod plain;
mod precision;
mod published;
mod setup;
mod steps;
mod timing;

fn main() {
    // Cargo passes `--bench` too.
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let parts: [(&str, fn()); 6] = [
        ("evaluation", evaluation::run),
        ("precision", precision::run),
        ("steps", steps::run),
        ("connections", connections::run),
        ("methods", methods::run),
        ("accuracy", accuracy::run),
    ];
    for (name, run) in parts {
        if wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str())) {
            run();
        }
    }
}
