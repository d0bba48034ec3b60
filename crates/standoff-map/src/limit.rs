//! What a map may cost, so that none, however made, takes the machine or the page. How large its text may be, and how dense
//! gzip, `standoff_sim::source::limit` says.

/// Most points of all maps of a run: a city of a million people has two million with its buildings. They take 150 MB.
pub(crate) const MAX_POINTS: usize = 5_000_000;

/// Most lines and areas of all maps of a run.
pub(crate) const MAX_SHAPES: usize = 1_000_000;

/// Largest map in a page, packed, bytes: two megabytes of text as a page holds it (base64).
pub(crate) const MAX_PACKED: usize = 1_500_000;

/// Largest map in a page, unpacked, bytes: packed it is a third to a tenth of that.
pub(crate) const MAX_UNPACKED: u64 = 30_000_000;

/// What is further from where a run can be is left out, m: seen from the UAVs, it is beyond every sensor.
pub(crate) const MARGIN_M: f64 = 5_000.0;

/// Furthest east or north, m: as far as a vehicle may be.
pub(crate) const FURTHEST_M: f64 = 1e8;

/// Lines keep their course to so many metres, or to twice as many, and again, until the map fits.
pub(crate) const TOLERANCE_M: f64 = 0.25;

/// At most to so many: then only the largest is left.
pub(crate) const TOLERANCE_MAX_M: f64 = 300.0;

/// Longest text of a projection, bytes: that of a national grid has some 200.
pub(crate) const MAX_PROJECTION: usize = 1_000;

/// Longest piece of a line that is simplified at once, points: the worst line takes its square of steps.
pub(crate) const MAX_PIECE: usize = 500;
