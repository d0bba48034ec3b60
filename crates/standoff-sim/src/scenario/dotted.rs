//! Dotted keys of TOML tables, such as `uavs.start.1.x_m`.

use standoff_io::display_text::printable;
use toml::{Table, Value};

/// Maximum depth of a key: that of a number's distribution in an array.
const DEPTH_MAX: usize = 6;

/// Returns the value of a dotted key.
pub(super) fn value_at<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let (first, rest) = key.split_once('.').unwrap_or((key, ""));
    value_in(table.get(first)?, rest)
}

/// Returns the part of a value at a dotted key in it.
pub(super) fn value_in<'a>(value: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').filter(|part| !part.is_empty()).try_fold(value, |here, part| match here {
        Value::Array(values) => values.get(part.parse::<usize>().ok()?),
        here => here.get(part),
    })
}

/// Returns the value of a dotted key.
pub(super) fn value_at_mut<'a>(table: &'a mut Table, key: &str) -> Option<&'a mut Value> {
    let mut parts = key.split('.');
    let first = table.get_mut(parts.next()?)?;
    parts.try_fold(first, |here, part| match here {
        Value::Array(values) => values.get_mut(part.parse::<usize>().ok()?),
        here => here.get_mut(part),
    })
}

/// Removes the value of a dotted key of tables.
pub(super) fn take_out(table: &mut Table, key: &str) -> Option<Value> {
    match key.rsplit_once('.') {
        Some((parent, last)) => value_at_mut(table, parent)?.as_table_mut()?.remove(last),
        None => table.remove(key),
    }
}

/// Sets the value of a dotted key of tables, which are created if they are missing. The error names the key.
pub(super) fn set(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    let refuse = |what: &str| Err(format!("{}: {what}", printable(key)));
    let mut parts: Vec<_> = key.split('.').collect();
    if parts.len() > DEPTH_MAX {
        return refuse("is nested too deeply");
    }
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
