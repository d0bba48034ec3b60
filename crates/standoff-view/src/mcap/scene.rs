//! 3D scene of a time step: zones, UAVs, targets, tracks and orbits. Colours identify groups and highlight problems.

use std::collections::BTreeSet;

use foxglove::messages::{
    Color, KeyValuePair, SceneEntity, SceneEntityDeletion, SceneUpdate, scene_entity_deletion::Type,
};
use plotters::style::RGBColor;
use standoff::research::math::atan2;
use standoff::{Zone, ZoneKind};
use standoff_record::{Frame, GroupRow, MembershipState, TrackRow, TrackStatus, TruthRow, UavRow, target_name};
use standoff_sim::scenario::Scenario;

use super::pose::{WORLD, pose, position, timestamp, vector};
use super::shapes::{arrow, circle, colour, cube, ellipse, outline, sphere, text, view};
use crate::colours::{GROUPS, GroupColours};

// These colours differ from those of the groups and are distinguishable with red-green colour blindness.
const UNSEEN: RGBColor = RGBColor(213, 94, 0);
const DWELL: RGBColor = RGBColor(240, 228, 66);
const REMOVED: RGBColor = RGBColor(170, 51, 119);
const UNASSIGNED: RGBColor = RGBColor(0, 114, 178);
/// Colour of true targets, and of UAVs without a group.
const PLAIN: RGBColor = RGBColor(150, 150, 150);

/// Scene that is updated at each time step.
pub(super) struct Scene {
    field_of_view_rad: f64,
    sensing_range_m: f64,
    colours: GroupColours,
    /// Zones, repeated at every time step because a viewer may start at any of them.
    zones: Vec<SceneEntity>,
    /// Ids of the entities at the last time step.
    shown: BTreeSet<String>,
}

impl Scene {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let sensor = &scenario.settings.team.track.sensor;
        Self {
            field_of_view_rad: sensor.field_of_view_rad,
            sensing_range_m: sensor.sensing_range_m,
            colours: GroupColours::default(),
            zones: scenario.settings.geofence.zones().enumerate().map(|(number, of)| zone(number, of)).collect(),
            shown: BTreeSet::new(),
        }
    }

    /// Makes the update for a time step: all current entities, and deletions of those that no longer exist.
    pub(super) fn update(&mut self, frame: &Frame, target_names: &[String]) -> SceneUpdate {
        self.colours.next_step(&frame.groups);
        let mut entities = self.zones.clone();
        entities.extend(frame.truth.iter().map(|row| truth(row, target_names)));
        entities.extend(frame.tracks.iter().map(|row| self.track(row, target_names)));
        entities.extend(frame.groups.iter().map(|row| self.orbit(row)));
        entities.extend(frame.uavs.iter().map(|row| self.uav(row)));
        let now = timestamp(frame.time_us);
        for entity in &mut entities {
            entity.timestamp = Some(now);
            WORLD.clone_into(&mut entity.frame_id);
        }
        let shown = entities.iter().map(|entity| entity.id.clone()).collect();
        let before = std::mem::replace(&mut self.shown, shown);
        let delete =
            |id: &String| SceneEntityDeletion { timestamp: Some(now), r#type: Type::MatchingId.into(), id: id.clone() };
        SceneUpdate { deletions: before.difference(&self.shown).map(delete).collect(), entities }
    }

    fn colour(&self, group: Option<u32>) -> Color {
        colour(group.and_then(|id| self.colours.place(id)).map_or(PLAIN, |place| GROUPS[place]))
    }

    /// A UAV and its field of view, in the colour of its assigned group.
    fn uav(&self, row: &UavRow) -> SceneEntity {
        let (at, colour) = (position(row), self.colour(row.group));
        let view = |boresight| view(at, boresight, self.field_of_view_rad, self.sensing_range_m, colour);
        SceneEntity {
            id: format!("uav/{}", row.uav),
            arrows: vec![arrow(pose(at, row.heading_rad), colour)],
            lines: row.boresight_rad.map(view).into_iter().collect(),
            texts: vec![text(at, format!("UAV {}", row.uav), colour)],
            ..SceneEntity::default()
        }
    }

    /// Desired orbit of a group.
    fn orbit(&self, row: &GroupRow) -> SceneEntity {
        let (centre, colour) = (vector(row.x_m, row.y_m, row.altitude_m), self.colour(Some(row.group)));
        let note = if row.feasible { "" } else { ", infeasible" };
        let label = format!("group {}: {:.0} m{note}", row.group, row.standoff_distance_m);
        SceneEntity {
            id: format!("group/{}", row.group),
            lines: vec![circle(centre, row.standoff_distance_m, colour)],
            texts: vec![text(centre, label, colour)],
            ..SceneEntity::default()
        }
    }

    /// A track. The colour of its marker shows its membership, the colour of its ellipse its track status.
    fn track(&self, row: &TrackRow, target_names: &[String]) -> SceneEntity {
        let [x, _, _, y, ..] = row.state;
        let (place, marker) = match row.membership {
            MembershipState::Member => ("member", self.colour(row.group)),
            MembershipState::InHandoff => ("in-handoff", colour(DWELL)),
            MembershipState::Removed => ("removed", colour(REMOVED)),
            MembershipState::Ungrouped => ("ungrouped", colour(UNASSIGNED)),
        };
        let (status, line) = match row.status {
            TrackStatus::Updated => ("updated", marker),
            TrackStatus::Coasting => ("coasting", colour(UNSEEN)),
            TrackStatus::Cued => ("cued", colour(UNSEEN)),
        };
        let name = target_name(row.target, target_names);
        let unusual = [place, status].into_iter().filter(|word| !["member", "updated"].contains(word));
        let label = std::iter::once(name.as_str()).chain(unusual).collect::<Vec<_>>().join(", ");
        let group = |key, group: Option<u32>| group.map(|id| pair(key, &id.to_string()));
        let metadata = [
            Some(pair("name", &name)),
            Some(pair("membership", place)),
            Some(pair("status", status)),
            group("group", row.group),
            group("receiving_group", row.receiving_group),
        ];
        SceneEntity {
            id: format!("track/{}", row.target),
            metadata: metadata.into_iter().flatten().collect(),
            spheres: vec![sphere(vector(x, y, 0.0), marker)],
            lines: vec![ellipse([x, y], position_covariance(row), line)],
            texts: vec![text(vector(x, y, 20.0), label, line)],
            ..SceneEntity::default()
        }
    }
}

/// Outline of a zone, with kind and name: on the ground, or at its floor and at its ceiling.
fn zone(number: usize, zone: &Zone) -> SceneEntity {
    let colour = colour(if zone.kind == ZoneKind::KeepOut { UNSEEN } else { PLAIN });
    let limits = [("altitude_min_m", zone.altitude_min_m), ("altitude_max_m", zone.altitude_max_m)];
    let corners =
        |altitude_m| -> Vec<_> { zone.vertices.iter().map(|at| vector(at.x_m(), at.y_m(), altitude_m)).collect() };
    // A zone without a ceiling has no upper outline.
    let levels_m = [Some(zone.altitude_min_m.unwrap_or(0.0)), zone.altitude_max_m];
    let outlines: Vec<_> = levels_m.into_iter().flatten().map(corners).collect();
    let label = [zone.kind.name(), &zone.name].join(" ");
    let metadata = [("kind", zone.kind.name()), ("name", &zone.name)].map(|(key, value)| pair(key, value));
    let limits = limits.iter().filter_map(|(key, altitude_m)| Some(pair(key, &(*altitude_m)?.to_string())));
    SceneEntity {
        id: format!("zone/{number}"),
        metadata: metadata.into_iter().chain(limits).collect(),
        texts: outlines
            .iter()
            .flatten()
            .next()
            .map(|at| text(*at, label.trim_end().to_owned(), colour))
            .into_iter()
            .collect(),
        lines: outlines.iter().map(|corners| outline(corners, colour)).collect(),
        ..SceneEntity::default()
    }
}

/// Position covariance of a track: variance east, covariance, variance north, m2.
fn position_covariance(row: &TrackRow) -> [f64; 3] {
    // Indices in the upper triangle for [x, vx, ax, y, vy, ay]: x-x, x-y and y-y.
    [0, 3, 15].map(|place| row.covariance[place])
}

/// True pose of a target.
fn truth(row: &TruthRow, target_names: &[String]) -> SceneEntity {
    let heading_rad = atan2(row.vy_m_s, row.vx_m_s);
    SceneEntity {
        id: format!("truth/{}", row.target),
        metadata: vec![pair("name", &target_name(row.target, target_names))],
        cubes: vec![cube(pose(vector(row.x_m, row.y_m, 0.0), heading_rad), colour(PLAIN))],
        ..SceneEntity::default()
    }
}

fn pair(key: &str, value: &str) -> KeyValuePair {
    KeyValuePair { key: key.to_owned(), value: value.to_owned() }
}
