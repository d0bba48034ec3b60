//! `standoff frames`: draws the map of a recorded run at a series of times, for an animation.

use std::io;
use std::path::PathBuf;

use clap::Parser;
use standoff_app::{Failure, of_record, report_end, settings_of};
use standoff_io::display_text;
use standoff_record::Record;
use standoff_view::figures::{Extent, MapFrames, Setup};

use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff frames standoff-out/improved/figure-9-1 --out frames
  standoff frames mine-1 --out frames --from 20 --to 60 --every 0.5

Programs such as rsvg-convert and ffmpeg turn the frames into a video. The
replay page records videos as well.";

/// Maximum number of frames: more than an hour at 25 frames per second.
const FRAMES_MAX: usize = 100_000;

/// Options of `standoff frames`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folder of the run.
    dir: PathBuf,
    /// Folder for the frames, which is created: 00000.svg, 00001.svg, ...
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Time of the first frame, s [default: the start of the run].
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    from: f64,
    /// Time of the last frame, s [default: the end of the run].
    #[arg(long, value_name = "SECONDS", default_value_t = f64::INFINITY, hide_default_value = true)]
    to: f64,
    /// Time between two frames, s; at least the length of a time step.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    every: f64,
}

pub(crate) fn draw(args: &Args) -> Result<(), Failure> {
    let Args { dir, out, from, to, every } = args;
    let record = Record::open(dir).map_err(of_record)?;
    report_end(&record, &note);
    let (settings, period_s) = (settings_of(&record)?, record.manifest().period_s);
    let wrong =
        |option: &str, value: f64, allowed: String| Err(Failure::Input(format!("{option} {value}: must be {allowed}")));
    if !(*every >= period_s && every.is_finite()) {
        return wrong("--every", *every, format!("at least {period_s} s, the length of a time step"));
    }
    if !from.is_finite() {
        return wrong("--from", *from, "a number of seconds".to_owned());
    }
    if to.is_nan() || to < from {
        return wrong("--to", *to, format!("at least --from, {from} s"));
    }
    let mut extent = Extent::default();
    for frame in record.frames().map_err(of_record)? {
        extent.add(&frame.map_err(of_record)?);
    }
    let setup = Setup::of(record.manifest().title(), &settings);
    let mut frames = MapFrames::new(&setup, extent);
    let mut written = 0;
    let cannot = |error| Failure::running(format!("--out {}: {error}", display_text::path(out)));
    std::fs::create_dir(out).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => {
            Failure::Input(format!("--out {}: exists; choose a new folder", display_text::path(out)))
        }
        _ => cannot(error),
    })?;
    for frame in record.frames().map_err(of_record)? {
        let frame = frame.map_err(of_record)?;
        let time_s = frame.time_us as f64 / 1e6;
        // Half a step of tolerance, so that the frames follow the times requested.
        let next_s = from + written as f64 * every;
        let requested = time_s + period_s / 2.0 > next_s && time_s <= *to && time_s >= *from;
        let Some(svg) = frames.next(&frame, requested).map_err(Failure::running)? else { continue };
        std::fs::write(out.join(format!("{written:05}.svg")), svg).map_err(cannot)?;
        written += 1;
        if written == FRAMES_MAX {
            note(&format!("warning: stopped after {FRAMES_MAX} frames"));
            break;
        }
    }
    if written == 0 {
        // The folder is empty.
        let _ = std::fs::remove_dir(out);
        return wrong("--from", *from, "a time of the run".to_owned());
    }
    print(&format!("{written} frames in {}\n", display_text::path(out)))
}
