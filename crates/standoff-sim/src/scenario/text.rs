//! Text of a scenario: its size limits, and the text with all values, which can be read again.

use standoff_record::SCENARIO_MAX;
use toml::ser::Error;
use toml::{Table, Value};

use super::dotted::value_at_mut;
use super::error::ScenarioError;
use super::number::Number;
use super::parameters::{tables, to_value};
use super::schema::{Node, root};
use super::schema_types::ScenarioFile;

/// Maximum size of a scenario file, bytes. 5,000 targets, one table each, take 1 MiB.
pub(super) const LENGTH_MAX: u64 = SCENARIO_MAX / SPELT_OUT;

/// Maximum number of line ends and punctuation characters in a text: parsing can take 500 bytes of memory for each.
/// 5,000 targets, one table each, have 180,000.
const SIGNS_MAX: u64 = 200_000;

/// Factor on the size limit for a text written by this program, which contains all values.
pub(super) const SPELT_OUT: u64 = 2;

/// Maximum number of these characters in such a text. The maximum numbers of targets and UAVs have 700,000.
const SPELT_OUT_SIGNS_MAX: u64 = 800_000;

/// Rejects a text that would take too much memory to read: `times` is 1 for a typed scenario, or [`SPELT_OUT`].
pub(super) fn check_size(label: &str, text: &str, times: u64) -> Result<(), ScenarioError> {
    let signs: u64 = text.bytes().map(signs_of).sum();
    let signs_max = if times == SPELT_OUT { SPELT_OUT_SIGNS_MAX } else { SIGNS_MAX };
    let length_max = times * LENGTH_MAX;
    if signs <= signs_max && text.len() as u64 <= length_max {
        return Ok(());
    }
    let what = format!(
        "it has more than {length_max} bytes, or more than {signs_max} line ends and punctuation characters; put targets \
         into a traffic file, see [traffic]"
    );
    Err(ScenarioError::one(label, None, what))
}

/// Cost of a byte: a dot can start a new table.
fn signs_of(byte: u8) -> u64 {
    match byte {
        b'_' | b'-' => 0,
        b'.' => 3,
        _ => (byte.is_ascii_control() || byte.is_ascii_punctuation()).into(),
    }
}

/// Returns the text of a drawn scenario or, with the `typed` one, the text before anything was drawn.
pub(super) fn text(name: &str, file: &ScenarioFile, typed: Option<&Table>) -> Result<String, ScenarioError> {
    let written = to_toml(file).and_then(|mut table| {
        typed.inspect(|typed| restore(typed, &mut table));
        toml::to_string(&table)
    });
    let text = written.map_err(|error| ScenarioError::one(name, None, error.to_string()))?;
    check_size(name, &text, SPELT_OUT)?;
    Ok(text)
}

/// Converts a scenario to TOML, with its parameters in the order of the schema. Parameters of absent optional tables are
/// left out.
fn to_toml(file: &ScenarioFile) -> Result<Table, Error> {
    let mut scenario = Table::try_from(file)?;
    for name in tables() {
        let Some(Value::Table(table)) = value_at_mut(&mut scenario, name) else { continue };
        let mut own = std::mem::take(table);
        for key in root().at(name).and_then(Node::keys).unwrap_or_default() {
            let parameter = file.parameters.get(format!("{name}.{key}").as_str());
            let value = parameter.map(to_value).or_else(|| own.remove(key));
            table.extend(value.map(|value| (key.to_owned(), value)));
        }
    }
    Ok(scenario)
}

/// Replaces drawn numbers by their distributions, and writes all typed numbers in the same way.
fn restore(typed: &Table, drawn: &mut Table) {
    for (key, typed) in typed {
        if let Some(drawn) = drawn.get_mut(key) {
            restore_value(typed, drawn);
        }
    }
}

fn restore_value(typed: &Value, drawn: &mut Value) {
    if let Some(number) = Number::read(typed).ok().and_then(|number| Value::try_from(number).ok()) {
        *drawn = number;
        return;
    }
    match (typed, drawn) {
        (Value::Table(typed), Value::Table(drawn)) => restore(typed, drawn),
        (Value::Array(typed), Value::Array(drawn)) => {
            typed.iter().zip(drawn).for_each(|(typed, drawn)| restore_value(typed, drawn));
        }
        _ => {}
    }
}
