//! The record's tables: which fields of which row are its columns, each named once for both ways.

use parquet::data_type::ByteArray;
use standoff::Presence;
use standoff_parquet::MAX_CELL;

use super::column::{self, Cells, Column, Fault, Field, Scalar, What};
use super::table::Row;
use crate::frame::{
    AgentEventRow, AgentRow, DetectionRow, EventRow, GroupRow, IntruderRow, OfAgent, Place, TeamRow, TrackRow,
    TrackStatus, TruthRow, UavRow, ViewRow,
};
use crate::text::quoted;

/// The names of the tables that frames are read from; the files are `<name>.parquet`.
pub(super) const TIMED: [&str; 6] =
    [UavRow::TABLE, TruthRow::TABLE, TrackRow::TABLE, GroupRow::TABLE, DetectionRow::TABLE, EventRow::TABLE];

/// The names of the tables of what each of several minds believes: all of them are there, or none is.
pub(super) const OF_AGENTS: [&str; 5] =
    [AgentRow::TABLE, OfAgent::<TrackRow>::TABLE, OfAgent::<GroupRow>::TABLE, AgentEventRow::TABLE, TeamRow::TABLE];

/// There is a table of that name.
pub(super) fn is_table(name: &str) -> bool {
    let others = [TargetRow::TABLE, ViewRow::TABLE, IntruderRow::TABLE];
    TIMED.contains(&name) || OF_AGENTS.contains(&name) || others.contains(&name)
}

/// A target's name: the table of targets is written once, when the run begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TargetRow {
    pub(super) target: u32,
    pub(super) name: String,
}

/// A row and its instant: two time columns go before the row's own.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct At<R> {
    pub(super) time_us: i64,
    pub(super) row: R,
}

/// Most UAVs of a run: as many as a scenario may have.
pub(super) const MOST_UAVS: usize = 100;

/// Most intruders of a run: as many as a scenario may have.
pub(super) const MOST_INTRUDERS: usize = 100;

/// Most rows of a table at one instant. Work on an instant takes UAVs by groups, or by one another; a scenario has up to
/// 100 of both. Events: four for each of the 5,000 targets that a scenario or traffic may have at one time. Detections
/// and views: of 100 UAVs that see 10,000 targets; so much 100 minds may believe, too.
pub(super) fn most_at_once(table: &str) -> usize {
    match table {
        "uavs" | "groups" | "agents" => MOST_UAVS,
        "intruders" => MOST_INTRUDERS,
        "agent_groups" | "agent_team" => MOST_UAVS * MOST_UAVS,
        "events" => 20_000,
        "detections" | "views" | "agent_tracks" | "agent_events" => 1_000_000,
        _ => 100_000,
    }
}

/// Makes a row of a struct: one column per field, named as the field, in this order. Those behind `added` may be missing
/// in a file of an older version: such a field is as `or` says, or none.
macro_rules! table {
    ($name:literal, $row:ident: $($field:ident),+ $(; added $($new:ident $(or $old:ident)?),+)? $(,)?) => {
        impl Row for $row {
            const TABLE: &'static str = $name;

            fn columns() -> Vec<Column> {
                let mut columns = Vec::new();
                $(declare(|row: &Self| &row.$field, stringify!($field), &mut columns);)+
                let _old = columns.len();
                $($(declare(|row: &Self| &row.$new, stringify!($new), &mut columns);)+
                columns[_old..].iter_mut().for_each(|column| column.may_be_missing = true);)?
                columns
            }

            fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
                $(self.$field.put(cells)?;)+
                $($(self.$new.put(cells)?;)+)?
                Ok(())
            }

            fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
                $(let $field = Field::get(cells)?;)+
                $($(let $new = if column::is_missing(cells) { table!(@ $($old)?) } else { Field::get(cells)? };)+)?
                Ok(Self { $($field,)+ $($($new,)+)? })
            }
        }
    };
    (@ $old:ident) => { $old };
    (@) => { None };
}

/// Declares the columns of the field that `_of` points out, of which only the type counts.
fn declare<R, T: Field>(_of: impl Fn(&R) -> &T, name: &str, columns: &mut Vec<Column>) {
    T::declare(name, columns);
}

table! { "uavs", UavRow:
    uav, group, x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s, boresight_rad,
    speed_command_m_s, turn_rate_command_rad_s, speed_limited, turn_rate_limited,
    centre_distance_m, phase_rad, steered_distance_m, desired_heading_rad, feedforward_rad_s,
    convergence_threshold_m2_s, centre_too_fast, altitude_m;
    added flown_altitude_m, climb_rate_m_s, avoids, foretold_m, border, avoids_intruder
}

table! { "truth", TruthRow:
    target, x_m, y_m, vx_m_s, vy_m_s, ax_m_s2, ay_m_s2
}

// `state` and `covariance` stand for several columns each: see `Named` below.
table! { "tracks", TrackRow:
    target, status, place, group, to_group, state, covariance; added track or target
}

table! { "groups", GroupRow:
    group, members, x_m, y_m, vx_m_s, vy_m_s, spread_m, margin_m, standoff_unclamped_m,
    standoff_distance_m, standoff_rate_m_s, turn_limit_m, feasible, convergence_threshold_m2_s, altitude_m, separation_m;
    added id
}

table! { "detections", DetectionRow:
    uav, target, range_m, bearing_rad
}

table! { "events", EventRow:
    kind, target, group, to_group, uavs, reason; added track, cause, into_group, members, together, dwell_s, needed_m,
    allowed_m, threshold_m2_s, limit_m2_s, speed_m_s, limit_m_s, distance_m, group_id, to_group_id, clear_fraction, zone, intruder
}

table! { "intruders", IntruderRow:
    intruder, x_m, y_m, heading_rad, speed_m_s, altitude_m, told
}

table! { "agents", AgentRow:
    agent, committed_us, disturbed, sent_messages, sent_bytes, double_counted
}

table! { "agent_team", TeamRow:
    agent, uav, presence, heard_us, group, group_id
}

table! { "targets", TargetRow:
    target, name
}

table! { "views", ViewRow:
    uav, target, range_m, off_boresight_rad
}

/// A table whose rows several minds may have of their own, in one of another name.
trait Own: Row {
    const OWN: &'static str;
}

impl Own for TrackRow {
    const OWN: &'static str = "agent_tracks";
}

impl Own for GroupRow {
    const OWN: &'static str = "agent_groups";
}

impl<R: Own> Row for OfAgent<R> {
    const TABLE: &'static str = R::OWN;

    fn columns() -> Vec<Column> {
        let mut columns = Vec::new();
        u32::declare("agent", &mut columns);
        columns.extend(R::columns());
        columns
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.agent.put(cells)?;
        self.row.put(cells)
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        Ok(Self { agent: Field::get(cells)?, row: R::get(cells)? })
    }
}

impl Row for AgentEventRow {
    const TABLE: &'static str = "agent_events";

    fn columns() -> Vec<Column> {
        let mut columns = Vec::new();
        u32::declare("agent", &mut columns);
        i64::declare("happened_us", &mut columns);
        bool::declare("provisional", &mut columns);
        columns.extend(EventRow::columns());
        columns
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.agent.put(cells)?;
        self.happened_us.put(cells)?;
        self.provisional.put(cells)?;
        self.event.put(cells)
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        Ok(Self {
            agent: Field::get(cells)?,
            happened_us: Field::get(cells)?,
            provisional: Field::get(cells)?,
            event: EventRow::get(cells)?,
        })
    }
}

/// A row and an error of it by the true geometry, in a column behind its own. It is for others: what reads a record here
/// derives it again, and has it of old records, too.
pub(super) struct WithError<R> {
    pub(super) row: R,
    pub(super) error_m: Option<f64>,
}

/// A row that has such a column.
pub(super) trait Erring: Row {
    const ERROR: &'static str;
}

impl Erring for UavRow {
    const ERROR: &'static str = "standoff_error_m";
}

impl Erring for TrackRow {
    const ERROR: &'static str = "position_error_m";
}

impl<R: Erring> Row for WithError<R> {
    const TABLE: &'static str = R::TABLE;

    fn columns() -> Vec<Column> {
        let mut columns = R::columns();
        Option::<f64>::declare(R::ERROR, &mut columns);
        columns
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.row.put(cells)?;
        self.error_m.put(cells)
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        Ok(Self { row: R::get(cells)?, error_m: Field::get(cells)? })
    }
}

impl<R: Row> Row for At<R> {
    const TABLE: &'static str = R::TABLE;

    fn columns() -> Vec<Column> {
        let mut columns = Vec::new();
        i64::declare("time_us", &mut columns);
        f64::declare("time_s", &mut columns);
        columns.extend(R::columns());
        columns
    }

    fn time_s(&self) -> f64 {
        seconds(self.time_us)
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.time_us.put(cells)?;
        self.time_s().put(cells)?;
        self.row.put(cells)
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        let time_us = i64::get(cells)?;
        f64::get(cells)?; // for people: the microseconds are what counts
        let row = R::get(cells)?;
        Ok(Self { time_us, row })
    }
}

/// The double nearest to the time in seconds.
pub(super) fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}

/// The whole microseconds nearest to the time: those of which it was made.
pub(super) fn microseconds(time_s: f64) -> i64 {
    (time_s * 1e6).round() as i64
}

/// An array that takes one column per element.
trait Named {
    fn names() -> Vec<String>;
}

impl Named for [f64; 6] {
    fn names() -> Vec<String> {
        ["x_m", "vx_m_s", "ax_m_s2", "y_m", "vy_m_s", "ay_m_s2"].map(str::to_owned).into()
    }
}

impl Named for [f64; 21] {
    fn names() -> Vec<String> {
        let axes = ["x", "vx", "ax", "y", "vy", "ay"];
        let upper = |i: usize| axes[i..].iter().map(move |column| (axes[i], column));
        (0..axes.len()).flat_map(upper).map(|(row, column)| format!("cov_{row}_{column}")).collect()
    }
}

impl<const N: usize> Field for [f64; N]
where
    Self: Named,
{
    fn declare(_name: &str, columns: &mut Vec<Column>) {
        for name in Self::names() {
            f64::declare(&name, columns);
        }
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.iter().try_for_each(|value| value.put(cells))
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f64::get(cells)?;
        }
        Ok(values)
    }
}

/// Makes scalars of types that a column holds as they are.
macro_rules! plain {
    ($($type:ty),+) => {
        $(impl Scalar for $type {
            type Cell = Self;

            fn encode(&self) -> Result<Self, What> {
                Ok(*self)
            }

            fn decode(cell: Self) -> Result<Self, What> {
                Ok(cell)
            }
        })+
    };
}

plain!(i64, bool);

/// Nothing of this world is larger, and what is made of it, squares and sums, stays finite.
const LARGEST: f64 = 1e100;

impl Scalar for f64 {
    type Cell = Self;

    fn encode(&self) -> Result<Self, What> {
        (self.abs() <= LARGEST).then_some(*self).ok_or(What::NotFinite)
    }

    fn decode(cell: Self) -> Result<Self, What> {
        let bad = || What::Bad(format!("is {cell:e}; {:e} to {LARGEST:e}", -LARGEST));
        (cell.abs() <= LARGEST).then_some(cell).ok_or_else(bad)
    }
}

impl Scalar for u32 {
    type Cell = i32;

    fn encode(&self) -> Result<i32, What> {
        i32::try_from(*self).map_err(|_| What::TooLarge(u64::from(*self)))
    }

    fn decode(cell: i32) -> Result<Self, What> {
        Self::try_from(cell).map_err(|_| What::Bad(format!("is negative: {cell}")))
    }
}

impl Scalar for u64 {
    type Cell = i64;

    fn encode(&self) -> Result<i64, What> {
        i64::try_from(*self).map_err(|_| What::TooLarge(*self))
    }

    fn decode(cell: i64) -> Result<Self, What> {
        Self::try_from(cell).map_err(|_| What::Bad(format!("is negative: {cell}")))
    }
}

impl Scalar for String {
    type Cell = ByteArray;

    fn encode(&self) -> Result<ByteArray, What> {
        Ok(ByteArray::from(self.as_str()))
    }

    fn decode(cell: ByteArray) -> Result<Self, What> {
        text(&cell).map(str::to_owned)
    }
}

/// Makes scalars of enumerations: each value is a word.
macro_rules! words {
    ($what:literal, $type:ident: $($value:ident = $word:literal),+ $(,)?) => {
        impl Scalar for $type {
            type Cell = ByteArray;

            fn encode(&self) -> Result<ByteArray, What> {
                Ok(ByteArray::from(match self { $(Self::$value => $word,)+ }))
            }

            fn decode(cell: ByteArray) -> Result<Self, What> {
                match text(&cell)? {
                    $($word => Ok(Self::$value),)+
                    other => Err(What::Bad(format!(concat!("is no ", $what, ": {}"), quoted(other)))),
                }
            }
        }
    };
}

words! { "track status", TrackStatus: Cued = "cued", Held = "held", Coasting = "coasting" }
words! { "place of a target", Place:
    Unassigned = "unassigned", Member = "member", Dwell = "dwell", Discarded = "discarded"
}

words! { "word for who is there", Presence: Live = "live", Silent = "silent", Gone = "gone", Left = "left" }

/// Ids joined by a space.
impl Scalar for Vec<u32> {
    type Cell = ByteArray;

    fn encode(&self) -> Result<ByteArray, What> {
        self.iter().try_for_each(|id| id.encode().map(drop))?;
        let ids: Vec<String> = self.iter().map(u32::to_string).collect();
        Ok(ByteArray::from(ids.join(" ").into_bytes()))
    }

    fn decode(cell: ByteArray) -> Result<Self, What> {
        let ids = text(&cell)?;
        ids.split_whitespace()
            .map(|id| id.parse().map_err(|_| What::Bad(format!("is no list of ids: {}", quoted(ids)))))
            .collect()
    }
}

fn text(cell: &ByteArray) -> Result<&str, What> {
    if cell.len() > MAX_CELL {
        return Err(What::Bad(format!("has {} bytes of text; at most {MAX_CELL}", cell.len())));
    }
    std::str::from_utf8(cell.data()).map_err(|_| What::Bad("is not UTF-8 text".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::super::table::{TableReader, TableWriter, file_of};
    use super::*;

    /// Rows as they were before tracks had ids of their own, and events their numbers.
    struct OldTrack {
        target: u32,
        status: TrackStatus,
        place: Place,
        group: Option<u32>,
        to_group: Option<u32>,
        state: [f64; 6],
        covariance: [f64; 21],
    }
    struct OldEvent {
        kind: String,
        target: Option<u32>,
        group: Option<u32>,
        to_group: Option<u32>,
        uavs: Vec<u32>,
        reason: String,
    }
    table! { "tracks", OldTrack: target, status, place, group, to_group, state, covariance }
    table! { "events", OldEvent: kind, target, group, to_group, uavs, reason }

    fn reread<R: Row, S: Row>(row: &R) -> Result<S, String> {
        let home = tempfile::tempdir().unwrap();
        let mut table = TableWriter::create::<R>(home.path()).unwrap();
        table.push(row).unwrap();
        table.finish().unwrap();
        let row = TableReader::open(file_of::<S>(home.path())).and_then(|mut table| table.next_row());
        row.map(Option::unwrap).map_err(|error| error.to_string())
    }

    #[test]
    fn tables_of_before_the_added_columns_are_read_and_no_other_column_may_be_missing() {
        let (status, place, state) = (TrackStatus::Held, Place::Member, [1.0; 6]);
        let old = OldTrack { target: 7, status, place, group: None, to_group: Some(1), state, covariance: [2.0; 21] };
        let track: TrackRow = reread(&old).unwrap();
        assert_eq!((track.target, track.track, track.to_group, track.covariance[20]), (7, 7, Some(1), 2.0));
        let (kind, reason) = ("lost".to_owned(), "unseen".to_owned());
        let old = OldEvent { kind, target: Some(7), group: None, to_group: None, uavs: vec![3], reason };
        let event: EventRow = reread(&old).unwrap();
        assert_eq!((event.track, event.dwell_s, event.why()), (None, None, "unseen".to_owned()));
        let whole = EventRow { track: Some(9), dwell_s: Some(0.5), cause: Some("widened".to_owned()), ..event };
        assert_eq!(reread(&whole), Ok(whole.clone()));
        let error = reread::<_, EventRow>(&OldNothing { kind: "lost".to_owned() }).unwrap_err();
        assert!(error.contains("events.parquet is damaged: column target is missing"), "{error}");
    }

    struct OldNothing {
        kind: String,
    }
    table! { "events", OldNothing: kind }
}
