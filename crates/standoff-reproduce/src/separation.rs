//! Figures 6 and 7: what a pair of UAVs tells about a target beside the centre of their orbit, by separation (36).

use standoff::guidance::pair_information::{
    best_separation_rad, even_range_m, pair_information_1_m4, pair_information_at_1_m4,
};
use standoff::{Angle, Displacement, Position, SensorParams, TeamParams};
use standoff_view::figures::study::{Line, Plot};

use super::claim::{Claim, shown};
use super::flights::Plan;
use super::statistics::mean;
use super::study::{Data, Study, Table, line, plot};
use crate::failure::Failure;

/// The orbit of both figures, m.
const ORBIT_M: f64 = 400.0;
/// Distances of the target from the centre that are drawn, m.
const TARGETS_M: [f64; 4] = [0.0, 60.0, 120.0, 180.0];
/// sigma_scale = r_d sigma_theta / sigma_r of figure 7: near bearing only, both, near range only.
const SCALES: [f64; 3] = [0.01, 1.0, 100.0];
/// Why 90 degrees is not best there, by sensor.
const REASONS: [&str; 3] = [
    "the mean over the bearing is dominated by bearings at which both UAVs are near the target, and a smaller separation \
     brings both near at once; the paper notes the change itself, earlier in the same paragraph",
    "the same, and r* is the orbit's radius: often one UAV is nearer to the target than r* and the other further, where \
     90 degrees is worst",
    "",
];
/// Values that differ by less than this share of them differ by rounding.
const ROUNDING: f64 = 1e-9;
/// Within so many degrees of 90 an angle is about 90 degrees.
const ABOUT_DEG: f64 = 10.0;

/// Figure 6: eta against the target's bearing.
pub(crate) fn figure_6(_: &Plan) -> Result<Study, Failure> {
    let mut figure = Study::new(
        "figure-6",
        "Figure 6: information of a pair by the target's bearing",
        "Both UAVs are on an orbit of 400 m, the first due east of the centre, the second ahead of it by the separation; \
         sigma_scale = r_d sigma_theta / sigma_r = 1. Normalised by a target at the centre and a separation of 90 \
         degrees.",
    );
    let bearings_deg = || (0..=360).map(f64::from);
    let eta =
        |separation_deg: f64, target_m: f64, bearing_deg: f64| normalised(1.0, separation_deg, target_m, bearing_deg);
    let by_bearing = |separation_deg: f64| {
        let line = |target_m: f64| bearings_deg().map(move |deg| (deg, eta(separation_deg, target_m, deg)));
        plot("Bearing of the target (°)", format!("η, separation {separation_deg:.0}°"), by_target(line))
    };
    let plots = [0.0, 90.0, 180.0].map(by_bearing);
    let heading = "Information of a pair against the target's bearing (figure 6)";
    figure.draw("figure-6", heading, "sigma_scale = 1, orbit of 400 m", &plots)?;
    let row = |deg: f64| {
        let cells = [0.0, 90.0, 180.0].into_iter().flat_map(|separation| TARGETS_M.map(|m| eta(separation, m, deg)));
        [deg].into_iter().chain(cells).collect()
    };
    let mut columns = "bearing_deg".to_owned();
    for deg in [0, 90, 180] {
        TARGETS_M.iter().for_each(|m| columns += &format!(",eta_separation_{deg}_deg_target_{m}_m"));
    }
    figure.data.push(Data::new("figure-6", columns, bearings_deg().map(row)));

    let furthest_m = TARGETS_M[3];
    let best = |sign: f64| best_of(0..=360, |deg| sign * eta(0.0, furthest_m, deg)).0;
    let worst = bearings_deg().map(|deg| (eta(0.0, furthest_m, deg) - eta(0.0, furthest_m, 360.0 - deg)).abs());
    let claim = |what: &str, unit, numbers, ours| Claim::computed(what, unit, numbers, ours, "");
    figure.claims = vec![
        claim("both UAVs in one place, target at 180 m: eta is largest at the bearing", "deg", [0.0, 1.0], best(1.0)),
        claim("and smallest at the bearing", "deg", [180.0, 1.0], best(-1.0)),
        claim("it is symmetrical about 180 deg: largest difference", "", [0.0, 1e-3], worst.fold(0.0, f64::max)),
    ];
    Ok(figure)
}

/// Figure 7: its mean over the bearing, and where 90 degrees is not best.
pub(crate) fn figure_7(_: &Plan) -> Result<Study, Failure> {
    let mut figure = Study::new(
        "figure-7",
        "Figure 7: where 90 degrees is best",
        "The same, averaged over the target's bearing, for three sensors. For one target, (36) is right as printed, and \
         its slope over cos^2 gamma is -(a - b_1)(a - b_2) with a = 1/sigma_r^2, b_i = 1/(r_i sigma_theta)^2: 90 degrees \
         is best while both UAVs are nearer than r* = sigma_r / sigma_theta or both further (191 m with Table I), 0 or \
         180 degrees with one on either side, and at r* separation does not matter.",
    );
    let by_separation = |scale: f64| {
        let line = |target_m: f64| (0..=180).map(f64::from).map(move |deg| (deg, averaged(scale, deg, target_m)));
        plot("Separation (°)", format!("mean η, σ_scale {scale}"), by_target(line))
    };
    let plots = SCALES.map(by_separation);
    let heading = "Information of a pair, mean over the target's bearing (figure 7)";
    figure.draw("figure-7", heading, "orbit of 400 m", &plots)?;

    let mut table = Table::new(
        "Best separation by sensor and distance of the target from the centre:",
        ["sigma_scale", "target (m)", "best separation (deg)", "eta there over eta at 90 deg"],
    );
    let mut rows = Vec::new();
    let mut best_at_edge = Vec::new();
    for scale in SCALES {
        for target_m in (0..=180).step_by(20).map(f64::from) {
            let (best_deg, most) = best_of(0..=180, |deg| averaged(scale, deg, target_m));
            let gain = most / averaged(scale, 90.0, target_m);
            rows.push(vec![scale, target_m, best_deg, gain]);
            if target_m == TARGETS_M[3] {
                best_at_edge.push(best_deg);
            }
            if TARGETS_M.contains(&target_m) {
                let angle = if best_deg.is_nan() { "any".to_owned() } else { format!("{best_deg:.0}") };
                table.rows.push(vec![scale.to_string(), target_m.to_string(), angle, shown(gain)]);
            }
        }
    }
    let away_deg = |row: &&Vec<f64>| (row[2] - 90.0).abs();
    let ranging = rows.iter().filter(|row| row[0] == 100.0).map(|row| away_deg(&row)).fold(0.0, f64::max);
    figure.data.push(Data::new("figure-7", "sigma_scale,target_m,best_separation_deg,eta_over_eta_at_90_deg", rows));
    let etas: Vec<f64> = (0..=180).map(|deg| averaged(1.0, f64::from(deg), 100.0)).collect();
    let spread = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(*v), high.max(*v)));
        100.0 * (high / low - 1.0)
    };
    let sensor = TeamParams::table_1().track.sensor;
    let alone = best_separation_rad([ORBIT_M; 2], &sensor).unwrap_or(f64::NAN).to_degrees();

    figure.claims.push(Claim::computed(
        "one target, both UAVs equally far: the best separation",
        "deg",
        [90.0, 1.0],
        alone,
        "",
    ));
    for ((scale, best_deg), reason) in SCALES.into_iter().zip(best_at_edge).zip(REASONS) {
        figure.claims.push(Claim::computed(
            format!("\"the optimal angle still stays around 90°\": target at 180 m, sigma_scale {scale}"),
            "deg",
            [90.0, ABOUT_DEG],
            best_deg,
            reason,
        ));
    }
    figure.claims.push(Claim::computed(
        "sigma_scale 100: the best separation stays about 90 deg at any distance; largest deviation",
        "deg",
        [0.0, ABOUT_DEG],
        ranging,
        "",
    ));
    figure.claims.push(Claim::computed(
        "sigma_scale 1: up to 100 m eta depends on the distance alone; most that separation changes it",
        "%",
        [0.0, 5.0],
        spread(&etas),
        "separation does change it, if little beside what distance does",
    ));
    figure.tables = vec![table, pairs(&sensor)];
    two_ranges(&mut figure, &sensor)?;
    Ok(figure)
}

/// Best separations of two UAVs at unequal ranges from one target, Table I's sensor.
fn pairs(sensor: &SensorParams) -> Table {
    const RANGES_M: [f64; 6] = [100.0, 150.0, 180.0, 200.0, 250.0, 400.0];
    let title = format!(
        "One target, Table I's sensor (r* = {:.0} m): best separation by the ranges of the two UAVs, and eta there over \
         eta at the other of 0 and 90 degrees:",
        even_range_m(sensor)
    );
    let names: Vec<String> = RANGES_M.iter().map(|range_m| format!("{range_m} m")).collect();
    let mut table = Table::new(title, ["ranges"].into_iter().chain(names.iter().map(String::as_str)));
    for (name, first_m) in names.iter().zip(RANGES_M) {
        let cell = |second_m: f64| {
            let ranges_m = [first_m, second_m];
            let best_rad = best_separation_rad(ranges_m, sensor).unwrap_or(f64::NAN);
            let eta = |rad: f64| pair_information_1_m4(ranges_m, rad, sensor);
            let other_rad = 90f64.to_radians() - best_rad;
            format!("{:.0}°, {:.2}", best_rad.to_degrees(), eta(best_rad) / eta(other_rad))
        };
        table.add(name, RANGES_M.map(cell));
    }
    table
}

/// Whether 0 or 90 degrees tells more, against the range of the second UAV.
fn two_ranges(figure: &mut Study, sensor: &SensorParams) -> Result<(), Failure> {
    let lines = (0..).zip([100.0, even_range_m(sensor), 300.0, 400.0]).map(|(colour, first_m)| {
        let points = (50..=600).step_by(5).map(f64::from).map(|second_m| {
            let eta = |deg: f64| pair_information_1_m4([first_m, second_m], deg.to_radians(), sensor);
            (second_m, eta(0.0) / eta(90.0))
        });
        line(format!("first UAV at {first_m:.0} m"), colour, points)
    });
    let levels = vec![(1.0, "both tell as much".to_owned())];
    let plot = Plot { levels, ..plot("Range of the second UAV (m)", "η at 0° over η at 90°", lines) };
    let heading = "Where two UAVs in line tell more of a target than at a right angle (36)";
    figure.draw("figure-7-ranges", heading, "Table I's sensor", &[plot])
}

/// A line for every distance of the target from the centre.
fn by_target<Points: Iterator<Item = (f64, f64)>>(points: impl Fn(f64) -> Points) -> impl Iterator<Item = Line> {
    (0..).zip(TARGETS_M).map(move |(colour, m)| line(format!("target at {m:.0} m"), colour, points(m)))
}

/// Table I's range noise, and the bearing noise that gives sigma_scale on the orbit.
fn sensor(scale: f64) -> SensorParams {
    let sensor = TeamParams::table_1().track.sensor;
    SensorParams { bearing_sd_rad: scale * sensor.range_sd_m / ORBIT_M, ..sensor }
}

/// eta of a target so far from the centre, over that of one at the centre with 90 degrees between the UAVs.
fn normalised(scale: f64, separation_deg: f64, target_m: f64, bearing_deg: f64) -> f64 {
    let sensor = sensor(scale);
    let at = |distance_m, deg| Position::ORIGIN + Displacement::from_polar(distance_m, Angle::from_deg(deg));
    let eta =
        pair_information_at_1_m4([at(ORBIT_M, 0.0), at(ORBIT_M, separation_deg)], at(target_m, bearing_deg), &sensor);
    eta / pair_information_1_m4([ORBIT_M; 2], 90f64.to_radians(), &sensor)
}

/// Its mean over bearings of whole degrees.
fn averaged(scale: f64, separation_deg: f64, target_m: f64) -> f64 {
    let etas: Vec<f64> = (0..360).map(|deg| normalised(scale, separation_deg, target_m, f64::from(deg))).collect();
    mean(&etas)
}

/// The first whole degree at which something is largest (none if it is the same everywhere), and how large.
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

    /// Checks Eq. (36) averaged over the bearing: at 180 m from the centre the best separation is 55, 41 and 86 degrees
    /// for the three sensors, 1.52, 1.10 and next to 1 times as good as 90.
    #[test]
    fn away_from_the_centre_ninety_degrees_is_not_best() {
        for (scale, best_deg, gain) in [(0.01, 55.0, 1.52), (1.0, 41.0, 1.10), (100.0, 86.0, 1.00)] {
            let (deg, most) = best_of(0..=180, |deg| averaged(scale, deg, 180.0));
            assert_eq!(deg, best_deg, "sigma_scale {scale}");
            assert!((most / averaged(scale, 90.0, 180.0) - gain).abs() < 0.005, "sigma_scale {scale}");
        }
        assert!((averaged(1.0, 90.0, 0.0) - 1.0).abs() < 1e-12);
    }
}
