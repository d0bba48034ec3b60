//! Missions whose sensors report no identities, miss targets and have false alarms.

use crate::common::{frames, load};
use standoff::{Detection, Message, ParamError, Scan, Time, UavId, UavState};
use standoff_record::{Frame, NO_TARGET};
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::controller::{Controller, PerAgentTables, ReportedState, ReportedTables, team_controller};
use standoff_sim::run::{Mission, fly as fly_scenario};
use standoff_sim::scenario::Scenario;

const TOUR: &str = "tour/10-unlabelled-detections";

fn fly(set: &[&str], seed: u64) -> Metrics {
    fly_scenario(&load(TOUR, set, seed), MetricSelection::all()).unwrap()
}

/// Passes the detections of each scan in reverse order.
struct Reversed(Box<dyn Controller + Send>);

impl Controller for Reversed {
    fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<Scan>) {
        let reversed: Vec<Detection> = scan.iter().flat_map(|scan| scan.detections).rev().copied().collect();
        let scan = scan.map(|scan| Scan { detections: &reversed, ..scan });
        self.0.observe(now, uav, own, scan);
    }
    fn outbox(&self, uav: UavId) -> &[Message] {
        self.0.outbox(uav)
    }
    fn receive(&mut self, uav: UavId, message: &Message) {
        self.0.receive(uav, message);
    }
    fn decide(&mut self, uav: UavId) -> standoff::AgentOutput {
        self.0.decide(uav)
    }
    fn reported(&self) -> ReportedTables {
        self.0.reported()
    }
    fn report(&self, beliefs: &mut ReportedState) {
        self.0.report(beliefs);
    }
    fn report_per_agent(&self, agents: &mut PerAgentTables) {
        self.0.report_per_agent(agents);
    }
}

fn reversed(scenario: &Scenario) -> Result<Vec<Frame>, Vec<ParamError>> {
    let settings = &scenario.settings;
    let controller =
        team_controller(settings.agents, settings.team, settings.geofence.clone(), Vec::new(), scenario.uavs.len())?;
    let mut mission = Mission::with_controller(scenario, Reversed(controller))?;
    Ok(std::iter::from_fn(|| mission.frame().cloned()).collect())
}

#[test]
fn order_of_the_detections_of_a_scan_changes_no_number() {
    for set in [&["team.agents=shared"], &["team.agents=per-uav"]] {
        let scenario = load(TOUR, set, 2);
        assert!(frames(&scenario) == reversed(&scenario).unwrap(), "{set:?}");
    }
}

/// Detections are of the targets in the record, or of none; no track is named after a target by the sensors.
#[test]
fn record_has_the_targets_of_detections_and_tracks_and_the_agents_do_not() {
    let frames = frames(&load(TOUR, &[], 1));
    let detections: Vec<_> = frames.iter().flat_map(|frame| &frame.detections).collect();
    let false_alarms = detections.iter().filter(|row| row.target.is_none()).count() as f64;
    // Poisson: 200 time steps with a pointed sensor, four UAVs, five false alarms each.
    assert!((false_alarms - 4_000.0).abs() < 5.0 * 4_000f64.sqrt(), "{false_alarms}");
    assert!(detections.iter().all(|row| row.range_rate_m_s.is_some()));
    for frame in &frames {
        assert!(frame.tracks.iter().all(|row| row.track >= NO_TARGET && row.track_uid.is_some()));
        assert!(frame.tentative.is_sorted_by(|row, next| row.track_uid < next.track_uid));
        assert!(frame.tracks.is_sorted_by(|row, next| row.target < next.target));
    }
    let with_target = frames.last().unwrap().tracks.iter().filter(|row| row.target < NO_TARGET).count();
    assert_eq!(with_target, 7);
}

/// All agents report the same ids for the same tracks.
#[test]
fn agents_share_the_ids_of_their_tracks() {
    let frames = frames(&load(TOUR, &["team.agents=per-uav"], 1));
    for frame in &frames {
        let of = |agent| frame.agents.tracks_of(agent).iter().map(|of| (of.row.track_uid, of.row.target, of.row.track));
        assert!((1..4).all(|agent| of(agent).eq(of(0))));
    }
    assert!(frames.last().unwrap().agents.tracks_of(3).len() >= 7);
}

/// Means over twelve runs: the team misjudges the detection probability or the minimum detectable velocity.
#[test]
fn wrong_assumptions_about_the_sensor_degrade_the_tracking_but_do_not_break_it() {
    let missed_more = ["sensor.detection_probability=0.7", "filter.detection_probability=0.9"];
    let blinder = ["sensor.mdv_m_s=3", "filter.mdv_m_s=2"];
    let means = |set: &[&str]| {
        let runs: Vec<Metrics> = (1..=12).map(|seed| fly(set, seed)).collect();
        let mean = |of: fn(&Metrics) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
        assert!(mean(|run| run["custody_fraction"].unwrap()) > 0.93, "{runs:?}");
        assert!(mean(|run| run["false_tracks"].unwrap()) < 1.0, "{runs:?}");
        assert!(mean(|run| run["track_swaps"].unwrap()) < 2.0, "{runs:?}");
        assert!(mean(|run| run["anees_nonmanoeuvring"].unwrap()) < 2.0, "{runs:?}");
        mean(|run| run["gospa_m"].unwrap())
    };
    let right_m = means(&[]);
    for wrong in [missed_more, blinder] {
        let gospa_m = means(&wrong);
        assert!((right_m..2.5 * right_m).contains(&gospa_m), "{wrong:?}: {gospa_m} m, {right_m} m if known");
    }
}

#[test]
fn clutter_alone_starts_no_track_and_needs_no_more_memory() {
    check_clutter(600);
}

#[test]
#[ignore = "long: for .ci/long"]
fn hour_of_clutter_alone_starts_no_track_and_needs_no_more_memory() {
    check_clutter(3600);
}

/// Two UAVs in clutter for `duration_s`; the only target is 90 km away and faster than they are. No false track is
/// confirmed, and the memory in use does not grow.
fn check_clutter(duration_s: i64) {
    let duration = format!("duration_s={duration_s}");
    let distant = [
        duration.as_str(),
        "uavs.count=2",
        "uavs.start=[{}, {x_m=300}]",
        "targets={acceleration_sd_m_s2=0, start=[{x_m=9e4, vx_m_s=60}]}",
        "filter.acceleration_sd_m_s2=0",
        "filter.deletion_position_sd_m=1e4",
        "cue.velocity_sd_m_s=0.001",
    ];
    let mut mission = Mission::new(&load(TOUR, &distant, 1)).unwrap();
    let mut tracks = 0;
    let mut fly_until = |s: i64| {
        while mission.now().s() < s as f64 {
            let frame = mission.frame().unwrap();
            assert!(frame.time_us == 0 || frame.uavs.iter().all(|uav| uav.boresight_rad.is_some()));
            tracks += frame.tracks.iter().filter(|row| row.target >= NO_TARGET).count();
        }
    };
    fly_until(duration_s / 6);
    let used = allocation_counter::measure(|| fly_until(duration_s));
    assert_eq!(tracks, 0);
    assert!(used.bytes_current < 100_000, "{used:?}");
}
