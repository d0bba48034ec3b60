//! Whatever happens to the bytes of a journal, a run in it is either correct or missing.

use super::super::{Shard, results};
use super::*;

static NEVER: AtomicBool = AtomicBool::new(false);

fn batch() -> Batch {
    Batch {
        format: FORMAT,
        version: "0".to_owned(),
        scenario: "s".to_owned(),
        seed: 7,
        runs: 12,
        shard: Some(Shard { index: 1, of: 2 }),
        metrics: vec!["a".to_owned(), "b".to_owned()],
        traffic_crc32: None,
        scenario_toml: String::new(),
    }
}

/// Values of run `run`.
fn values(run: u64) -> Vec<Option<f64>> {
    vec![Some(run as f64 / 3.0), run.is_multiple_of(2).then_some(-0.0)]
}

fn put(journal: &mut Journal, run: u64) -> Result<(), MonteCarloError> {
    journal.put(0, run, &values(run))
}

fn rows(journal: &Journal) -> Vec<(u64, Option<Vec<Option<f64>>>)> {
    journal.rows(&NEVER).unwrap().map(Result::unwrap).collect()
}

/// A folder with this journal.
fn folder(bytes: &[u8]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(JOURNAL), bytes).unwrap();
    dir
}

fn bytes(dir: &tempfile::TempDir) -> Vec<u8> {
    fs::read(dir.path().join(JOURNAL)).unwrap()
}

/// Returns the journal after these runs, and the offset of its first slot.
fn journal_of(runs: &[u64]) -> (Vec<u8>, usize) {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), &batch()).unwrap();
    runs.iter().for_each(|run| put(&mut journal, *run).unwrap());
    (bytes(&dir), journal.slots.start as usize)
}

/// Writes the missing runs.
fn complete(journal: &mut Journal) {
    let missing: Vec<u64> = journal.missing(&NEVER).unwrap().map(Result::unwrap).collect();
    missing.into_iter().for_each(|run| put(journal, run).unwrap());
    let complete: Vec<_> = journal.complete_rows(&NEVER).unwrap().map(Result::unwrap).collect();
    assert_eq!(complete, (6..12).map(values).collect::<Vec<_>>());
}

#[test]
fn runs_are_stored_in_order_whatever_the_order_they_end() {
    let (in_order, _) = journal_of(&[6, 7, 8, 9, 10, 11]);
    let (out_of_order, _) = journal_of(&[9, 6, 11, 10, 8, 7]);
    assert_eq!(in_order, out_of_order);
    let (some, _) = journal_of(&[9, 6]);
    let dir = folder(&some);
    let journal = Journal::open(dir.path(), &batch()).unwrap();
    let kept = |run| (run, [6, 9].contains(&run).then(|| values(run)));
    assert_eq!(rows(&journal), (6..12).map(kept).collect::<Vec<_>>());
    assert_eq!((journal.count(&NEVER).unwrap(), journal.first_complete(&NEVER).unwrap()), (2, Some((6, values(6)))));
}

#[test]
fn truncated_journal_keeps_the_runs_before_the_cut() {
    let (whole, start) = journal_of(&[6, 7, 8, 9, 10, 11]);
    let slot = 8 + 2 * 8 + 4;
    assert_eq!(whole.len(), start + 6 * slot);
    for length in 0..=whole.len() {
        let dir = folder(&whole[..length]);
        let mut journal = Journal::open(dir.path(), &batch()).unwrap();
        let kept = (length.saturating_sub(start) / slot) as u64;
        assert_eq!(journal.count(&NEVER).unwrap(), kept, "{length} bytes");
        let expected = |run| (run, (run < 6 + kept).then(|| values(run)));
        assert_eq!(rows(&journal), (6..12).map(expected).collect::<Vec<_>>(), "{length} bytes");
        complete(&mut journal);
        assert_eq!(bytes(&dir), whole, "{length} bytes");
    }
}

#[test]
fn changed_byte_is_refused_or_loses_one_run() {
    let (whole, start) = journal_of(&[6, 7, 8, 9, 10, 11]);
    for at in 0..whole.len() {
        for change in [0x01, 0x80, 0xff] {
            let mut changed = whole.clone();
            changed[at] ^= change;
            let dir = folder(&changed);
            let opened = Journal::open(dir.path(), &batch());
            if at < start {
                let error = opened.unwrap_err().to_string();
                assert!(error.contains("monte-carlo.journal is damaged"), "byte {at}: {error}");
                assert_eq!(bytes(&dir), changed, "byte {at}: a refused journal was changed");
                continue;
            }
            let mut journal = opened.unwrap();
            let lost = 6 + ((at - start) / 28) as u64;
            let expected = |run| (run, (run != lost).then(|| values(run)));
            assert_eq!(rows(&journal), (6..12).map(expected).collect::<Vec<_>>(), "byte {at}");
            complete(&mut journal);
            assert_eq!(bytes(&dir), whole, "byte {at}");
        }
    }
}

/// Slots of another batch, or at another index, have valid checksums, but not for this batch and index.
#[test]
fn slot_is_valid_only_in_its_batch_and_at_its_index() {
    let (whole, start) = journal_of(&[6, 7, 8, 9, 10, 11]);
    let mut moved = whole.clone();
    moved.copy_within(start..start + 28, start + 28);
    let dir = folder(&moved);
    let journal = Journal::open(dir.path(), &batch()).unwrap();
    assert_eq!(rows(&journal)[1], (7, None));

    let other = Batch { seed: 8, ..batch() };
    let dir = tempfile::tempdir().unwrap();
    Journal::open(dir.path(), &other).unwrap();
    let mut foreign = bytes(&dir);
    assert_eq!(foreign.len(), start);
    foreign.extend_from_slice(&whole[start..]);
    let dir = folder(&foreign);
    assert_eq!(Journal::open(dir.path(), &other).unwrap().count(&NEVER).unwrap(), 0);
    let refusal = Journal::open(dir.path(), &batch()).unwrap_err().to_string();
    assert!(refusal.contains("the first seed is 8, not 7"), "{refusal}");
}

#[test]
fn two_processes_do_not_write_one_journal() {
    let dir = tempfile::tempdir().unwrap();
    let first = Journal::open(dir.path(), &batch()).unwrap();
    let refusal = Journal::open(dir.path(), &batch()).unwrap_err();
    assert!(refusal.to_string().contains("another run is writing"), "{refusal}");
    assert!(!refusal.is_wrong_input());
    drop(first);
    Journal::open(dir.path(), &batch()).unwrap();
}

#[test]
fn journal_of_a_later_format_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let later = Batch { format: FORMAT + 1, version: "9.9".to_owned(), ..batch() };
    Journal::open(dir.path(), &later).unwrap();
    let refusal = Journal::open(dir.path(), &batch()).unwrap_err().to_string();
    assert!(
        refusal.contains("has format 3 of standoff 9.9; this version supports format 2; use the version that wrote it"),
        "{refusal}"
    );
}

#[test]
fn non_finite_value_is_an_error_and_is_not_stored() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), &batch()).unwrap();
    for wrong in [f64::NAN, f64::INFINITY] {
        let error = journal.put(13, 6, &[Some(1.0), Some(wrong)]).unwrap_err();
        assert!(error.to_string().starts_with("seed 13: b is not finite"), "{error}");
    }
    assert_eq!(journal.count(&NEVER).unwrap(), 0);
}

#[test]
#[cfg(target_os = "linux")]
fn full_disk_is_an_error_with_the_reason_of_the_system() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), &batch()).unwrap();
    journal.file = File::options().write(true).open("/dev/full").unwrap();
    let error = put(&mut journal, 6).unwrap_err();
    assert!(error.to_string().contains("No space left on device"), "{error}");
    assert!(!error.is_wrong_input());
}

#[test]
#[cfg(unix)]
fn symbolic_link_is_refused_and_its_target_unchanged() {
    let dir = tempfile::tempdir().unwrap();
    let victim = dir.path().join("victim");
    fs::write(&victim, "hi").unwrap();
    let batches = dir.path().join("o");
    fs::create_dir(&batches).unwrap();
    std::os::unix::fs::symlink(&victim, batches.join(JOURNAL)).unwrap();
    let error = Journal::open(&batches, &batch()).unwrap_err();
    assert!(error.is_wrong_input() && error.to_string().contains("contains something other than a run"), "{error}");
    assert_eq!(fs::read_to_string(&victim).unwrap(), "hi");
}

/// Hence a batch with very many runs starts and resumes quickly.
#[test]
fn nothing_is_read_after_the_last_stored_run() {
    let dir = tempfile::tempdir().unwrap();
    let many = Batch { runs: 100_000_000, shard: None, ..batch() };
    let mut journal = Journal::open(dir.path(), &many).unwrap();
    for run in [0, 3] {
        journal.put(7 + run, run, &values(run)).unwrap();
    }
    assert_eq!(journal.rows(&NEVER).unwrap().with_a_slot().count(), 4);
    assert_eq!(journal.count(&NEVER).unwrap(), 2);
    let missing: Vec<u64> = journal.missing(&NEVER).unwrap().take(4).map(Result::unwrap).collect();
    assert_eq!(missing, [1, 2, 4, 5]);
}

#[test]
fn batch_stopped_in_its_last_steps_is_incomplete_but_keeps_all_runs() {
    let (whole, _) = journal_of(&[6, 7, 8, 9, 10, 11]);
    let dir = folder(&whole);
    let journal = Journal::open(dir.path(), &batch()).unwrap();
    let stopped = AtomicBool::new(true);
    for rows_stop in [&NEVER, &stopped] {
        let rows = journal.complete_rows(rows_stop).unwrap();
        let error = results::write(dir.path(), &batch(), rows, &stopped).unwrap_err();
        assert!(matches!(error, MonteCarloError::Interrupted), "{error}");
        assert!(results::Results::open(dir.path()).is_err());
    }
    assert!(matches!(journal.count(&stopped), Err(MonteCarloError::Interrupted)));
    assert_eq!(bytes(&dir), whole);
    results::write(dir.path(), &batch(), journal.complete_rows(&NEVER).unwrap(), &NEVER).unwrap();
    assert!(results::Results::open(dir.path()).is_ok());
}

/// Returns the batch of a journal and its runs, as [`Journal::open`] and [`Journal::rows`] read them.
pub(in super::super) fn read_journal(path: &Path) -> Result<Option<(Batch, Rows<'static>)>, MonteCarloError> {
    let mut file = File::open(path).unwrap();
    let Some(batch) = read_head(&mut file, path)? else { return Ok(None) };
    let start = file.stream_position().unwrap();
    let (runs, seal) = (batch.flown(), crc32fast::hash(&serde_json::to_vec(&batch).unwrap()));
    let slots = Slots { start, runs, metrics: batch.metrics.len(), seal };
    Ok(Some((batch, Rows::new(path.to_owned(), file, slots, &NEVER).unwrap())))
}

/// Makes a journal with arbitrary contents and valid checksums.
pub(in super::super) fn sealed(json: &[u8], slots: &[u8]) -> Vec<u8> {
    [&head(json).unwrap().0, slots].concat()
}
