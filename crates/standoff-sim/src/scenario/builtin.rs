//! The scenarios that come with the program, by name.

/// A scenario that comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// Its name: folder and file of `scenarios/`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltIn { name: $name, text: include_str!(concat!("../../../../scenarios/", $name, ".toml")) }),*]
    };
}

/// Every built-in scenario, in the order in which a newcomer may read them.
pub const BUILT_IN: &[BuiltIn] = built_in![
    "tour/01-one-uav",
    "tour/02-two-uavs",
    "tour/03-a-group-that-spreads",
    "tour/04-two-groups",
    "tour/05-a-handoff",
    "tour/06-a-uav-drops-out",
    "traffic/convoy",
    "traffic/city",
    "paper/table-2-single",
    "paper/table-2-pair-basic",
    "paper/table-2-pair",
    "paper/figure-8",
    "paper/figure-9",
    "paper/figure-9-basic",
    "best/table-2-pair",
    "best/figure-9",
];

/// Traffic files that built-in scenarios name.
pub(super) const BUILT_IN_TRAFFIC: &[(&str, &[u8])] = &[
    ("convoy.fcd.xml.gz", include_bytes!("../../../../scenarios/traffic/convoy.fcd.xml.gz")),
    ("city.fcd.xml.gz", include_bytes!("../../../../scenarios/traffic/city.fcd.xml.gz")),
];

/// The built-in scenario of that name.
pub fn built_in(name: &str) -> Option<&'static BuiltIn> {
    BUILT_IN.iter().find(|scenario| scenario.name == name)
}
