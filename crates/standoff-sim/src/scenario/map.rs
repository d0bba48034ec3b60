//! The maps that a scenario names: where they are found. They are read by who shows them.

use std::path::{Path, PathBuf};

use super::builtin::BUILT_IN_MAPS;
use super::load::Typed;

/// Most maps of a scenario: a net, buildings, water, what is green, and some more.
pub const MAPS_MAX: usize = 16;

/// A file of what lies under the vehicles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MapFile {
    /// One that comes with the program: its name, and what is in it.
    BuiltIn(&'static str, &'static [u8]),
    /// One on disk.
    OnDisk(PathBuf),
}

/// The maps that a scenario names, where they are looked for.
pub(super) fn files(typed: &Typed) -> Vec<MapFile> {
    let folder = typed.files_from.as_deref().unwrap_or(Path::new(""));
    let file = |name: &String| {
        let path = folder.join(name);
        let built_in = BUILT_IN_MAPS.iter().find(|(built_in, _)| built_in == name).filter(|_| !path.exists());
        built_in.map_or(MapFile::OnDisk(path), |&(name, bytes)| MapFile::BuiltIn(name, bytes))
    };
    typed.file.map.iter().map(file).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::{Edits, Scenario};
    use super::*;

    #[test]
    fn a_scenario_finds_its_maps_beside_it_and_a_record_has_their_names_alone() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("mine.toml");
        fs::write(&file, "map = [\"in/town.net.xml\"]\n[[targets.at]]\nx_m = 1\n").unwrap();
        let scenario = Scenario::load(file.to_str().unwrap(), &Edits::default(), 1).unwrap();
        assert_eq!(scenario.map, [MapFile::OnDisk(home.path().join("in/town.net.xml"))]);
        assert!(scenario.resolved().unwrap().contains("map = [\"town.net.xml\"]"));
    }

    #[test]
    fn built_in_traffic_has_its_streets_and_other_traffic_does_not() {
        for name in ["convoy", "city"] {
            let scenario = Scenario::load(&format!("traffic/{name}"), &Edits::default(), 1).unwrap();
            assert!(matches!(scenario.map[..], [MapFile::BuiltIn(file, _)] if file == format!("{name}.net.xml.gz")));
        }
        let home = tempfile::tempdir().unwrap();
        let traffic = home.path().join("cars.csv");
        fs::write(&traffic, "t,id,x,y\n0,a,0,0\n60,a,1,0\n").unwrap();
        let edits = Edits { traffic: Some(traffic), ..Edits::default() };
        assert_eq!(Scenario::load("traffic/city", &edits, 1).unwrap().map, []);
    }

    #[test]
    fn too_many_maps_and_empty_names_are_refused() {
        for (set, expected) in [("map=[\"\"]", "must be names of files"), ("map=\"a.net.xml\"", "map")] {
            let edits = Edits { set: vec![set.to_owned()], ..Edits::default() };
            let error = Scenario::load("traffic/city", &edits, 1).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        let many = format!("map=[{}]", "\"a\",".repeat(MAPS_MAX + 1));
        let edits = Edits { set: vec![many], ..Edits::default() };
        assert!(Scenario::load("traffic/city", &edits, 1).is_err());
    }
}
