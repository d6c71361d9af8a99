//! Options of MCX's command line.

use crate::command_error::CommandError;
use serde_json::{Map, Value, json};

/// Effect of an option.
#[derive(Clone, Copy)]
enum Effect {
    /// Sets a number or a truth value in a section of the input.
    Number(&'static str, &'static str),
    /// Sets a text in a section of the input.
    Text(&'static str, &'static str),
    /// Sets a number or a text in a section of the input.
    Any(&'static str, &'static str),
    /// Names the input file.
    Input,
    /// Repeats the photons.
    Repeat,
    /// Sets the order of axes of raw volumes.
    Array,
    /// Sets the seed.
    Seed,
    /// Adds shapes.
    Shapes,
    /// Changes the input.
    Json,
    /// Names the folder of the input's files.
    Root,
    /// Writes messages to a file.
    Log,
    /// Prints the input after all changes.
    Dump,
    /// Prints something and ends.
    Show(Show),
    /// Has no effect, for a reason that is shown.
    Ignored(&'static str),
    /// Requests debug output. Only a progress bar (P) exists, and is always shown.
    Debug,
    /// Has no effect, because results do not depend on it.
    Silent,
    /// Has no effect if it is 0; otherwise it is an error with advice.
    Off(&'static str),
    /// Is an error with advice.
    Refused(&'static str),
}

/// Output that replaces a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Show {
    Help,
    Version,
    Devices,
}

/// Value after an option.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Takes {
    /// No value.
    None,
    /// A number, or 1 if no number follows.
    Switch,
    /// A value.
    One,
    /// A value, unless another option follows.
    Maybe,
}

const GPU: &str = "it is about GPUs; morgana runs on all CPUs";
const REPLAY: &str = "morgana does not replay photons; for derivatives use 'derivatives' of a scene (docs/guides/inverse-problems.md)";
const LOCAL: &str =
    "give an input file: mcx -Q NAME --dumpjson FILE.json writes one where MCX is installed";

/// All options: the short name (0 for none), the long name, the value and the effect.
const OPTIONS: &[(u8, &str, Takes, Effect)] = &[
    (b'f', "input", Takes::Maybe, Effect::Input),
    (
        b'n',
        "photon",
        Takes::One,
        Effect::Number("Session", "Photons"),
    ),
    (b'r', "repeat", Takes::One, Effect::Repeat),
    (
        b'b',
        "reflect",
        Takes::Switch,
        Effect::Number("Session", "DoMismatch"),
    ),
    (b'B', "bc", Takes::One, Effect::Text("Session", "BCFlags")),
    (
        b'u',
        "unitinmm",
        Takes::One,
        Effect::Number("Domain", "LengthUnit"),
    ),
    (
        b'U',
        "normalize",
        Takes::Switch,
        Effect::Number("Session", "DoNormalize"),
    ),
    (b'E', "seed", Takes::One, Effect::Seed),
    (
        b'z',
        "srcfrom0",
        Takes::Switch,
        Effect::Number("Domain", "OriginType"),
    ),
    (b'k', "voidtime", Takes::One, Effect::Silent),
    (b'Y', "replaydet", Takes::One, Effect::Refused(REPLAY)),
    (
        b'V',
        "specular",
        Takes::Switch,
        Effect::Number("Session", "DoSpecular"),
    ),
    (b'e', "minenergy", Takes::One, Effect::Silent),
    (b'g', "gategroup", Takes::One, Effect::Silent),
    (b'L', "listgpu", Takes::None, Effect::Show(Show::Devices)),
    (b't', "thread", Takes::One, Effect::Ignored(GPU)),
    (b'T', "blocksize", Takes::One, Effect::Ignored(GPU)),
    (b'A', "autopilot", Takes::Switch, Effect::Ignored(GPU)),
    (b'G', "gpu", Takes::One, Effect::Ignored(GPU)),
    (b'W', "workload", Takes::One, Effect::Ignored(GPU)),
    (b'I', "printgpu", Takes::None, Effect::Ignored(GPU)),
    (0, "atomic", Takes::Switch, Effect::Ignored(GPU)),
    (b'P', "shapes", Takes::One, Effect::Shapes),
    (b'j', "json", Takes::One, Effect::Json),
    (
        b'K',
        "mediabyte",
        Takes::One,
        Effect::Any("Domain", "MediaFormat"),
    ),
    (b'a', "array", Takes::Switch, Effect::Array),
    (b's', "session", Takes::One, Effect::Text("Session", "ID")),
    (
        b'O',
        "outputtype",
        Takes::One,
        Effect::Text("Session", "OutputType"),
    ),
    (
        b'd',
        "savedet",
        Takes::Switch,
        Effect::Number("Session", "DoPartialPath"),
    ),
    (
        b'w',
        "savedetflag",
        Takes::One,
        Effect::Any("Session", "SaveDataMask"),
    ),
    (
        b'x',
        "saveexit",
        Takes::Switch,
        Effect::Number("Session", "DoSaveExit"),
    ),
    (
        b'X',
        "saveref",
        Takes::Switch,
        Effect::Number("Session", "DoSaveRef"),
    ),
    (
        b'm',
        "momentum",
        Takes::Switch,
        Effect::Number("Session", "DoDCS"),
    ),
    (b'q', "saveseed", Takes::Switch, Effect::Off(REPLAY)),
    (
        b'M',
        "dumpmask",
        Takes::Switch,
        Effect::Off("detectors are discs, not masks of voxels: leave it out"),
    ),
    (
        b'H',
        "maxdetphoton",
        Takes::One,
        Effect::Number("Session", "MaxDetPhoton"),
    ),
    (
        b'S',
        "save2pt",
        Takes::Switch,
        Effect::Number("Session", "DoSaveVolume"),
    ),
    (
        b'F',
        "outputformat",
        Takes::One,
        Effect::Text("Session", "OutputFormat"),
    ),
    (
        b'Z',
        "zip",
        Takes::One,
        Effect::Ignored("arrays are compressed by zlib, which all readers of JData know"),
    ),
    (0, "dumpjson", Takes::Maybe, Effect::Dump),
    (b'h', "help", Takes::None, Effect::Show(Show::Help)),
    (b'v', "version", Takes::None, Effect::Show(Show::Version)),
    (b'l', "log", Takes::Switch, Effect::Log),
    (b'y', "lang", Takes::Maybe, Effect::Silent),
    (
        b'i',
        "interactive",
        Takes::None,
        Effect::Refused("give an input file by -f"),
    ),
    (b'D', "debug", Takes::One, Effect::Debug),
    (b'Q', "bench", Takes::Maybe, Effect::Refused(LOCAL)),
    (b'N', "net", Takes::Maybe, Effect::Refused(LOCAL)),
    (0, "root", Takes::One, Effect::Root),
    (
        0,
        "gscatter",
        Takes::One,
        Effect::Ignored("all scattering events are anisotropic"),
    ),
    (0, "srcid", Takes::One, Effect::Number("Source", "ID")),
    (0, "internalsrc", Takes::Switch, Effect::Silent),
    (0, "faststep", Takes::Switch, Effect::Silent),
    (0, "maxvoidstep", Takes::One, Effect::Silent),
    (0, "maxjumpdebug", Takes::One, Effect::Silent),
    (
        0,
        "trajstokes",
        Takes::Switch,
        Effect::Off("polarised light needs a scene (docs/scene/polarization.md)"),
    ),
];

/// Command line of MCX.
#[derive(Debug, Default)]
pub(super) struct CommandLine {
    /// Input: a file, `-` for the standard input, or JSON text.
    pub input: Option<String>,
    /// Changes of the input: section, key, value.
    pub settings: Vec<(&'static str, &'static str, Value)>,
    pub seed: Option<i64>,
    pub repeat: u64,
    /// Shapes as JSON text.
    pub shapes: Option<String>,
    /// Changes of the input as JSON text.
    pub json: Option<String>,
    /// Folder of the input's files.
    pub root: Option<String>,
    pub log: bool,
    /// File for the input after all changes; `-` for the standard output.
    pub dump: Option<String>,
    pub show: Option<Show>,
    /// Options without effect, with the reason.
    pub notes: Vec<String>,
}

impl CommandLine {
    /// Parses arguments.
    ///
    /// # Errors
    /// Unknown options, missing or wrong values, and options that request what morgana cannot do.
    pub(super) fn parse(arguments: &[String]) -> Result<Self, CommandError> {
        let mut line = CommandLine {
            repeat: 1,
            ..CommandLine::default()
        };
        let mut rest = arguments.iter().peekable();
        while let Some(name) = rest.next() {
            let &(_, _, takes, effect) = find(name)?;
            let follows = |text: &&&String| match takes {
                Takes::None => false,
                Takes::Switch => text.starts_with(|c: char| c.is_ascii_digit()),
                Takes::One => true,
                Takes::Maybe => !text.starts_with('-') || text.as_str() == "-",
            };
            let value = rest.next_if(|text| follows(&text)).cloned();
            if value.is_none() && takes == Takes::One {
                return Err(usage(name, "it needs a value"));
            }
            line.apply(name, value, effect)?;
        }
        Ok(line)
    }

    fn apply(
        &mut self,
        name: &str,
        value: Option<String>,
        effect: Effect,
    ) -> Result<(), CommandError> {
        let text = value.clone().unwrap_or_else(|| "1".to_owned());
        let number = || {
            let number = text.parse::<f64>().ok().filter(|v| v.is_finite());
            number.ok_or_else(|| usage(name, &format!("'{text}' is not a number")))
        };
        match effect {
            Effect::Number(section, key) => {
                let number = whole(number()?);
                self.settings.push((section, key, number));
            }
            Effect::Text(section, key) => self.settings.push((section, key, json!(text))),
            Effect::Any(section, key) => {
                let value = number().map_or_else(|_| json!(text), whole);
                self.settings.push((section, key, value));
            }
            Effect::Input => self.input = Some(value.unwrap_or_else(|| "-".to_owned())),
            Effect::Repeat => {
                let times = number()?;
                // A negative number divides the photons.
                self.repeat = if times > 0.0 { times as u64 } else { 1 };
            }
            Effect::Array => {
                let order = if number()? == 0.0 { "c" } else { "r" };
                self.settings.push(("Domain", "ArrayOrder", json!(order)));
            }
            Effect::Seed
                if [".mch", ".jdt", ".jdat"]
                    .iter()
                    .any(|end| text.ends_with(end)) =>
            {
                return Err(usage(name, REPLAY));
            }
            Effect::Seed => self.seed = Some(number()? as i64),
            Effect::Shapes => self.shapes = value,
            Effect::Json => self.json = value,
            Effect::Root => self.root = value,
            Effect::Log => self.log = number()? != 0.0,
            Effect::Dump => self.dump = Some(value.unwrap_or_else(|| "-".to_owned())),
            Effect::Show(show) => self.show = Some(show),
            Effect::Ignored(why) => self.notes.push(format!("{name} has no effect: {why}")),
            Effect::Debug if !["P", "0", "4"].contains(&text.to_ascii_uppercase().as_str()) => {
                let note = "has no effect: for the data of photons use detectors (-d, -w)";
                self.notes.push(format!("{name} {text} {note}"));
            }
            Effect::Debug | Effect::Silent => {}
            Effect::Off(advice) if number()? != 0.0 => return Err(usage(name, advice)),
            Effect::Off(_) => {}
            Effect::Refused(advice) => return Err(usage(name, advice)),
        }
        Ok(())
    }

    /// Changes the input as the options say.
    ///
    /// # Errors
    /// JSON texts that cannot be read, or are no objects.
    pub(super) fn change(&self, root: &mut Value) -> Result<(), CommandError> {
        for (section, key, value) in &self.settings {
            let object = match *section {
                "Source" => section_of(section_of(root, "Optode"), "Source"),
                section => section_of(root, section),
            };
            let Value::Object(entries) = object else {
                let message = format!("{section} of the input is no object");
                return Err(CommandError::Usage(message));
            };
            set(entries, key, value.clone());
        }
        if let Some(text) = &self.json {
            merge(root, &parsed("--json", text)?);
        }
        if let Some(text) = &self.shapes {
            let added = parsed("--shapes", text)?;
            let added = added.get("Shapes").cloned().unwrap_or(added);
            let list = |value: Value| match value {
                Value::Array(items) => items,
                other => vec![other],
            };
            if let Value::Object(entries) = root {
                let known = entries.remove("Shapes").map_or_else(Vec::new, list);
                let all = known.into_iter().chain(list(added)).collect();
                entries.insert("Shapes".to_owned(), Value::Array(all));
            }
        }
        Ok(())
    }
}

fn find(name: &str) -> Result<&'static (u8, &'static str, Takes, Effect), CommandError> {
    let found = OPTIONS.iter().find(|(short, long, ..)| {
        let is_short = name.len() == 2 && name.as_bytes() == [b'-', *short];
        is_short || name.strip_prefix("--") == Some(long)
    });
    found.ok_or_else(|| {
        let message = if name.starts_with('-') {
            "unknown option: morgana mcx --help lists the options"
        } else {
            "it follows no option: write -f before the input file, and -s before the session"
        };
        usage(name, message)
    })
}

fn usage(name: &str, message: &str) -> CommandError {
    CommandError::Usage(format!("{name}: {message}"))
}

fn parsed(name: &str, text: &str) -> Result<Value, CommandError> {
    serde_json::from_str(text).map_err(|e| usage(name, &format!("it is not JSON: {e}")))
}

/// Returns a number of JSON, without a fraction if it has none.
fn whole(v: f64) -> Value {
    if v.fract() == 0.0 && v.abs() < 9.0e15 {
        json!(v as i64)
    } else {
        json!(v)
    }
}

/// Returns a section of an object, which is added if it is missing.
fn section_of<'a>(root: &'a mut Value, name: &str) -> &'a mut Value {
    if !root.is_object() {
        *root = json!({});
    }
    let key = root.as_object().and_then(|entries| {
        let mut keys = entries.keys();
        keys.find(|key| key.eq_ignore_ascii_case(name)).cloned()
    });
    let section = &mut root[key.unwrap_or_else(|| name.to_owned())];
    if section.is_null() {
        *section = json!({});
    }
    section
}

/// Sets a value, whatever the case of its key.
pub(super) fn set(entries: &mut Map<String, Value>, key: &str, value: Value) {
    take(entries, key);
    entries.insert(key.to_owned(), value);
}

/// Removes a value, whatever the case of its key.
pub(super) fn take(entries: &mut Map<String, Value>, key: &str) -> Option<Value> {
    let known = entries
        .keys()
        .find(|k| k.eq_ignore_ascii_case(key))
        .cloned();
    known.and_then(|known| entries.remove(&known))
}

/// Replaces the values of an object by those of another object, level by level.
fn merge(base: &mut Value, changes: &Value) {
    let (Value::Object(entries), Value::Object(changes)) = (&mut *base, changes) else {
        *base = changes.clone();
        return;
    };
    for (key, change) in changes {
        let known = entries
            .keys()
            .find(|k| k.eq_ignore_ascii_case(key))
            .cloned();
        match known {
            Some(known) => merge(&mut entries[&known], change),
            None => {
                entries.insert(key.clone(), change.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<CommandLine, String> {
        let arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
        CommandLine::parse(&arguments).map_err(|e| match e {
            CommandError::Usage(message) => message,
            other => format!("{other:?}"),
        })
    }

    #[test]
    fn the_command_line_of_simpa() {
        let line = parse("-f a.json -O F -a 1 -F jnii").unwrap();
        assert_eq!(line.input.as_deref(), Some("a.json"));
        let mut root = json!({"session": {"outputtype": "X", "Photons": 10}});
        line.change(&mut root).unwrap();
        let expected = json!({
            "session": {"OutputType": "F", "OutputFormat": "jnii", "Photons": 10},
            "Domain": {"ArrayOrder": "r"},
        });
        assert_eq!(root, expected);
    }

    #[test]
    fn options_with_and_without_values() {
        let line =
            parse("--input a.json -n 1e6 -b -d 0 -X --bc ______000010 -A 1 -G 1101 -E 7 --log")
                .unwrap();
        assert_eq!((line.seed, line.log, line.notes.len()), (Some(7), true, 2));
        let mut root = json!({});
        line.change(&mut root).unwrap();
        let session = json!({
            "Photons": 1_000_000, "DoMismatch": 1, "DoPartialPath": 0, "DoSaveRef": 1, "BCFlags": "______000010",
        });
        assert_eq!(root["Session"], session);
        assert_eq!(parse("-f").unwrap().input.as_deref(), Some("-"));
        assert_eq!(parse("-q 0 -f a").unwrap().notes.len(), 0);
    }

    #[test]
    fn inputs_may_be_changed_by_text() {
        let arguments = [
            "-j",
            r#"{"optode": {"Source": {"Type": "cone"}}}"#,
            "-P",
            r#"{"Shapes": [{"ZLayers": [[1, 2, 3]]}]}"#,
        ];
        let line = CommandLine::parse(&arguments.map(str::to_owned)).unwrap();
        let mut root =
            json!({"Optode": {"Source": {"Type": "pencil", "Pos": [1]}}, "Shapes": [{"Grid": {}}]});
        line.change(&mut root).unwrap();
        assert_eq!(
            root["Optode"]["Source"],
            json!({"Type": "cone", "Pos": [1]})
        );
        assert_eq!(
            root["Shapes"],
            json!([{"Grid": {}}, {"ZLayers": [[1, 2, 3]]}])
        );
    }

    #[test]
    fn mistakes() {
        for (line, expected) in [
            ("-f a.json -J 1", "-J: unknown option"),
            ("a.json", "write -f before"),
            ("-n", "needs a value"),
            ("-n many", "'many' is not a number"),
            ("-E old.mch", "does not replay"),
            ("-q 1", "does not replay"),
            ("-Q cube60", "dumpjson"),
        ] {
            let message = parse(line).unwrap_err();
            assert!(message.contains(expected), "{line}: {message}");
        }
    }
}
