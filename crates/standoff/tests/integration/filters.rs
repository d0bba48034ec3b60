//! Comparison of the information filter with two independent filters: a Kalman filter in Joseph form and a square-root
//! filter by QR decomposition. Also checks that its covariance stays positive definite over long runs.

use crate::common::Draw;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use proptest::prelude::*;
use standoff::target::Transition;
use standoff::tracking::information_filter::Contribution;
use standoff::*;

/// Measurements of one time step, each with the position of its UAV.
type Looks = Vec<(Position, RangeBearingMeasurement)>;

/// An estimation problem: target model, sensor, initial estimate and measurements.
#[derive(Debug, Clone)]
struct Problem {
    transition: Transition,
    sensor: SensorParams,
    start: Estimate,
    scans: Vec<Looks>,
}

const STEPS: usize = 200;

/// Number of measured values per time step: range and bearing from at most four UAVs.
const ROWS: usize = 8;

prop_compose! {
    /// A well-posed problem: the sensor is neither much better nor much worse than the cue, and no UAV is above the
    /// target.
    fn any_problem()(
        seed in 1..u64::MAX,
        correlation_rate_1_s in prop_oneof![Just(0.0), 0.01..3.0f64],
        acceleration_sd_m_s2 in 0.05..3.0f64,
        dt_s in 0.1..2.0f64,
        range_sd_m in 1.0..50.0f64,
        bearing_sd_deg in 0.2..10.0f64,
        cue_sd_m in 5.0..200.0f64,
        cue_sd_m_s in 0.5..20.0f64,
        uavs in 1..5usize,
        missed in 0.0..0.6f64,
        radius_m in 150.0..1000.0f64,
    ) -> Problem {
        let mut draw = Draw(seed);
        let model = TargetParams { correlation_rate_1_s, acceleration_sd_m_s2 };
        let sensor = SensorParams {
            range_sd_m,
            bearing_sd_rad: bearing_sd_deg.to_radians(),
            ..TeamParams::paper().track.sensor
        };
        let axis = [cue_sd_m, cue_sd_m_s, acceleration_sd_m_s2];
        let start = Estimate {
            state: TargetState::new(
                Position::from_m(2000.0 * draw.next(), 2000.0 * draw.next()),
                Velocity::from_m_s(15.0 * draw.next(), 15.0 * draw.next()),
                [0.0, 0.0],
            ),
            covariance: Covariance::from_diagonal(core::array::from_fn(|i| axis[i % 3] * axis[i % 3])),
        };
        let phases: Vec<f64> = (0..uavs).map(|_| 3.1 * draw.next()).collect();
        let velocity = start.state.velocity();
        let scans = (1..=STEPS).map(|step| {
            let t_s = step as f64 * dt_s;
            let truth = start.state.position() + velocity * t_s;
            let look = |phase: &f64| {
                let direction = Angle::from_rad(phase + 0.1 * t_s);
                let uav = truth + Displacement::from_polar(radius_m * (1.0 + 0.2 * draw.next()), direction);
                let exact = standoff::sensor::measure(uav, truth);
                let bearing = exact.bearing + Angle::from_rad(1.5 * sensor.bearing_sd_rad * draw.next());
                let measured = RangeBearingMeasurement { range_m: exact.range_m + 1.5 * range_sd_m * draw.next(), bearing };
                (draw.next() >= 2.0 * missed - 1.0).then_some((uav, measured))
            };
            phases.iter().filter_map(look).collect()
        });
        let scans = scans.collect();
        Problem { transition: model.transition(Duration::from_s(dt_s)), sensor, start, scans }
    }
}

impl Problem {
    /// F and Q of all six states.
    fn whole_transition(&self) -> (Matrix6<f64>, Matrix6<f64>) {
        let (mut f, mut q) = (Matrix6::zeros(), Matrix6::zeros());
        for block in [0, 3] {
            f.fixed_view_mut::<3, 3>(block, block).copy_from(&self.transition.f);
            q.fixed_view_mut::<3, 3>(block, block).copy_from(&self.transition.q);
        }
        (f, q)
    }

    /// Stacks all measurements of a time step: H, the innovations, and the standard deviations. Values that were not
    /// measured have a row of zeros.
    fn stacked(
        &self,
        looks: &Looks,
        predicted: Position,
    ) -> (SMatrix<f64, ROWS, 6>, SVector<f64, ROWS>, SVector<f64, ROWS>) {
        let (mut h, mut nu, mut sd) = (SMatrix::zeros(), SVector::zeros(), SVector::repeat(1.0));
        for (index, (uav, z)) in looks.iter().enumerate() {
            let expected = standoff::sensor::measure(*uav, predicted);
            let rows = standoff::sensor::jacobian(*uav, predicted).unwrap();
            for (row, (difference, own_sd)) in [
                (z.range_m - expected.range_m, self.sensor.range_sd_m),
                ((z.bearing - expected.bearing).rad(), self.sensor.bearing_sd_rad),
            ]
            .into_iter()
            .enumerate()
            {
                let line = 2 * index + row;
                (h[(line, 0)], h[(line, 3)]) = (rows[(row, 0)], rows[(row, 1)]);
                (nu[line], sd[line]) = (difference, own_sd);
            }
        }
        (h, nu, sd)
    }
}

/// Mean and covariance as plain matrices.
#[derive(Debug, Clone)]
struct Belief {
    x: Vector6<f64>,
    p: Matrix6<f64>,
}

/// A Kalman filter, updated in Joseph form: P = (1 - K H) P (1 - K H)' + K R K'.
fn joseph(problem: &Problem, belief: &Belief, looks: &Looks) -> Belief {
    let (f, q) = problem.whole_transition();
    let (x, p) = (f * belief.x, f * belief.p * f.transpose() + q);
    let (h, nu, sd) = problem.stacked(looks, Position::from_m(x[0], x[3]));
    let r = SMatrix::from_diagonal(&sd.component_mul(&sd));
    let s = h * p * h.transpose() + r;
    let gain = p * h.transpose() * s.cholesky().unwrap().inverse();
    let a = Matrix6::identity() - gain * h;
    Belief { x: x + gain * nu, p: a * p * a.transpose() + gain * r * gain.transpose() }
}

/// Mean and square root S of the covariance, P = S S'.
#[derive(Debug, Clone)]
struct Root {
    x: Vector6<f64>,
    s: Matrix6<f64>,
}

/// Predicts and updates a square root by orthogonal triangularisation, without forming a covariance.
fn square_root(problem: &Problem, root: &Root, looks: &Looks) -> Root {
    let (f, q) = problem.whole_transition();
    let x = f * root.x;
    let mut stacked = SMatrix::<f64, 12, 6>::zeros();
    stacked.fixed_view_mut::<6, 6>(0, 0).copy_from(&(f * root.s).transpose());
    stacked.fixed_view_mut::<6, 6>(6, 0).copy_from(&root_of(&q).transpose());
    let s = stacked.qr().r().transpose();
    let (h, nu, sd) = problem.stacked(looks, Position::from_m(x[0], x[3]));
    // The triangle of | R^1/2  H S | is | (H P H' + R)^1/2     0 |
    //                 |   0     S  |    | K (H P H' + R)^1/2  S+ |, S+ the updated root.
    let mut before = SMatrix::<f64, { ROWS + 6 }, { ROWS + 6 }>::zeros();
    before.fixed_view_mut::<ROWS, ROWS>(0, 0).copy_from(&SMatrix::from_diagonal(&sd));
    before.fixed_view_mut::<6, ROWS>(ROWS, 0).copy_from(&(s.transpose() * h.transpose()));
    before.fixed_view_mut::<6, 6>(ROWS, ROWS).copy_from(&s.transpose());
    let after = before.qr().r().transpose();
    let innovation_root = after.fixed_view::<ROWS, ROWS>(0, 0).into_owned();
    let whitened = innovation_root.solve_lower_triangular(&nu).unwrap();
    let x = x + after.fixed_view::<6, ROWS>(ROWS, 0) * whitened;
    Root { x, s: after.fixed_view::<6, 6>(ROWS, ROWS).into_owned() }
}

/// Lower triangular L with L L' = Q; Q may be singular.
fn root_of(q: &Matrix6<f64>) -> Matrix6<f64> {
    let mut l = Matrix6::zeros();
    for column in 0..6 {
        let pivot: f64 = q[(column, column)] - (0..column).map(|k| l[(column, k)] * l[(column, k)]).sum::<f64>();
        if pivot <= 0.0 {
            continue;
        }
        l[(column, column)] = pivot.sqrt();
        for row in column + 1..6 {
            let rest: f64 = q[(row, column)] - (0..column).map(|k| l[(row, k)] * l[(column, k)]).sum::<f64>();
            l[(row, column)] = rest / l[(column, column)];
        }
    }
    l
}

/// Largest difference of two beliefs: means relative to the standard deviations, covariances relative to their
/// products.
fn max_difference(one: &Belief, other: &Belief) -> f64 {
    let sd = |i: usize| one.p[(i, i)].sqrt();
    let means = (0..6).map(|i| (one.x[i] - other.x[i]).abs() / sd(i));
    let indices = (0..6).flat_map(|row| (0..6).map(move |column| (row, column)));
    let covariances = indices.map(|(i, j)| (one.p[(i, j)] - other.p[(i, j)]).abs() / (sd(i) * sd(j)));
    means.chain(covariances).fold(0.0, f64::max)
}

/// Smallest eigenvalue of the correlation matrix of a covariance; 1 if the states are independent.
fn least_eigenvalue_of_correlation(p: &Matrix6<f64>) -> f64 {
    let correlation = Matrix6::from_fn(|i, j| p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt());
    correlation.symmetric_eigenvalues().min().max(f64::EPSILON)
}

fn follow(estimate: &mut Estimate, problem: &Problem, looks: &Looks) {
    estimate.predict(&problem.transition);
    let at = estimate.state.position();
    let mut sum = Contribution::default();
    for (uav, z) in looks {
        sum += Contribution::from_measurement(&problem.sensor, *uav, z, at);
    }
    estimate.update(&sum);
}

/// Number of cases: `PROPTEST_CASES`, or 50 if it is not set. Each case runs three filters over 200 scans.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").map_or(50, |cases| cases.parse().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]
    /// Checks Eq. (8), (9), (10), (11): from the same estimate before each of 200 scans with up to four UAVs, the three
    /// filters get the same mean, to 1e-9 of its standard deviation, and the same covariance, to 1e-9 of the product of
    /// the standard deviations of its row and column. More is allowed where a combination of the states is known much
    /// more precisely than each of them: there, rounding errors are amplified. So are they from scan to scan at short
    /// range, because each filter linearises about its own estimate; hence the common start.
    #[test]
    fn information_joseph_and_square_root_forms_agree(problem in any_problem()) {
        let start = &problem.start;
        let mut estimate = *start;
        let mut before = Belief { x: start.state.0, p: start.covariance.matrix() };
        for (step, looks) in problem.scans.iter().enumerate() {
            follow(&mut estimate, &problem, looks);
            let own = Belief { x: estimate.state.0, p: estimate.covariance.matrix() };
            let kalman = joseph(&problem, &before, looks);
            let root = square_root(&problem, &Root { x: before.x, s: root_of(&before.p) }, looks);
            let rooted = Belief { x: root.x, p: root.s * root.s.transpose() };
            let [to_joseph, to_root] = [&kalman, &rooted].map(|other| max_difference(&own, other));
            let least = least_eigenvalue_of_correlation(&own.p);
            let allowed = f64::max(1e-9, 1e-14 / least);
            prop_assert!(to_joseph < allowed, "step {step}, Joseph: {to_joseph:e}, eigenvalue {least:e}");
            prop_assert!(to_root < allowed, "step {step}, square root: {to_root:e}, eigenvalue {least:e}");
            before = own;
        }
    }
}

/// The position is known to 10 km and measured to 1 cm along and 21 m across the line of sight. After the update, the
/// variance in each direction is that of the measurement.
#[test]
fn a_measurement_much_more_precise_than_the_prior_is_fully_used() {
    let sensor = SensorParams { range_sd_m: 0.01, ..TeamParams::paper().track.sensor };
    for bearing_deg in [0.0, 30.0, 77.0, 135.0, -100.0] {
        let axis = [1e8, 4.0, 0.04];
        let covariance = Covariance::from_diagonal(core::array::from_fn(|i| axis[i % 3]));
        let mut estimate = Estimate { state: TargetState::default(), covariance };
        let along = Displacement::from_polar(1.0, Angle::from_deg(bearing_deg)).vector();
        let uav = Position::from_m(-400.0 * along.x, -400.0 * along.y);
        let z = RangeBearingMeasurement { range_m: 407.0, bearing: Angle::from_deg(bearing_deg) };
        estimate.update(&Contribution::from_measurement(&sensor, uav, &z, Position::ORIGIN));
        let position = estimate.position_covariance();
        let across = Angle::from_deg(bearing_deg + 90.0);
        let across = Displacement::from_polar(1.0, across).vector();
        let across_m2 = (400.0 * sensor.bearing_sd_rad) * (400.0 * sensor.bearing_sd_rad);
        assert!((along.dot(&(position * along)) / 1e-4 - 1.0).abs() < 1e-3, "{bearing_deg}: {position}");
        assert!((across.dot(&(position * across)) / across_m2 - 1.0).abs() < 1e-4, "{bearing_deg}: {position}");
        let moved = estimate.state.position().vector();
        assert!((moved.dot(&along) - 7.0).abs() < 1e-6 && moved.dot(&across).abs() < 1e-6, "{bearing_deg}: {moved}");
        assert!(estimate.information_matrix().is_some(), "{bearing_deg}");
    }
}

/// Over 10,000 s the remaining acceleration decays by a tenth per second.
#[test]
fn a_track_of_a_target_that_never_accelerates_stays_valid_for_hours() {
    let mut params = TeamParams::paper().track;
    params.target.acceleration_sd_m_s2 = 0.0;
    let transition = params.transition(Duration::from_s(0.5));
    let uav = Position::from_m(-300.0, 0.0);
    let z = standoff::sensor::measure(uav, Position::from_m(40.0, 30.0));
    let mut track = Track::from_measurements(TargetLabel(0).into(), [(uav, z)], &params).unwrap();
    for step in 0..20_000 {
        let before = track;
        track.predict(&transition);
        let predicted = track.estimate().state.position();
        let measured = Contribution::from_measurement(&params.sensor, uav, &z, predicted);
        track.update(&before, Some(&measured), transition.dt, |_, _| true, &params);
        assert_eq!(track.status, TrackStatus::Updated, "step {step}");
    }
    // The estimate is still valid in both forms.
    assert!(track.estimate().checked().is_some(), "{:?}", track.estimate());
}

/// Runs one filter per thread for `steps` steps, each in another world. Returns the number of sampled covariances that
/// were not positive definite.
fn broken_covariances(threads: u64, steps: u64) -> u64 {
    let one = |seed: u64| {
        let mut draw = Draw(seed);
        let model = TargetParams { correlation_rate_1_s: 0.1, acceleration_sd_m_s2: 0.2 };
        let transition = model.transition(Duration::from_s(0.5));
        let sensor = TeamParams::paper().track.sensor;
        let start = Estimate {
            state: TargetState::new(Position::from_m(3.0, 5.0), Velocity::ZERO, [0.0, 0.0]),
            covariance: Covariance::from_diagonal([400.0, 4.0, 0.04, 400.0, 4.0, 0.04]),
        };
        let mut estimate = start;
        let mut broken = 0;
        for step in 0..steps {
            estimate.predict(&transition);
            // Two UAVs at a phase difference of 90 degrees; from time to time both have no measurements for a while.
            if step % 1000 < 960 {
                let at = estimate.state.position();
                let mut sum = Contribution::default();
                for phase in [0.05 * step as f64, 0.05 * step as f64 + 1.57] {
                    let uav = Position::ORIGIN + Displacement::from_polar(400.0, Angle::from_rad(phase));
                    let exact = standoff::sensor::measure(uav, Position::ORIGIN);
                    let range_m = exact.range_m + 10.0 * draw.next();
                    let bearing = exact.bearing + Angle::from_rad(0.05 * draw.next());
                    sum +=
                        Contribution::from_measurement(&sensor, uav, &RangeBearingMeasurement { range_m, bearing }, at);
                }
                estimate.update(&sum);
            }
            if step % 50 == 0 || step + 1 == steps {
                broken += u64::from(estimate.information_matrix().is_none() || !estimate.is_valid());
            }
        }
        assert!(estimate.state.position().distance_m(Position::ORIGIN) < 200.0, "the filter has diverged");
        broken
    };
    std::thread::scope(|scope| {
        let runs: Vec<_> = (1..=threads).map(|seed| scope.spawn(move || one(seed))).collect();
        runs.into_iter().map(|run| run.join().unwrap()).sum()
    })
}

/// A filter that slowly loses precision looks correct for hundreds of steps and then diverges.
#[test]
fn the_covariance_stays_positive_definite_over_half_a_million_steps() {
    assert_eq!(broken_covariances(2, 250_000), 0);
}

#[test]
#[ignore = "long: for .ci/long"]
fn the_covariance_stays_positive_definite_over_ten_million_steps() {
    assert_eq!(broken_covariances(2, 5_000_000), 0);
}
