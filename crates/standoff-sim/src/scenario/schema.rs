//! JSON schema of scenario files, generated from their types and the library's parameters. Editors use it for
//! completion, and error messages for the known keys and values.

use std::sync::LazyLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::{Map, Value, json};
use standoff::ParamInfo;
use standoff::params::ParamKind;

use super::parameters::{DERIVED, Parameters, declared, split, tables};
use super::schema_types::ScenarioFile;

/// Returns the JSON schema (draft 7, which TOML editors support) of a scenario file.
pub fn schema() -> Value {
    let mut generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.root_schema_for::<ScenarioFile>();
    RecursiveTransform(without_null).transform(&mut schema);
    schema.insert("title".to_owned(), "A scenario of standoff".into());
    let mut keys = Keys { root: schema.to_value() };
    tables().into_iter().for_each(|table| keys.insert_parameters(table));
    keys.root
}

/// Keys of the simulator that stand between the library's numbers and words; others follow them.
const BEFORE_WORDS: [&str; 1] = ["count"];

/// Returns the schema of a parameter's key.
fn property(param: &ParamInfo, defaults: &Parameters) -> Value {
    let (what, (kind, of_kind)) = match param.kind {
        ParamKind::Number { unit, allowed } => {
            let (unit, allowed) = match param.is_angle() {
                true => (unit.replace("rad", "degrees"), allowed.map(f64::to_degrees)),
                false => (unit.to_owned(), allowed),
            };
            let number = json!([{ "$ref": "#/definitions/Number" }]);
            (format!(" Unit: {unit}. Range: {allowed}."), ("allOf", number))
        }
        ParamKind::Word(words) => {
            let listed: Vec<String> = words.iter().map(|word| format!("`{}`", word.word)).collect();
            let one_of =
                words.iter().map(|word| json!({ "type": "string", "const": word.word, "description": word.doc() }));
            (format!(" Values: {}.", listed.join(", ")), ("oneOf", one_of.collect()))
        }
        ParamKind::Flag => (String::new(), ("type", "boolean".into())),
    };
    let derived = DERIVED.iter().find(|(key, _)| *key == param.key).map(|(_, absent)| format!(" {absent}"));
    let default = defaults.value(param.key).and_then(|default| serde_json::to_value(default).ok());
    let mut property = Map::new();
    property.extend(default.map(|default| ("default".to_owned(), default)));
    let description = format!("{}{what}{}", param.doc(), derived.unwrap_or_default());
    property.extend([("description".to_owned(), description.into()), (kind.to_owned(), of_kind)]);
    property.into()
}

/// Removes null, which TOML does not have: optional keys are simply not required. Also removes the defaults of tables,
/// which are those of their keys, and the formats of numbers.
fn without_null(schema: &mut Schema) {
    let Some(object) = schema.as_object_mut() else { return };
    object.remove("format");
    if object.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
        object.remove("default");
    }
    let Some(Value::Array(any)) = object.get("anyOf") else { return };
    let [one, Value::Object(other)] = &any[..] else { return };
    if one.get("$ref").is_some() && other.get("type").is_some_and(|name| name == "null") {
        let one = one.clone();
        object.remove("anyOf");
        object.insert("allOf".to_owned(), Value::Array(vec![one]));
    }
}

/// Schema in which keys are looked up.
pub(super) static KEYS: LazyLock<Keys> = LazyLock::new(|| Keys { root: schema() });

/// Known keys and values.
pub(super) struct Keys {
    root: Value,
}

impl Keys {
    /// Returns the keys of the table `table` (dotted; empty for the root); `None` if it is not a table.
    pub(super) fn of(&self, table: &str) -> Option<Vec<&str>> {
        Some(self.node(table)?.get("properties")?.as_object()?.keys().map(String::as_str).collect())
    }

    /// Returns the values of a key that accepts fixed words; `None` for other keys.
    pub(super) fn words(&self, key: &str) -> Option<Vec<&str>> {
        let words = self.node(key)?.get("oneOf")?.as_array()?;
        words.iter().map(|word| word.get("const")?.as_str()).collect()
    }

    /// Returns the key of the number to which `key` belongs, if `key` is a number or part of a number's distribution.
    pub(super) fn number<'k>(&self, key: &'k str) -> Option<&'k str> {
        let ends = key.match_indices('.').map(|(end, _)| end).chain([key.len()]);
        let mut prefixes = ends.map(|end| &key[..end]);
        prefixes.find(|prefix| {
            self.raw(prefix).is_some_and(|node| reference(node).is_some_and(|name| name.ends_with("/Number")))
        })
    }

    /// Returns all tables that have a key of that name.
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

    /// Inserts the keys of the library's parameters into a table.
    fn insert_parameters(&mut self, table: &str) {
        let definition = self.raw(table).and_then(reference).map(|name| name.trim_start_matches('#').to_owned());
        let definition = definition.and_then(|pointer| self.root.pointer_mut(&pointer)).and_then(Value::as_object_mut);
        let Some(definition) = definition else { return };
        let properties = definition.entry("properties").or_insert_with(|| Map::new().into());
        let Some(Value::Object(own)) = Some(std::mem::take(properties)) else { return };
        let (before, after): (Map<_, _>, Map<_, _>) =
            own.into_iter().partition(|(key, _)| BEFORE_WORDS.contains(&key.as_str()));
        let defaults = Parameters::default();
        let parameters = |is_number: bool| {
            let of_table =
                declared().filter(move |param| split(param).0 == table && param.kind.is_number() == is_number);
            of_table.map(|param| (split(param).1.to_owned(), property(param, &defaults)))
        };
        let all = parameters(true).chain(before).chain(parameters(false)).chain(after);
        *properties = Value::Object(all.collect());
    }

    fn node(&self, key: &str) -> Option<&Value> {
        Some(self.followed(self.raw(key)?))
    }

    /// Returns the schema node of a key, without following references. Arrays may be given with or without an index.
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

/// Returns the definition that a node refers to.
fn reference(node: &Value) -> Option<&str> {
    let node = node.pointer("/allOf/0").or_else(|| node.pointer("/anyOf/0")).unwrap_or(node);
    node.get("$ref")?.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_and_in_arrays_of_tables() {
        assert!(KEYS.of("").unwrap().contains(&"duration_s"));
        assert!(KEYS.of("uavs.start").unwrap().contains(&"heading_deg"));
        assert!(KEYS.of("uavs.start.3").unwrap().contains(&"heading_deg"));
        assert_eq!(KEYS.of("uavs.speed_m_s"), None);
        assert_eq!(KEYS.words("guidance.orbit_direction"), Some(vec!["anticlockwise", "clockwise"]));
        assert_eq!(KEYS.words("guidance.lead_s"), None);
        assert_eq!(KEYS.number("orbit.margin_sds.uniform.min"), Some("orbit.margin_sds"));
        assert_eq!(KEYS.number("targets.start.1.x_m"), Some("targets.start.1.x_m"));
        assert_eq!(KEYS.number("duration_s"), Some("duration_s"));
        assert_eq!(KEYS.number("guidance.orbit_direction"), None);
        assert_eq!(KEYS.tables_with("lead_s"), ["guidance"]);
        assert_eq!(KEYS.tables_with("start_ring"), ["uavs"]);
        assert_eq!(
            KEYS.tables_with("x_m"),
            ["uavs.start", "geofence", "intruders", "targets.random", "targets.start"].map(str::to_owned)
        );
    }
}
