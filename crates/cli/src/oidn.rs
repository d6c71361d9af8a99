//! Intel Open Image Denoise, called through its program `oidnDenoise`
//! (<https://www.openimagedenoise.org>).

use crate::command_error::CommandError;
use crate::output::safe;
use io::Limits;
use io::diagnostic::shown;
use io::image::{RgbImage, pfm};
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Default name of the program.
const NAME: &str = "oidnDenoise";
/// Environment variable that names another program.
const VARIABLE: &str = "MORGANA_OIDN";
/// Number of lines of the program's error message that are shown.
const LINES: usize = 5;

/// The program, with a temporary folder for the files that it reads and writes.
#[derive(Debug)]
pub struct Oidn {
    program: OsString,
    folder: TempDir,
    /// Arguments for guide images.
    guides: Vec<OsString>,
    limits: Limits,
}

impl Oidn {
    /// Uses the program at `path`, otherwise the one in the environment variable or on the PATH.
    pub fn new(path: Option<&Path>, limits: Limits) -> Result<Self, CommandError> {
        let program = path.map(|path| path.as_os_str().to_owned());
        let program = program.or_else(|| std::env::var_os(VARIABLE).filter(|p| !p.is_empty()));
        let mut builder = tempfile::Builder::new();
        builder.prefix("morgana-");
        // Deny access to other users, which the default permissions may allow.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
        let folder = builder.tempdir();
        Ok(Oidn {
            program: program.unwrap_or_else(|| NAME.into()),
            folder: folder.map_err(|e| {
                let message = format!("cannot make a folder for temporary files: {e}");
                CommandError::Runtime(message)
            })?,
            guides: Vec::new(),
            limits,
        })
    }

    /// Adds a guide image for an option such as `--alb`.
    pub fn guide(&mut self, option: &str, image: &RgbImage) -> Result<(), CommandError> {
        let path = self.path(&format!("{}.pfm", option.trim_start_matches('-')));
        pfm::write(&path, image)?;
        self.guides.extend([option.into(), path.into()]);
        Ok(())
    }

    /// Denoises an image of linear colours.
    pub fn denoise(&self, image: &RgbImage) -> Result<RgbImage, CommandError> {
        let [noisy, denoised] = ["noisy.pfm", "denoised.pfm"].map(|name| self.path(name));
        pfm::write(&noisy, image)?;
        // Remove the output for an earlier image.
        _ = std::fs::remove_file(&denoised);
        let mut command = Command::new(&self.program);
        command.arg("--hdr").arg(&noisy).args(&self.guides);
        command.arg("-o").arg(&denoised).stdin(Stdio::null());
        let output = command.output().map_err(|e| self.missing(&e))?;
        if !output.status.success() {
            return Err(self.failed(&output));
        }
        if !denoised.exists() {
            let program = shown(Path::new(&self.program));
            let message =
                format!("'{program}' wrote no image: is it {NAME} of Open Image Denoise?");
            return Err(CommandError::Runtime(message));
        }
        Ok(RgbImage::read_within(&denoised, self.limits)?)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn missing(&self, error: &std::io::Error) -> CommandError {
        let program = shown(Path::new(&self.program));
        let why = match error.kind() {
            ErrorKind::NotFound => "there is no such program".into(),
            _ => error.to_string(),
        };
        CommandError::Usage(format!(
            "cannot run '{program}': {why}; install Open Image Denoise, whose releases \
             (https://www.openimagedenoise.org) have the program {NAME}, and put it on the PATH, or give its place with \
             --oidn or in {VARIABLE}"
        ))
    }

    fn failed(&self, output: &Output) -> CommandError {
        let text = [&output.stderr, &output.stdout].map(|bytes| String::from_utf8_lossy(bytes));
        let said: Vec<&str> = text.iter().flat_map(|text| text.lines()).collect();
        let said = &said[said.len().saturating_sub(LINES)..];
        let program = shown(Path::new(&self.program));
        CommandError::Runtime(format!(
            "'{program}' failed ({}): {}",
            output.status,
            safe(&said.join(" ")).trim()
        ))
    }
}
