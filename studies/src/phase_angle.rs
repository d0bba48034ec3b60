//! Figures 6 and 7: information (36) of a pair of UAVs about a target away from the centre of their orbit.

use standoff::guidance::pair_information::equal_accuracy_range_m;
use standoff::guidance::pair_information::optimal_phase_difference_rad;
use standoff::guidance::pair_information::pair_information_1_m4;
use standoff::guidance::pair_information::pair_information_at_1_m4;
use standoff::{Angle, Displacement, Position, SensorParams, TeamParams};
use standoff_view::figures::study::{Line, Plot};

use super::claim::{Claim, shown};
use super::monte_carlo_plan::Plan;
use super::statistics::mean;
use super::study::{Data, Study, Table, line, plot};
use crate::error::Failure;

/// Radius of the orbit in both figures, m.
const ORBIT_M: f64 = 400.0;
/// Distances of the target from the centre in the figures, m.
const TARGETS_M: [f64; 4] = [0.0, 60.0, 120.0, 180.0];
/// Values of sigma_scale = r_d sigma_theta / sigma_r in figure 7: nearly bearing only, both, nearly range only.
const SCALES: [f64; 3] = [0.01, 1.0, 100.0];
/// Reason why 90 degrees is not optimal, for each value of `SCALES`.
const REASONS: [&str; 3] = [
    "bearings at which both UAVs are close to the target dominate the mean over the bearing, and a smaller phase \
     difference brings both UAVs close at the same time; the paper notes the change itself, earlier in the same \
     paragraph",
    "the same, and r* equals the radius of the orbit: often one UAV is closer to the target than r* and the other \
     further, where 90 degrees is worst",
    "",
];
/// Relative difference below which two values are considered equal.
const ROUNDING: f64 = 1e-9;
/// Maximum deviation of an angle that the paper calls "around 90°", degrees.
const ABOUT_DEG: f64 = 10.0;

/// Computes figure 6: eta as a function of the target's bearing.
pub(crate) fn figure_6(_: &Plan) -> Result<Study, Failure> {
    let mut figure = Study::new(
        "figure-6",
        "Figure 6: information of a pair by the target's bearing",
        "Both UAVs are on an orbit of 400 m, the first due east of the centre, the second ahead of it by the phase \
         difference; sigma_scale = r_d sigma_theta / sigma_r = 1. eta is normalised by its value for a target at the \
         centre and a phase difference of 90 degrees.",
    );
    let bearings_deg = || (0..=360).map(f64::from);
    let eta = |phase_deg: f64, target_m: f64, bearing_deg: f64| normalised(1.0, phase_deg, target_m, bearing_deg);
    let by_bearing = |phase_deg: f64| {
        let line = |target_m: f64| bearings_deg().map(move |deg| (deg, eta(phase_deg, target_m, deg)));
        plot("Bearing of the target (°)", format!("η, phase difference {phase_deg:.0}°"), by_target(line))
    };
    let plots = [0.0, 90.0, 180.0].map(by_bearing);
    let heading = "Information of a pair of UAVs by the target's bearing (figure 6)";
    figure.draw("figure-6", heading, "sigma_scale = 1, orbit of 400 m", &plots)?;
    let row = |deg: f64| {
        let cells = [0.0, 90.0, 180.0].into_iter().flat_map(|phase_deg| TARGETS_M.map(|m| eta(phase_deg, m, deg)));
        [deg].into_iter().chain(cells).collect()
    };
    let mut columns = "bearing_deg".to_owned();
    for deg in [0, 90, 180] {
        TARGETS_M.iter().for_each(|m| columns += &format!(",eta_phase_{deg}_deg_target_{m}_m"));
    }
    figure.data.push(Data::new("figure-6", columns, bearings_deg().map(row)));

    let furthest_m = TARGETS_M[3];
    let best = |sign: f64| best_of(0..=360, |deg| sign * eta(0.0, furthest_m, deg)).0;
    let worst = bearings_deg().map(|deg| (eta(0.0, furthest_m, deg) - eta(0.0, furthest_m, 360.0 - deg)).abs());
    let claim = |what: &str, unit, numbers, ours| Claim::computed(what, unit, numbers, ours, "");
    figure.claims = vec![
        claim("both UAVs at one place, target at 180 m: bearing at which eta is largest", "deg", [0.0, 1.0], best(1.0)),
        claim("bearing at which eta is smallest", "deg", [180.0, 1.0], best(-1.0)),
        claim("eta is symmetric about 180 deg: largest difference", "", [0.0, 1e-3], worst.fold(0.0, f64::max)),
    ];
    Ok(figure)
}

/// Computes figure 7: the mean of eta over the bearing, and the cases where 90 degrees is not optimal.
pub(crate) fn figure_7(_: &Plan) -> Result<Study, Failure> {
    let mut figure = Study::new(
        "figure-7",
        "Figure 7: where 90 degrees is optimal",
        "eta averaged over the target's bearing, for three sensors. For one target, [90 degrees is \
         optimal](method.md#phase-of-two-uavs-on-one-orbit-35-36) if both UAVs are closer than r* = sigma_r / sigma_theta or \
         both are further away.",
    );
    let by_phase = |scale: f64| {
        let line = |target_m: f64| (0..=180).map(f64::from).map(move |deg| (deg, averaged(scale, deg, target_m)));
        plot("Phase difference (°)", format!("mean η, σ_scale {scale}"), by_target(line))
    };
    let heading = "Information of a pair of UAVs, mean over the target's bearing (figure 7)";
    figure.draw("figure-7", heading, "orbit of 400 m", &SCALES.map(by_phase))?;

    let sensor = TeamParams::paper().track.sensor;
    let optima = optima();
    figure.claims = claims(&sensor, &optima);
    figure.tables = vec![table_of_optima(&optima), pairs(&sensor)];
    let row = |at: &Optimum| vec![at.scale, at.target_m, at.phase_difference_deg, at.gain];
    figure.data.push(Data::new(
        "figure-7",
        "sigma_scale,target_m,optimal_phase_difference_deg,eta_over_eta_at_90_deg",
        optima.iter().map(row),
    ));
    two_ranges(&mut figure, &sensor)?;
    Ok(figure)
}

/// Optimal phase difference for a sensor and a distance of the target from the centre.
struct Optimum {
    scale: f64,
    target_m: f64,
    /// NaN if eta is constant.
    phase_difference_deg: f64,
    /// Eta there, divided by eta at 90 degrees.
    gain: f64,
}

/// Computes the optima of every sensor, every 20 m.
fn optima() -> Vec<Optimum> {
    let optimum = |scale, target_m| {
        let (phase_difference_deg, most) = best_of(0..=180, |deg| averaged(scale, deg, target_m));
        Optimum { scale, target_m, phase_difference_deg, gain: most / averaged(scale, 90.0, target_m) }
    };
    let distances_m = || (0..=180).step_by(20).map(f64::from);
    SCALES.into_iter().flat_map(|scale| distances_m().map(move |target_m| optimum(scale, target_m))).collect()
}

/// Creates the table of the optima for the distances of the figures.
fn table_of_optima(optima: &[Optimum]) -> Table {
    let mut table = Table::new(
        "Optimal phase difference by sensor and distance of the target from the centre:",
        ["sigma_scale", "target (m)", "optimal phase difference (deg)", "eta there / eta at 90 deg"],
    );
    for at in optima.iter().filter(|at| TARGETS_M.contains(&at.target_m)) {
        let deg = at.phase_difference_deg;
        let angle = if deg.is_nan() { "any".to_owned() } else { format!("{deg:.0}") };
        table.add(at.scale.to_string(), [at.target_m.to_string(), angle, shown(at.gain)]);
    }
    table
}

/// Creates the claims of figure 7.
fn claims(sensor: &SensorParams, optima: &[Optimum]) -> Vec<Claim> {
    let alone = optimal_phase_difference_rad([ORBIT_M; 2], sensor).unwrap_or(f64::NAN).to_degrees();
    let mut claims = vec![Claim::computed(
        "one target, both UAVs at the same range: the optimal phase difference",
        "deg",
        [90.0, 1.0],
        alone,
        "",
    )];
    for (at, reason) in optima.iter().filter(|at| at.target_m == TARGETS_M[3]).zip(REASONS) {
        claims.push(Claim::computed(
            format!("\"the optimal angle still stays around 90°\": target at 180 m, sigma_scale {}", at.scale),
            "deg",
            [90.0, ABOUT_DEG],
            at.phase_difference_deg,
            reason,
        ));
    }
    let ranging = optima.iter().filter(|at| at.scale == 100.0);
    claims.push(Claim::computed(
        "sigma_scale 100: the optimal phase difference stays around 90 deg at any distance; largest deviation",
        "deg",
        [0.0, ABOUT_DEG],
        ranging.map(|at| (at.phase_difference_deg - 90.0).abs()).fold(0.0, f64::max),
        "",
    ));
    let etas = (0..=180).map(|deg| averaged(1.0, f64::from(deg), 100.0));
    let (low, high) = etas.fold((f64::INFINITY, 0.0f64), |(low, high), eta| (low.min(eta), high.max(eta)));
    claims.push(Claim::computed(
        "sigma_scale 1: up to 100 m, eta depends on the distance only; largest change by the phase difference",
        "%",
        [0.0, 5.0],
        100.0 * (high / low - 1.0),
        "the phase difference changes eta, although much less than the distance does",
    ));
    claims
}

/// Creates the table of optimal phase differences of two UAVs at unequal ranges from one target, with the sensor of
/// Table I.
fn pairs(sensor: &SensorParams) -> Table {
    const RANGES_M: [f64; 6] = [100.0, 150.0, 180.0, 200.0, 250.0, 400.0];
    let title = format!(
        "One target, sensor of Table I (r* = {:.0} m): optimal phase difference by the ranges of the two UAVs, and eta \
         there divided by eta at the other one of 0 and 90 degrees:",
        equal_accuracy_range_m(sensor)
    );
    let names: Vec<String> = RANGES_M.iter().map(|range_m| format!("{range_m} m")).collect();
    let mut table = Table::new(title, ["ranges"].into_iter().chain(names.iter().map(String::as_str)));
    for (name, first_m) in names.iter().zip(RANGES_M) {
        let cell = |second_m: f64| {
            let ranges_m = [first_m, second_m];
            let best_rad = optimal_phase_difference_rad(ranges_m, sensor).unwrap_or(f64::NAN);
            let eta = |rad: f64| pair_information_1_m4(ranges_m, rad, sensor);
            let other_rad = 90f64.to_radians() - best_rad;
            format!("{:.0}°, {:.2}", best_rad.to_degrees(), eta(best_rad) / eta(other_rad))
        };
        table.add(name, RANGES_M.map(cell));
    }
    table
}

/// Draws the ratio of eta at 0 degrees to eta at 90 degrees as a function of the range of the second UAV.
fn two_ranges(figure: &mut Study, sensor: &SensorParams) -> Result<(), Failure> {
    let lines = (0..).zip([100.0, equal_accuracy_range_m(sensor), 300.0, 400.0]).map(|(colour, first_m)| {
        let points = (50..=600).step_by(5).map(f64::from).map(|second_m| {
            let eta = |deg: f64| pair_information_1_m4([first_m, second_m], deg.to_radians(), sensor);
            (second_m, eta(0.0) / eta(90.0))
        });
        line(format!("first UAV at {first_m:.0} m"), colour, points)
    });
    let levels = vec![(1.0, "equal information".to_owned())];
    let plot = Plot { levels, ..plot("Range of the second UAV (m)", "η at 0° / η at 90°", lines) };
    let heading = "Information of two UAVs in line relative to that at a right angle (36)";
    figure.draw("figure-7-ranges", heading, "sensor of Table I", &[plot])
}

/// Creates a line for each distance of the target from the centre.
fn by_target<Points: Iterator<Item = (f64, f64)>>(points: impl Fn(f64) -> Points) -> impl Iterator<Item = Line> {
    (0..).zip(TARGETS_M).map(move |(colour, m)| line(format!("target at {m:.0} m"), colour, points(m)))
}

/// Returns a sensor with the range noise of Table I and the bearing noise for this sigma_scale on the orbit.
fn sensor(scale: f64) -> SensorParams {
    let sensor = TeamParams::paper().track.sensor;
    SensorParams { bearing_sd_rad: scale * sensor.range_sd_m / ORBIT_M, ..sensor }
}

/// Computes eta for a target at this distance and bearing, divided by eta at the centre with a phase difference of 90
/// degrees.
fn normalised(scale: f64, phase_deg: f64, target_m: f64, bearing_deg: f64) -> f64 {
    let sensor = sensor(scale);
    let at = |distance_m, deg| Position::ORIGIN + Displacement::from_polar(distance_m, Angle::from_deg(deg));
    let eta = pair_information_at_1_m4([at(ORBIT_M, 0.0), at(ORBIT_M, phase_deg)], at(target_m, bearing_deg), &sensor);
    eta / pair_information_1_m4([ORBIT_M; 2], 90f64.to_radians(), &sensor)
}

/// Computes the mean of [`normalised`] over bearings of whole degrees.
fn averaged(scale: f64, phase_deg: f64, target_m: f64) -> f64 {
    let etas: Vec<f64> = (0..360).map(|deg| normalised(scale, phase_deg, target_m, f64::from(deg))).collect();
    mean(&etas)
}

/// Returns the first whole degree at which `eta` is largest (NaN if it is constant), and its value there.
fn best_of(degrees: std::ops::RangeInclusive<i32>, eta: impl Fn(f64) -> f64) -> (f64, f64) {
    let all: Vec<(f64, f64)> = degrees.map(|deg| (f64::from(deg), eta(f64::from(deg)))).collect();
    let best = all.iter().copied().reduce(|best, next| if next.1 > best.1 { next } else { best });
    let (deg, most) = best.unwrap_or((f64::NAN, f64::NAN));
    let matters = all.iter().any(|other| (other.1 - most).abs() > ROUNDING * most.abs());
    (if matters { deg } else { f64::NAN }, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks Eq. (36) averaged over the bearing: at 180 m from the centre the optimal phase difference is 55, 41 and
    /// 86 degrees for the three sensors; eta there is 1.52, 1.10 and nearly 1 times its value at 90 degrees.
    #[test]
    fn away_from_the_centre_ninety_degrees_is_not_optimal() {
        for (scale, best_deg, gain) in [(0.01, 55.0, 1.52), (1.0, 41.0, 1.10), (100.0, 86.0, 1.00)] {
            let (deg, most) = best_of(0..=180, |deg| averaged(scale, deg, 180.0));
            assert_eq!(deg, best_deg, "sigma_scale {scale}");
            assert!((most / averaged(scale, 90.0, 180.0) - gain).abs() < 0.005, "sigma_scale {scale}");
        }
        assert!((averaged(1.0, 90.0, 0.0) - 1.0).abs() < 1e-12);
    }
}
