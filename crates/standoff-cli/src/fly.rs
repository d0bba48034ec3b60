//! `standoff fly`: runs the agent of one UAV behind its autopilot.

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};
use standoff::{Duration, LinkModel, TeamParams, UavId};
use standoff_app::{Failure, of_record};
use standoff_fly::address::LinkAddress;
use standoff_fly::codec::SigningKey;
use standoff_fly::config::{Config, Steer};
use standoff_fly::flight_record::{FlightRecordError, FlightRecorder};
use standoff_fly::run::{Devices, RunError, run as run_until};
use standoff_io::atomic_file::{self, PARTIAL, sibling};
use standoff_io::geodesy::Origin;
use standoff_io::{bounded_input, display_text};
use standoff_record::{Frame, Manifest, Occupancy, Writer, conflicting_files, occupancy};
use standoff_sim::scenario::{Overrides, Scenario, ScenarioError, ScenarioTemplate};
use standoff_view::serve::Server;
use standoff_view::site;

use crate::live_view::{LiveReplay, ServeArgs};
use crate::overrides::key_and_value;
use crate::signals::Interruption;
use crate::terminal::note;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff fly team.toml --link udpin:127.0.0.1:14550 --origin 47.4,8.5
  standoff fly team.toml --link serial:/dev/ttyAMA0:921600 \\
    --origin 47.4,8.5 --key-file key.hex
  standoff fly team.toml --link udpin:127.0.0.1:14550 --origin 47.4,8.5 \\
    --out flight-1 --view
  standoff fly --config /etc/standoff/uav-1.toml
  standoff fly team.toml --link udpin:127.0.0.1:14560 --origin 47.4,8.5 \\
    --uav 1 --system-id 2 --feed 127.0.0.1:47801 --listen 127.0.0.1:47901 \\
    --teammate 0=127.0.0.1:47900

Read docs/user/fly-safety.md first. Exit status: 0 ended by the user,
1 failure while running, 2 wrong input or usage.";

/// How the aircraft is steered.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum SteerBy {
    Roll,
    Course,
}

/// Options of `standoff fly`.
#[derive(Parser)]
pub(crate) struct Args {
    /// Scenario whose parameters and geofence the team uses: the same on every aircraft.
    scenario: String,
    /// TOML file with options: its keys are their names. Options of the command line replace those of the file.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Link to the autopilot: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD.
    #[arg(long, value_name = "ADDRESS")]
    link: LinkAddress,
    /// Origin of the team's local plane, degrees: the same on every aircraft.
    #[arg(long, value_name = "LATITUDE,LONGITUDE", value_parser = pair, allow_hyphen_values = true)]
    origin: [f64; 2],
    /// Id of this UAV in the team.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=65_535))]
    uav: u32,
    /// Number of starts of this program on this flight, from 0; increase it after a restart in the air.
    #[arg(long, value_name = "N", default_value_t = 0)]
    restart_count: u32,
    /// Take the number of starts from this file, and count this start in it.
    #[arg(long, value_name = "FILE", conflicts_with = "restart_count")]
    starts_file: Option<PathBuf>,
    /// File that exists while the aircraft is commanded, for a supervisor that restarts the program.
    #[arg(long, value_name = "FILE")]
    commanded_file: Option<PathBuf>,
    /// MAVLink system id of the autopilot.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..))]
    system_id: u8,
    /// File with the key of the message signing: 64 hexadecimal digits. Without it, every sender that reaches the link can command.
    #[arg(long, value_name = "FILE")]
    key_file: Option<PathBuf>,
    /// Link id of the message signing, different for each sender with the same key.
    #[arg(long, value_name = "N", default_value_t = 191)]
    signing_link_id: u8,
    /// Local address on which the feed of detections and cues arrives (UDP).
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:47800")]
    feed: String,
    /// Local address on which teammates' messages arrive (UDP).
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:47900")]
    listen: String,
    /// Id and address of a teammate; may be given several times.
    #[arg(long, value_name = "ID=HOST:PORT", value_parser = teammate)]
    teammate: Vec<(u32, String)>,
    /// Address of a running SUMO simulation (TraCI) with targets: cues and simulated detections of its vehicles.
    #[arg(long, value_name = "HOST:PORT")]
    sumo: Option<String>,
    /// Lowest and highest altitude above home that is commanded, m; in addition to the vehicle's fence [default: 60 to 300, or further to the altitudes of the team].
    #[arg(long, value_name = "MIN,MAX", value_parser = altitudes)]
    altitude: Option<[f64; 2]>,
    /// Engage even if GUIDED was selected before this program started. Otherwise the pilot must select GUIDED again, because the pilot may fly in it after a restart.
    #[arg(long)]
    engage_after_restart: bool,
    /// Steer by roll targets, which the autopilot releases 3 s after the last one, or by course commands, which it keeps for ever.
    #[arg(long, value_enum, default_value_t = SteerBy::Roll)]
    steer: SteerBy,
    /// Send UAVs and tracks as Cursor-on-Target events to an operator map (UDP).
    #[arg(long, value_name = "HOST:PORT")]
    cot: Option<String>,
    /// Write a record of the flight to this folder, which must not exist.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write a record of each flight to a new folder in this one: flight-1, flight-2, ...
    #[arg(long, value_name = "DIR", conflicts_with = "out")]
    records: Option<PathBuf>,
    /// Serve a page that shows the flight.
    #[arg(long)]
    view: bool,
    /// Serve the page at this address and port [default: 127.0.0.1:0].
    #[arg(long, value_name = "ADDRESS:PORT", requires = "view")]
    view_at: Option<SocketAddr>,
    /// Do not open a browser.
    #[arg(long, requires = "view")]
    no_open: bool,
    /// End after this time, s.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: Option<u32>,
    /// Change a value of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set: Vec<String>,
}

impl Args {
    fn origin(&self) -> Origin {
        let [latitude_deg, longitude_deg] = self.origin;
        Origin { latitude_deg, longitude_deg }
    }
}

/// Altitudes above home that are commanded at least, m.
const ALTITUDES_M: [f64; 2] = [60.0, 300.0];

/// Length of a flight that ends when the user ends it, s. A finished record has the length of the flight.
const LENGTH_MAX_S: u32 = 86_400;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let overrides = Overrides { set: args.set.clone(), origin: Some(args.origin()), ..Overrides::default() };
    let template = ScenarioTemplate::load(&args.scenario, &overrides).map_err(Failure::Scenario)?;
    let length_s = args.seconds.unwrap_or(LENGTH_MAX_S);
    let scenario = of_length(&template, length_s.into()).map_err(Failure::Scenario)?;
    let (config, devices) = (config(args, &scenario)?, devices(args)?);
    warn(&config, &devices, scenario.uavs.len());
    let interruption = Interruption::install()?;
    let duration = args.seconds.map(|s| Duration::from_s(s.into()));
    let out = args.out.clone().or_else(|| args.records.as_deref().map(free_folder));
    let Some((recorder, _server)) = begin_record(args, out.as_deref(), &scenario)? else {
        return run_until(config, &devices, interruption.flag(), duration, &mut note, &mut |_| {}).map_err(failure);
    };
    let add = &mut |frame| recorder.add(frame);
    let flown = run_until(config, &devices, interruption.flag(), duration, &mut note, add).map_err(failure);
    // The record is completed also after a failure.
    let of_flight = |length_s| {
        let scenario = of_length(&template, length_s).and_then(|scenario| scenario.resolved());
        scenario.map_err(|error| error.to_string())
    };
    let recorded = recorder.finish(of_flight).map_err(|error| match error {
        FlightRecordError::Record(error) => of_record(error),
        other => Failure::running(other),
    });
    if let (Ok(Some(length)), Some(out)) = (&recorded, &out) {
        let (shown, out, length_s) = (display_text::path(out), display_text::shell_path(out), length.s());
        note(&format!("the record of {length_s} s is in {shown}: to print its results, run standoff report {out}"));
    }
    flown.and(recorded.map(|_| ()))
}

/// Configuration of the companion.
fn config(args: &Args, scenario: &Scenario) -> Result<Config, Failure> {
    let mut params = scenario.settings.team;
    // Real radios lose messages.
    params.link = LinkModel::Lossy;
    let plane = args.origin().plane().map_err(|error| Failure::Input(format!("--origin: {error}")))?;
    if let Some((id, _)) = args.teammate.iter().find(|(id, _)| *id == args.uav) {
        return Err(Failure::Input(format!("--teammate {id}=...: is the id of this UAV; give each UAV another --uav")));
    }
    for (place, (id, address)) in args.teammate.iter().enumerate() {
        if args.teammate[..place].iter().any(|(other, _)| other == id) {
            let what =
                format!("--teammate {id}={address}: UAV {id} has an address already; give each UAV another --uav");
            return Err(Failure::Input(what));
        }
    }
    let team = args.teammate.iter().map(|(id, _)| *id).chain([args.uav]);
    Ok(Config {
        altitude_m: args.altitude.unwrap_or_else(|| default_altitudes_m(&params, team.map(UavId))),
        params,
        geofence: scenario.settings.geofence.clone(),
        areas: scenario.settings.priorities.areas.clone(),
        uav: UavId(args.uav),
        restart_count: args.starts_file.as_deref().map_or(Ok(args.restart_count), count_start)?,
        system_id: args.system_id,
        plane,
        teammates: args.teammate.iter().map(|(id, _)| UavId(*id)).collect(),
        steer: match args.steer {
            SteerBy::Roll => Steer::Roll,
            SteerBy::Course => Steer::Course,
        },
        engages_after_restart: args.engage_after_restart,
    })
}

/// Links of the companion.
fn devices(args: &Args) -> Result<Devices, Failure> {
    Ok(Devices {
        link: args.link.clone(),
        signing: args.key_file.as_deref().map(|file| key(file, args.signing_link_id)).transpose()?,
        // Each program with the same key has another link id.
        time_stamps: args.key_file.as_deref().map(|file| sibling(file, &format!(".link-{}", args.signing_link_id))),
        feed: args.feed.clone(),
        listen: args.listen.clone(),
        teammates: args.teammate.iter().map(|(_, address)| address.clone()).collect(),
        sumo: args.sumo.clone(),
        cot: args.cot.clone(),
        commanded_file: args.commanded_file.clone(),
    })
}

/// Adds 1 to the number of starts in a file, and returns the number before.
fn count_start(file: &Path) -> Result<u32, Failure> {
    let shown = display_text::path(file);
    let starts = match bounded_input::text(file, 100) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => 0,
        text => {
            let text = text.map_err(|error| Failure::Input(format!("{shown}: {error}")))?;
            let wrong = |_| Failure::Input(format!("{shown}: must contain the number of starts; write 0 for none"));
            text.trim().parse().map_err(wrong)?
        }
    };
    let next = u32::saturating_add(starts, 1);
    atomic_file::save(file, format!("{next}\n")).map_err(|error| Failure::running(format!("{shown}: {error}")))?;
    Ok(starts)
}

/// Warns of what makes a flight unsafe or its tracks wrong.
fn warn(config: &Config, devices: &Devices, uavs: usize) {
    let team = config.teammates.len() + 1;
    if uavs > team {
        note(&format!(
            "warning: uavs.count = {uavs}, but --teammate makes a team of {team}: this UAV does not wait for the others, \
             hear them or avoid them"
        ));
    }
    if devices.signing.is_none() {
        note(
            "warning: messages are not signed: every sender that reaches the link can command the aircraft; give --key-file",
        );
    }
    let acceleration_sd_m_s2 = config.params.track.target.acceleration_sd_m_s2;
    if acceleration_sd_m_s2 < TeamParams::recommended().track.target.acceleration_sd_m_s2 {
        note(&format!(
            "warning: filter.acceleration_sd_m_s2 = {acceleration_sd_m_s2}: tracks of targets that turn will be wrong; \
             set it in the scenario, for example to 0.5"
        ));
    }
}

fn failure(error: RunError) -> Failure {
    match error {
        RunError::Input(what) => Failure::Input(what),
        RunError::Running(what) => Failure::Running(what),
    }
}

/// Returns the scenario with the length of a flight, s.
fn of_length(template: &ScenarioTemplate, length_s: f64) -> Result<Scenario, ScenarioError> {
    template.changed(&[format!("duration_s={length_s}")])?.draw(1)
}

/// Starts the record and the page of a flight; `None` if the user wants neither.
fn begin_record(
    args: &Args,
    out: Option<&Path>,
    scenario: &Scenario,
) -> Result<Option<(FlightRecorder, Option<Server>)>, Failure> {
    if out.is_none() && !args.view {
        return Ok(None);
    }
    let period = scenario.settings.period;
    let manifest = Manifest {
        origin: Some(args.origin()),
        // The recorder replaces it by the time of the first frame.
        begin_unix_us: Some(0),
        ..Manifest::new(&scenario.name, scenario.seed, scenario.settings.duration.s(), period.s())
    };
    let writer = out.map(|out| create_record(out, &manifest, scenario)).transpose()?;
    let mut live =
        args.view.then(|| LiveReplay::new(&manifest, &scenario.settings, Vec::new(), true, None)).transpose()?;
    let served = ServeArgs::at(args.view_at, args.no_open);
    let announce = |url: &str| {
        note(&format!("live view: {url}", url = url.trim_end()));
        Ok(())
    };
    let server =
        live.as_ref().map(|live| served.serve(site::of_runs(live.replay(), None, None), announce)).transpose()?;
    let look = move |frame: &Frame| live.iter_mut().for_each(|live| live.frame(frame));
    let recorder = FlightRecorder::start(writer, period, look, note).map_err(Failure::running)?;
    Ok(Some((recorder, server)))
}

/// Returns the first folder in `records` without a record. Its name is no time, because the clock of a companion
/// computer can be wrong after the start.
fn free_folder(records: &Path) -> PathBuf {
    let is_free = |out: &PathBuf| !out.exists() && !sibling(out, PARTIAL).exists();
    (1_u32..).map(|number| records.join(format!("flight-{number}"))).find(is_free).unwrap_or_default()
}

/// Creates the record of a flight. A flight cannot be repeated, so no older record is replaced.
fn create_record(out: &Path, manifest: &Manifest, scenario: &Scenario) -> Result<Writer, Failure> {
    // Removes a trailing slash, as for other records.
    let out: PathBuf = out.components().collect();
    match occupancy(&out) {
        Occupancy::Other => return Err(of_record(conflicting_files(&out))),
        Occupancy::Free if !sibling(&out, PARTIAL).exists() => {}
        _ => {
            let out = display_text::path(&out);
            return Err(Failure::Input(format!(
                "--out {out}: has an older record; flights replace none: name another folder"
            )));
        }
    }
    let resolved = scenario.resolved().map_err(Failure::Scenario)?;
    let writer = Writer::create(&out, manifest, &resolved, &[]).map_err(of_record)?;
    writer.without_truth().map_err(of_record)
}

/// Reads the key of the message signing. The key itself is never shown.
fn key(file: &Path, link_id: u8) -> Result<SigningKey, Failure> {
    const LENGTH_MAX: u64 = 1024;
    let shown = display_text::path(file);
    let failure = |what: &str| Failure::Input(format!("--key-file {shown}: {what}"));
    let length = std::fs::metadata(file).map_err(|error| failure(&error.to_string()))?;
    if !length.is_file() || length.len() > LENGTH_MAX {
        return Err(failure("must be a file with 64 hexadecimal digits"));
    }
    let text = std::fs::read_to_string(file).map_err(|error| failure(&error.to_string()))?;
    let digits: Vec<u32> = text.trim().chars().map_while(|digit| digit.to_digit(16)).collect();
    if digits.len() != 64 || text.trim().len() != 64 {
        return Err(failure("must have 64 hexadecimal digits; create one with: openssl rand -hex 32"));
    }
    let mut key = [0; 32];
    for (byte, pair) in key.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = (16 * pair[0] + pair[1]) as u8;
    }
    Ok(SigningKey { key, link_id })
}

/// Parses two numbers with a comma between them.
pub(crate) fn pair(text: &str) -> Result<[f64; 2], String> {
    let number = |part: &str| part.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    let error = || format!("`{text}`: must be two numbers, for example 47.4,8.5");
    numbers.ok_or_else(error)?.try_into().map_err(|_| error())
}

/// Altitudes that are commanded without `--altitude`, m: those of the team are among them.
fn default_altitudes_m(params: &TeamParams, team: impl Iterator<Item = UavId>) -> [f64; 2] {
    team.map(|uav| params.initial_altitude_m(uav)).fold(ALTITUDES_M, |[min_m, max_m], m| [min_m.min(m), max_m.max(m)])
}

fn altitudes(text: &str) -> Result<[f64; 2], String> {
    let [min_m, max_m] = pair(text)?;
    if (20.0..=20_000.0).contains(&min_m) && (min_m..=20_000.0).contains(&max_m) {
        return Ok([min_m, max_m]);
    }
    Err(format!("`{text}`: must be between 20 and 20000 m, the lower one first"))
}

fn teammate(text: &str) -> Result<(u32, String), String> {
    let parsed = text.split_once('=').and_then(|(id, address)| {
        let id = id.trim().parse().ok().filter(|id| *id <= 65_535)?;
        address.contains(':').then(|| (id, address.to_owned()))
    });
    parsed.ok_or_else(|| format!("`{text}`: must be ID=HOST:PORT, for example 1=127.0.0.1:47901"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_altitudes_of_the_team_are_commanded_by_default() {
        let params = TeamParams { link: LinkModel::Lossy, ..TeamParams::recommended() };
        for (ids, expected_m) in [(vec![0], [60.0, 300.0]), (vec![0, 1], [60.0, 350.0]), (vec![5, 2], [60.0, 550.0])] {
            let altitudes_m = default_altitudes_m(&params, ids.iter().map(|id| UavId(*id)));
            assert_eq!(altitudes_m, expected_m, "{ids:?}");
        }
        let mut params = params;
        params.group.altitude_lowest_m = 40.0;
        assert_eq!(default_altitudes_m(&params, [UavId(0)].into_iter()), [40.0, 300.0]);
    }
}
