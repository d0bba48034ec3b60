//! Merges the shards of a batch: gives the same bytes as the batch in one piece.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use standoff_io::display_text;

use super::journal::Journal;
use super::{MonteCarloError, Results, Shard, check_not_stopped, find_complete, results};

/// Merges the complete shards in `dirs`, in any order, into the batch in `out`. An existing merged batch is not merged
/// again.
///
/// Refuses anything but every shard of one batch exactly once, and names the wrong folder or the missing shards. `stop`
/// interrupts it; another call starts again.
pub fn merge(dirs: &[PathBuf], out: &Path, stop: &AtomicBool) -> Result<Results, MonteCarloError> {
    let mut parts = complete_parts(dirs, stop)?;
    parts.sort_by_key(|(shard, _)| *shard);
    let whole = parts[0].1.batch().whole_batch();
    if let Some(complete) = find_complete(out, &whole, stop)? {
        return Ok(complete);
    }
    // An empty journal locks the folder against other processes, and identifies it if this process ends.
    let journal = Journal::open(out, &whole)?;
    let metrics: Vec<&str> = whole.metrics().collect();
    let rows = parts.iter().flat_map(|(_, part)| match part.runs().and_then(|runs| runs.rows(&metrics)) {
        Ok(rows) => {
            Box::new(rows.map(|row| check_not_stopped(stop).and(Ok(row?.values)))) as Box<dyn Iterator<Item = _>>
        }
        Err(error) => Box::new(std::iter::once(Err(error))),
    });
    let merged = results::write(out, &whole, rows, stop)?;
    journal.remove()?;
    Ok(merged)
}

/// Opens the shards in `dirs`; at least one. Fails unless they are every shard of one batch exactly once.
fn complete_parts(dirs: &[PathBuf], stop: &AtomicBool) -> Result<Vec<(Shard, Results)>, MonteCarloError> {
    let refuse = |what: String| Err(MonteCarloError::NotMergeable(what));
    let mut parts: Vec<(Shard, Results)> = Vec::new();
    for dir in dirs {
        check_not_stopped(stop)?;
        let part = Results::open(dir)?;
        let Some(shard) = part.batch().shard else {
            return refuse(format!("{} contains a whole batch, not a shard", display_text::path(dir)));
        };
        if let Some((other_shard, other)) = parts.first() {
            let other_dir = display_text::path(other.dir());
            if let Some(difference) = other.batch().whole_batch().difference(&part.batch().whole_batch()) {
                return refuse(format!(
                    "{} and {other_dir} belong to different batches: {difference}",
                    display_text::path(dir)
                ));
            }
            if shard.of != other_shard.of {
                return refuse(format!(
                    "{} is shard {shard}, {other_dir} is shard {other_shard}",
                    display_text::path(dir)
                ));
            }
        }
        if let Some((_, other)) = parts.iter().find(|(other, _)| *other == shard) {
            return refuse(format!(
                "{} and {} are both shard {shard}",
                display_text::path(other.dir()),
                display_text::path(dir)
            ));
        }
        parts.push((shard, part));
    }
    let Some((Shard { of, .. }, _)) = parts.first() else { return refuse("no folder is given".to_owned()) };
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
    Ok(parts)
}
