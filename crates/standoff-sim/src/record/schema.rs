//! Table schema of records: the columns of each row type, used for writing and reading.

use parquet::data_type::ByteArray;
use standoff::TeammateStatus;
use standoff_io::display_text::quoted;

use super::column::{Cells, Column, Fault, Field, Scalar, ValueProblem};
use super::table::Row;
use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, GroupRow, IntruderRow, MembershipState, TeammateRow,
    TrackRow, TrackStatus, TruthRow, UavRow, ViewRow,
};

/// Names of the tables that frames are read from; the files are `<name>.parquet`.
pub(super) const TIMED: [&str; 6] =
    [UavRow::TABLE, TruthRow::TABLE, TrackRow::TABLE, GroupRow::TABLE, DetectionRow::TABLE, EventRow::TABLE];

/// Names of the tables of several agents: a record has either all of them or none.
pub(super) const OF_AGENTS: [&str; 5] =
    [AgentRow::TABLE, ByAgent::<TrackRow>::TABLE, ByAgent::<GroupRow>::TABLE, AgentEventRow::TABLE, TeammateRow::TABLE];

/// True if a table has this name.
pub(super) fn is_table(name: &str) -> bool {
    let others = [TargetRow::TABLE, ViewRow::TABLE, IntruderRow::TABLE];
    TIMED.contains(&name) || OF_AGENTS.contains(&name) || others.contains(&name)
}

/// Name of a target. The table of targets is written once, at the start of the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TargetRow {
    pub(super) target: u32,
    pub(super) name: String,
}

/// Row with its time step: two time columns precede the columns of the row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct At<R> {
    pub(super) time_us: i64,
    pub(super) row: R,
}

/// Implements `Row` for a struct: one column per field, with the same name, in this order.
macro_rules! table {
    ($name:literal, $row:ident: $($field:ident),+ $(,)?) => {
        impl Row for $row {
            const TABLE: &'static str = $name;

            fn columns() -> Vec<Column> {
                let mut columns = Vec::new();
                $(declare(|row: &Self| &row.$field, stringify!($field), &mut columns);)+
                columns
            }

            fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
                $(self.$field.put(cells)?;)+
                Ok(())
            }

            fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
                $(let $field = Field::get(cells)?;)+
                Ok(Self { $($field,)+ })
            }
        }
    };
}

/// Declares the columns of the field selected by `_of`; only its type is used.
fn declare<R, T: Field>(_of: impl Fn(&R) -> &T, name: &str, columns: &mut Vec<Column>) {
    T::declare(name, columns);
}

table! { "uavs", UavRow:
    uav, group, x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s, boresight_rad,
    speed_command_m_s, turn_rate_command_rad_s, speed_limited, turn_rate_limited,
    centre_distance_m, phase_rad, steered_radius_m, desired_heading_rad, feedforward_rad_s,
    convergence_threshold_m2_s, centre_too_fast, commanded_altitude_m, altitude_m, climb_rate_m_s, avoided_uav, predicted_distance_m, limiting_zone, avoided_intruder
}

table! { "truth", TruthRow:
    target, x_m, y_m, vx_m_s, vy_m_s, ax_m_s2, ay_m_s2
}

// `state` and `covariance` expand to several columns each: see `Named` below.
table! { "tracks", TrackRow:
    target, status, membership, group, receiving_group, state, covariance, track
}

table! { "groups", GroupRow:
    group, members, x_m, y_m, vx_m_s, vy_m_s, spread_m, margin_m, standoff_unclamped_m,
    standoff_distance_m, standoff_rate_m_s, turn_limit_m, feasible, convergence_threshold_m2_s, altitude_m, nearest_groupmate_m, group_uid
}

table! { "detections", DetectionRow:
    uav, target, range_m, bearing_rad
}

table! { "events", EventRow:
    kind, target, group, to_group, uavs, reason, track, cause, into_group, members, coverable_targets, dwell_s, required_radius_m,
    allowed_radius_m, threshold_m2_s, limit_m2_s, speed_m_s, limit_m_s, distance_m, group_id, to_group_id, clear_fraction, zone, intruder
}

table! { "intruders", IntruderRow:
    intruder, x_m, y_m, heading_rad, speed_m_s, altitude_m, transponder_on
}

table! { "agents", AgentRow:
    agent, committed_us, link_degraded, sent_messages, sent_bytes, double_counted
}

table! { "agent_teammates", TeammateRow:
    agent, uav, status, last_report_us, group, group_id
}

table! { "targets", TargetRow:
    target, name
}

table! { "in_view", ViewRow:
    uav, target, range_m, off_boresight_rad
}

/// Row type that also exists per agent, in a table with another name.
trait Own: Row {
    const OWN: &'static str;
}

impl Own for TrackRow {
    const OWN: &'static str = "agent_tracks";
}

impl Own for GroupRow {
    const OWN: &'static str = "agent_groups";
}

impl<R: Own> Row for ByAgent<R> {
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
        i64::declare("event_time_us", &mut columns);
        bool::declare("provisional", &mut columns);
        columns.extend(EventRow::columns());
        columns
    }

    fn put(&self, cells: &mut Cells<'_>) -> Result<(), Fault> {
        self.agent.put(cells)?;
        self.event_time_us.put(cells)?;
        self.provisional.put(cells)?;
        self.event.put(cells)
    }

    fn get(cells: &mut Cells<'_>) -> Result<Self, Fault> {
        Ok(Self {
            agent: Field::get(cells)?,
            event_time_us: Field::get(cells)?,
            provisional: Field::get(cells)?,
            event: EventRow::get(cells)?,
        })
    }
}

/// Row with its error relative to the truth, in an additional last column. The column is for other programs: readers in
/// this crate recompute the error, also for old records.
pub(super) struct WithError<R> {
    pub(super) row: R,
    pub(super) error_m: Option<f64>,
}

/// Row type with an error column.
pub(super) trait HasErrorColumn: Row {
    const ERROR: &'static str;
}

impl HasErrorColumn for UavRow {
    const ERROR: &'static str = "standoff_error_m";
}

impl HasErrorColumn for TrackRow {
    const ERROR: &'static str = "position_error_m";
}

impl<R: HasErrorColumn> Row for WithError<R> {
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
        f64::get(cells)?; // for users only: the microseconds are authoritative
        let row = R::get(cells)?;
        Ok(Self { time_us, row })
    }
}

/// Converts a time to seconds, rounded to the nearest double.
pub(super) fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}

/// Converts a time to whole microseconds; inverse of [`seconds`].
pub(super) fn microseconds(time_s: f64) -> i64 {
    (time_s * 1e6).round() as i64
}

/// An array with one column per element.
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

/// Implements scalars whose type equals that of the column.
macro_rules! plain {
    ($($type:ty),+) => {
        $(impl Scalar for $type {
            type Cell = Self;

            fn encode(&self) -> Result<Self, ValueProblem> {
                Ok(*self)
            }

            fn decode(cell: Self) -> Result<Self, ValueProblem> {
                Ok(cell)
            }
        })+
    };
}

plain!(i64, bool);

/// Larger than any physical value here; its squares and sums stay finite.
const LARGEST: f64 = 1e100;

impl Scalar for f64 {
    type Cell = Self;

    fn encode(&self) -> Result<Self, ValueProblem> {
        (self.abs() <= LARGEST).then_some(*self).ok_or(ValueProblem::NotFinite)
    }

    fn decode(cell: Self) -> Result<Self, ValueProblem> {
        let bad = || ValueProblem::Bad(format!("is {cell:e}; must be {:e} to {LARGEST:e}", -LARGEST));
        (cell.abs() <= LARGEST).then_some(cell).ok_or_else(bad)
    }
}

impl Scalar for u32 {
    type Cell = i32;

    fn encode(&self) -> Result<i32, ValueProblem> {
        i32::try_from(*self).map_err(|_| ValueProblem::TooLarge(u64::from(*self)))
    }

    fn decode(cell: i32) -> Result<Self, ValueProblem> {
        Self::try_from(cell).map_err(|_| ValueProblem::Bad(format!("is negative: {cell}")))
    }
}

impl Scalar for u64 {
    type Cell = i64;

    fn encode(&self) -> Result<i64, ValueProblem> {
        i64::try_from(*self).map_err(|_| ValueProblem::TooLarge(*self))
    }

    fn decode(cell: i64) -> Result<Self, ValueProblem> {
        Self::try_from(cell).map_err(|_| ValueProblem::Bad(format!("is negative: {cell}")))
    }
}

impl Scalar for String {
    type Cell = ByteArray;

    fn encode(&self) -> Result<ByteArray, ValueProblem> {
        Ok(ByteArray::from(self.as_str()))
    }

    fn decode(cell: ByteArray) -> Result<Self, ValueProblem> {
        text(&cell).map(str::to_owned)
    }
}

/// Implements scalars for enumerations: each value is a word.
macro_rules! words {
    ($what:literal, $type:ident: $($value:ident = $word:literal),+ $(,)?) => {
        impl Scalar for $type {
            type Cell = ByteArray;

            fn encode(&self) -> Result<ByteArray, ValueProblem> {
                Ok(ByteArray::from(match self { $(Self::$value => $word,)+ }))
            }

            fn decode(cell: ByteArray) -> Result<Self, ValueProblem> {
                match text(&cell)? {
                    $($word => Ok(Self::$value),)+
                    other => Err(ValueProblem::Bad(format!(concat!("is not a ", $what, ": {}"), quoted(other)))),
                }
            }
        }
    };
}

words! { "track status", TrackStatus: Cued = "cued", Updated = "updated", Coasting = "coasting" }
words! { "group membership", MembershipState:
    Ungrouped = "ungrouped", Member = "member", InHandoff = "in-handoff", Removed = "removed"
}

words! { "teammate status", TeammateStatus: Live = "live", Silent = "silent", TimedOut = "timed-out", Left = "left" }

/// Ids, separated by spaces.
impl Scalar for Vec<u32> {
    type Cell = ByteArray;

    fn encode(&self) -> Result<ByteArray, ValueProblem> {
        self.iter().try_for_each(|id| id.encode().map(drop))?;
        let ids: Vec<String> = self.iter().map(u32::to_string).collect();
        Ok(ByteArray::from(ids.join(" ").into_bytes()))
    }

    fn decode(cell: ByteArray) -> Result<Self, ValueProblem> {
        let ids = text(&cell)?;
        ids.split_whitespace()
            .map(|id| id.parse().map_err(|_| ValueProblem::Bad(format!("is not a list of ids: {}", quoted(ids)))))
            .collect()
    }
}

fn text(cell: &ByteArray) -> Result<&str, ValueProblem> {
    std::str::from_utf8(cell.data()).map_err(|_| ValueProblem::Bad("is not UTF-8 text".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::super::table::{TableReader, TableWriter, file_of};
    use super::*;

    fn reread<R: Row, S: Row>(row: &R) -> Result<S, String> {
        let home = tempfile::tempdir().unwrap();
        let mut table = TableWriter::create::<R>(home.path()).unwrap();
        table.push(row).unwrap();
        table.finish().unwrap();
        let row = TableReader::open(file_of::<S>(home.path())).and_then(|mut table| table.next_row());
        row.map(Option::unwrap).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_are_read_as_they_were_written_and_missing_columns_are_refused() {
        let whole = EventRow { track: Some(9), dwell_s: Some(0.5), cause: Some("too-uncertain".to_owned()), ..event() };
        assert_eq!(reread(&whole), Ok(whole.clone()));
        let error = reread::<_, EventRow>(&OneColumn { kind: "lost".to_owned() }).unwrap_err();
        assert!(error.contains("events.parquet is damaged: column target is missing"), "{error}");
    }

    fn event() -> EventRow {
        EventRow { kind: "lost".to_owned(), target: Some(7), reason: "unseen".to_owned(), ..EventRow::default() }
    }

    struct OneColumn {
        kind: String,
    }
    table! { "events", OneColumn: kind }
}
