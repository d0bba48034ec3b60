//! (25) is the derivative of the field's heading only on the orbit and only about a stationary centre.

use standoff::guidance::heading::steer;
use standoff::guidance::vector_field::VectorField;
use standoff::params::Feedforward;
use standoff::{Displacement, Position, TeamParams, UavState, Velocity};
use standoff_view::figures::study::{Line, Plot};

use super::flight::{Flight, Form, orbit};
use crate::claim::{Claim, shown};
use crate::error::Failure;
use crate::monte_carlo_plan::Plan;
use crate::study::{Data, Study, Table, line_of, plot};

/// Radius of the orbit on which the forms are compared, m.
const ORBIT_M: f64 = 300.0;
/// Speed of the UAV, m/s.
const SPEED_M_S: f64 = 40.0;
/// Range of distances from the centre for the claim, m: one third of the radius to three times the radius.
const EVALUATED_M: [f64; 2] = [100.0, 900.0];
/// Turn rate that counts as zero, rad/s.
const ZERO_TOLERANCE_RAD_S: f64 = 1e-3;

const FORMS: [(&str, Form); 3] = [("published", Form::Published), ("exact", Form::Exact), ("field", Form::Field)];

pub(super) fn study_feedforward(_: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (25): the feedforward",
        "*Published* is (25). *Exact* has r_d^3 instead of r_d r^2. *Field* is the derivative of the field that is \
         flown, including k_l, the lead and the velocity of the centre. The reference is a numerical derivative along \
         the field.",
    );
    compare_with_derivative(&mut found)?;
    fly_about_moving_centre(&mut found)?;
    Ok(found)
}

/// Compares (25) and its exact form with the derivative of the field's heading.
fn compare_with_derivative(found: &mut Study) -> Result<(), Failure> {
    let turn_rates_rad_s = |r_m: f64| {
        let [published, exact] =
            [Feedforward::Paper, Feedforward::StaticCentre].map(|form| stationary_centre_rad_s(form, r_m));
        vec![r_m, numeric_rad_s(r_m), published, exact]
    };
    let rows: Vec<Vec<f64>> = (20..=1200).step_by(10).map(f64::from).map(turn_rates_rad_s).collect();
    let exact = Line { dashed: true, ..line_of("exact", 2, &rows, 3) };
    let lines = [line_of("numeric derivative", 0, &rows, 1), line_of("published (25)", 1, &rows, 2), exact];
    let levels = vec![(0.3, "maximum turn rate".to_owned())];
    let plot = Plot { levels, ..plot("Distance from the centre (m)", "Feedforward (rad/s)", lines) };
    let heading = "Turn rate of the vector field's heading by distance from the centre";
    found.draw("errata-feedforward", heading, "orbit of 300 m about a stationary centre, 40 m/s", &[plot])?;

    let [from_m, to_m] = EVALUATED_M;
    let largest_error = |column: usize| {
        let evaluated = rows.iter().filter(|row| (from_m..=to_m).contains(&row[0]));
        evaluated.map(|row| (row[column] - row[1]).abs()).fold(0.0, f64::max)
    };
    let title = format!("Largest difference from the derivative, {from_m} to {to_m} m from the centre (rad/s):");
    let mut table = Table::new(title, ["published", "exact"]);
    table.rows.push([2, 3].map(|column| shown(largest_error(column))).to_vec());
    found.tables.push(table);
    found.claims.push(Claim::computed(
        format!(
            "(25) is obtained by differentiating (23): largest difference, {from_m} to {to_m} m from the centre of an \
             orbit of {ORBIT_M} m"
        ),
        "rad/s",
        [0.0, ZERO_TOLERANCE_RAD_S],
        largest_error(2),
        "the derivative has r_d^3 where (25) has r_d r^2; they are equal only on the orbit",
    ));
    found.data.push(Data::new("errata-feedforward", "r_m,numeric_rad_s,published_rad_s,exact_rad_s", rows));
    Ok(())
}

/// Flies around a moving centre with each form of the feedforward.
fn fly_about_moving_centre(found: &mut Study) -> Result<(), Failure> {
    let errors_m = |gain: f64, centre_speed_m_s: f64| {
        FORMS.map(|(_, form)| Flight { centre_speed_m_s, ..Flight::new(form, gain) }.largest_error_m())
    };
    let rows: Vec<Vec<f64>> = (0..=20)
        .map(f64::from)
        .map(|speed| [speed].into_iter().chain(errors_m(1.0, speed)).chain(errors_m(0.2, speed)).collect())
        .collect();
    let over_speed = |first: usize, gain: &str| {
        let lines = (0..).zip(FORMS).map(|(form, (name, _))| line_of(name, form + 1, &rows, first + form));
        let upward = format!("Largest |r − r_d| (m), k_l = {gain}");
        Plot { shown: vec![0.0], ..plot("Speed of the centre (m/s)", upward, lines) }
    };
    let heading = "Steady-state orbit error about a moving centre, by form of the feedforward";
    let caption = "orbit of 400 m, 40 m/s, no lead; the last third of 600 s";
    found.draw("errata-feedforward-moving", heading, caption, &[over_speed(1, "1"), over_speed(4, "0.2")])?;

    let mut table = Table::new(
        "Largest |r - r_d| about a moving centre (m), orbit of 400 m:",
        ["centre (m/s)", "k_l 1: published", "exact", "field", "k_l 0.2: published", "exact", "field"],
    );
    for row in rows.iter().filter(|row| [5.0, 10.0, 15.0].contains(&row[0])) {
        table.row(row[0].to_string(), row[1..].iter().copied());
    }
    found.tables.push(table);
    found.claims.push(Claim::computed(
        "(24) with (25) keeps the UAV on its orbit about a centre at 15 m/s: largest error, k_l = 1",
        "m",
        [0.0, 2.0],
        rows.iter().find(|row| row[0] == 15.0).map_or(f64::NAN, |row| row[1]),
        "(25) neglects the motion of the centre (28), as does the exact form",
    ));
    let columns = "centre_m_s,published_gain_1_m,exact_gain_1_m,field_gain_1_m,published_gain_0.2_m,exact_gain_0.2_m,\
                   field_gain_0.2_m";
    found.data.push(Data::new("errata-feedforward-moving", columns, rows));
    Ok(())
}

/// Returns the feedforward of a form about a stationary centre, rad/s.
fn stationary_centre_rad_s(form: Feedforward, r_m: f64) -> f64 {
    let TeamParams { mut guidance, uav: aircraft, .. } = TeamParams::paper();
    (guidance.feedforward, guidance.radial_gain) = (form, 1.0);
    let orbit = orbit(Position::ORIGIN, Velocity::ZERO, ORBIT_M);
    let position = Position::from_m(r_m, 0.0);
    let uav = UavState::level_flight(position, standoff::Angle::ZERO, SPEED_M_S);
    steer(&guidance, &aircraft, &uav, &orbit, SPEED_M_S).feedforward_rad_s
}

/// Computes the turn rate of the field's heading along the field by central differences, rad/s.
fn numeric_rad_s(r_m: f64) -> f64 {
    const H_S: f64 = 1e-4;
    let field =
        VectorField { radius_m: ORBIT_M, radial_gain: 1.0, orbit_direction: standoff::OrbitDirection::Anticlockwise };
    let here = Position::ORIGIN + Displacement::from_m(r_m, 0.0);
    let velocity = field.velocity(here - Position::ORIGIN, SPEED_M_S);
    let heading = |t_s: f64| field.velocity(here + velocity * t_s - Position::ORIGIN, SPEED_M_S).direction();
    (heading(H_S) - heading(-H_S)).rad() / (2.0 * H_S)
}
