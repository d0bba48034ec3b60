//! Limits on maps, so that no file exhausts the machine or the page. `standoff_sim::source::limit` has the limits on
//! the size of text and on the compression ratio.

/// Maximum number of points of all maps of a run. A city of a million people has two million, including buildings. They
/// take 150 MB.
pub(crate) const MAX_POINTS: usize = 5_000_000;

/// Maximum number of lines and areas of all maps of a run.
pub(crate) const MAX_SHAPES: usize = 1_000_000;

/// Maximum size of a packed map, bytes: two megabytes of text in a page (base64).
pub(crate) const MAX_PACKED: usize = 1_500_000;

/// Maximum size of an unpacked map, bytes: packed maps have a tenth to a third of the size.
pub(crate) const MAX_UNPACKED: u64 = 30_000_000;

/// Initial tolerance of simplified lines, m; doubled until the map fits.
pub(crate) const TOLERANCE_M: f64 = 0.25;

/// Maximum tolerance, m: only the largest areas remain.
pub(crate) const TOLERANCE_MAX_M: f64 = 300.0;

/// Maximum length of the name of a road, bytes; longer names are omitted.
pub(crate) const MAX_NAME: usize = 100;

/// Maximum number of points of a line that are simplified together: the worst case takes quadratic time.
pub(crate) const MAX_PIECE: usize = 500;
