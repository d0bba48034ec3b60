//! Paths of the maps that a scenario names. The programs that show maps read them.

use std::path::{Path, PathBuf};

use super::builtin::BUILT_IN_MAPS;
use super::load::Typed;

/// Maximum number of maps of a scenario: a net, buildings, water, green areas, and some more.
pub const MAPS_MAX: usize = 16;

/// A background map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MapFile {
    /// A built-in map: name and contents.
    BuiltIn(&'static str, &'static [u8]),
    /// A map on disk.
    OnDisk(PathBuf),
}

/// Returns the maps of a scenario with their paths: those of the command line, otherwise those that it names.
pub(super) fn files(typed: &Typed) -> Vec<MapFile> {
    if !typed.overrides.maps.is_empty() {
        return typed.overrides.maps.iter().cloned().map(MapFile::OnDisk).collect();
    }
    let folder = typed.files_from.as_deref().unwrap_or(Path::new(""));
    let file = |name: &String| {
        let path = folder.join(name);
        let built_in = BUILT_IN_MAPS.iter().find(|(built_in, _)| built_in == name).filter(|_| !path.exists());
        built_in.map_or(MapFile::OnDisk(path), |&(name, bytes)| MapFile::BuiltIn(name, bytes))
    };
    typed.file.basemap.iter().map(file).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::{Overrides, Scenario};
    use super::*;
    use crate::common::{load, overrides};

    #[test]
    fn maps_are_relative_to_the_scenario_and_records_contain_only_their_names() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("mine.toml");
        fs::write(&file, "basemap = [\"in/town.net.xml\"]\n[[targets.start]]\nx_m = 1\n").unwrap();
        let scenario = load(file.to_str().unwrap(), &[], 1);
        assert_eq!(scenario.map, [MapFile::OnDisk(home.path().join("in/town.net.xml"))]);
        assert!(scenario.resolved().unwrap().contains("basemap = [\"town.net.xml\"]"));
    }

    #[test]
    fn built_in_traffic_has_a_street_map_and_other_traffic_has_none() {
        for name in ["convoy", "city"] {
            let scenario = load(&format!("traffic/{name}"), &[], 1);
            assert!(matches!(scenario.map[..], [MapFile::BuiltIn(file, _)] if file == format!("{name}.net.xml.gz")));
        }
        let home = tempfile::tempdir().unwrap();
        let traffic = home.path().join("cars.csv");
        fs::write(&traffic, "t,id,x,y\n0,a,0,0\n60,a,1,0\n").unwrap();
        let overrides = Overrides { traffic: vec![traffic], ..Overrides::default() };
        assert_eq!(Scenario::load("traffic/city", &overrides, 1).unwrap().map, []);
    }

    #[test]
    fn too_many_maps_and_empty_names_are_refused() {
        for (set, expected) in [("basemap=[\"\"]", "must be names of files"), ("basemap=\"a.net.xml\"", "basemap")] {
            let error = Scenario::load("traffic/city", &overrides(&[set]), 1).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        let many = format!("basemap=[{}]", "\"a\",".repeat(MAPS_MAX + 1));
        assert!(Scenario::load("traffic/city", &overrides(&[&many]), 1).is_err());
    }
}
