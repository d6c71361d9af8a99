//! Scripts for job arrays in docs/clusters, run by a stand-in that sets the variables of Slurm and
//! AWS Batch.

use crate::support::{Folder, program};
use std::process::Command;

/// Reads a script or definition of the documentation.
fn document(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/clusters/");
    std::fs::read_to_string(format!("{folder}{name}")).unwrap()
}

/// Runs a command in the folder with the program on its path. Asserts that it succeeds.
fn run(folder: &Folder, command: &[&str], variables: &[(&str, &str)]) {
    let bin = program().parent().unwrap().display().to_string();
    let path = format!("{bin}:{}", std::env::var("PATH").unwrap());
    let output = Command::new(command[0])
        .args(&command[1..])
        .current_dir(folder.path("."))
        .env("PATH", path)
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{command:?}: {text}");
}

#[test]
fn slurm_arrays_make_the_image() {
    let folder = Folder::with_fog();
    for name in ["shard.slurm", "merge.slurm"] {
        std::fs::write(folder.path(name), document(name)).unwrap();
    }
    let task = |id: &str, min: &str, max: &str, count: &str, parts: &[(&str, &str)]| {
        let mut variables = vec![
            ("SLURM_ARRAY_TASK_ID", id),
            ("SLURM_ARRAY_TASK_MIN", min),
            ("SLURM_ARRAY_TASK_MAX", max),
            ("SLURM_ARRAY_TASK_COUNT", count),
            ("SLURM_CPUS_PER_TASK", "2"),
        ];
        variables.extend(parts);
        run(
            &folder,
            &["sh", "shard.slurm", "scene.xml", "9"],
            &variables,
        );
    };
    // Task 2 of --array=0-3 fails; repeat it as the documentation describes.
    for id in ["3", "0", "1"] {
        task(id, "0", "3", "4", &[]);
    }
    let missing = folder.output(1, "status --missing parts/0.part parts/1.part parts/3.part");
    assert_eq!(missing.trim(), "2");
    task("2", "2", "2", "1", &[("PARTS", "4")]);
    // Slurm restarts tasks that it has stopped: nothing is left to do.
    task("1", "0", "3", "4", &[]);
    run(&folder, &["sh", "merge.slurm", "image.exr"], &[]);
    folder.succeed("render scene.xml --spp 9 -o whole.exr");
    assert!(folder.read("image.exr") == folder.read("whole.exr"));
}

#[test]
fn aws_batch_arrays_make_the_image() {
    let folder = Folder::with_fog();
    let definition: serde_json::Value = serde_json::from_str(&document("aws-batch.json")).unwrap();
    let place = folder.path(".").display().to_string();
    let command = definition["containerProperties"]["command"]
        .as_array()
        .unwrap();
    let word = |word: &serde_json::Value| match word.as_str().unwrap() {
        "Ref::folder" => place.clone(),
        "Ref::spp" => "9".into(),
        other => match other.strip_prefix("Ref::") {
            Some(name) => definition["parameters"][name].as_str().unwrap().to_owned(),
            None => other.to_owned(),
        },
    };
    let command: Vec<String> = command.iter().map(word).collect();
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    for index in ["1", "0", "2"] {
        let variables = [
            ("AWS_BATCH_JOB_ARRAY_INDEX", index),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "3"),
        ];
        run(&folder, &command, &variables);
    }
    folder.succeed("merge scene.0-of-3.part scene.1-of-3.part scene.2-of-3.part -o image.exr");
    folder.succeed("render scene.xml --spp 9 -o whole.exr");
    assert!(folder.read("image.exr") == folder.read("whole.exr"));
}
