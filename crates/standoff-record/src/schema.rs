//! Tables of records, and how the values of their rows are stored. [`crate::frame`] declares the columns.

use parquet::basic::{LogicalType, TimeUnit};
use parquet::data_type::ByteArray;
use standoff::TeammateStatus;
use standoff_io::display_text::quoted;

use crate::column::{Columns, Declaration, Field, Part, Row, Scalar, ValueProblem, rows};
use crate::frame::{
    AgentEventRow, AgentRow, ByAgent, DetectionRow, EventRow, GroupRow, IntruderRow, MembershipState, TeammateRow,
    TentativeRow, TrackRow, TrackStatus, TruthRow, UavRow, ViewRow,
};

/// Names of the tables that every record has and frames are read from; the files are `<name>.parquet`.
pub(crate) const TIMED: [&str; 6] =
    [UavRow::TABLE, TruthRow::TABLE, TrackRow::TABLE, GroupRow::TABLE, DetectionRow::TABLE, EventRow::TABLE];

/// Names of the tables of several agents: a record has either all of them or none.
pub(crate) const OF_AGENTS: [&str; 5] =
    [AgentRow::TABLE, ByAgent::<TrackRow>::TABLE, ByAgent::<GroupRow>::TABLE, AgentEventRow::TABLE, TeammateRow::TABLE];

/// Names of all tables that frames are read from, including those that a record may lack.
pub(crate) fn frame_tables() -> impl Iterator<Item = &'static str> {
    TIMED.into_iter().chain([IntruderRow::TABLE, TentativeRow::TABLE]).chain(OF_AGENTS)
}

/// True if a table has this name.
pub(crate) fn is_table(name: &str) -> bool {
    frame_tables().chain([TargetRow::TABLE, ViewRow::TABLE]).any(|table| table == name)
}

rows! {
    /// Name of a target. The table of targets is written once, at the start of the run.
    pub(crate) struct TargetRow in "targets" {
        /// Target id.
        pub target: u32,
        /// Name in the traffic file, or `target-0`, `target-1`, ...
        pub name: String,
    }
}

/// Implements `Field` for a row that contains another one: the columns of its fields, from left to right.
macro_rules! nested {
    ($row:ident<R: $bound:ident>: $($field:ident: $type:ty, $name:expr, $doc:expr;)+) => {
        impl<R: $bound> Field for $row<R> {
            fn declare<T: 'static>(_: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
                $(<$type>::declare(Declaration::new($name, $doc), columns, move |row| &mut part(row).$field);)+
            }
        }
    };
}

/// Row with its time step.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct At<R> {
    pub(crate) time_us: i64,
    /// For users only: the microseconds are authoritative.
    time_s: f64,
    pub(crate) row: R,
    /// For users only, like the next two.
    pub(crate) time_utc: UtcTime,
    pub(crate) latitude_deg: Option<f64>,
    pub(crate) longitude_deg: Option<f64>,
}

/// A time in UTC, microseconds since 1970.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct UtcTime(pub(crate) i64);

impl<R: Default> At<R> {
    pub(crate) fn new(time_us: i64, row: R) -> Self {
        Self { time_us, time_s: seconds(time_us), row, ..Self::default() }
    }
}

nested! { At<R: Row>: time_us: i64, "time_us", ""; time_s: f64, "time_s", ""; row: R, "", ""; }

impl<R: Row> Row for At<R> {
    const TABLE: &'static str = R::TABLE;

    fn time_s(&self) -> f64 {
        self.time_s
    }
}

nested! { ByAgent<R: Row>: agent: u32, "agent", "UAV of the agent."; row: R, "", ""; }

impl<R: Row> Row for ByAgent<R> {
    const TABLE: &'static str = R::OF_AGENTS;
}

/// Row with its error relative to the truth, in an additional last column. The column is for other programs: readers in
/// this crate recompute the error, also for old records.
#[derive(Clone, Default)]
pub(crate) struct WithError<R> {
    pub(crate) row: R,
    pub(crate) error_m: Option<f64>,
}

/// Row type with an error column: its name and meaning.
pub(crate) trait HasErrorColumn: Row {
    const ERROR: (&'static str, &'static str);
}

impl HasErrorColumn for UavRow {
    const ERROR: (&'static str, &'static str) = (
        "standoff_error_m",
        "r - r_d with the true centre and orbit, m; negative inside the orbit. The mean of its absolute values is the \
         metric `standoff_error_m`.",
    );
}

impl HasErrorColumn for TrackRow {
    const ERROR: (&'static str, &'static str) =
        ("position_error_m", "Distance between estimated and true position, m; null if the target does not exist.");
}

nested! { WithError<R: HasErrorColumn>: row: R, "", ""; error_m: Option<f64>, R::ERROR.0, R::ERROR.1; }

impl<R: HasErrorColumn> Row for WithError<R> {
    const TABLE: &'static str = R::TABLE;
}

/// Converts a time to seconds, rounded to the nearest double.
pub(crate) fn seconds(time_us: i64) -> f64 {
    time_us as f64 / 1e6
}

/// Converts a time to whole microseconds; inverse of [`seconds`].
pub(crate) fn microseconds(time_s: f64) -> i64 {
    (time_s * 1e6).round() as i64
}

/// An array with one column per element.
trait Named {
    const NAMES: &'static [&'static str];
    /// Those that the replay page contains if it contains the array.
    const ON_PAGE: &'static [&'static str];
}

impl Named for [f64; 6] {
    const NAMES: &'static [&'static str] = &["x_m", "vx_m_s", "ax_m_s2", "y_m", "vy_m_s", "ay_m_s2"];
    const ON_PAGE: &'static [&'static str] = &["x_m", "vx_m_s", "y_m", "vy_m_s"];
}

#[rustfmt::skip]
impl Named for [f64; 21] {
    const NAMES: &'static [&'static str] = &[
        "cov_x_x", "cov_x_vx", "cov_x_ax", "cov_x_y", "cov_x_vy", "cov_x_ay",
        "cov_vx_vx", "cov_vx_ax", "cov_vx_y", "cov_vx_vy", "cov_vx_ay",
        "cov_ax_ax", "cov_ax_y", "cov_ax_vy", "cov_ax_ay",
        "cov_y_y", "cov_y_vy", "cov_y_ay",
        "cov_vy_vy", "cov_vy_ay",
        "cov_ay_ay",
    ];
    const ON_PAGE: &'static [&'static str] = &["cov_x_x", "cov_x_y", "cov_y_y"];
}

impl<const N: usize> Field for [f64; N]
where
    Self: Named,
{
    fn declare<T: 'static>(array: Declaration, columns: &mut Columns<T>, part: impl Part<T, Self>) {
        for (index, name) in Self::NAMES.iter().enumerate() {
            let is_on_page = array.is_on_page && Self::ON_PAGE.contains(name);
            let declaration = Declaration { is_on_page, ..Declaration::new(*name, array.doc) };
            f64::declare(declaration, columns, move |row| &mut part(row)[index]);
        }
    }

    fn is_finite(&self) -> bool {
        self.iter().copied().all(f64::is_finite)
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

            fn number(&self) -> Option<f64> {
                Some(i64::from(*self) as f64)
            }
        })+
    };
}

plain!(i64, bool);

impl Scalar for UtcTime {
    type Cell = i64;

    fn encode(&self) -> Result<i64, ValueProblem> {
        Ok(self.0)
    }

    fn decode(cell: i64) -> Result<Self, ValueProblem> {
        Ok(Self(cell))
    }

    fn logical_type() -> Option<LogicalType> {
        Some(LogicalType::timestamp(true, TimeUnit::MICROS))
    }
}

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

    fn number(&self) -> Option<f64> {
        Some(*self)
    }

    fn is_finite(&self) -> bool {
        f64::is_finite(*self)
    }
}

/// Implements a count or id that a column stores as a signed integer.
macro_rules! unsigned {
    ($($type:ty as $cell:ty),+) => {
        $(impl Scalar for $type {
            type Cell = $cell;

            fn encode(&self) -> Result<$cell, ValueProblem> {
                <$cell>::try_from(*self).map_err(|_| ValueProblem::TooLarge(u64::from(*self)))
            }

            fn decode(cell: $cell) -> Result<Self, ValueProblem> {
                Self::try_from(cell).map_err(|_| ValueProblem::Bad(format!("is negative: {cell}")))
            }

            fn number(&self) -> Option<f64> {
                Some(*self as f64)
            }
        })+
    };
}

unsigned!(u32 as i32, u64 as i64);

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

            fn number(&self) -> Option<f64> {
                Some(f64::from(*self as u8))
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
    use super::*;
    use crate::column;
    use crate::table::{TableReader, TableWriter, file_of};

    fn reread<R: Row, S: Row>(row: R) -> Result<S, String> {
        let home = tempfile::tempdir().unwrap();
        let mut table = TableWriter::create(Some(home.path()), column::columns()).unwrap();
        table.push(&mut [row]).unwrap();
        table.finish().unwrap();
        let row = TableReader::open(file_of::<S>(home.path())).and_then(|mut table| table.next_row());
        row.map(Option::unwrap).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_are_read_as_they_were_written_and_missing_columns_are_refused() {
        let whole = EventRow { track: Some(9), dwell_s: Some(0.5), cause: Some("too-uncertain".to_owned()), ..event() };
        assert_eq!(reread(whole.clone()), Ok(whole));
        let error = reread::<_, EventRow>(OneColumn { kind: "lost".to_owned() }).unwrap_err();
        assert!(error.contains("events.parquet is damaged: column target is missing"), "{error}");
    }

    fn event() -> EventRow {
        EventRow { kind: "lost".to_owned(), target: Some(7), reason: "unseen".to_owned(), ..EventRow::default() }
    }

    rows! {
        /// A row with one of the columns of an event.
        struct OneColumn in "events" {
            /// Kind of event.
            pub kind: String,
        }
    }
}
