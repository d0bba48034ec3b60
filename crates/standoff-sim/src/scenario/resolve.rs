//! From what was typed to what is run: draws, defaults, checks.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use standoff::{Duration, Integrator, Position, TargetId, TargetParams, TargetState, TeamParams, UavId, Velocity};

use super::check::{Problems, check_about, check_settings, check_step, check_who};
use super::error::ScenarioError;
use super::file::{self, ScenarioFile, TargetAt};
use super::load::{SPELT_OUT, Typed, check_size};
use super::number::{Number, of, value};
use super::team::team;
use super::traffic::{check_span, length_warning};
use super::{CueError, Manoeuvre, Noise, Outage, Scenario, Settings, Targets, start};
use crate::draws::{Draws, Stream};
use crate::traffic::Traffic;

/// Table I's T_s, s.
pub(super) const PERIOD_S: f64 = 0.5;

/// Draws, fills in and checks.
pub(super) fn resolve(typed: &Typed, traffic: Option<&Arc<Traffic>>, seed: u64) -> Result<Scenario, ScenarioError> {
    let draws = Draws::new(seed);
    let (mut file, settings) = checked(typed, traffic.map(Arc::as_ref), seed)?;
    let targets = match traffic {
        Some(traffic) => Targets::Traffic(Arc::clone(traffic)),
        None => random_targets(&mut file, draws),
    };
    let uavs = start::uavs(&mut file, &settings.team, &targets);
    let mut warnings = warnings(&settings.team, settings.period);
    warnings.extend(traffic.and_then(|traffic| length_warning(typed, &settings, traffic)));
    let outages = file.uavs.outage.iter().map(|outage| Outage {
        uav: UavId(value(&outage.uav) as u32),
        from_s: value(&outage.from_s),
        until_s: value(&outage.until_s),
    });
    Ok(Scenario {
        name: typed.name.clone(),
        about: file.about.clone(),
        seed,
        uavs,
        outages: outages.collect(),
        targets,
        warnings,
        settings,
        file,
    })
}

/// Everything drawn but the targets, filled in, and in its range.
pub(super) fn checked(
    typed: &Typed,
    traffic: Option<&Traffic>,
    seed: u64,
) -> Result<(ScenarioFile, Settings), ScenarioError> {
    let mut file = typed.file.clone();
    let mut problems = Problems::default();
    draw_numbers(&mut file, Draws::new(seed), &mut problems);
    if let Some(traffic) = traffic {
        check_span(typed, &file, traffic)?;
    }
    fill_in(&mut file, traffic);
    let settings = settings(&file);
    check_about(&file, &mut problems);
    check_who(&mut file, &mut problems);
    check_settings(&file, &settings.team, &mut problems);
    check_step(&settings, &mut problems);
    problems.report(typed, &file, seed)?;
    Ok((file, settings))
}

/// The settings of a scenario in which everything is spelt out.
pub(super) fn settings_of_record(mut typed: Typed) -> Result<Settings, ScenarioError> {
    let mut problems = Problems::default();
    fill_in(&mut typed.file, None);
    let settings = settings(&typed.file);
    check_settings(&typed.file, &settings.team, &mut problems);
    problems.report(&typed, &typed.file, 0)?;
    Ok(settings)
}

fn settings(file: &ScenarioFile) -> Settings {
    let manoeuvres = file.targets.iter().flat_map(|targets| &targets.manoeuvre);
    Settings {
        duration: Duration::from_s(of(&file.duration_s)),
        period: Duration::from_s(of(&file.period_s)),
        settle: Duration::from_s(of(&file.settle_s)),
        team: team(file),
        minds: file.team.minds,
        noise: Noise {
            range_sd_m: value(&file.sensor.range_sd_m),
            bearing_sd_rad: value(&file.sensor.bearing_sd_deg).to_radians(),
        },
        cue: CueError {
            position_sd_m: value(&file.cue.position_sd_m),
            velocity_sd_m_s: value(&file.cue.velocity_sd_m_s),
        },
        model: file.targets.as_ref().map(target_model),
        manoeuvring: Arc::new(
            manoeuvres.map(|manoeuvre| (value(&manoeuvre.target) as u32).saturating_sub(1)).collect(),
        ),
    }
}

fn target_model(targets: &file::Targets) -> TargetParams {
    TargetParams {
        correlation_rate_1_s: value(&targets.correlation_rate_1_s),
        acceleration_sd_m_s2: value(&targets.acceleration_sd_m_s2),
    }
}

/// Every number drawn, in place. A draw depends on the seed and the key alone.
fn draw_numbers(file: &mut ScenarioFile, draws: Draws, problems: &mut Problems) {
    // Most numbers are constants: keys are spelt out for the others only.
    let mut draw = |key: fmt::Arguments, number: &mut Number| match number.problem() {
        Some(problem) => problems.replace(key.to_string(), problem, number),
        None if matches!(number, Number::Constant(_)) => {}
        None => {
            let key = key.to_string();
            let drawn = number.draw(&mut draws.at(Stream::Scenario, hash(&key), 0));
            *number = Number::Constant(if key.ends_with(".count") { drawn.round() } else { drawn });
        }
    };
    let tables = [
        ("uavs", file.uavs.numbers()),
        ("team", file.team.numbers()),
        ("sensor", file.sensor.numbers()),
        ("filter", file.filter.numbers()),
        ("cue", file.cue.numbers()),
        ("orbit", file.orbit.numbers()),
        ("groups", file.groups.numbers()),
        ("guidance", file.guidance.numbers()),
    ];
    for (table, numbers) in tables {
        for (key, number) in numbers {
            draw(format_args!("{table}.{key}"), number);
        }
    }
    for (index, at) in file.uavs.at.iter_mut().enumerate() {
        for (key, number) in at.numbers() {
            draw(format_args!("uavs.at.{index}.{key}"), number);
        }
    }
    for (index, outage) in file.uavs.outage.iter_mut().enumerate() {
        for (key, number) in outage.numbers() {
            draw(format_args!("uavs.outage.{index}.{key}"), number);
        }
    }
    if let Some(targets) = &mut file.targets {
        for (key, number) in targets.numbers() {
            draw(format_args!("targets.{key}"), number);
        }
        for (index, at) in targets.at.iter_mut().enumerate() {
            for (key, number) in at.numbers() {
                draw(format_args!("targets.at.{index}.{key}"), number);
            }
        }
        for (index, manoeuvre) in targets.manoeuvre.iter_mut().enumerate() {
            for (key, number) in manoeuvre.numbers() {
                draw(format_args!("targets.manoeuvre.{index}.{key}"), number);
            }
        }
        for (key, number) in targets.scatter.iter_mut().flat_map(|scatter| scatter.numbers()) {
            match key {
                "count" => draw(format_args!("targets.scatter.{key}"), number),
                // Drawn once for each target, later; here only looked at.
                _ => draw(format_args!("targets.scatter.{key}"), &mut number.clone()),
            }
        }
    }
    let filter = &mut file.filter;
    let optional = [
        ("uavs.count", &mut file.uavs.count),
        ("duration_s", &mut file.duration_s),
        ("period_s", &mut file.period_s),
        ("settle_s", &mut file.settle_s),
        ("filter.correlation_rate_1_s", &mut filter.correlation_rate_1_s),
        ("filter.acceleration_sd_m_s2", &mut filter.acceleration_sd_m_s2),
        ("filter.range_sd_m", &mut filter.range_sd_m),
        ("filter.bearing_sd_deg", &mut filter.bearing_sd_deg),
    ];
    let ring = file.uavs.ring.iter_mut().flat_map(|ring| {
        [
            ("uavs.ring.radius_m", &mut ring.radius_m),
            ("uavs.ring.phase_deg", &mut ring.phase_deg),
            ("uavs.ring.spacing_deg", &mut ring.spacing_deg),
        ]
    });
    let gap = file.traffic.iter_mut().map(|traffic| ("traffic.gap_s", &mut traffic.gap_s));
    for (key, number) in optional.into_iter().chain(ring).chain(gap) {
        if let Some(number) = number {
            draw(format_args!("{key}"), number);
        }
    }
}

/// Spells out every default that depends on something else.
fn fill_in(file: &mut ScenarioFile, traffic: Option<&Traffic>) {
    let spelt = |number: &mut Option<Number>, default: f64| {
        number.get_or_insert(Number::Constant(default));
    };
    spelt(&mut file.period_s, PERIOD_S);
    spelt(&mut file.duration_s, traffic.map_or(100.0, Traffic::span_s));
    spelt(&mut file.settle_s, 30.0);
    // Measured cars: 0.2-0.5 1/s and 0.5-1 m/s2 per axis.
    let model = file
        .targets
        .as_ref()
        .map_or((0.3, 0.75), |targets| (value(&targets.correlation_rate_1_s), value(&targets.acceleration_sd_m_s2)));
    spelt(&mut file.filter.correlation_rate_1_s, model.0);
    spelt(&mut file.filter.acceleration_sd_m_s2, model.1);
    let or_table_1 = |noise: f64, table_1: f64| if noise > 0.0 { noise } else { table_1 };
    spelt(&mut file.filter.range_sd_m, or_table_1(value(&file.sensor.range_sd_m), 10.0));
    spelt(&mut file.filter.bearing_sd_deg, or_table_1(value(&file.sensor.bearing_sd_deg), 3.0));
    if file.uavs.count.is_none() {
        file.uavs.count = Some(Number::Constant(file.uavs.at.len().max(1) as f64));
    }
}

/// The random targets' first states, spelt out in the file as `[[targets.at]]`.
fn random_targets(file: &mut ScenarioFile, draws: Draws) -> Targets {
    let targets = file.targets.get_or_insert_default();
    let model = target_model(targets);
    if let Some(scatter) = targets.scatter.take() {
        for index in 0..value(&scatter.count) as u64 {
            let draw = |key: &str, number: Number| {
                Number::Constant(number.draw(&mut draws.at(Stream::Scenario, hash(key), index + 1)))
            };
            let acceleration: [f64; 2] = draws.at(Stream::TargetMotion, index, 0).normals();
            let acceleration = acceleration.map(|normal| normal * model.acceleration_sd_m_s2);
            targets.at.push(TargetAt {
                x_m: draw("targets.scatter.x_m", scatter.x_m),
                y_m: draw("targets.scatter.y_m", scatter.y_m),
                vx_m_s: draw("targets.scatter.vx_m_s", scatter.vx_m_s),
                vy_m_s: draw("targets.scatter.vy_m_s", scatter.vy_m_s),
                ax_m_s2: acceleration[0].into(),
                ay_m_s2: acceleration[1].into(),
            });
        }
    }
    let start = targets.at.iter().map(|at| {
        let position = Position::from_m(value(&at.x_m), value(&at.y_m));
        let velocity = Velocity::from_m_s(value(&at.vx_m_s), value(&at.vy_m_s));
        TargetState::new(position, velocity, [value(&at.ax_m_s2), value(&at.ay_m_s2)])
    });
    let manoeuvres = targets.manoeuvre.iter().map(|manoeuvre| Manoeuvre {
        target: TargetId(value(&manoeuvre.target) as u32 - 1),
        from_s: value(&manoeuvre.from_s),
        until_s: value(&manoeuvre.until_s),
        acceleration_m_s2: [value(&manoeuvre.ax_m_s2), value(&manoeuvre.ay_m_s2)],
    });
    Targets::Random { model, start: start.collect(), manoeuvres: manoeuvres.collect() }
}

fn warnings(team: &TeamParams, period: Duration) -> Vec<String> {
    let modulus = team.uav.heading_loop_modulus(team.guidance.heading_gain_1_s, period);
    let mut warnings = Vec::new();
    if modulus > 1.0 - 1e-6 {
        let euler = match team.uav.integrator {
            Integrator::Euler => " (Euler needs guidance.heading_gain_1_s * period_s below 1)",
            Integrator::Exact => "",
        };
        warnings.push(format!(
            "the heading loop is not stable at this period: its largest eigenvalue has modulus {modulus:.3}, \
             it must be below 1{euler}"
        ));
    }
    warnings
}

/// A file in which every value is spelt out, as text that can be read again. Paths stay behind: a record says what was
/// flown, not where.
pub(super) fn text(name: &str, file: &ScenarioFile) -> Result<String, ScenarioError> {
    let mut file = file.clone();
    if let Some(traffic) = &mut file.traffic {
        let name = Path::new(&traffic.file).file_name();
        traffic.file = name.map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    }
    let text = toml::to_string(&file).map_err(|error| ScenarioError::one(name, None, error.to_string()))?;
    check_size(name, &text, SPELT_OUT)?;
    Ok(text)
}

/// A stable hash of a key (FNV-1a).
fn hash(key: &str) -> u64 {
    key.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
