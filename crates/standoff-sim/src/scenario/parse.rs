//! Form of a scenario: compares keys and types with the schema, and collects the errors.
//!
//! A value of the wrong form is reported and left out, so that all errors are found in one pass.

use standoff_io::display_text::{did_you_mean, nearest, printable, quoted};
use toml::{Table, Value};

use super::dotted::value_in;
use super::number::Number;
use super::schema::{Node, root};

/// Maximum number of mistakes; reading stops after that, because a text with more is probably not a scenario.
pub const MISTAKES_MAX: usize = 20;

/// A key or value of the wrong form.
pub(super) struct Mistake {
    /// Dotted key.
    pub(super) key: String,
    pub(super) message: String,
    pub(super) help: Option<String>,
}

/// Mistakes in the form of a scenario.
#[derive(Default)]
pub(super) struct Form {
    pub(super) mistakes: Vec<Mistake>,
    /// Keys that were left out: those of mistakes, or of the arrays around them.
    pub(super) left_out: Vec<String>,
}

impl Form {
    /// Checks a table at a key, and leaves out everything that is unknown or wrong in it.
    pub(super) fn check(&mut self, node: Node, at: &str, table: &mut Table) {
        table.retain(|name, value| {
            let key = if at.is_empty() { name.to_owned() } else { format!("{at}.{name}") };
            let is_right = match node.key(name) {
                Some(inner) => self.is_right(inner, &key, value),
                None => {
                    self.add(&key, || {
                        (format!("{}: there is no such key", printable(&key)), Some(suggestion(node, at, name)))
                    });
                    false
                }
            };
            if !is_right {
                self.left_out.push(key);
            }
            is_right
        });
    }

    /// Returns whether the value at a key can be used, without the parts of tables that are left out.
    fn is_right(&mut self, node: Node, key: &str, value: &mut Value) -> bool {
        if node.is_number() {
            let wrong = Number::read(value).err();
            if let Some((part, what)) = &wrong {
                let part_key = if part.is_empty() { key.to_owned() } else { format!("{key}.{part}") };
                self.add(&part_key, || (format!("{}: {what}", with_value(&part_key, value_in(value, part))), None));
            }
            return wrong.is_none();
        }
        if let (Value::Table(table), Some(_)) = (&mut *value, node.keys()) {
            self.check(node, key, table);
            return true;
        }
        if let (Value::Array(values), Some(element)) = (&mut *value, node.element()) {
            let mut elements = values.iter_mut().enumerate();
            return elements.all(|(index, value)| self.is_right(element, &format!("{key}.{index}"), value));
        }
        let is_accepted = node.forms().into_iter().any(|form| accepts(form, value));
        if !is_accepted {
            self.add(key, || {
                let words = node.words().unwrap_or_default();
                let near = value.as_str().and_then(|typed| nearest(typed, &words));
                let what = format!("{}: must be {}", with_value(key, Some(value)), expected(node, key));
                (what, near.map(did_you_mean))
            });
        }
        is_accepted
    }

    /// Adds a mistake with its message and help, which are costly, unless there are too many already.
    fn add(&mut self, key: &str, describe: impl FnOnce() -> (String, Option<String>)) {
        if self.mistakes.len() < MISTAKES_MAX {
            let (message, help) = describe();
            self.mistakes.push(Mistake { key: key.to_owned(), message, help });
        }
    }
}

/// Returns whether a key accepts this text or switch.
fn accepts(form: Node, value: &Value) -> bool {
    match value {
        Value::String(text) => {
            form.words().map_or(form.json_type() == Some("string"), |words| words.contains(&text.as_str()))
        }
        Value::Boolean(_) => form.json_type() == Some("boolean"),
        _ => false,
    }
}

/// Describes the values that a key accepts.
fn expected(node: Node, key: &str) -> String {
    if let Some(words) = node.words() {
        return words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ");
    }
    let forms = node.forms().into_iter().map(|form| match (form.json_type(), form.element()) {
        (Some("object"), _) => "a table".to_owned(),
        (Some("boolean"), _) if node.json_type().is_some() => "a boolean".to_owned(),
        // A table that can be switched off.
        (Some("boolean"), _) => "false".to_owned(),
        (_, Some(element)) if element.keys().is_some() => format!("an array of tables, [[{key}]]"),
        (_, Some(_)) => "an array, in []".to_owned(),
        _ => "a string".to_owned(),
    });
    forms.collect::<Vec<_>>().join(" or ")
}

/// Suggests what an unknown key of the table at `at` may have meant.
fn suggestion(table: Node, at: &str, typed: &str) -> String {
    let keys = table.keys().unwrap_or_default();
    if let Some(near) = nearest(typed, &keys) {
        return did_you_mean(near);
    }
    let place = |table: &str| if table.is_empty() { "at the top".to_owned() } else { format!("in [{table}]") };
    match root().tables_with(typed).first() {
        Some(elsewhere) => format!("`{typed}` belongs {}", place(elsewhere)),
        None => format!("the keys {} are {}", place(at), keys.join(", ")),
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
