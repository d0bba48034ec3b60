//! Buildings of a scenario, typed or read from a file.

mod file;
mod outline;

use std::path::Path;

use outline::Outline;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::Origin;
use standoff_io::text_source::{self, Expectation, Fault};
use standoff_score::{BUILDINGS_MAX, Buildings};

use super::builtin::BUILT_IN_BUILDINGS;
use super::diagnostics::Problems;
use super::error::{Problem, ScenarioError};
use super::load::Typed;
use super::locate::{Map, SourcePosition};
use super::schema_types::World;
use super::traffic::NAME_MAX;

/// Key of the buildings in a scenario.
const OUTLINES: &str = "world.building_outlines_cm";

/// Expected contents of a file, for messages.
static BUILDINGS: Expectation = Expectation {
    description: "buildings",
    formats: "GeoJSON or SUMO polygons (.poly.xml), plain or gzip",
    is_map: true,
};

/// Replaces the name of the file by its buildings. The scenario, and so its record, then contains the buildings.
pub(super) fn spell_out(typed: &mut Typed, origin: Option<Origin>) -> Result<(), ScenarioError> {
    let Some(world) = typed.file.world.as_ref().filter(|world| !world.buildings.is_empty()) else { return Ok(()) };
    let (name, mut outlines) = (world.buildings.clone(), world.building_outlines_cm.clone());
    let key = "world.buildings";
    if name.len() > NAME_MAX {
        let message = format!("{key} = {}: must be at most {NAME_MAX} bytes", quoted(&name));
        return Err(typed.origin.problem(&Map::new(&typed.origin.text), key, message, None).into());
    }
    let path = typed.files_from.as_deref().unwrap_or(Path::new("")).join(&name);
    let built_in = BUILT_IN_BUILDINGS.iter().find(|(built_in, _)| *built_in == name).filter(|_| !path.exists());
    let text = match built_in {
        Some((_, bytes)) => text_source::text(*bytes, &BUILDINGS),
        None => text_source::open(&path, &BUILDINGS),
    };
    let described = |fault: Fault| {
        let place = fault.position.map(|at| SourcePosition { line: at.line as usize, column: at.column as usize });
        let problem = Problem {
            file: path.display().to_string(),
            place,
            excerpt: None,
            message: fault.message.clone(),
            help: Some(format!("{key} = {} names this file", quoted(&name))),
        };
        ScenarioError { is_io_error: fault.is_io_error, ..problem.into() }
    };
    let contents = text.and_then(|text| file::read(text, origin)).map_err(described)?;
    typed.notes.extend(contents.notes.iter().map(|note| format!("{key} = {}: {note}", quoted(&name))));
    outlines.extend(contents.buildings.iter().map(Outline::to_string));
    typed.set(key, String::new().into())?;
    typed.set(OUTLINES, outlines.into())
}

/// Returns the buildings; none if they have problems.
pub(super) fn buildings(world: Option<&World>, problems: &mut Problems) -> Buildings {
    let Some(world) = world else { return Buildings::default() };
    if world.building_outlines_cm.len() > BUILDINGS_MAX {
        problems.add(OUTLINES, format!("must be at most {BUILDINGS_MAX}"), None);
        return Buildings::default();
    }
    let (mut all, before) = (Vec::new(), problems.found.len());
    for (index, text) in world.building_outlines_cm.iter().enumerate() {
        match text.parse::<Outline>() {
            Ok(outline) => all.push(outline.building(world.building_height_m)),
            Err(message) => problems.add(format!("{OUTLINES}.{index}"), message, None),
        }
    }
    if problems.found.len() > before {
        return Buildings::default();
    }
    Buildings::new(all).unwrap_or_else(|message| {
        problems.add(OUTLINES, message, None);
        Buildings::default()
    })
}

#[cfg(test)]
mod fuzz;

#[cfg(test)]
mod tests;
