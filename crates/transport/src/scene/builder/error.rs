//! What can be wrong with a scene that is being built.

use std::fmt;

/// Something wrong with a scene that is being built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildProblem {
    /// The part it is about, with its name: `medium "fog"`.
    pub subject: String,
    /// The parameter of that part, if it is about one: `albedo`.
    pub parameter: Option<&'static str>,
    /// What is wrong, and what to do about it.
    pub message: String,
}

impl fmt::Display for BuildProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.parameter {
            Some(parameter) => write!(f, "{}: {parameter}: {}", self.subject, self.message),
            None => write!(f, "{}: {}", self.subject, self.message),
        }
    }
}

/// Everything that is wrong with a scene that was to be built. It shows each problem on a line of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildError {
    /// At least one problem.
    pub problems: Vec<BuildProblem>,
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for BuildError {}
