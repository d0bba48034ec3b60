//! `standoff fly`: runs the agent of one UAV behind its autopilot.

use std::path::{Path, PathBuf};

use clap::Parser;
use standoff::{Duration, LinkModel, UavId};
use standoff_app::Failure;
use standoff_fly::address::LinkAddress;
use standoff_fly::codec::SigningKey;
use standoff_fly::config::Config;
use standoff_fly::run::{Devices, RunError, run as run_until};
use standoff_io::display_text;
use standoff_io::geodesy::LocalPlane;
use standoff_sim::scenario::{Overrides, Scenario};

use crate::overrides::key_and_value;
use crate::signals::Interruption;
use crate::terminal::note;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff fly team.toml --link udpin:127.0.0.1:14550 --origin 47.4,8.5
  standoff fly team.toml --link serial:/dev/ttyAMA0:921600 \\
    --origin 47.4,8.5 --key-file key.hex
  standoff fly team.toml --link udpin:127.0.0.1:14560 --origin 47.4,8.5 \\
    --uav 1 --system-id 2 --feed 127.0.0.1:47801 --listen 127.0.0.1:47901 \\
    --teammate 0=127.0.0.1:47900

Read docs/fly-safety.md first. Exit status: 0 ended by the user,
1 failure while running, 2 wrong input or usage.";

/// Standard deviation of the targets' acceleration below which the program warns, m/s2: the default of the library.
const ACCELERATION_SD_MIN_M_S2: f64 = 0.2;

/// Options of `standoff fly`.
#[derive(Parser)]
pub(crate) struct Args {
    /// Scenario whose parameters and geofence the team uses: the same on every aircraft.
    scenario: String,
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
    /// Lowest and highest altitude above home that is commanded, m; in addition to the vehicle's fence.
    #[arg(long, value_name = "MIN,MAX", default_value = "60,300", value_parser = altitudes)]
    altitude: [f64; 2],
    /// End after this time, s.
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: Option<u32>,
    /// Change a value of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set: Vec<String>,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let overrides = Overrides { set: args.set.clone(), ..Overrides::default() };
    let scenario = Scenario::load(&args.scenario, &overrides, 1).map_err(Failure::Scenario)?;
    let mut params = scenario.settings.team;
    // Real radios lose messages.
    params.link = LinkModel::Lossy;
    let [latitude_deg, longitude_deg] = args.origin;
    let plane =
        LocalPlane::about(latitude_deg, longitude_deg).map_err(|error| Failure::Input(format!("--origin: {error}")))?;
    if let Some((id, _)) = args.teammate.iter().find(|(id, _)| *id == args.uav) {
        return Err(Failure::Input(format!("--teammate {id}=...: is the id of this UAV; give each UAV another --uav")));
    }
    let config = Config {
        params,
        geofence: scenario.settings.geofence.clone(),
        uav: UavId(args.uav),
        restart_count: args.restart_count,
        system_id: args.system_id,
        plane,
        teammates: args.teammate.iter().map(|(id, _)| UavId(*id)).collect(),
        altitude_m: args.altitude,
    };
    let devices = Devices {
        link: args.link.clone(),
        signing: args.key_file.as_deref().map(|file| key(file, args.signing_link_id)).transpose()?,
        feed: args.feed.clone(),
        listen: args.listen.clone(),
        teammates: args.teammate.iter().map(|(_, address)| address.clone()).collect(),
        sumo: args.sumo.clone(),
    };
    if devices.signing.is_none() {
        note(
            "warning: messages are not signed: every sender that reaches the link can command the aircraft; give --key-file",
        );
    }
    let acceleration_sd_m_s2 = config.params.track.target.acceleration_sd_m_s2;
    if acceleration_sd_m_s2 < ACCELERATION_SD_MIN_M_S2 {
        note(&format!(
            "warning: filter.acceleration_sd_m_s2 = {acceleration_sd_m_s2}: tracks of targets that turn will be wrong; \
             set it in the scenario, for example to 0.5"
        ));
    }
    let interruption = Interruption::install()?;
    let duration = args.seconds.map(|s| Duration::from_s(s.into()));
    run_until(config, &devices, interruption.flag(), duration, &mut |line| note(line)).map_err(|error| match error {
        RunError::Input(what) => Failure::Input(what),
        RunError::Running(what) => Failure::Running(what),
    })
}

/// Reads the key of the message signing. The key itself is never shown.
fn key(file: &Path, link_id: u8) -> Result<SigningKey, Failure> {
    const LENGTH_MAX: u64 = 1024;
    let shown = display_text::path(file);
    let failure = |what: &str| Failure::Input(format!("{shown}: {what}"));
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
fn pair(text: &str) -> Result<[f64; 2], String> {
    let number = |part: &str| part.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    let error = || format!("`{text}`: must be two numbers, for example 47.4,8.5");
    numbers.ok_or_else(error)?.try_into().map_err(|_| error())
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
