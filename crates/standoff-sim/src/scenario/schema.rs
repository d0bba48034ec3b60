//! The JSON schema of scenario files, made from their types: editors complete scenarios with it, and messages tell from
//! it which keys and words there are.

use std::sync::LazyLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::Value;

use super::file::ScenarioFile;

/// The JSON schema (draft 7, which editors of TOML know) of a scenario file.
pub fn schema() -> Value {
    let mut generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.root_schema_for::<ScenarioFile>();
    RecursiveTransform(without_null).transform(&mut schema);
    schema.insert("title".to_owned(), "A scenario of standoff".into());
    schema.to_value()
}

/// TOML knows no null: what may be absent is not listed as required, and that is all. A table's defaults are those of
/// its keys, and a number is a number.
fn without_null(schema: &mut Schema) {
    let Some(object) = schema.as_object_mut() else { return };
    object.remove("format");
    if object.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
        object.remove("default");
    }
    let Some(Value::Array(any)) = object.get("anyOf") else { return };
    let Some(one) = any.iter().find(|one| one.get("$ref").is_some()) else { return };
    let one = one.clone();
    object.remove("anyOf");
    object.insert("allOf".to_owned(), Value::Array(vec![one]));
}

/// The schema, to look keys up in.
pub(super) static KEYS: LazyLock<Keys> = LazyLock::new(|| Keys { root: schema() });

/// Which keys there are.
pub(super) struct Keys {
    root: Value,
}

impl Keys {
    /// The keys of the table called `table` (dotted; empty for the root), if it is one.
    pub(super) fn of(&self, table: &str) -> Option<Vec<&str>> {
        Some(self.node(table)?.get("properties")?.as_object()?.keys().map(String::as_str).collect())
    }

    /// The words that a key takes, if it takes words.
    pub(super) fn words(&self, key: &str) -> Option<Vec<&str>> {
        let words = self.node(key)?.get("oneOf")?.as_array()?;
        words.iter().map(|word| word.get("const")?.as_str()).collect()
    }

    /// The key is that of a number, or leads into a number's distribution: the number's own key.
    pub(super) fn number<'k>(&self, key: &'k str) -> Option<&'k str> {
        let ends = key.match_indices('.').map(|(end, _)| end).chain([key.len()]);
        let mut prefixes = ends.map(|end| &key[..end]);
        prefixes.find(|prefix| {
            self.raw(prefix).is_some_and(|node| reference(node).is_some_and(|name| name.ends_with("/Number")))
        })
    }

    /// Every table with a key of that name.
    pub(super) fn tables_with(&self, key: &str) -> Vec<String> {
        let tables = self.of("").unwrap_or_default().into_iter().flat_map(|table| {
            let inner = self.of(table).unwrap_or_default().into_iter().map(move |inner| format!("{table}.{inner}"));
            std::iter::once(table.to_owned()).chain(inner)
        });
        std::iter::once(String::new())
            .chain(tables)
            .filter(|table| self.of(table).is_some_and(|keys| keys.contains(&key)))
            .collect()
    }

    fn node(&self, key: &str) -> Option<&Value> {
        Some(self.followed(self.raw(key)?))
    }

    /// What stands at a key, references not followed. Arrays may be given with or without an index.
    fn raw(&self, key: &str) -> Option<&Value> {
        let parts = key.split('.').filter(|part| !part.is_empty());
        parts
            .filter(|part| part.parse::<usize>().is_err())
            .try_fold(&self.root, |node, part| {
                let node = self.followed(node);
                let node = node.get("items").map_or(node, |items| self.followed(items));
                node.get("properties")?.get(part)
            })
            .map(|node| self.followed(node).get("items").unwrap_or(node))
    }

    fn followed<'a>(&'a self, node: &'a Value) -> &'a Value {
        let pointed = reference(node).and_then(|name| self.root.pointer(name.trim_start_matches('#')));
        pointed.unwrap_or(node)
    }
}

/// The definition that a node refers to.
fn reference(node: &Value) -> Option<&str> {
    let node = node.pointer("/allOf/0").unwrap_or(node);
    node.get("$ref")?.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_and_in_arrays_of_tables() {
        assert!(KEYS.of("").unwrap().contains(&"duration_s"));
        assert!(KEYS.of("uavs.at").unwrap().contains(&"heading_deg"));
        assert!(KEYS.of("uavs.at.3").unwrap().contains(&"heading_deg"));
        assert_eq!(KEYS.of("uavs.speed_m_s"), None);
        assert_eq!(KEYS.words("guidance.sense"), Some(vec!["anticlockwise", "clockwise"]));
        assert_eq!(KEYS.words("guidance.lead_s"), None);
        assert_eq!(KEYS.number("orbit.margin_sds.uniform.min"), Some("orbit.margin_sds"));
        assert_eq!(KEYS.number("targets.at.1.x_m"), Some("targets.at.1.x_m"));
        assert_eq!(KEYS.number("duration_s"), Some("duration_s"));
        assert_eq!(KEYS.number("guidance.sense"), None);
        assert_eq!(KEYS.tables_with("lead_s"), ["guidance"]);
        assert_eq!(KEYS.tables_with("ring"), ["uavs"]);
        assert_eq!(
            KEYS.tables_with("x_m"),
            ["uavs.at", "intruders", "targets.scatter", "targets.at"].map(str::to_owned)
        );
    }
}
