//! Built-in scenarios, by name.

use standoff_io::display_text::nearest;

/// A scenario that is part of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// Name: folder and file in `scenarios/`.
    pub name: &'static str,
    /// Text of the file.
    pub text: &'static str,
}

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltIn { name: $name, text: include_str!(concat!("../../../../scenarios/", $name, ".toml")) }),*]
    };
}

/// All built-in scenarios, in the order recommended for reading.
pub const BUILT_IN: &[BuiltIn] = built_in![
    "tour/01-one-uav",
    "tour/02-two-uavs",
    "tour/03-a-group-that-spreads",
    "tour/04-two-groups",
    "tour/05-a-handoff",
    "tour/06-a-uav-drops-out",
    "tour/07-lossy-radio",
    "tour/08-network-partition",
    "tour/09-separation",
    "tour/10-unlabelled-detections",
    "tour/11-behind-buildings",
    "tour/12-wind",
    "tour/13-banking-aircraft",
    "traffic/convoy",
    "traffic/city",
    "traffic/town",
    "paper/table-2-single",
    "paper/table-2-pair-basic",
    "paper/table-2-pair",
    "paper/figure-8",
    "paper/figure-9",
    "paper/figure-9-basic",
    "improved/table-2-pair",
    "improved/figure-9",
];

/// Traffic files of the built-in scenarios.
pub(super) const BUILT_IN_TRAFFIC: &[(&str, &[u8])] = &[
    ("convoy.fcd.xml.gz", include_bytes!("../../../../scenarios/traffic/convoy.fcd.xml.gz")),
    ("city.fcd.xml.gz", include_bytes!("../../../../scenarios/traffic/city.fcd.xml.gz")),
];

/// Maps of the built-in scenarios.
pub(super) const BUILT_IN_MAPS: &[(&str, &[u8])] = &[
    ("convoy.net.xml.gz", include_bytes!("../../../../scenarios/traffic/convoy.net.xml.gz")),
    ("city.net.xml.gz", include_bytes!("../../../../scenarios/traffic/city.net.xml.gz")),
];

/// Buildings of the built-in scenarios.
pub(super) const BUILT_IN_BUILDINGS: &[(&str, &[u8])] =
    &[("town.poly.xml.gz", include_bytes!("../../../../scenarios/traffic/town.poly.xml.gz"))];

/// Returns the built-in scenario of that name.
pub fn built_in(name: &str) -> Option<&'static BuiltIn> {
    BUILT_IN.iter().find(|scenario| scenario.name == name)
}

/// Suggests built-in scenarios for an unknown name: those with that name in another folder, or those with the closest
/// name.
pub fn built_in_like(typed: &str) -> Option<String> {
    let typed = typed.strip_suffix(".toml").unwrap_or(typed);
    let names = || BUILT_IN.iter().map(|scenario| scenario.name);
    let last = |name: &'static str| name.rsplit_once('/').map_or(name, |(_, last)| last);
    let called = |file: &str| names().filter(|name| last(name) == file).collect::<Vec<_>>();
    let mut alike = called(typed);
    if alike.is_empty() {
        alike.extend(nearest(typed, &names().collect::<Vec<_>>()));
    }
    if alike.is_empty() {
        alike = called(nearest(typed, &names().map(last).collect::<Vec<_>>())?);
    }
    let alike: Vec<String> = alike.into_iter().map(|name| format!("`{name}`")).collect();
    Some(format!("did you mean {}?", alike.join(" or ")))
}
