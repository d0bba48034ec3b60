//! Time stamps of signed frames, kept across restarts, so that frames recorded before a restart are refused after it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use standoff::{Duration, Time};
use standoff_io::{atomic_file, bounded_input};

use crate::period::is_due;

/// Link id, system id and component id of a sender.
pub type Stream = (u8, u8, u8);

/// Last time stamp of each stream, in units of 10 us since 2015.
pub type TimeStamps = BTreeMap<Stream, u64>;

/// Period at which the time stamps are saved.
const PERIOD: Duration = Duration::from_us(2_000_000);

/// Time by which saved time stamps are ahead, in units of 10 us: a program that is killed has received frames since. It
/// is longer than the period and the time to save.
const AHEAD: u64 = 300_000;

/// Maximum number of streams; a file with more is refused.
const STREAMS_MAX: usize = 1_000;

/// Maximum size of the file, bytes.
const FILE_MAX: u64 = 64 << 10;

/// Largest time stamp: it has 48 bits.
pub(crate) const STAMP_MAX: u64 = (1 << 48) - 1;

/// Reads the time stamps of the last session; none if there is no file.
pub fn read(file: &Path) -> io::Result<TimeStamps> {
    let text = match bounded_input::text(file, FILE_MAX) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(TimeStamps::new()),
        text => text?,
    };
    let stamps: Option<TimeStamps> = text.lines().map(parsed).collect();
    let stamps = stamps.filter(|stamps| stamps.len() <= STREAMS_MAX);
    let wrong = "it does not contain time stamps; if you delete it, frames of earlier sessions can be repeated";
    stamps.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, wrong))
}

fn parsed(line: &str) -> Option<(Stream, u64)> {
    let mut words = line.split(' ');
    let mut id = || words.next()?.parse::<u8>().ok();
    let stream = (id()?, id()?, id()?);
    let stamp = words.next()?.parse().ok().filter(|stamp| *stamp <= STAMP_MAX)?;
    words.next().is_none().then_some((stream, stamp))
}

fn save(file: &Path, stamps: &TimeStamps, ahead: u64) -> io::Result<()> {
    let mut text = String::new();
    for ((link, system, component), stamp) in stamps.iter().take(STREAMS_MAX) {
        let stamp = stamp.saturating_add(ahead).min(STAMP_MAX);
        let _ = writeln!(text, "{link} {system} {component} {stamp}");
    }
    atomic_file::save(file, text)
}

/// Saves time stamps by a thread of its own, because a disk can be slow.
pub(crate) struct Saver {
    file: PathBuf,
    sender: SyncSender<TimeStamps>,
    thread: JoinHandle<()>,
    saved_at: Option<Time>,
}

impl Saver {
    pub(crate) fn start(file: PathBuf) -> io::Result<Self> {
        let (sender, receiver) = sync_channel::<TimeStamps>(1);
        let path = file.clone();
        let run = move || {
            while let Ok(stamps) = receiver.recv() {
                // The next period tries again.
                let _ = save(&path, &stamps, AHEAD);
            }
        };
        Ok(Self {
            file,
            sender,
            thread: thread::Builder::new().name("time stamps".to_owned()).spawn(run)?,
            saved_at: None,
        })
    }

    /// Saves the time stamps if the period has passed.
    pub(crate) fn update(&mut self, now: Time, stamps: &TimeStamps) {
        if is_due(self.saved_at, now, PERIOD) {
            self.saved_at = Some(now);
            let _ = self.sender.try_send(stamps.clone());
        }
    }

    /// Saves the time stamps at the end of a session.
    pub(crate) fn finish(self, stamps: &TimeStamps) -> io::Result<()> {
        drop(self.sender);
        let _ = self.thread.join();
        save(&self.file, stamps, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_time_stamps_are_read_back_and_those_of_a_killed_program_are_ahead() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("key.hex.link-191");
        assert_eq!(read(&file).unwrap(), TimeStamps::new());
        let stamps = TimeStamps::from([((0, 1, 1), 123_456_789_012), ((191, 1, 191), STAMP_MAX)]);
        let mut saver = Saver::start(file.clone()).unwrap();
        saver.update(Time::from_us(0), &stamps);
        let until = std::time::Instant::now() + std::time::Duration::from_secs(10);
        while !file.exists() && std::time::Instant::now() < until {
            thread::sleep(std::time::Duration::from_millis(5));
        }
        let ahead = TimeStamps::from([((0, 1, 1), 123_456_789_012 + AHEAD), ((191, 1, 191), STAMP_MAX)]);
        assert_eq!(read(&file).unwrap(), ahead);
        saver.finish(&stamps).unwrap();
        assert_eq!(read(&file).unwrap(), stamps);
    }

    #[test]
    fn wrong_files_are_refused() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("stamps");
        let many: String = (0..1_001).map(|n| format!("{} {} 1 5\n", n / 256, n % 256)).collect();
        for text in ["0 1 1", "0 1 256 5", "0 1 1 5 6", "0 1 1 -5", "0 1 1 281474976710656", "x", &many] {
            std::fs::write(&file, text).unwrap();
            assert_eq!(read(&file).unwrap_err().kind(), io::ErrorKind::InvalidData, "{text}");
        }
        bolero::check!().with_iterations(1000).for_each(|bytes: &[u8]| {
            let _ = String::from_utf8_lossy(bytes).lines().map(parsed).count();
        });
    }
}
