//! `standoff fly --config`: options from a TOML file.

use std::ffi::OsString;
use std::path::PathBuf;

use standoff_app::Failure;
use standoff_io::{bounded_input, display_text};
use toml::{Table, Value};

/// Maximum size of the file, bytes.
const FILE_MAX: u64 = 64 << 10;

/// Returns the arguments with the options of the file of `standoff fly --config`, and this file.
pub(crate) fn with_options_of_file(mut arguments: Vec<OsString>) -> Result<(Vec<OsString>, Option<PathBuf>), Failure> {
    let Some(file) = file_of(&arguments) else { return Ok((arguments, None)) };
    let failure = |what: String| Failure::Input(format!("{}: {what}", display_text::path(&file)));
    let text = bounded_input::text(&file, FILE_MAX).map_err(|error| failure(error.to_string()))?;
    let table: Table = text.parse().map_err(|error: toml::de::Error| failure(error.to_string()))?;
    let mut options = Vec::new();
    for (key, value) in &table {
        options.extend(options_of(key, value).map_err(failure)?);
    }
    // The options of the command line follow, so that they replace those of the file.
    arguments.splice(2..2, options);
    Ok((arguments, Some(file)))
}

/// File of `standoff fly --config`.
fn file_of(arguments: &[OsString]) -> Option<PathBuf> {
    let options = arguments.get(2..).filter(|_| arguments[1] == "fly")?;
    let next = options.windows(2).find(|pair| pair[0] == "--config").map(|pair| PathBuf::from(&pair[1]));
    next.or_else(|| options.iter().find_map(|option| option.to_str()?.strip_prefix("--config=").map(PathBuf::from)))
}

/// Arguments for a key of the file.
fn options_of(key: &str, value: &Value) -> Result<Vec<OsString>, String> {
    let argument = |value: &Value| match value {
        Value::String(text) if key == "scenario" => Ok(text.into()),
        Value::String(text) => Ok(format!("--{key}={text}").into()),
        Value::Integer(_) | Value::Float(_) => Ok(format!("--{key}={value}").into()),
        _ => Err(format!("`{key}`: must be a text, a number, true, false, or a list of texts or numbers")),
    };
    match value {
        _ if key == "config" => {
            Err("`config`: a file cannot name another one; move the options into one file".to_owned())
        }
        Value::Boolean(is_set) => Ok(is_set.then(|| format!("--{key}").into()).into_iter().collect()),
        Value::Array(values) => values.iter().map(argument).collect(),
        value => Ok(vec![argument(value)?]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_gives_options_which_those_of_the_command_line_follow() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("uav.toml");
        let options = |text: &str| {
            std::fs::write(&file, text).unwrap();
            let typed = ["standoff", "fly", "--config", file.to_str().unwrap(), "--uav", "2"].map(OsString::from);
            with_options_of_file(typed.to_vec()).map(|(arguments, _)| arguments)
        };
        let given = "scenario = 'a.toml'\nuav = 1\nview = true\nno-open = false\nset = ['b=1', 'c=2']\n";
        let path = file.to_str().unwrap();
        let expected = ["a.toml", "--uav=1", "--view", "--set=b=1", "--set=c=2", "--config", path, "--uav", "2"];
        assert_eq!(options(given).unwrap()[2..], expected);
        for wrong in ["uav = {}", "config = 'other.toml'", "uav = ", "set = [[]]"] {
            assert!(matches!(options(wrong), Err(Failure::Input(_))), "{wrong}");
        }
    }
}
