//! Table of all tracks, by ascending id.

use crate::time::Duration;
use crate::tracking::track::{Track, TrackId};

/// Row of a track table: a track, and the data that others keep about it.
pub(crate) trait TrackRow {
    /// Row of a new track.
    fn new(track: Track) -> Self;
    fn track(&self) -> &Track;
    fn track_mut(&mut self) -> &mut Track;
    /// Priority of the target.
    fn own_priority_mut(&mut self) -> &mut f64;
}

/// All tracks, by ascending id.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct TrackTable<R> {
    rows: Vec<R>,
}

impl<R> Default for TrackTable<R> {
    fn default() -> Self {
        Self { rows: Vec::new() }
    }
}

impl<R: TrackRow> TrackTable<R> {
    pub(crate) fn rows(&self) -> &[R] {
        &self.rows
    }

    /// Rows, for changes of other data than the track id.
    pub(crate) fn rows_mut(&mut self) -> &mut [R] {
        &mut self.rows
    }

    /// Index of a track, or the index at which to insert it.
    pub(crate) fn index(&self, track: TrackId) -> Result<usize, usize> {
        self.rows.binary_search_by_key(&track, |row| row.track().id)
    }

    /// Track with an id.
    pub(crate) fn get(&self, track: TrackId) -> Option<&Track> {
        self.index(track).ok().map(|index| self.rows[index].track())
    }

    /// Adds a track, or replaces the one with its id. Returns false if the table contains `rows_max` other tracks.
    pub(crate) fn start(&mut self, track: Track, rows_max: usize) -> bool {
        match self.index(track.id) {
            Ok(index) => {
                let priority = *self.rows[index].own_priority_mut();
                self.rows[index] = R::new(track);
                *self.rows[index].own_priority_mut() = priority;
            }
            Err(_) if self.rows.len() >= rows_max => return false,
            Err(index) => self.rows.insert(index, R::new(track)),
        }
        true
    }

    /// Sets the priority of a track's target; `None` keeps it.
    pub(crate) fn set_priority(&mut self, track: TrackId, priority: Option<f64>) {
        if let (Ok(index), Some(priority)) = (self.index(track), priority) {
            *self.rows[index].own_priority_mut() = priority;
        }
    }

    /// Removes tracks that have been lost for longer than `after`. Returns false if there are none.
    pub(crate) fn remove_lost(&mut self, after: Duration) -> bool {
        let count = self.rows.len();
        self.rows.retain(|row| row.track().time_since_lost() <= after);
        self.rows.len() < count
    }

    /// Copies another table and reuses the buffer.
    pub(crate) fn copy(&mut self, other: &Self)
    where
        R: Clone,
    {
        self.rows.clone_from(&other.rows);
    }
}
