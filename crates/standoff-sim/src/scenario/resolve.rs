//! Resolves a typed scenario: draws, fills in defaults and checks.

use std::sync::Arc;

use standoff::{
    BankParams, ClimbParams, Duration, ParamValue, Position, SensorParams, SeparationParams, TargetParams, TargetState,
    TeamParams, Velocity, Wind, WindParams,
};
use standoff_score::{Buildings, CueError};

use super::error::ScenarioError;
use super::load::Typed;
use super::number::Number;
use super::parameters::{self, DERIVED};
use super::resolved::{Scenario, SensorModel, Settings, Targets};
use super::sample::value;
use super::schema_types::{self, AgentSetup, Labels, Scatter, ScenarioFile, SpeedCommand, TargetAt};
use super::traffic::{absence_warning, check_span, length_warning};
use super::validate::{check_objects, check_settings, report};
use super::warnings::warnings;
use super::{basemap, buildings, geofence, priorities, start};
use crate::gusts::GustModel;
use crate::navigation::NavigationModel;
use crate::random::{Draws, Stream};
use crate::traffic::Traffic;
use crate::wind::WindModel;

/// Draws all values, fills in defaults and checks everything.
pub(super) fn resolve(typed: &Typed, traffic: Option<&Arc<Traffic>>, seed: u64) -> Result<Scenario, ScenarioError> {
    let (mut file, settings) = checked(typed, traffic.map(Arc::as_ref), seed)?;
    let targets = match (traffic, &mut file.targets) {
        (Some(traffic), _) => Targets::Traffic(Arc::clone(traffic)),
        (None, Some(targets)) => {
            if let Some(scatter) = targets.random.take() {
                let (sd_m_s2, draws) = (targets.acceleration_sd_m_s2, Draws::new(seed));
                let scattered =
                    (0..scatter.count as u64).map(|index| scattered_target(&scatter, index, sd_m_s2, draws));
                targets.start.extend(scattered);
            }
            random_targets(targets)
        }
        (None, None) => unreachable!("a scenario without targets is refused"),
    };
    let uavs = start::states(&mut file.uavs, &settings.team, &targets);
    let intruders = start::intruders(&mut file.intruders, &uavs, &settings.team);
    let mut warnings = warnings(&settings, &targets);
    warnings.extend(geofence::warnings(&settings, &uavs));
    warnings.extend(traffic.and_then(|traffic| length_warning(typed, &settings, traffic)));
    warnings.extend(traffic.and_then(|traffic| absence_warning(&settings, traffic)));
    warnings.extend(typed.notes.iter().cloned());
    warnings.extend(traffic.iter().flat_map(|traffic| traffic.notes.iter().cloned()));
    let late = file.uavs.boot_delay_s.unwrap_or_default();
    let draws = Draws::new(seed);
    let starts_s = (1..).take(uavs.len()).map(|nth| value(&late, &"uavs.boot_delay_s", draws, nth)).collect();
    Ok(Scenario {
        name: typed.name.clone(),
        seed,
        uavs,
        intruders,
        outages: file.uavs.outage.clone(),
        radio: file.radio.clone(),
        starts_s,
        restarts: file.uavs.restart.clone(),
        clocks: file.uavs.clock.clone(),
        map: basemap::files(typed),
        targets,
        warnings,
        settings,
        file,
    })
}

/// Draws, fills in and checks everything except for the starts of targets and UAVs that are not listed.
pub(super) fn checked(
    typed: &Typed,
    traffic: Option<&Traffic>,
    seed: u64,
) -> Result<(ScenarioFile, Settings), ScenarioError> {
    let (mut file, mut problems) = typed.drawn(Draws::new(seed))?;
    fill_in(&mut file, traffic);
    if let Some(traffic) = traffic {
        check_span(typed, file.period_s, traffic)?;
    }
    let mut settings = settings(&file);
    settings.geofence = geofence::geofence(&file.geofence, &mut problems);
    settings.buildings = buildings::buildings(file.world.as_ref(), &mut problems);
    let names = priorities::target_names(&file, traffic);
    settings.priorities = Arc::new(priorities::priorities(&file.priorities, &names, &mut problems));
    if file.needs_an_agent_per_uav() {
        settings.team.link = standoff::LinkModel::Lossy;
    }
    // A rejected bandwidth is not reported twice.
    let radio = file.radio.as_ref().filter(|_| problems.found.is_empty());
    settings.team.log.bandwidth_bytes_per_s = radio.and_then(|radio| radio.bandwidth_bytes_per_s);
    if settings.agents == AgentSetup::Shared && file.needs_an_agent_per_uav() {
        let what = "a single agent for all UAVs needs an ideal radio: with [radio], restarts, late starts or clocks \
                    set \"per-uav\", or leave out the key";
        problems.add("team.agents", what, None);
    }
    check_objects(&file, &mut problems);
    let over = settings.team.errors_for_period(settings.period);
    check_settings(&file, &settings.team, over, &mut problems);
    if problems.found.is_empty() {
        // With wrong parameters, the altitudes are wrong, too.
        geofence::check_altitudes(&settings.geofence, &settings.team, &file.uavs, &mut problems);
        geofence::check_room(&settings.geofence, &settings, &mut problems);
    }
    report(problems, typed, seed)?;
    Ok((file, settings))
}

/// Returns the settings of a resolved scenario, whatever version flew it, so that old records stay readable.
pub(super) fn settings_of_record(typed: &Typed, target_names: &[String]) -> Result<Settings, ScenarioError> {
    let (mut file, mut problems) = typed.drawn(Draws::new(0))?;
    fill_in(&mut file, None);
    // The starts of UAVs and intruders do not matter here: a ring about distant targets can exceed the range of typed
    // coordinates.
    problems.found.retain(|found| !found.key.contains(".start.") && !found.key.starts_with("intruders."));
    let mut settings = settings(&file);
    settings.geofence = geofence::geofence(&file.geofence, &mut problems);
    settings.buildings = buildings::buildings(file.world.as_ref(), &mut problems);
    settings.priorities = Arc::new(priorities::priorities(&file.priorities, target_names, &mut problems));
    check_settings(&file, &settings.team, Vec::new(), &mut problems);
    report(problems, typed, 0)?;
    Ok(settings)
}

/// Fills in the defaults that depend on other values.
fn fill_in(file: &mut ScenarioFile, traffic: Option<&Traffic>) {
    if file.duration_s.is_nan() {
        file.duration_s = traffic.map_or(100.0, Traffic::span_s);
    }
    if file.uavs.count.is_nan() {
        file.uavs.count = file.uavs.start.len().max(1) as f64;
    }
    for (key, _, default) in DERIVED {
        let default = default(file);
        file.parameters.entry(key).or_insert(ParamValue::Number(default));
    }
}

fn settings(file: &ScenarioFile) -> Settings {
    let manoeuvres = file.targets.iter().flat_map(|targets| &targets.manoeuvre);
    let (team, sensor) = (team(file), &file.sensor);
    Settings {
        about: file.about.clone(),
        duration: Duration::from_s(file.duration_s),
        period: Duration::from_s(file.period_s),
        transient: Duration::from_s(file.transient_s),
        gospa_cutoff_m: file.gospa_cutoff_m,
        team,
        geofence: standoff::Geofence::default(),
        buildings: Buildings::default(),
        priorities: Arc::default(),
        agents: file.team.agents,
        sensor: SensorModel {
            has_labels: sensor.labels == Labels::All,
            truth: SensorParams {
                range_sd_m: sensor.range_sd_m,
                bearing_sd_rad: sensor.bearing_sd_deg.to_radians(),
                detection_probability: sensor.detection_probability,
                mdv_m_s: sensor.mdv_m_s,
                false_alarms_per_scan: sensor.false_alarms_per_scan,
                ..team.track.sensor
            },
            range_rate_sd_m_s: sensor.range_rate_sd_m_s,
        },
        navigation: NavigationModel {
            position_sd_m: file.navigation.position_sd_m,
            correlation_s: file.navigation.correlation_s,
            heading_sd_rad: file.navigation.heading_bias_deg.to_radians(),
        },
        wind: file.wind.as_ref().map(|wind| WindModel {
            at_reference: Wind::blowing_from(wind.speed_m_s, wind.from_deg.to_radians()),
            reference_height_m: wind.reference_height_m,
            shear_exponent: wind.shear_exponent,
            gusts: (wind.gust_w20_m_s > 0.0)
                .then_some(GustModel { w20_m_s: wind.gust_w20_m_s, airspeed_m_s: team.uav.speed_m_s }),
        }),
        flies_equivalent_airspeed: file
            .uavs
            .bank
            .as_ref()
            .is_some_and(|bank| bank.speed_command == SpeedCommand::EquivalentAirspeed),
        cue: CueError { position_sd_m: file.cue.position_sd_m, velocity_sd_m_s: file.cue.velocity_sd_m_s },
        model: file.targets.as_ref().map(target_model),
        intruders: file.intruders.len(),
        manoeuvring: Arc::new(manoeuvres.map(|manoeuvre| manoeuvre.target as u32).collect()),
        faults_end_s: faults_end_s(file),
    }
}

/// Returns the team parameters. The library checks their ranges.
pub(super) fn team(file: &ScenarioFile) -> TeamParams {
    let mut team = TeamParams::recommended();
    team.log.period_s = file.period_s;
    team.separation = file.separation.is_on().then(SeparationParams::default);
    // Vertical separation needs simulated altitudes, and so do buildings, which hide less from above.
    let has_buildings = file.world.as_ref().is_some_and(|world| !world.building_outlines_cm.is_empty());
    let has_altitudes = file.uavs.climb.is_some() || file.separation.is_on() || has_buildings;
    team.uav.climb = has_altitudes.then(ClimbParams::default);
    team.uav.bank = file.uavs.bank.as_ref().map(|_| BankParams::default());
    team.wind = file.wind.as_ref().map(|_| WindParams::default());
    parameters::apply(&file.parameters, &mut team);
    team
}

/// See [`Settings::faults_end_s`].
fn faults_end_s(file: &ScenarioFile) -> Option<f64> {
    let partitions = file.radio.iter().flat_map(|radio| radio.partition.iter().map(|partition| partition.until_s));
    let radio = file.radio.iter().filter_map(|radio| radio.fault_until_s);
    let restarts = file.uavs.restart.iter().map(|restart| restart.at_s + restart.down_s);
    let ends_s = partitions.chain(radio).chain(restarts).filter(|end_s| *end_s <= file.duration_s);
    ends_s.reduce(f64::max)
}

fn target_model(targets: &schema_types::Targets) -> TargetParams {
    TargetParams {
        correlation_rate_1_s: targets.correlation_rate_1_s,
        acceleration_sd_m_s2: targets.acceleration_sd_m_s2,
    }
}

/// Draws one target of `[targets.random]`.
fn scattered_target(scatter: &Scatter, index: u64, acceleration_sd_m_s2: f64, draws: Draws) -> TargetAt {
    let of = |key: &str, number: &Number| value(number, &format_args!("targets.random.{key}"), draws, index + 1);
    let acceleration: [f64; 2] = draws.at(Stream::TargetMotion, index, 0).normals();
    let [ax_m_s2, ay_m_s2] = acceleration.map(|normal| normal * acceleration_sd_m_s2);
    TargetAt {
        x_m: of("x_m", &scatter.x_m),
        y_m: of("y_m", &scatter.y_m),
        vx_m_s: of("vx_m_s", &scatter.vx_m_s),
        vy_m_s: of("vy_m_s", &scatter.vy_m_s),
        ax_m_s2,
        ay_m_s2,
    }
}

/// Converts the listed targets.
fn random_targets(targets: &schema_types::Targets) -> Targets {
    let start = targets.start.iter().map(|at| {
        let position = Position::from_m(at.x_m, at.y_m);
        TargetState::new(position, Velocity::from_m_s(at.vx_m_s, at.vy_m_s), [at.ax_m_s2, at.ay_m_s2])
    });
    Targets::Random { model: target_model(targets), start: start.collect(), manoeuvres: targets.manoeuvre.clone() }
}
