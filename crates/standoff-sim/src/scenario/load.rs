//! Reads the text of a scenario, applies the changes of the command line, and converts it to the typed form.

use std::io;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use standoff::Law;
use standoff_io::display_text::{did_you_mean, escaped, printable, quoted, shell_path};
use standoff_io::{bounded_input, geodesy};
use toml::de::{DeTable, DeValue, ValueDeserializer};
use toml::{Spanned, Table, Value};

use super::builtin::{BUILT_IN, built_in, built_in_like};
use super::diagnostics::Problems;
use super::dotted::{set, take_out, value_at};
use super::error::{Excerpt, Problem, ScenarioError};
use super::locate::{Map, line_around, position_of};
use super::parameters::law_of;
use super::parse::{Form, MISTAKES_MAX, Mistake};
use super::sample::Sampler;
use super::schema::root;
use super::schema_types::{Dynamics, ScenarioFile};
use super::text::{LENGTH_MAX, SPELT_OUT, check_size, text};
use crate::random::Draws;
use crate::traffic::{STANDARD_INPUT, Traffic};

/// Maximum number of traffic files that the description of a scenario names.
const NAMED: usize = 3;

/// Changes that the command line makes to a scenario.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overrides {
    /// `KEY=VALUE`, dotted keys, values as in TOML; a value that is not TOML is a word.
    pub set: Vec<String>,
    /// Traffic files that replace the scenario's targets; `-` is standard input.
    pub traffic: Vec<PathBuf>,
    /// Number of UAVs, with automatic starts.
    pub uavs: Option<u32>,
    /// Maps that replace those of the scenario. The first SUMO net with a projection places degrees.
    pub maps: Vec<PathBuf>,
    /// Where the origin of the plane is. If absent: where the traffic or the maps are.
    pub origin: Option<geodesy::Origin>,
}

/// Returns the stem of the name of a traffic file: `city` for `some/where/city.fcd.xml.gz`.
pub(super) fn stem(traffic: &Path) -> String {
    let file = file_name(traffic);
    file.split('.').next().filter(|stem| !["", STANDARD_INPUT].contains(stem)).unwrap_or("traffic").to_owned()
}

/// Returns the name of a built-in scenario or of a scenario file.
pub fn name_of(name_or_file: &str) -> String {
    let stem = Path::new(name_or_file).file_stem().filter(|_| built_in(name_or_file).is_none());
    stem.map_or_else(|| name_or_file.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// A scenario as typed, and its origin.
#[derive(Debug, Clone)]
pub(super) struct Typed {
    /// Name of the run.
    pub(super) name: String,
    /// The scenario without the parts that are wrong in form. Its numbers may be distributions.
    pub(super) table: Table,
    /// Draws the scenario in `table`.
    sampler: Sampler,
    /// The scenario of some seed, for everything in it that is not drawn.
    pub(super) file: ScenarioFile,
    /// Problems in the form of the scenario and of the command line's changes.
    pub(super) problems: Vec<Problem>,
    /// Warnings about the files that the scenario names.
    pub(super) notes: Vec<String>,
    /// Keys that were left out because their values have a wrong form.
    pub(super) left_out: Vec<String>,
    /// True if parts of the text are not TOML: their keys, which are unknown, are missing.
    pub(super) is_text_broken: bool,
    pub(super) origin: Origin,
    /// Changes of the command line.
    pub(super) overrides: Overrides,
    /// Folder of the traffic file and maps; `None` for built-in ones.
    pub(super) files_from: Option<PathBuf>,
}

/// Where the values were typed.
#[derive(Debug, Clone)]
pub(super) struct Origin {
    /// Name of the file in messages.
    pub(super) label: String,
    pub(super) text: Arc<str>,
    /// Keys that the command line set.
    edited: Vec<Edited>,
}

/// A key that the command line set.
#[derive(Debug, Clone)]
struct Edited {
    key: String,
    /// The argument as typed.
    text: Arc<str>,
}

impl Typed {
    /// Where the origin of the plane is, if the user or the traffic states it.
    pub(super) fn origin_on_earth(&self, traffic: Option<&Traffic>) -> Option<geodesy::Origin> {
        self.overrides.origin.or_else(|| traffic?.origin)
    }

    /// Reads the scenario called `name_or_file`, and applies the overrides.
    pub(super) fn load(name_or_file: &str, overrides: &Overrides) -> Result<Self, ScenarioError> {
        let mut name = name_of(name_or_file);
        let (label, text, mut files_from) = match built_in(name_or_file) {
            Some(found) => (format!("{}.toml", found.name), found.text.to_owned(), None),
            None => {
                let folder = Path::new(name_or_file).parent().unwrap_or(Path::new("")).to_owned();
                (name_or_file.to_owned(), read(name_or_file)?, Some(folder))
            }
        };
        if let Some(traffic) = overrides.traffic.first() {
            // Paths on the command line are relative to the current folder.
            (name, files_from) = (stem(traffic), Some(PathBuf::new()));
        }
        Self::new(name, &label, &text, 1, overrides, files_from)
    }

    /// Reads a scenario from TOML that is not in a file, and applies the overrides.
    pub(super) fn of_toml(name: &str, toml: &str, overrides: &Overrides, folder: &Path) -> Result<Self, ScenarioError> {
        let (called, files_from) = match overrides.traffic.first() {
            Some(traffic) => (stem(traffic), PathBuf::new()),
            None => (name.to_owned(), folder.to_owned()),
        };
        // The program's own texts are also read here.
        Self::new(called, name, toml, SPELT_OUT, overrides, Some(files_from))
    }

    /// Reads a scenario from a text in which the program may have spelt out all values.
    pub(super) fn of_text(label: &str, text: &str) -> Result<Self, ScenarioError> {
        Self::new(label.to_owned(), label, text, SPELT_OUT, &Overrides::default(), None)
    }

    /// Reads the same text again, with further changes.
    pub(super) fn changed(&self, set: &[String]) -> Result<Self, ScenarioError> {
        let Self { name, origin, overrides, files_from, .. } = self;
        let overrides = Overrides { set: [&overrides.set, set].concat(), ..overrides.clone() };
        Self::new(name.clone(), &origin.label, &origin.text, SPELT_OUT, &overrides, files_from.clone())
    }

    /// Reads a text of at most `times` the size of a typed scenario. Fails if no scenario can be read from it.
    fn new(
        name: String,
        label: &str,
        text: &str,
        times: u64,
        overrides: &Overrides,
        files_from: Option<PathBuf>,
    ) -> Result<Self, ScenarioError> {
        check_size(label, text, times)?;
        let mut origin = Origin { label: label.to_owned(), text: text.into(), edited: Vec::new() };
        let map = Map::new(text);
        let (mut table, mut problems) = understood(&map, &origin);
        let is_text_broken = !problems.is_empty();
        origin.apply(overrides, &mut table, &mut problems)?;
        let mut form = Form::default();
        form.check(root(), "", &mut table);
        let is_form_known = form.mistakes.len() < MISTAKES_MAX;
        for Mistake { key, message, help } in form.mistakes {
            problems.push(origin.problem(&map, &key, message, help));
        }
        if !is_form_known {
            return Err(problems.into());
        }
        let (sampler, file, notes) = (Sampler::new(&table), ScenarioFile::default(), Vec::new());
        let (left_out, overrides) = (form.left_out, overrides.clone());
        let mut typed = Self {
            name,
            table,
            sampler,
            file,
            problems,
            notes,
            left_out,
            is_text_broken,
            origin,
            overrides,
            files_from,
        };
        typed.complete()?;
        Ok(typed)
    }

    /// Reads the tables, and adds what follows from other keys.
    fn complete(&mut self) -> Result<(), ScenarioError> {
        (self.file, _) = self.drawn(Draws::new(0))?;
        let is_set = |key: &str| value_at(&self.table, key).is_some();
        let mut implied = Vec::new();
        if law_of(&self.table) == Law::Oh2015 && !is_set("separation") {
            // Only the phases on an orbit separate UAVs.
            implied.push(("separation", Value::Boolean(false)));
        }
        if value_at(&self.table, "separation") == Some(&Value::Boolean(true)) {
            implied.push(("separation", Table::new().into()));
        }
        if self.file.needs_an_agent_per_uav() && !is_set("team.agents") {
            implied.push(("team.agents", "per-uav".into()));
        }
        if self.file.uavs.dynamics == Dynamics::Bank && !is_set("uavs.bank") {
            implied.push(("uavs.bank", Table::new().into()));
        }
        if implied.is_empty() {
            return Ok(());
        }
        implied.into_iter().try_for_each(|(key, value)| self.insert(key, value))?;
        self.read()
    }

    /// Sets a key to a value of the right form.
    pub(super) fn set(&mut self, key: &str, value: Value) -> Result<(), ScenarioError> {
        self.insert(key, value)?;
        self.read()
    }

    fn insert(&mut self, key: &str, value: Value) -> Result<(), ScenarioError> {
        set(&mut self.table, key, value).map_err(|message| ScenarioError::one(&self.origin.label, None, message))
    }

    /// Reads the tables again after a change.
    fn read(&mut self) -> Result<(), ScenarioError> {
        self.sampler = Sampler::new(&self.table);
        (self.file, _) = self.drawn(Draws::new(0))?;
        Ok(())
    }

    /// Draws every number for a seed. Also returns the numbers that are out of range.
    pub(super) fn drawn(&self, draws: Draws) -> Result<(ScenarioFile, Problems), ScenarioError> {
        let refused = |error: toml::de::Error| ScenarioError::one(&self.origin.label, None, printable(error.message()));
        self.sampler.drawn(draws).map_err(refused)
    }

    /// Returns whether the number at a key is drawn.
    pub(super) fn is_drawn(&self, key: &str) -> bool {
        value_at(&self.table, key).is_some_and(Value::is_table)
    }

    /// Returns the scenario before anything is drawn, as text with all values.
    pub(super) fn text(&self) -> Result<String, ScenarioError> {
        text(&self.origin.label, &self.file, Some(&self.table))
    }
}

impl Origin {
    /// Returns whether the key was typed, in the file or on the command line.
    pub(super) fn is_typed(&self, map: &Map, key: &str) -> bool {
        self.is_edited(key) || map.has(key)
    }

    /// Returns whether the command line set the key.
    pub(super) fn is_edited(&self, key: &str) -> bool {
        self.edited(key).is_some()
    }

    /// Creates a problem with a key that points into the file or at the command line.
    pub(super) fn problem(&self, map: &Map, key: &str, message: String, help: Option<String>) -> Problem {
        if let Some(edited) = self.edited(key) {
            return Problem { help, ..on_command_line(message, &edited.text) };
        }
        Problem { help, ..self.at(map.find(key), message) }
    }

    /// Creates a problem with a part of the text, or with all of it.
    fn at(&self, span: Option<Range<usize>>, message: String) -> Problem {
        let place = span.as_ref().map(|span| position_of(&self.text, span.start));
        let excerpt = span.map(|span| Excerpt { text: Arc::clone(&self.text), span });
        Problem { file: self.label.clone(), place, excerpt, message, help: None }
    }

    /// Returns the last argument of the command line that set this key, a table around it, or a part of it.
    fn edited(&self, key: &str) -> Option<&Edited> {
        self.edited.iter().rev().find(|edited| related(&edited.key, key))
    }

    /// Applies the changes of the command line.
    fn apply(
        &mut self,
        overrides: &Overrides,
        table: &mut Table,
        problems: &mut Vec<Problem>,
    ) -> Result<(), ScenarioError> {
        if !overrides.traffic.is_empty() {
            table.remove("targets");
            table.remove("traffic");
            // The map shows another place.
            table.remove("basemap");
            // So do the buildings.
            table.remove("world");
            table.remove("priorities");
            // The size of the scenario's ring has no meaning for other targets.
            take_out(table, "uavs.start_ring");
            take_out(table, "uavs.start");
            table.insert("about".to_owned(), Value::String(about(&overrides.traffic)));
            let name = |path: &PathBuf| {
                path.to_str().map(|path| Value::String(path.to_owned())).ok_or_else(|| {
                    let what =
                        "the path of a traffic file must be UTF-8 text: rename the file, or change to its folder";
                    ScenarioError::one(escaped(&path.to_string_lossy()), None, what)
                })
            };
            let files = Value::Array(overrides.traffic.iter().map(name).collect::<Result<_, _>>()?);
            table.insert("traffic".to_owned(), Value::Table([("file".to_owned(), files)].into_iter().collect()));
        }
        if let Some(uavs) = overrides.uavs {
            take_out(table, "uavs.start");
            let given = ("uavs.count", Value::Integer(i64::from(uavs)), format!("--uavs {uavs}"));
            problems.extend(self.edit(table, given.0, given.1, &given.2));
        }
        for edit in &overrides.set {
            if problems.len() >= MISTAKES_MAX {
                break;
            }
            let text = format!("--set {edit}");
            problems.extend(match edit.split_once('=') {
                // Several lines could contain several values, of which only the first would count.
                Some(_) if edit.contains(['\n', '\r']) => {
                    let what = format!("{}: must be one line; give --set once for each value", quoted(edit));
                    Some(on_command_line(what, &escaped(&text).into()))
                }
                Some((key, value)) => self.edit(table, key.trim(), value_of(value.trim()), &text),
                None => {
                    let what = format!("{}: must be KEY=VALUE, like guidance.radial_gain=0.5", quoted(edit));
                    Some(on_command_line(what, &text.into()))
                }
            });
        }
        Ok(())
    }

    /// Sets a key to the value from the command line.
    fn edit(&mut self, table: &mut Table, key: &str, value: Value, text: &str) -> Option<Problem> {
        let text = text.into();
        let wrong = set(table, key, value).err().map(|what| on_command_line(what, &text));
        self.edited.push(Edited { key: key.to_owned(), text });
        wrong
    }
}

/// Describes a scenario that is flown over these traffic files.
fn about(traffic: &[PathBuf]) -> String {
    let name = |path: &PathBuf| match path.to_str() {
        Some(STANDARD_INPUT) => "standard input".to_owned(),
        _ => printable(&file_name(path)),
    };
    let names: Vec<String> = traffic.iter().take(NAMED).map(name).collect();
    let more = traffic.len() - names.len();
    let more = if more == 0 { String::new() } else { format!(" and {more} more files") };
    format!("UAVs over {}{more}", names.join(", "))
}

/// Returns whether any of the changes `KEY=VALUE` sets the key, a part of it, or a table around it.
pub(super) fn sets(set: &[String], key: &str) -> bool {
    set.iter().filter_map(|edit| edit.split_once('=')).any(|(edited, _)| related(edited.trim(), key))
}

/// Returns whether two keys are equal or one contains the other.
pub(super) fn related(one: &str, other: &str) -> bool {
    let within = |inner: &str, outer: &str| inner.strip_prefix(outer).is_some_and(|rest| rest.starts_with('.'));
    one == other || within(one, other) || within(other, one)
}

fn on_command_line(message: String, text: &Arc<str>) -> Problem {
    let excerpt = Some(Excerpt { text: Arc::clone(text), span: 0..text.len() });
    Problem { file: "command line".to_owned(), place: None, excerpt, message, help: None }
}

fn read(name: &str) -> Result<String, ScenarioError> {
    let refuse = |message: &str| Err(ScenarioError::one(name, None, message));
    if [".csv", ".xml", ".gz", ".gpx", ".parquet"].iter().any(|ending| name.to_lowercase().ends_with(ending)) {
        let how = format!("standoff run --traffic {}", shell_path(Path::new(name)));
        return refuse(&format!("its name is that of a traffic file, not of a scenario; to fly over it, run: {how}"));
    }
    let bytes = match bounded_input::bytes(Path::new(name), LENGTH_MAX) {
        Ok(bytes) => bytes,
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => {
            let file = format!("{name}.toml");
            let help =
                if Path::new(&file).is_file() { Some(did_you_mean(&printable(&file))) } else { built_in_like(name) };
            let message = match (Path::new(name).extension(), &help) {
                (Some(_), _) => format!("cannot be read: {reason}"),
                (None, Some(_)) => format!("no such scenario, built in or as a file ({reason})"),
                (None, None) => {
                    let names: Vec<_> = BUILT_IN.iter().map(|scenario| scenario.name).collect();
                    let listed = names.join(", ");
                    format!("no such scenario; built-in scenarios are {listed}; or name a file ({reason})")
                }
            };
            return Err(Problem { file: name.to_owned(), place: None, excerpt: None, message, help }.into());
        }
        Err(reason) if reason.kind() == io::ErrorKind::FileTooLarge => {
            return refuse(&format!("{reason}; put many targets into a traffic file, see [traffic]"));
        }
        Err(reason) => {
            let is_io_error = !bounded_input::is_input_error(&reason);
            return Err(ScenarioError {
                is_io_error,
                ..ScenarioError::one(name, None, bounded_input::cannot_be_read(&reason))
            });
        }
    };
    if let Some(encoding) = bounded_input::wide_encoding(&bytes) {
        return refuse(&format!("{encoding} text; a scenario is a TOML file in UTF-8: save it again in that encoding"));
    }
    match String::from_utf8(bytes) {
        // A byte order mark is not part of the text.
        Ok(text) => Ok(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_owned)),
        Err(error) => {
            let good = String::from_utf8_lossy(&error.as_bytes()[..error.utf8_error().valid_up_to()]).into_owned();
            let what = "not UTF-8 text; a scenario is a TOML file in UTF-8: save it again in that encoding";
            Err(ScenarioError::one(name, Some(position_of(&good, good.len())), what))
        }
    }
}

/// Returns the valid part of a text, and the problems in the rest, one per line.
fn understood(map: &Map, origin: &Origin) -> (Table, Vec<Problem>) {
    let mut problems: Vec<Problem> = Vec::new();
    let mut broken: Vec<RangeInclusive<usize>> = Vec::new();
    for error in &map.errors {
        let span = error.span().unwrap_or_default();
        if broken.iter().any(|line| line.contains(&span.start)) {
            continue;
        }
        broken.push(line_around(&origin.text, span.start));
        let message = match error.message().trim() {
            // The parser gives this message for anything that is not a value.
            "string values must be quoted, expected literal string" => {
                "not a value: a number, true, false, or text in \"quotes\"".to_owned()
            }
            what => printable(what),
        };
        problems.push(origin.at(Some(span), message));
        if problems.len() == MISTAKES_MAX {
            break;
        }
    }
    let mut reader = Reader { origin, broken, problems };
    let table = reader.table(map.root.get_ref());
    (table, reader.problems)
}

/// Copies valid values, and leaves out keys and values on broken lines.
struct Reader<'a> {
    origin: &'a Origin,
    /// Broken lines, as byte ranges of the text.
    broken: Vec<RangeInclusive<usize>>,
    problems: Vec<Problem>,
}

impl Reader<'_> {
    fn table(&mut self, table: &DeTable) -> Table {
        let mut sound = Table::new();
        for (key, value) in table {
            if !self.is_broken(key.span().start)
                && !self.is_broken(value.span().start)
                && let Some(value) = self.value(value)
            {
                sound.insert(key.get_ref().to_string(), value);
            }
        }
        sound
    }

    fn value(&mut self, value: &Spanned<DeValue>) -> Option<Value> {
        match value.get_ref() {
            DeValue::Table(table) => Some(Value::Table(self.table(table))),
            DeValue::Array(values) => {
                let values: Option<Vec<Value>> = values.iter().map(|value| self.value(value)).collect();
                values.map(Value::Array)
            }
            _ => match Value::deserialize(ValueDeserializer::from(value.clone())) {
                Ok(value) => Some(value),
                Err(_) => {
                    // Of the values that TOML allows, only numbers can be too large for our types.
                    if self.problems.len() < MISTAKES_MAX {
                        let typed = self.origin.text.get(value.span()).unwrap_or_default();
                        let message = format!("{}: too large", printable(typed));
                        self.problems.push(self.origin.at(Some(value.span()), message));
                    }
                    None
                }
            },
        }
    }

    fn is_broken(&self, at: usize) -> bool {
        self.broken.iter().any(|line| line.contains(&at))
    }
}

fn value_of(text: &str) -> Value {
    let parsed = toml::from_str::<Table>(&format!("value = {text}"));
    let value = parsed.ok().and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| Value::String(text.to_owned()))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
