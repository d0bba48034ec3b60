//! Form of a scenario: converts TOML to the types of the tables, and collects the errors.
//!
//! A value of the wrong type is reported and left out, and reading continues without it, so that all errors are found
//! in one pass.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};
use standoff::Law;
use standoff::params::ParamKind;
use standoff_io::display_text::{did_you_mean, nearest, printable, quoted};
use toml::{Table, Value};

use super::parameters::{Parameters, TypedValue, declared, split, tables};
use super::schema::KEYS;
use super::schema_types::ScenarioFile;

/// Maximum number of mistakes; reading stops after that, because a text with more is probably not a scenario.
pub const MISTAKES_MAX: usize = 20;

/// A key or value of the wrong form.
pub(super) struct Mistake {
    /// Dotted key.
    pub(super) key: String,
    /// Dotted key of the part that was left out: the key itself or something around it.
    pub(super) left_out: String,
    pub(super) message: String,
    pub(super) help: Option<String>,
}

/// A value of the wrong form: the path of the error in the value, and what is wrong.
#[derive(Debug, Default)]
struct WrongForm {
    path: String,
    what: String,
}

impl Mistake {
    /// Creates the mistake in the value at a key, which is left out.
    fn new(table: &Table, at: &str, WrongForm { path, what }: WrongForm) -> Self {
        let key = [at, &path].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".");
        let (message, help) = message(&key, value_at(table, &key), &what);
        Self { key, left_out: at.to_owned(), message, help }
    }
}

/// Returns the scenario without the mistakes; `None` if there are too many.
pub(super) fn typed(mut table: Table) -> (Option<ScenarioFile>, Vec<Mistake>) {
    let mut mistakes = Vec::new();
    take_out_unknown(&mut table, "", &mut mistakes);
    if law_of(&table) == Law::Oh2015 {
        // Only the phases on an orbit separate UAVs.
        table.entry("separation").or_insert(Value::Boolean(false));
    }
    let parameters = take_parameters(&mut table, &mut mistakes);
    while mistakes.len() < MISTAKES_MAX {
        let wrong = match deserialized(Value::Table(table.clone())) {
            Ok(file) => return (Some(ScenarioFile { parameters, ..file }), mistakes),
            Err(wrong) => wrong,
        };
        let mistake = Mistake::new(&table, "", wrong);
        let left_out = take_out(&mut table, &mistake.key);
        let stuck = left_out.is_none();
        mistakes.push(Mistake { left_out: left_out.unwrap_or_else(|| mistake.key.clone()), ..mistake });
        if stuck {
            break;
        }
    }
    (None, mistakes)
}

/// Law that a scenario names, which determines the defaults; this project's law if it names none.
fn law_of(table: &Table) -> Law {
    value_at(table, "guidance.law").and_then(Value::as_str).and_then(Law::named).unwrap_or(Law::Standoff)
}

/// Takes the values of the library's parameters out of a scenario.
fn take_parameters(table: &mut Table, mistakes: &mut Vec<Mistake>) -> Parameters {
    let mut parameters = Parameters::of_law(law_of(table));
    for (param, slot) in parameters.iter_mut() {
        let Some(value) = value_at(table, param.key) else { continue };
        let read = match param.kind {
            ParamKind::Number { .. } => deserialized(value.clone()).map(TypedValue::Number),
            ParamKind::Flag => deserialized(value.clone()).map(TypedValue::Flag),
            ParamKind::Word(words) => {
                let known = words.iter().find(|known| value.as_str() == Some(known.word));
                known.map(|known| TypedValue::Word(known.word)).ok_or_else(WrongForm::default)
            }
        };
        match read {
            Ok(typed) => *slot = Some(typed),
            // Two parameters may share a key.
            Err(wrong)
                if mistakes.len() < MISTAKES_MAX && mistakes.iter().all(|mistake| mistake.left_out != param.key) =>
            {
                mistakes.push(Mistake::new(table, param.key, wrong));
            }
            Err(_) => {}
        }
    }
    declared().for_each(|param| drop(take_out(table, param.key)));
    parameters
}

/// Converts a typed or resolved scenario to TOML, with its parameters in the order of the schema. Parameters of absent
/// optional tables are left out.
pub(super) fn to_toml(file: &impl Serialize, parameters: &Parameters) -> Result<Table, toml::ser::Error> {
    let mut scenario = Table::try_from(file)?;
    for name in tables() {
        let Some(Value::Table(table)) = value_at_mut(&mut scenario, name) else { continue };
        let mut own = std::mem::take(table);
        for key in KEYS.of(name).unwrap_or_default() {
            let typed = parameters.iter().find(|(param, _)| split(param) == (name, key)).and_then(|(_, typed)| typed);
            let value = match typed {
                Some(typed) => Some(Value::try_from(typed)?),
                None => own.remove(key),
            };
            table.extend(value.map(|value| (key.to_owned(), value)));
        }
    }
    Ok(scenario)
}

/// Converts a value to a type.
fn deserialized<T: DeserializeOwned>(value: Value) -> Result<T, WrongForm> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = dotted(error.path());
        // The library appends a line with the position, for which the key is better.
        let what = error.into_inner().to_string().lines().next().unwrap_or_default().to_owned();
        WrongForm { path, what }
    })
}

/// Removes all unknown keys of a table in one pass, because there can be many. `at` is the key of the table.
fn take_out_unknown(table: &mut Table, at: &str, mistakes: &mut Vec<Mistake>) {
    // The library reports errors in the distribution of a number, and values in place of a table.
    let Some(keys) = KEYS.of(at) else { return };
    table.retain(|typed, value| {
        let key = if at.is_empty() { typed.to_owned() } else { format!("{at}.{typed}") };
        let is_known = keys.contains(&typed);
        if is_known {
            inner_tables(&key, value).for_each(|(key, table)| take_out_unknown(table, &key, mistakes));
        } else if mistakes.len() < MISTAKES_MAX {
            let message = format!("{}: there is no such key", printable(&key));
            let help = Some(suggestion(at, typed, &keys));
            mistakes.push(Mistake { left_out: key.clone(), key, message, help });
        }
        is_known
    });
}

/// Returns the value if it is a table, or the tables of an array, with their keys.
fn inner_tables<'a>(key: &str, value: &'a mut Value) -> impl Iterator<Item = (String, &'a mut Table)> {
    let (table, array) = match value {
        Value::Table(table) => (Some((key.to_owned(), table)), None),
        Value::Array(values) => (None, Some(values)),
        _ => (None, None),
    };
    let array = array.into_iter().flatten().enumerate();
    table.into_iter().chain(array.filter_map(move |(index, value)| match value {
        Value::Table(table) => Some((format!("{key}.{index}"), table)),
        _ => None,
    }))
}

/// Dotted form of a path, such as `uavs.start.1.x_m`.
fn dotted(path: &Path) -> String {
    let parts = path.iter().filter_map(|segment| match segment {
        Segment::Map { key } => Some(key.clone()),
        Segment::Seq { index } => Some(index.to_string()),
        Segment::Enum { .. } | Segment::Unknown => None,
    });
    parts.collect::<Vec<_>>().join(".")
}

/// Describes the mistake at a key, from the library's message `what`; also returns advice.
fn message(key: &str, value: Option<&Value>, what: &str) -> (String, Option<String>) {
    let is = with_value(key, value);
    if let Some(words) = KEYS.words(key) {
        let listed: Vec<_> = words.iter().map(|word| format!("\"{word}\"")).collect();
        let near = value.and_then(Value::as_str).and_then(|typed| nearest(typed, &words));
        return (format!("{is}: must be {}", listed.join(" or ")), near.map(did_you_mean));
    }
    let expected = what.strip_prefix("invalid type").and_then(|what| what.rsplit_once(", expected "));
    match expected {
        Some((_, expected)) if expected.starts_with("struct ") => (format!("{is}: must be a table"), None),
        Some((_, "a sequence")) if KEYS.of(key).is_none() => (format!("{is}: must be an array, in []"), None),
        Some((_, "a sequence")) => (format!("{is}: must be an array of tables, [[{key}]]"), None),
        Some((_, expected)) => (format!("{is}: must be {expected}"), None),
        None => (format!("{is}: {}", printable(what)), None),
    }
}

/// Suggests what an unknown key of a table may have meant.
fn suggestion(table: &str, typed: &str, keys: &[&str]) -> String {
    if let Some(near) = nearest(typed, keys) {
        return did_you_mean(near);
    }
    let place = |table: &str| if table.is_empty() { "at the top".to_owned() } else { format!("in [{table}]") };
    match KEYS.tables_with(typed).first() {
        Some(elsewhere) => format!("`{typed}` belongs {}", place(elsewhere)),
        None => format!("the keys {} are {}", place(table), keys.join(", ")),
    }
}

/// Formats a key with its value, if the value is short: `uavs.count = 0`.
pub(super) fn with_value(key: &str, value: Option<&Value>) -> String {
    let key = printable(key);
    match value {
        // 1e300 and 1e-300, not three hundred digits.
        Some(Value::Float(value)) if value.abs() >= 1e15 || value.abs() > 0.0 && value.abs() < 1e-6 => {
            format!("{key} = {value:e}")
        }
        Some(Value::String(text)) => format!("{key} = {}", quoted(text)),
        Some(value) if !value.is_table() && !value.is_array() => format!("{key} = {value}"),
        _ => key,
    }
}

/// Returns the value of a dotted key.
pub(super) fn value_at<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut parts = key.split('.');
    let first = table.get(parts.next()?)?;
    parts.try_fold(first, |here, part| match here {
        Value::Array(values) => values.get(part.parse::<usize>().ok()?),
        here => here.get(part),
    })
}

/// Removes the value of a key: for a part of a distribution the whole number, for an element of an array the whole
/// array, so that the rest is valid. Returns the key of the removed part, if there was one.
pub(super) fn take_out(table: &mut Table, key: &str) -> Option<String> {
    let mut key = KEYS.number(key).unwrap_or(key);
    while let Some((array, index)) = key.rsplit_once('.')
        && index.parse::<usize>().is_ok()
    {
        key = array;
    }
    let (parent, last) = key.rsplit_once('.').unwrap_or(("", key));
    let parent = if parent.is_empty() { table } else { value_at_mut(table, parent)?.as_table_mut()? };
    parent.remove(last).map(|_| key.to_owned())
}

/// Returns the value of a dotted key.
fn value_at_mut<'a>(table: &'a mut Table, key: &str) -> Option<&'a mut Value> {
    let mut parts = key.split('.');
    let first = table.get_mut(parts.next()?)?;
    parts.try_fold(first, |here, part| match here {
        Value::Array(values) => values.get_mut(part.parse::<usize>().ok()?),
        here => here.get_mut(part),
    })
}
