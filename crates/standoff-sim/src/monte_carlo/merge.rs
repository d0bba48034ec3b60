//! The shards of a batch, put together: the same bytes as if it had been flown in one piece.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::journal::Journal;
use super::{MonteCarloError, Results, Shard, find_complete, results, unless_set};
use crate::text;

/// Merges the complete shards in `dirs`, in any order, into the batch in `out`. A merged batch is not merged again.
///
/// Refuses anything but every shard of one batch exactly once, and says which folder is in the way or what is missing.
/// `stop` ends it; the same again begins anew.
pub fn merge(dirs: &[PathBuf], out: &Path, stop: &AtomicBool) -> Result<Results, MonteCarloError> {
    let refuse = |what: String| Err(MonteCarloError::NotMergeable(what));
    let mut parts: Vec<(Shard, Results)> = Vec::new();
    for dir in dirs {
        unless_set(stop)?;
        let part = Results::open(dir)?;
        let Some(shard) = part.batch().shard else {
            return refuse(format!("{} holds a whole batch, not a shard of one", text::path(dir)));
        };
        if let Some((other_shard, other)) = parts.first() {
            let there = text::path(other.dir());
            if let Some(difference) = other.batch().whole().difference(&part.batch().whole()) {
                return refuse(format!("{} and {there} are of different batches: {difference}", text::path(dir)));
            }
            if shard.of != other_shard.of {
                return refuse(format!("{} is shard {shard}, {there} is shard {other_shard}", text::path(dir)));
            }
        }
        if let Some((_, other)) = parts.iter().find(|(other, _)| *other == shard) {
            return refuse(format!("{} and {} are both shard {shard}", text::path(other.dir()), text::path(dir)));
        }
        parts.push((shard, part));
    }
    let Some((Shard { of, .. }, first)) = parts.first() else { return refuse("no folder is named".to_owned()) };
    let is_missing = |index: &u64| !parts.iter().any(|(shard, _)| shard.index == *index);
    let missing = (0..*of).filter(is_missing).map(|index| Shard { index, of: *of }.to_string());
    let some: Vec<_> = missing.take(10).collect();
    if !some.is_empty() {
        let more = match *of - parts.len() as u64 - some.len() as u64 {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        return refuse(format!("missing: shard {}{more}", some.join(", ")));
    }

    let whole = first.batch().whole();
    if let Some(complete) = find_complete(out, &whole, stop)? {
        return Ok(complete);
    }
    parts.sort_by_key(|(shard, _)| *shard);
    // An empty journal keeps other processes away, and tells what this folder is for if this one ends.
    let journal = Journal::open(out, &whole)?;
    let metrics: Vec<&str> = whole.metrics().collect();
    let rows = parts.iter().flat_map(|(_, part)| match part.runs().and_then(|runs| runs.rows(&metrics)) {
        Ok(rows) => Box::new(rows.map(|row| unless_set(stop).and(Ok(row?.values)))) as Box<dyn Iterator<Item = _>>,
        Err(error) => Box::new(std::iter::once(Err(error))),
    });
    let merged = results::write(out, &whole, rows, stop)?;
    journal.remove()?;
    Ok(merged)
}
