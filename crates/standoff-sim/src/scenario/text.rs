//! Writes a scenario as text with all values, which can be read again.

use toml::ser::Error;
use toml::{Table, Value};

use super::error::ScenarioError;
use super::load::{SPELT_OUT, check_size};
use super::number::Number;
use super::parameters::{tables, to_value};
use super::parse::value_at_mut;
use super::schema::{Node, root};
use super::schema_types::ScenarioFile;

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
