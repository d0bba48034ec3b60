//! From a scenario's text and what the command line changes about it to its typed form.

use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::builtin::{BUILT_IN, built_in};
use super::error::ScenarioError;
use super::file::ScenarioFile;
use super::locate::{Map, Place};

/// What the command line changes about a scenario.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Edits {
    /// `KEY=VALUE`, dotted keys, values as in TOML; a value that is not TOML is a word.
    pub set: Vec<String>,
    /// Fly over this traffic file instead of the scenario's targets.
    pub traffic: Option<PathBuf>,
    /// With so many UAVs, started automatically.
    pub uavs: Option<u32>,
}

/// A scenario as typed, and where it came from.
#[derive(Debug, Clone)]
pub(super) struct Typed {
    /// Name of the run.
    pub(super) name: String,
    /// The file's name in messages.
    pub(super) label: String,
    pub(super) text: String,
    pub(super) file: ScenarioFile,
    /// Keys that the command line gave.
    pub(super) edited: Vec<String>,
    /// Where the traffic file is looked for; `None`: among the built-in ones.
    pub(super) traffic_from: Option<PathBuf>,
}

impl Typed {
    /// Reads the scenario called `name_or_file`, and applies the edits.
    pub(super) fn load(name_or_file: &str, edits: &Edits) -> Result<Self, ScenarioError> {
        let path = Path::new(name_or_file);
        let (mut name, label, text, mut traffic_from) = match built_in(name_or_file) {
            Some(found) => (found.name.to_owned(), format!("{}.toml", found.name), found.text.to_owned(), None),
            None => {
                let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                let folder = path.parent().unwrap_or(Path::new("")).to_owned();
                (stem, name_or_file.to_owned(), read(name_or_file)?, Some(folder))
            }
        };
        let mut table = parse(&label, &text)?;
        let mut edited = Vec::new();
        if let Some(traffic) = &edits.traffic {
            table.remove("targets");
            table.remove("traffic");
            // A ring of the scenario's own size would mean nothing over other targets.
            remove(&mut table, "uavs", &["ring", "at"]);
            set(&mut table, "traffic.file", Value::String(traffic.to_string_lossy().into_owned()))?;
            let file = traffic.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            set(&mut table, "about", Value::String(format!("UAVs over {file}")))?;
            traffic_from = Some(PathBuf::new());
            name = traffic_name(traffic);
        }
        if let Some(uavs) = edits.uavs {
            remove(&mut table, "uavs", &["at"]);
            set(&mut table, "uavs.count", Value::Integer(i64::from(uavs)))?;
            edited.push("uavs.count".to_owned());
        }
        for edit in &edits.set {
            let Some((key, value)) = edit.split_once('=') else {
                let message = format!("\"{edit}\": must be KEY=VALUE, like guidance.radial_gain=0.5");
                return Err(ScenarioError::one("--set", None, message));
            };
            set(&mut table, key.trim(), value_of(value.trim()))?;
            edited.push(key.trim().to_owned());
        }
        let file = typed(table, &label, &text, &edited)?;
        Ok(Self { name, label, text, file, edited, traffic_from })
    }

    /// A scenario that is nothing but its text.
    pub(super) fn of_text(label: &str, text: &str) -> Result<Self, ScenarioError> {
        let file = typed(parse(label, text)?, label, text, &[])?;
        let (name, label, text) = (label.to_owned(), label.to_owned(), text.to_owned());
        Ok(Self { name, label, text, file, edited: Vec::new(), traffic_from: None })
    }

    /// The key was typed, in the file or on the command line.
    pub(super) fn is_typed(&self, key: &str) -> bool {
        is_edited(&self.edited, key) || Map::new(&self.text).has(key)
    }

    /// Where to point for a key: into the file, or at the command line.
    pub(super) fn place(&self, key: &str) -> (String, Option<Place>) {
        place(&self.label, &self.text, &self.edited, key)
    }
}

fn read(name: &str) -> Result<String, ScenarioError> {
    match fs::read(name) {
        Ok(bytes) => String::from_utf8(bytes)
            .map_err(|_| ScenarioError::one(name, None, "not UTF-8 text; a scenario is a TOML file in UTF-8")),
        Err(reason) if !Path::new(name).exists() && Path::new(name).extension().is_none() => {
            let names: Vec<_> = BUILT_IN.iter().map(|scenario| scenario.name).collect();
            let names = names.join(", ");
            Err(ScenarioError::one(
                name,
                None,
                format!("no such scenario; built in are {names}; or name a file ({reason})"),
            ))
        }
        Err(reason) => Err(ScenarioError::one(name, None, format!("cannot be read: {reason}"))),
    }
}

fn parse(label: &str, text: &str) -> Result<Table, ScenarioError> {
    toml::from_str(text).map_err(|error| {
        let place = error.span().map(|span| Map::new(text).place(span.start));
        ScenarioError::one(label, place, error.message().trim())
    })
}

fn typed(table: Table, label: &str, text: &str, edited: &[String]) -> Result<ScenarioFile, ScenarioError> {
    serde_path_to_error::deserialize(Value::Table(table)).map_err(|error| {
        let key = error.path().to_string().replace('[', ".").replace(']', "");
        let (file, place) = place(label, text, edited, &key);
        // The library adds a line that says where; the key says it better.
        let inner = error.inner().to_string();
        let what = inner.lines().next().unwrap_or_default();
        ScenarioError::one(file, place, format!("{key}: {what}"))
    })
}

fn place(label: &str, text: &str, edited: &[String], key: &str) -> (String, Option<Place>) {
    if is_edited(edited, key) {
        return ("command line".to_owned(), None);
    }
    (label.to_owned(), Map::new(text).find(key))
}

/// The command line gave this key, a table around it, or a part of it.
fn is_edited(edited: &[String], key: &str) -> bool {
    let within = |inner: &str, outer: &str| inner.strip_prefix(outer).is_some_and(|rest| rest.starts_with('.'));
    edited.iter().any(|edited| edited == key || within(key, edited) || within(edited, key))
}

fn value_of(text: &str) -> Value {
    let parsed = toml::from_str::<Table>(&format!("value = {text}"));
    let value = parsed.ok().and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| Value::String(text.to_owned()))
}

fn set(table: &mut Table, key: &str, value: Value) -> Result<(), ScenarioError> {
    let refuse = |what: &str| Err(ScenarioError::one("--set", None, format!("{key}: {what}")));
    let mut parts: Vec<_> = key.split('.').collect();
    let Some(last) = parts.pop().filter(|last| !last.is_empty()) else { return refuse("is not a key") };
    let mut here = table;
    for part in parts {
        let next = here.entry(part).or_insert_with(|| Value::Table(Table::new()));
        let Value::Table(next) = next else { return refuse("goes through something that is not a table") };
        here = next;
    }
    here.insert(last.to_owned(), value);
    Ok(())
}

fn remove(table: &mut Table, parent: &str, keys: &[&str]) {
    if let Some(Value::Table(parent)) = table.get_mut(parent) {
        for key in keys {
            parent.remove(*key);
        }
    }
}

/// `city` of `some/where/city.fcd.xml.gz`.
fn traffic_name(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("traffic").to_owned()
}
