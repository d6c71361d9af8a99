//! Scenes for tests, and functions that run the program.

use assert_cmd::Command;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A sensor with a film of 8 × 6 pixels that looks at the origin.
const SENSOR: &str = r#"
  <default name="spp" value="4"/>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world">
      <lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/>
    </transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="8"/><integer name="height" value="6"/>
    </film>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.4, 0.8"/></emitter>"#;

/// A temporary folder with scene files, in which commands run.
pub struct Folder(TempDir);

impl Folder {
    /// Creates a folder with `scene.xml`: a ball of fog of index 1 and extinction 0.5 under uniform
    /// light.
    pub fn with_fog() -> Self {
        Self::with_scene(
            r#"<shape type="sphere" id="ball"><bsdf type="null"/>
                 <medium type="homogeneous" name="interior" id="fog">
                   <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
                 </medium>
               </shape>"#,
        )
    }

    /// Creates a folder with `scene.xml`: a clear Luneburg lens.
    pub fn with_lens() -> Self {
        Self::with_scene(
            r#"<shape type="sphere" id="lens"><bsdf type="null"/>
                 <medium type="transparent" name="interior" id="glass">
                   <volume type="luneburg" name="ior"/>
                 </medium>
               </shape>"#,
        )
    }

    /// Creates a folder with `scene.xml`: the usual sensor and light, and `content`.
    pub fn with_scene(content: &str) -> Self {
        Self::with_file(&format!(
            "<scene version=\"3.0.0\">{SENSOR}\n{content}\n</scene>\n"
        ))
    }

    /// Creates a folder with `scene.xml` of the given text.
    pub fn with_file(text: &str) -> Self {
        let folder = Folder(TempDir::new().unwrap());
        std::fs::write(folder.path("scene.xml"), text).unwrap();
        folder
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Reads the bytes of a file in the folder.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Reads a JSON file in the folder.
    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    /// Returns the names of its files, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Returns the command of the program with arguments separated by blanks, to run in the folder.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(program());
        command
            .current_dir(self.0.path())
            .args(arguments.split_whitespace());
        command
    }

    /// Runs the program.
    pub fn run(&self, arguments: &str) -> Outcome {
        let output = self.command(arguments).output().unwrap();
        Outcome {
            status: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs the program, asserts that it succeeds, and returns its standard output.
    pub fn succeed(&self, arguments: &str) -> String {
        let outcome = self.run(arguments);
        assert_eq!(outcome.status, Some(0), "{arguments}: {outcome:?}");
        outcome.stdout
    }

    /// Runs the program, asserts its exit status, and returns its standard output.
    pub fn output(&self, status: i32, arguments: &str) -> String {
        let outcome = self.run(arguments);
        assert_eq!(outcome.status, Some(status), "{arguments}: {outcome:?}");
        outcome.stdout
    }

    /// Runs the program, asserts its exit status, and returns its standard error.
    pub fn fail(&self, status: i32, arguments: &str) -> String {
        let outcome = self.run(arguments);
        assert_eq!(outcome.status, Some(status), "{arguments}: {outcome:?}");
        outcome.stderr
    }

    /// Runs the program with a limit on file sizes, in blocks; asserts that it fails, and returns
    /// its standard error.
    #[cfg(unix)]
    pub fn fail_within(&self, blocks: usize, arguments: &str) -> String {
        let script = format!("ulimit -f {blocks}; exec \"$MORGANA\" {arguments}");
        let output = Command::new("bash")
            .args(["-c", &script])
            .env("MORGANA", program())
            .current_dir(self.0.path())
            .output()
            .unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        text
    }

    /// Runs the program, asserts that it refuses its input, and returns its standard error.
    pub fn refuse(&self, arguments: &str) -> String {
        let outcome = self.run(arguments);
        assert_eq!(outcome.status, Some(2), "{arguments}: {outcome:?}");
        assert_eq!(outcome.stdout, "");
        outcome.stderr
    }
}

/// Exit status and output of a run of the program.
#[derive(Debug)]
pub struct Outcome {
    pub status: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// The program under test.
pub fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_morgana"))
}
