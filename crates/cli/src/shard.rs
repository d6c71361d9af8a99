//! Selection of the part of a render that this process computes.

use std::env;

/// A part of a render, as given on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shard {
    /// Part with index `.0`, from 0, of `.1` parts.
    Part(u64, u64),
    /// Index from the task in a job array; the number of parts, too, if it is not given.
    Auto(Option<u64>),
}

/// Parses `3/16`, `auto` or `auto/16`.
pub fn parse(text: &str) -> Result<Shard, String> {
    let message =
        || "expected I/N with I from 0 to N − 1, such as 3/16, or auto, or auto/N".to_owned();
    let (index, count) = match text.split_once('/') {
        None => (text, None),
        Some((index, count)) => (index, Some(count.parse().map_err(|_| message())?)),
    };
    match (index, count) {
        ("auto", Some(0)) => Err(message()),
        ("auto", count) => Ok(Shard::Auto(count)),
        (index, Some(count)) => match index.parse() {
            Ok(index) if index < count => Ok(Shard::Part(index, count)),
            _ => Err(message()),
        },
        _ => Err(message()),
    }
}

/// Variables of job arrays: the task's index, the array's size, and the number to add to the size.
/// This number is 1 if the size is given as the index of the last task.
const ARRAYS: [(&str, &str, u64); 2] = [
    ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MAX", 1),
    ("AWS_BATCH_JOB_ARRAY_INDEX", "AWS_BATCH_JOB_ARRAY_SIZE", 0),
];

impl Shard {
    /// Returns the index of the part and the number of parts.
    ///
    /// # Errors
    /// Returns an error if the variables of the job array are wrong.
    pub fn resolve(self) -> Result<[u64; 2], String> {
        self.resolve_by(|name| env::var(name).ok())
    }

    fn resolve_by(self, variable: impl Fn(&str) -> Option<String>) -> Result<[u64; 2], String> {
        let count = match self {
            Shard::Part(index, count) => return Ok([index, count]),
            Shard::Auto(count) => count,
        };
        let number = |name: &str| {
            let text = variable(name).ok_or(format!("the variable {name} is not set"))?;
            let number = text.parse::<u64>();
            number.map_err(|_| format!("the variable {name} is '{text}', which is not a number"))
        };
        let array = ARRAYS.iter().find(|(index, ..)| variable(index).is_some());
        let (index, size, more) = array.ok_or_else(|| {
            let names: Vec<&str> = ARRAYS.iter().map(|(index, ..)| *index).collect();
            format!(
                "--shard auto needs a job array, but neither {} is set: give I/N",
                names.join(" nor ")
            )
        })?;
        let task = number(index)?;
        let count = match count {
            Some(count) => count,
            None if *more == 1 => whole_array(&number, task, number(size)? + 1)?,
            None => number(size)?,
        };
        if task < count {
            Ok([task, count])
        } else {
            Err(format!(
                "{index} is {task}, but parts are numbered from 0 to {}",
                count - 1
            ))
        }
    }
}

/// Returns the number of parts of a complete job array. Refuses arrays of some tasks only, as for
/// repeated tasks, because they do not give the number of parts.
fn whole_array(
    number: &dyn Fn(&str) -> Result<u64, String>,
    task: u64,
    count: u64,
) -> Result<u64, String> {
    let (first, tasks) = (
        number("SLURM_ARRAY_TASK_MIN")?,
        number("SLURM_ARRAY_TASK_COUNT")?,
    );
    if first == 0 && tasks == count {
        Ok(count)
    } else {
        Err(format!(
            "--shard auto needs a job array of all parts, --array=0-{}; for some of the parts give their number N: --shard auto/N (task {task})",
            count - 1
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(shard: &str, variables: &[(&str, &str)]) -> Result<[u64; 2], String> {
        let value = |name: &str| {
            let found = variables.iter().find(|(n, _)| *n == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        parse(shard)?.resolve_by(value)
    }

    #[test]
    fn parts_are_numbered_from_zero() {
        assert_eq!(resolved("3/16", &[]), Ok([3, 16]));
        for wrong in [
            "16/16", "-1/4", "1", "1/0", "auto/0", "auto/x", "", "/", "a/b",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn job_arrays_say_which_part() {
        let aws = [
            ("AWS_BATCH_JOB_ARRAY_INDEX", "2"),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "10"),
        ];
        assert_eq!(resolved("auto", &aws), Ok([2, 10]));
        let slurm = |id, min, max, count| {
            [
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", min),
                ("SLURM_ARRAY_TASK_MAX", max),
                ("SLURM_ARRAY_TASK_COUNT", count),
            ]
        };
        assert_eq!(resolved("auto", &slurm("5", "0", "7", "8")), Ok([5, 8]));
        // Some tasks run again: 5 and 7 of 8, or 1 to 8 by mistake.
        for some in [slurm("5", "5", "7", "2"), slurm("5", "1", "8", "8")] {
            let error = resolved("auto", &some).unwrap_err();
            assert!(error.contains("auto/N"), "{error}");
            assert_eq!(resolved("auto/8", &some), Ok([5, 8]));
        }
        let outside = resolved("auto/4", &slurm("5", "5", "7", "2")).unwrap_err();
        assert!(outside.contains("from 0 to 3"), "{outside}");
        let none = resolved("auto", &[]).unwrap_err();
        assert!(none.contains("SLURM_ARRAY_TASK_ID nor AWS"), "{none}");
        let odd = resolved("auto", &[("AWS_BATCH_JOB_ARRAY_INDEX", "x")]).unwrap_err();
        assert!(odd.contains("'x', which is not a number"), "{odd}");
    }
}
