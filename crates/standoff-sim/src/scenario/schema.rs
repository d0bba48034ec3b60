//! JSON schema of scenario files, generated from their types and the library's parameters. Editors use it for
//! completion, and error messages for the known keys and values.

use std::sync::LazyLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::{Map, Value, json};
use standoff::params::ParamKind;
use standoff::{Law, ParamInfo, ParamValue};

use super::number::whole;
use super::parameters::{DERIVED, declared, defaults, split, tables};
use super::schema_types::{KeyRange, Parameters, RANGES, ScenarioFile};

/// Returns the JSON schema (draft 7, which TOML editors support) of a scenario file.
pub fn schema() -> Value {
    let mut generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.root_schema_for::<ScenarioFile>();
    RecursiveTransform(without_null).transform(&mut schema);
    schema.insert("title".to_owned(), "A scenario of standoff".into());
    let (mut root, defaults) = (schema.to_value(), defaults(Law::Standoff));
    tables().into_iter().for_each(|table| insert_parameters(&mut root, table, &defaults));
    root
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
    let derived = DERIVED.iter().find(|(key, ..)| *key == param.key).map(|(_, is, _)| format!(" If absent: {is}."));
    let default = defaults.get(param.key).map(|default| match *default {
        ParamValue::Number(number) => whole(number).map_or(number.into(), Value::from),
        ParamValue::Word(word) => word.into(),
        ParamValue::Flag(flag) => flag.into(),
    });
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

/// Inserts the keys of the library's parameters into a table.
fn insert_parameters(root: &mut Value, table: &str, defaults: &Parameters) {
    let forms = Node::top(root).at(table).map(Node::forms).unwrap_or_default();
    let definition = forms.iter().find(|form| form.json_type() == Some("object")).map(|form| form.name.to_owned());
    let definition = definition.and_then(|name| root.pointer_mut(&format!("/definitions/{name}"))?.as_object_mut());
    let Some(definition) = definition else { return };
    let properties = definition.entry("properties").or_insert_with(|| Map::new().into());
    let Some(Value::Object(own)) = Some(std::mem::take(properties)) else { return };
    let (before, after): (Map<_, _>, Map<_, _>) =
        own.into_iter().partition(|(key, _)| BEFORE_WORDS.contains(&key.as_str()));
    let parameters = |is_number: bool| {
        let of_table = declared().filter(move |param| split(param).0 == table && param.kind.is_number() == is_number);
        of_table.map(|param| (split(param).1.to_owned(), property(param, defaults)))
    };
    let all = parameters(true).chain(before).chain(parameters(false)).chain(after);
    *properties = Value::Object(all.collect());
}

/// Returns the schema of a whole scenario, in which keys are looked up.
pub(super) fn root() -> Node<'static> {
    static SCHEMA: LazyLock<Value> = LazyLock::new(schema);
    Node::top(&SCHEMA)
}

/// The part of the schema that belongs to a key.
#[derive(Clone, Copy)]
pub(super) struct Node<'a> {
    root: &'a Value,
    json: &'a Value,
    /// Name of its definition; empty if it has none.
    name: &'a str,
}

impl<'a> Node<'a> {
    fn top(root: &'a Value) -> Self {
        Self { root, json: root, name: "ScenarioFile" }
    }

    /// Follows the reference of a part to its definition, if it has one.
    fn of(root: &'a Value, json: &'a Value) -> Self {
        let reference = json.pointer("/allOf/0/$ref").or_else(|| json.get("$ref")).and_then(Value::as_str);
        let definition = reference.and_then(|name| root.pointer(name.trim_start_matches('#')));
        let name = reference.and_then(|name| name.rsplit('/').next()).unwrap_or_default();
        Self { root, json: definition.unwrap_or(json), name }
    }

    /// The forms that a value of the key may have.
    pub(super) fn forms(self) -> Vec<Self> {
        match self.json.get("anyOf").and_then(Value::as_array) {
            Some(forms) => forms.iter().map(|form| Self::of(self.root, form)).collect(),
            None => vec![self],
        }
    }

    /// Type of the values in JSON.
    pub(super) fn json_type(self) -> Option<&'a str> {
        self.json.get("type")?.as_str()
    }

    /// Returns whether the values are numbers, or distributions.
    pub(super) fn is_number(self) -> bool {
        self.name == "Number"
    }

    /// Returns the fixed words that are allowed; `None` for other keys.
    pub(super) fn words(self) -> Option<Vec<&'a str>> {
        let words = self.json.get("oneOf")?.as_array()?;
        words.iter().map(|word| word.get("const")?.as_str()).collect()
    }

    /// Returns the keys of a table; `None` if it is not a table.
    pub(super) fn keys(self) -> Option<Vec<&'a str>> {
        Some(self.properties()?.keys().map(String::as_str).collect())
    }

    fn properties(self) -> Option<&'a Map<String, Value>> {
        let of = |form: Self| form.json.get("properties")?.as_object();
        of(self).or_else(|| self.forms().into_iter().find_map(of))
    }

    /// Returns the part of a key of this table.
    pub(super) fn key(self, key: &str) -> Option<Self> {
        Some(Self::of(self.root, self.properties()?.get(key)?))
    }

    /// Returns the part of the elements of an array.
    pub(super) fn element(self) -> Option<Self> {
        let of = |form: Self| form.json.get("items");
        Some(Self::of(self.root, of(self).or_else(|| self.forms().into_iter().find_map(of))?))
    }

    /// Returns the part of a dotted key, in which arrays may have an index.
    pub(super) fn at(self, key: &str) -> Option<Self> {
        let parts = key.split('.').filter(|part| !part.is_empty());
        parts.filter(|part| part.parse::<usize>().is_err()).try_fold(self, |node, part| {
            let node = node.element().unwrap_or(node);
            node.key(part)
        })
    }

    /// Returns the range of the numbers at a key of this table.
    pub(super) fn range(self, key: &str) -> Option<&'static KeyRange> {
        let (_, ranges) = RANGES.iter().find(|(table, _)| *table == self.name)?;
        ranges.iter().find(|range| range.key == key)
    }

    /// Returns this table and all tables in it that have a key of that name.
    pub(super) fn tables_with(self, key: &str) -> Vec<String> {
        let tables = self.keys().unwrap_or_default().into_iter().flat_map(|table| {
            let inner = self.at(table).map(|node| node.element().unwrap_or(node)).and_then(Self::keys);
            let inner = inner.unwrap_or_default().into_iter().map(move |inner| format!("{table}.{inner}"));
            std::iter::once(table.to_owned()).chain(inner)
        });
        let has_key = |table: &String| {
            let node = self.at(table).map(|node| node.element().unwrap_or(node));
            node.and_then(Self::keys).is_some_and(|keys| keys.contains(&key))
        };
        std::iter::once(String::new()).chain(tables).filter(has_key).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_and_in_arrays_of_tables() {
        let of = |key: &str| root().at(key).unwrap();
        assert!(root().keys().unwrap().contains(&"duration_s"));
        assert!(of("uavs.start").element().unwrap().keys().unwrap().contains(&"heading_deg"));
        assert!(of("uavs.start.3.heading_deg").is_number());
        assert_eq!(of("uavs.speed_m_s").keys(), None);
        assert_eq!(of("guidance.orbit_direction").words(), Some(vec!["anticlockwise", "clockwise"]));
        assert_eq!(of("guidance.lead_s").words(), None);
        assert!(of("duration_s").is_number() && !of("guidance.orbit_direction").is_number());
        assert_eq!(root().tables_with("lead_s"), ["guidance"]);
        assert_eq!(root().tables_with("start_ring"), ["uavs"]);
        assert_eq!(
            root().tables_with("x_m"),
            ["uavs.start", "geofence", "intruders", "targets.random", "targets.start", "priorities"].map(str::to_owned)
        );
    }

    /// A range without its table would not be checked.
    #[test]
    fn every_range_belongs_to_a_number() {
        let definitions = root().json["definitions"].as_object().unwrap();
        for (table, ranges) in RANGES.iter().filter(|(table, _)| *table != "ScenarioFile") {
            let node = Node { root: root().json, json: &definitions[*table], name: table };
            assert!(ranges.iter().all(|range| node.key(range.key).unwrap().is_number()), "{table}");
        }
    }
}
