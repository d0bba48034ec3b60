//! Measures a radio with packet loss and latency at different sizes of the team and the traffic, and the time of the
//! agents' steps, which include rollback and replay.
//!
//! `radio LATENCY_S RUNS REPETITIONS UAVSxVEHICLES...` prints a table; docs/user/radio.md and docs/developer/benchmarks.md explain it.

use std::process::ExitCode;
use std::time::Duration;

use standoff::{AgentOutput, AirVelocity, Message, Scan, Time, UavId, UavState};
use standoff_record::{PerAgentTables, ReportedState, ReportedTables};
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::controller::{Controller, team_controller};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Overrides, Scenario, ScenarioTemplate};

const USAGE: &str = "usage: radio LATENCY_S RUNS REPETITIONS UAVSxVEHICLES...";

/// Duration of a mission, s.
const DURATION_S: u32 = 120;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [latency_s, runs, repetitions, sizes @ ..] = arguments.as_slice() else { return usage() };
    let size = |size: &String| {
        let (uavs, vehicles) = size.split_once('x')?;
        Some((uavs.parse::<u32>().ok()?, vehicles.parse::<u32>().ok()?))
    };
    let (Ok(latency_s), Ok(runs), Ok(repetitions), Some(sizes)) = (
        latency_s.parse::<f64>(),
        runs.parse(),
        repetitions.parse(),
        sizes.iter().map(size).collect::<Option<Vec<_>>>(),
    ) else {
        return usage();
    };
    println!(
        "| UAVs | vehicles | commit lag, s | maximum, s | disagreement, % | in the worst run, % | bytes/s per UAV | limited, % | agent step, mean, ms | p99.9, ms | longest, ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (uavs, vehicles) in sizes {
        measure((uavs, vehicles), latency_s, runs, repetitions);
    }
    ExitCode::SUCCESS
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

/// CPU time of this thread, which other programs on the machine hardly change.
fn cpu_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

/// Scenario with vehicles at random places of a square of 2 km, and 20 % packet loss.
fn scenario((uavs, vehicles): (u32, u32), latency_s: f64, seed: u64) -> Scenario {
    let text = format!(
        "duration_s = {DURATION_S}
         [uavs]
         count = {uavs}
         [sensor]
         range_sd_m = 10
         bearing_sd_deg = 3
         [targets]
         acceleration_sd_m_s2 = 0.03
         [targets.random]
         count = {vehicles}
         x_m = {{ uniform = {{ min = -1000.0, max = 1000.0 }} }}
         y_m = {{ uniform = {{ min = -1000.0, max = 1000.0 }} }}
         vx_m_s = {{ uniform = {{ min = -8.0, max = 8.0 }} }}
         vy_m_s = {{ uniform = {{ min = -8.0, max = 8.0 }} }}
         [radio]
         packet_loss = 0.2
         latency_s = {latency_s}"
    );
    let template = ScenarioTemplate::of_toml("radio", &text, &Overrides::default(), ".".as_ref());
    template.and_then(|template| template.draw(seed)).unwrap_or_else(|error| panic!("{error}"))
}

/// Flies missions of one size and prints a row of the table. Each step of an agent counts with the shortest time of
/// the repetitions of its mission, because other programs on the machine only make it longer.
fn measure(size: (u32, u32), latency_s: f64, runs: u64, repetitions: u32) {
    let (mut steps, mut all): (Vec<Duration>, Vec<Metrics>) = (Vec::new(), Vec::new());
    for seed in 1..=runs {
        let scenario = scenario(size, latency_s, seed);
        let (metrics, mut shortest) = fly(&scenario);
        for _ in 1..repetitions {
            let (_, again) = fly(&scenario);
            shortest.iter_mut().zip(again).for_each(|(shortest, time)| *shortest = time.min(*shortest));
        }
        all.push(metrics);
        steps.extend(shortest);
    }
    steps.sort_unstable();
    let mean = |metric: fn(&Metrics) -> Option<f64>| all.iter().filter_map(metric).sum::<f64>() / all.len() as f64;
    let most = |metric: fn(&Metrics) -> Option<f64>| all.iter().filter_map(metric).fold(f64::NAN, f64::max);
    let ms = |time: Duration| 1e3 * time.as_secs_f64();
    let step_ms = |share: f64| steps.get((share * steps.len() as f64) as usize).map_or(f64::NAN, |time| ms(*time));
    println!(
        "| {} | {} | {:.1} | {:.1} | {:.2} | {:.2} | {:.0} | {:.1} | {:.2} | {:.1} | {:.1} |",
        size.0,
        size.1,
        mean(|metrics| metrics["commit_lag_s"]),
        most(|metrics| metrics["commit_lag_max_s"]),
        100.0 * mean(|metrics| metrics["assignment_disagreement_fraction"]),
        100.0 * most(|metrics| metrics["assignment_disagreement_fraction"]),
        mean(|metrics| metrics["sent_bytes_per_s"]),
        100.0 * mean(|metrics| metrics["retransmission_limited_fraction"]),
        ms(steps.iter().sum()) / steps.len() as f64,
        step_ms(0.999),
        steps.last().map_or(f64::NAN, |time| ms(*time))
    );
}

/// Flies a mission; returns its metrics and the times of the agents' steps, in the order of the steps.
fn fly(scenario: &Scenario) -> (Metrics, Vec<Duration>) {
    let settings = &scenario.settings;
    let controller =
        team_controller(settings.agents, settings.team, settings.geofence.clone(), Vec::new(), scenario.uavs.len());
    let controller = controller.expect("a loaded scenario has valid parameters");
    let mut steps = Vec::new();
    let timed = Timed { controller, steps: &mut steps, step: vec![Duration::ZERO; scenario.uavs.len()] };
    let mut mission = Mission::with_controller(scenario, timed).expect("a loaded scenario can be flown");
    let metrics = mission.score_while(MetricSelection::standard(), || true);
    drop(mission);
    (metrics, steps)
}

/// Controller that measures the time of the steps of each agent.
struct Timed<'a> {
    controller: Box<dyn Controller + Send>,
    /// Times of the steps so far.
    steps: &'a mut Vec<Duration>,
    /// Time of the current step, by UAV.
    step: Vec<Duration>,
}

impl Timed<'_> {
    fn time<T>(&mut self, uav: UavId, call: impl FnOnce(&mut dyn Controller) -> T) -> T {
        let start = cpu_time();
        let result = call(&mut *self.controller);
        self.step[uav.0 as usize] += cpu_time() - start;
        result
    }
}

impl Controller for Timed<'_> {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        self.time(uav, |controller| controller.observe(now, uav, own, scan));
    }

    fn observe_air(&mut self, uav: UavId, air: &AirVelocity) {
        self.time(uav, |controller| controller.observe_air(uav, air));
    }

    fn outbox(&self, uav: UavId) -> &[Message] {
        self.controller.outbox(uav)
    }

    fn receive(&mut self, uav: UavId, message: &Message) {
        self.time(uav, |controller| controller.receive(uav, message));
    }

    fn decide(&mut self, uav: UavId) -> AgentOutput {
        let output = self.time(uav, |controller| controller.decide(uav));
        self.steps.push(std::mem::take(&mut self.step[uav.0 as usize]));
        output
    }

    fn reported(&self) -> ReportedTables {
        self.controller.reported()
    }

    fn report(&self, beliefs: &mut ReportedState) {
        self.controller.report(beliefs);
    }

    fn report_per_agent(&self, agents: &mut PerAgentTables) {
        self.controller.report_per_agent(agents);
    }
}
