//! Fence of the vehicle, read from its parameters and by the mission protocol, as zones of the geofence.
//!
//! The autopilot requires that the aircraft is inside every inclusion zone and outside every exclusion zone, as the zones
//! of the library do. If `FENCE_OPTIONS` allows the union of inclusion zones, the intersection is on the safe side.

use mavlink::dialects::ardupilotmega::{MISSION_COUNT_DATA, MISSION_ITEM_INT_DATA, MavCmd, MavMessage, MavMissionType};
use standoff::safety::geofence::ZONES_MAX;
use standoff::{Duration, Position, Time, Zone, ZoneKind};
use standoff_io::geodesy::LocalPlane;

use crate::command;
use crate::parameters::Parameters;
use crate::period::is_due;

/// Maximum number of items of a fence: the zones of the library have at most 1,000 vertices.
const ITEMS_MAX: u16 = 1_100;

/// Number of vertices of the polygon that takes the place of a circle. Its sides are up to 0.9 % of the radius from it.
const CIRCLE_VERTICES: u32 = 24;

/// Range of the radius of a circle, m.
const RADIUS_M: core::ops::RangeInclusive<f64> = 1.0..=1e6;

/// Time to wait for an item before it is requested again.
const ITEM_TIMEOUT: Duration = Duration::from_us(1_000_000);

/// Time to wait for a list before it is requested again.
const LIST_TIMEOUT: Duration = Duration::from_us(5_000_000);

/// Maximum number of items that are requested and have not arrived, so that a slow radio is not flooded.
const REQUESTS_MAX: usize = 5;

/// Time after which the fence is read again, because it can be changed in flight.
const PERIOD: Duration = Duration::from_us(60_000_000);

/// Distance by which home must move before a circle around it moves, m.
const HOME_CHANGE_MIN_M: f64 = 1.0;

/// An item of a fence.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Item {
    command: MavCmd,
    /// Number of vertices of the polygon, or radius of the circle, m.
    param1: f64,
    /// Latitude and longitude, degrees.
    point_deg: [f64; 2],
}

/// A transfer in progress.
#[derive(Debug, Clone, PartialEq)]
struct Transfer {
    items: Vec<Option<Item>>,
    /// Last time at which each item was requested.
    requested_at: Vec<Option<Time>>,
}

/// Fence as far as it was read.
#[derive(Debug, Clone, Default)]
pub struct Fence {
    /// Items of the last complete transfer.
    items: Option<Vec<Item>>,
    /// Number of items that the autopilot reported, if there are too many.
    too_many: Option<u16>,
    transfer: Option<Transfer>,
    /// Time of the last request of a list.
    requested_at: Option<Time>,
    home: Option<Position>,
    /// Number of changes of items and home.
    changes: u64,
}

impl Fence {
    /// Number of changes so far, from which a user of the zones sees that they may have changed.
    pub(crate) fn changes(&self) -> u64 {
        self.changes
    }

    /// Stores the position of home.
    pub(crate) fn hear_home(&mut self, home: Position) {
        if self.home.is_none_or(|known| known.distance_m(home) >= HOME_CHANGE_MIN_M) {
            self.home = Some(home);
            self.changes += 1;
        }
    }

    /// Starts a transfer, if a list was requested.
    pub(crate) fn hear_count(&mut self, count: &MISSION_COUNT_DATA) {
        if count.mission_type != MavMissionType::MAV_MISSION_TYPE_FENCE || self.requested_at.is_none() {
            return;
        }
        // A repeated answer does not begin again.
        if self.transfer.as_ref().is_some_and(|transfer| transfer.items.len() == usize::from(count.count)) {
            return;
        }
        self.too_many = (count.count > ITEMS_MAX).then_some(count.count);
        if self.too_many.is_some() {
            (self.transfer, self.items) = (None, None);
            self.changes += 1;
            return;
        }
        let length = usize::from(count.count);
        self.transfer = Some(Transfer { items: vec![None; length], requested_at: vec![None; length] });
    }

    /// Stores an item that was requested.
    pub(crate) fn hear_item(&mut self, item: &MISSION_ITEM_INT_DATA) {
        let is_fence = item.mission_type == MavMissionType::MAV_MISSION_TYPE_FENCE;
        let Some(transfer) = self.transfer.as_mut().filter(|_| is_fence) else { return };
        if let Some(slot) = transfer.items.get_mut(usize::from(item.seq)) {
            let point_deg = [item.x, item.y].map(|e7| f64::from(e7) * 1e-7);
            *slot = Some(Item { command: item.command, param1: item.param1.into(), point_deg });
        }
    }

    /// Appends the requests that are due. `has_items`: the parameters state that items count.
    pub(crate) fn append_requests(&mut self, now: Time, system_id: u8, has_items: bool, to: &mut Vec<MavMessage>) {
        if !has_items {
            (self.transfer, self.requested_at) = (None, None);
            return;
        }
        if let Some(transfer) = &mut self.transfer {
            let Transfer { items, requested_at } = transfer;
            if let Some(items) = items.iter().copied().collect::<Option<Vec<_>>>() {
                if self.items.as_ref() != Some(&items) {
                    self.items = Some(items);
                    self.changes += 1;
                }
                self.transfer = None;
                to.push(command::fence_received(system_id));
                return;
            }
            let missing: Vec<usize> =
                (0..items.len()).filter(|index| items[*index].is_none()).take(REQUESTS_MAX).collect();
            for index in missing {
                if is_due(requested_at[index], now, ITEM_TIMEOUT) {
                    requested_at[index] = Some(now);
                    to.push(command::request_fence_item(system_id, index as u16));
                }
            }
        }
        let is_silent = self.items.is_none() && self.transfer.is_none();
        if is_due(self.requested_at, now, if is_silent { LIST_TIMEOUT } else { PERIOD }) {
            self.requested_at = Some(now);
            // A transfer that did not end begins again.
            self.transfer = None;
            to.push(command::request_fence(system_id));
        }
    }

    /// Zones of the fence. The error states what is missing or wrong.
    pub(crate) fn zones(&self, parameters: &Parameters, plane: &LocalPlane) -> Result<Vec<Zone>, String> {
        let mut zones = Vec::new();
        if !parameters.has_fence_type() {
            return Err("FENCE_TYPE: not received from the autopilot".to_owned());
        }
        if parameters.has_fence_circle() {
            let radius_m = parameters.fence_radius_m().ok_or("FENCE_RADIUS: not received from the autopilot")?;
            let home = self.home.ok_or("home position: not received from the autopilot")?;
            zones.push(circle("fence around home".to_owned(), ZoneKind::KeepIn, home, radius_m)?);
        }
        if parameters.has_fence_items() {
            if let Some(count) = self.too_many {
                return Err(format!("the fence has {count} items: at most {ITEMS_MAX} are supported; simplify it"));
            }
            let items = self.items.as_ref().ok_or_else(|| match &self.transfer {
                None => "items of the fence: not received from the autopilot".to_owned(),
                Some(Transfer { items, .. }) => {
                    format!("items of the fence: {} of {} received", items.iter().flatten().count(), items.len())
                }
            })?;
            zones.extend(zones_of(items, plane)?);
        }
        if zones.len() > ZONES_MAX {
            return Err(format!("the fence has {} zones: at most {ZONES_MAX} are supported; simplify it", zones.len()));
        }
        Ok(zones)
    }
}

/// Zones of the items of a fence.
fn zones_of(mut items: &[Item], plane: &LocalPlane) -> Result<Vec<Zone>, String> {
    let (mut zones, all) = (Vec::new(), items.len());
    let position = |item: &Item, number: usize| {
        let [latitude_deg, longitude_deg] = item.point_deg;
        let error = |error| format!("item {number} of the fence: {error}");
        plane.position(latitude_deg, longitude_deg).map_err(error)
    };
    while let Some(item) = items.first() {
        let number = all - items.len();
        let name = format!("fence item {number}");
        let kind = match item.command {
            MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION | MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION => {
                ZoneKind::KeepIn
            }
            _ => ZoneKind::KeepOut,
        };
        match item.command {
            MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT => items = &items[1..],
            MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION | MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION => {
                zones.push(circle(name, kind, position(item, number)?, item.param1)?);
                items = &items[1..];
            }
            MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION | MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION => {
                let is_count = item.param1 >= 3.0 && item.param1 <= f64::from(ITEMS_MAX) && item.param1.fract() == 0.0;
                let count = if is_count { item.param1 as usize } else { 0 };
                let of_polygon = items.get(..count).filter(|vertices| {
                    let is_same = |vertex: &Item| vertex.command == item.command && vertex.param1 == item.param1;
                    is_count && vertices.iter().all(is_same)
                });
                let vertices = of_polygon.ok_or_else(|| {
                    format!("item {number} of the fence: the polygon has no {} consecutive vertices", item.param1)
                })?;
                let vertices = (number..).zip(vertices).map(|(number, vertex)| position(vertex, number));
                zones.push(Zone { name, kind, vertices: vertices.collect::<Result<_, _>>()?, ..Zone::default() });
                items = &items[count..];
            }
            other => return Err(format!("item {number} of the fence: {other:?} is not supported")),
        }
    }
    Ok(zones)
}

/// Polygon inside a circle, if UAVs must stay inside it, otherwise around it.
fn circle(name: String, kind: ZoneKind, centre: Position, radius_m: f64) -> Result<Zone, String> {
    if !RADIUS_M.contains(&radius_m) {
        let (min, max) = (RADIUS_M.start(), RADIUS_M.end());
        return Err(format!("{name}: radius {radius_m} m: must be between {min} and {max}"));
    }
    Ok(Zone { name, kind, vertices: kind.circle(centre, radius_m, CIRCLE_VERTICES), ..Zone::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::Geofence;

    fn plane() -> LocalPlane {
        LocalPlane::about(47.4, 8.5).unwrap()
    }

    fn item(command: MavCmd, param1: f64, x_m: f64, y_m: f64) -> Item {
        let point_deg = plane().degrees_at(Position::from_m(x_m, y_m)).unwrap();
        Item { command, param1, point_deg }
    }

    const INCLUSION: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
    const EXCLUSION: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION;
    const CIRCLE_IN: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION;
    const CIRCLE_OUT: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION;

    fn square(command: MavCmd, half_m: f64) -> Vec<Item> {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        corners.map(|(x, y)| item(command, 4.0, half_m * x, half_m * y)).into()
    }

    #[test]
    fn polygons_and_circles_of_both_kinds_become_zones() {
        let items = [
            vec![item(MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT, 0.0, 0.0, 0.0)],
            square(INCLUSION, 2000.0),
            square(EXCLUSION, 100.0),
            vec![item(CIRCLE_IN, 1500.0, 0.0, 0.0), item(CIRCLE_OUT, 50.0, 700.0, 0.0)],
        ];
        let zones = zones_of(&items.concat(), &plane()).unwrap();
        let kinds: Vec<_> = zones.iter().map(|zone| (zone.kind, zone.vertices.len())).collect();
        let (keep_in, keep_out) = (ZoneKind::KeepIn, ZoneKind::KeepOut);
        assert_eq!(kinds, [(keep_in, 4), (keep_out, 4), (keep_in, 24), (keep_out, 24)]);
        let fence = Geofence::new(zones).unwrap();
        for (x_m, y_m, is_allowed) in [
            (500.0, 500.0, true),
            (0.0, 0.0, false),
            (720.0, 0.0, false),
            (1600.0, 0.0, false),
            (1900.0, 1900.0, false),
        ] {
            assert_eq!(fence.contains(Position::from_m(x_m, y_m)), is_allowed, "{x_m} {y_m}");
        }
    }

    #[test]
    fn the_polygon_of_a_circle_lies_inside_an_inclusion_and_around_an_exclusion() {
        let distances_m = |kind| {
            let vertices = circle(String::new(), kind, Position::ORIGIN, 300.0).unwrap().vertices;
            let next = vertices.iter().cycle().skip(1);
            let middle = |(a, b): (&Position, &Position)| {
                Position::from_m(0.5 * (a.x_m() + b.x_m()), 0.5 * (a.y_m() + b.y_m())).distance_m(Position::ORIGIN)
            };
            let sides_m: Vec<f64> = vertices.iter().zip(next).map(middle).collect();
            (sides_m[0], vertices[0].distance_m(Position::ORIGIN))
        };
        let (inside_m, outside_m) = (distances_m(ZoneKind::KeepIn), distances_m(ZoneKind::KeepOut));
        assert!(inside_m.1 <= 300.0 + 1e-9 && inside_m.0 >= 297.0, "{inside_m:?}");
        assert!(outside_m.0 >= 300.0 - 1e-9 && outside_m.1 <= 303.0, "{outside_m:?}");
    }

    #[test]
    fn wrong_items_are_errors_that_name_the_item() {
        let mut mixed = square(INCLUSION, 500.0);
        mixed[2].command = EXCLUSION;
        let far = Item { point_deg: [91.0, 0.0], ..item(CIRCLE_IN, 100.0, 0.0, 0.0) };
        for (items, what) in [
            (square(INCLUSION, 500.0)[..3].to_vec(), "item 0 of the fence: the polygon has no 4 consecutive vertices"),
            (mixed, "item 0 of the fence: the polygon has no 4"),
            (vec![item(INCLUSION, f64::NAN, 0.0, 0.0)], "item 0 of the fence: the polygon has no NaN"),
            (vec![item(INCLUSION, 1e30, 0.0, 0.0)], "item 0 of the fence: the polygon has no 1"),
            (vec![item(CIRCLE_OUT, f64::INFINITY, 0.0, 0.0)], "fence item 0: radius inf m: must be between 1 and"),
            (vec![item(CIRCLE_OUT, 0.0, 0.0, 0.0)], "fence item 0: radius 0 m"),
            (vec![item(MavCmd::MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, 0.0)], "item 0 of the fence: MAV_CMD_NAV_WAYPOINT"),
            (vec![far], "item 0 of the fence: "),
        ] {
            let error = zones_of(&items, &plane()).unwrap_err();
            assert!(error.starts_with(what), "{error}");
        }
    }

    #[test]
    fn lost_items_are_requested_again_and_the_fence_is_read_again_after_a_minute() {
        let (mut fence, mut now) = (Fence::default(), Time::from_us(0));
        let is_fence = MavMissionType::MAV_MISSION_TYPE_FENCE;
        let count = MISSION_COUNT_DATA { count: 12, mission_type: is_fence, ..MISSION_COUNT_DATA::default() };
        // An answer without a request counts for nothing.
        fence.hear_count(&count);
        assert!(fence.transfer.is_none());
        let (mut lists, mut requests) = (0, 0);
        for step in 0..700 {
            let mut sent = Vec::new();
            fence.append_requests(now, 1, true, &mut sent);
            for message in sent {
                match message {
                    MavMessage::MISSION_REQUEST_LIST(_) => {
                        lists += 1;
                        fence.hear_count(&count);
                    }
                    MavMessage::MISSION_REQUEST_INT(request) => {
                        requests += 1;
                        // Every second answer is lost.
                        if requests % 2 == 0 {
                            fence.hear_item(&MISSION_ITEM_INT_DATA {
                                seq: request.seq,
                                param1: 100.0,
                                command: CIRCLE_OUT,
                                mission_type: is_fence,
                                ..MISSION_ITEM_INT_DATA::default()
                            });
                        }
                    }
                    _ => {}
                }
            }
            now = now + Duration::from_us(100_000);
            if step == 590 {
                assert_eq!((lists, fence.items.as_ref().map(Vec::len), fence.changes), (1, Some(12), 1));
            }
        }
        // The second transfer has the same items.
        assert_eq!((lists, fence.changes), (2, 1));
    }
}
