//! Normalised estimation error squared.

use crate::config::ScoreConfig;
use crate::matching::Matched;

/// A filter with a smaller configured value assumes this one, so that its covariance has an inverse. Its targets'
/// acceleration counts as known, hence not as a random state.
const LEAST_ACCELERATION_SD_M_S2: f64 = 1e-6;

/// Returns the normalised estimation error squared, divided by the number of random states. These are all six if the
/// truth includes the acceleration and the filter models one, otherwise position and velocity. `None` if the covariance
/// is not positive definite.
pub(crate) fn nees_per_state(score_config: &ScoreConfig, Matched { target, track }: Matched<'_>) -> Option<f64> {
    let [x_m, vx_m_s, ax_m_s2, y_m, vy_m_s, ay_m_s2] = track.state;
    let [x, vx, y, vy] = [x_m - target.x_m, vx_m_s - target.vx_m_s, y_m - target.y_m, vy_m_s - target.vy_m_s];
    let is_random = score_config.target.acceleration_sd_m_s2 >= LEAST_ACCELERATION_SD_M_S2;
    if let (true, Some(true_ax), Some(true_ay)) = (is_random, target.ax_m_s2, target.ay_m_s2) {
        let error = [x, vx, ax_m_s2 - true_ax, y, vy, ay_m_s2 - true_ay];
        return normalised([0, 1, 2, 3, 4, 5], error, &track.covariance);
    }
    normalised([0, 1, 3, 4], [x, vx, y, vy], &track.covariance)
}

/// Computes e' P^-1 e / N, where e and P are the error and the covariance of these components of the state, by
/// elimination: the terms of the sum are not negative, and no root is needed. `None` if P is not positive definite.
/// `upper_triangle` is that of the covariance of the state, row by row.
fn normalised<const N: usize>(components: [usize; N], mut error: [f64; N], upper_triangle: &[f64; 21]) -> Option<f64> {
    // Of each row, only the columns from the diagonal on are used.
    let index = |row: usize, column: usize| row * (11 - row) / 2 + column.max(row);
    let mut p = components.map(|row| components.map(|column| upper_triangle[index(row, column)]));
    let mut sum = 0.0;
    for pivot in 0..N {
        let of_pivot = p[pivot];
        let variance = of_pivot[pivot];
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let weight = 1.0 / variance;
        sum += weight * error[pivot] * error[pivot];
        for row in pivot + 1..N {
            let factor = weight * of_pivot[row];
            error[row] -= factor * error[pivot];
            for (value, of_pivot) in p[row][row..].iter_mut().zip(&of_pivot[row..]) {
                *value -= factor * of_pivot;
            }
        }
    }
    Some(sum / N as f64)
}
