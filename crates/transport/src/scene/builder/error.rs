//! Problems of a scene that is being built.

use std::fmt;

/// A problem of a scene that is being built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildProblem {
    /// Part with the problem, with its name: `medium "fog"`.
    pub subject: String,
    /// Parameter of this part with the problem, if there is one: `albedo`.
    pub parameter: Option<&'static str>,
    /// Description of the problem and of its solution.
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

/// All problems of a scene that could not be built. Each problem is displayed on a separate line.
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
