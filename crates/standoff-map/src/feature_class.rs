//! Feature classes of lines and areas, from the terms of SUMO and OpenStreetMap.

use serde::{Deserialize, Serialize};

/// Feature class of a line or an area, in drawing order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    Green,
    Water,
    Other,
    Building,
    Path,
    Rail,
    Minor,
    Major,
}

const MAJOR: &[&str] =
    &["motorway", "motorway_link", "trunk", "trunk_link", "primary", "primary_link", "secondary", "secondary_link"];
const PATH: &[&str] = &[
    "footway",
    "path",
    "steps",
    "cycleway",
    "bridleway",
    "pedestrian",
    "track",
    "corridor",
    "elevator",
    "sidewalk",
    "crossing",
    "platform",
];
const WATER: &[&str] = &[
    "water",
    "waterway",
    "bay",
    "river",
    "riverbank",
    "stream",
    "canal",
    "basin",
    "reservoir",
    "lake",
    "sea",
    "dock",
    "swimming_pool",
];
const GREEN: &[&str] = &[
    "forest",
    "wood",
    "grass",
    "meadow",
    "park",
    "garden",
    "orchard",
    "vineyard",
    "farmland",
    "scrub",
    "heath",
    "wetland",
    "golf_course",
    "pitch",
    "recreation_ground",
    "village_green",
    "cemetery",
    "allotments",
    "grassland",
    "nature_reserve",
    "plant_nursery",
    "greenfield",
    "playground",
    "farm",
];

/// Splits compound types such as `highway.primary` or `landuse:forest` into words.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(['.', ':', ' ', '/', '|', ','])
}

impl Kind {
    /// Returns the class of a SUMO type of an edge or polygon (`highway.primary`, `building`, `landuse.forest`).
    pub(crate) fn of_type(text: &str) -> Option<Self> {
        let has = |known: &[&str]| words(text).any(|word| known.contains(&word));
        if has(&["building", "buildings"]) {
            Some(Self::Building)
        } else if has(&["railway", "rail", "tram", "subway", "light_rail"]) {
            Some(Self::Rail)
        } else if has(MAJOR) {
            Some(Self::Major)
        } else if has(PATH) {
            Some(Self::Path)
        } else if has(&["highway", "road", "street"]) {
            Some(Self::Minor)
        } else if has(WATER) {
            Some(Self::Water)
        } else if has(GREEN) {
            Some(Self::Green)
        } else {
            None
        }
    }

    /// Default width of a line of this class, m.
    pub(crate) fn width_m(self) -> f64 {
        match self {
            Self::Major => 9.0,
            Self::Minor => 6.0,
            Self::Water => 8.0,
            Self::Rail => 3.0,
            Self::Path => 2.0,
            Self::Green | Self::Other | Self::Building => 1.0,
        }
    }
}

/// GeoJSON properties that define the feature class, as in OpenStreetMap.
pub(crate) const TAGS: [&str; 12] = [
    "highway",
    "building",
    "railway",
    "waterway",
    "natural",
    "water",
    "landuse",
    "leisure",
    "type",
    "kind",
    "fclass",
    "building:part",
];

/// Returns the class from properties: names and values, of [`TAGS`], lanes, width and name.
pub(crate) fn of_tags(tags: &[(String, String)]) -> Kind {
    let of = |(key, value): &(String, String)| match (key.as_str(), value.as_str()) {
        ("name", _) | (_, "no" | "false" | "") => None,
        ("building" | "building:part", _) => Some(Kind::Building),
        ("railway", _) => Some(Kind::Rail),
        ("waterway" | "water", _) => Some(Kind::Water),
        ("highway", value) => Kind::of_type(value).or(Some(Kind::Minor)),
        (_, value) => Kind::of_type(value),
    };
    // If several match, the class that is drawn on top is used.
    tags.iter().filter_map(of).max().unwrap_or(Kind::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn class_of(tags: &[(&str, &str)]) -> Kind {
        let tags: Vec<_> = tags.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        of_tags(&tags)
    }

    #[test]
    fn sumo_types_and_openstreetmap_properties_define_the_class() {
        for (text, kind) in [
            ("highway.primary_link", Some(Kind::Major)),
            ("highway.residential", Some(Kind::Minor)),
            ("highway.track", Some(Kind::Path)),
            ("railway.rail", Some(Kind::Rail)),
            ("building.yes", Some(Kind::Building)),
            ("natural.water", Some(Kind::Water)),
            ("landuse.forest", Some(Kind::Green)),
            ("", None),
            ("t1", None),
        ] {
            assert_eq!(Kind::of_type(text), kind, "{text}");
        }
        assert_eq!(class_of(&[("highway", "tertiary")]), Kind::Minor);
        assert_eq!(class_of(&[("highway", "trunk"), ("landuse", "forest")]), Kind::Major);
        assert_eq!(class_of(&[("building", "no"), ("leisure", "park")]), Kind::Green);
        assert_eq!(class_of(&[("waterway", "ditch")]), Kind::Water);
        assert_eq!(class_of(&[("natural", "peak")]), Kind::Other);
    }
}
