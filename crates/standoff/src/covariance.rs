//! Covariance of a target state. Only one triangle is stored, so the covariance cannot lose its symmetry.

use core::ops::{AddAssign, Index, IndexMut, Mul};

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

/// Covariance P of a state `[x, vx, ax, y, vy, ay]`: 21 of the 36 entries are stored.
///
/// Both axes have the same model, so corresponding entries of east and north are stored in pairs and processed
/// together.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Covariance {
    /// Blocks of east with east and of north with north: the upper triangle of each, row by row.
    pub(crate) same_axis: [Vector2<f64>; 6],
    /// Block of east (rows) with north (columns).
    pub(crate) cross_axis: [[f64; 3]; 3],
}

/// Index in [`Covariance::same_axis`] of each row and column of one axis.
const OWN: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

impl Covariance {
    /// Creates the covariance of independent components with these variances.
    pub fn from_diagonal(variances: [f64; 6]) -> Self {
        Self::from(&Matrix6::from_diagonal(&variances.into()))
    }

    /// Returns `v v'`.
    pub(crate) fn outer(v: &Vector6<f64>) -> Self {
        let at = |row: usize, column: usize| Vector2::new(v[row] * v[column], v[3 + row] * v[3 + column]);
        Self {
            same_axis: [at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)],
            cross_axis: core::array::from_fn(|row| core::array::from_fn(|column| v[row] * v[3 + column])),
        }
    }

    /// Returns the product with a vector.
    pub(crate) fn times(&self, v: &Vector6<f64>) -> Vector6<f64> {
        let mut product = Vector6::zeros();
        for row in 0..3 {
            for column in 0..3 {
                let own = self.same_axis[OWN[row][column]];
                product[row] += own.x * v[column] + self.cross_axis[row][column] * v[3 + column];
                product[3 + row] += own.y * v[3 + column] + self.cross_axis[column][row] * v[column];
            }
        }
        product
    }

    /// Creates a covariance from its upper triangle, row by row.
    pub fn from_upper_triangle(upper: &[f64; 21]) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u] = *upper;
        Self {
            same_axis: [[a, p], [b, q], [c, r], [g, s], [h, t], [l, u]].map(Vector2::from),
            cross_axis: [[d, e, f], [i, j, k], [m, n, o]],
        }
    }

    /// Returns the upper triangle, row by row.
    #[inline]
    pub fn upper_triangle(&self) -> [f64; 21] {
        let [[a, p], [b, q], [c, r], [g, s], [h, t], [l, u]] = self.same_axis.map(<[f64; 2]>::from);
        let [[d, e, f], [i, j, k], [m, n, o]] = self.cross_axis;
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u]
    }

    /// Returns the covariance as a full matrix.
    pub fn matrix(&self) -> Matrix6<f64> {
        let mut upper = self.upper_triangle().into_iter();
        let mut matrix = Matrix6::zeros();
        for row in 0..6 {
            for (column, value) in (row..6).zip(upper.by_ref()) {
                matrix[(row, column)] = value;
                matrix[(column, row)] = value;
            }
        }
        matrix
    }

    /// Returns the covariance of the position, m2.
    pub fn position(&self) -> Matrix2<f64> {
        let across = self.cross_axis[0][0];
        Matrix2::new(self.same_axis[0].x, across, across, self.same_axis[0].y)
    }

    /// Standard deviation of the position in its most uncertain direction, m.
    pub fn position_sd_max_m(&self) -> f64 {
        let p = self.position();
        let mean = 0.5 * (p[(0, 0)] + p[(1, 1)]);
        let half_difference = 0.5 * (p[(0, 0)] - p[(1, 1)]);
        (mean + (half_difference * half_difference + p[(0, 1)] * p[(0, 1)]).sqrt()).max(0.0).sqrt()
    }

    /// Replaces the position covariance. Only the upper triangle of `position` is used.
    pub(crate) fn with_position(mut self, position: &Matrix2<f64>) -> Self {
        self.same_axis[0] = position.diagonal();
        self.cross_axis[0][0] = position[(0, 1)];
        self
    }

    /// Returns the variances of the components, the diagonal of P.
    pub fn variances(&self) -> [f64; 6] {
        let [x, _, _, vx, _, ax] = self.same_axis;
        [x.x, vx.x, ax.x, x.y, vx.y, ax.y]
    }

    /// Returns C: the covariances of each east and north component with x, and with y.
    #[inline]
    pub(crate) fn with_position_components(&self) -> [[Vector2<f64>; 3]; 2] {
        [
            [0, 1, 2].map(|i| Vector2::new(self.same_axis[i].x, self.cross_axis[0][i])),
            [0, 1, 2].map(|i| Vector2::new(self.cross_axis[i][0], self.same_axis[i].y)),
        ]
    }

    /// Adds information about the position, 1/m2, to the inverse Y of this covariance. Returns `(1 + I A)^-1`, where I is
    /// the information and A the position block of P before.
    ///
    /// Implements Eq. (11). The matrix added to Y has rank two, so by the matrix inversion lemma P decreases by
    /// `C W C'`, where C are the position columns of P and `W = (1 + I A)^-1 I`.
    #[inline]
    pub fn add_position_information(&mut self, information: &Matrix2<f64>) -> Matrix2<f64> {
        let undamped = Matrix2::identity() + information * self.position();
        let determinant = undamped[(0, 0)] * undamped[(1, 1)] - undamped[(0, 1)] * undamped[(1, 0)];
        let damping =
            Matrix2::new(undamped[(1, 1)], -undamped[(0, 1)], -undamped[(1, 0)], undamped[(0, 0)]) / determinant;
        let weight = damping * information;
        let (w_xx, w_xy, w_yy) = (weight[(0, 0)], weight[(0, 1)], weight[(1, 1)]);
        let [with_x, with_y] = self.with_position_components();
        let lost_x = [0, 1, 2].map(|i| with_x[i] * w_xx + with_y[i] * w_xy);
        let lost_y = [0, 1, 2].map(|i| with_x[i] * w_xy + with_y[i] * w_yy);
        for row in 0..3 {
            for column in row..3 {
                self.same_axis[OWN[row][column]] -=
                    lost_x[row].component_mul(&with_x[column]) + lost_y[row].component_mul(&with_y[column]);
            }
            for column in 0..3 {
                self.cross_axis[row][column] -= lost_x[row].x * with_x[column].y + lost_y[row].x * with_y[column].y;
            }
        }
        damping
    }
}

/// Only the upper triangle is used.
impl From<&Matrix6<f64>> for Covariance {
    fn from(matrix: &Matrix6<f64>) -> Self {
        let mut upper = [0.0; 21];
        let indices = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        for (value, index) in upper.iter_mut().zip(indices) {
            *value = matrix[index];
        }
        Self::from_upper_triangle(&upper)
    }
}

/// Entry of a row and a column; both orders name the same one.
impl Index<(usize, usize)> for Covariance {
    type Output = f64;
    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        match (row.min(column), row.max(column)) {
            (east, other @ 0..3) => &self.same_axis[OWN[east][other]].x,
            (east @ 0..3, north) => &self.cross_axis[east][north - 3],
            (one, other) => &self.same_axis[OWN[one - 3][other - 3]].y,
        }
    }
}

impl IndexMut<(usize, usize)> for Covariance {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        match (row.min(column), row.max(column)) {
            (east, other @ 0..3) => &mut self.same_axis[OWN[east][other]].x,
            (east @ 0..3, north) => &mut self.cross_axis[east][north - 3],
            (one, other) => &mut self.same_axis[OWN[one - 3][other - 3]].y,
        }
    }
}

impl AddAssign for Covariance {
    fn add_assign(&mut self, other: Self) {
        for (own, other) in self.same_axis.iter_mut().zip(other.same_axis) {
            *own += other;
        }
        for (across, other) in self.cross_axis.as_flattened_mut().iter_mut().zip(other.cross_axis.as_flattened()) {
            *across += other;
        }
    }
}

impl Mul<f64> for Covariance {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            same_axis: self.same_axis.map(|own| own * factor),
            cross_axis: self.cross_axis.map(|row| row.map(|value| value * factor)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangle, matrix and blocks have the same entries.
    #[test]
    fn the_upper_triangle_represents_the_whole_matrix() {
        let upper: [f64; 21] = core::array::from_fn(|i| i as f64);
        let covariance = Covariance::from_upper_triangle(&upper);
        assert_eq!(covariance.upper_triangle(), upper);
        let matrix = covariance.matrix();
        assert_eq!(matrix, matrix.transpose());
        assert_eq!((matrix[(0, 5)], matrix[(1, 1)], matrix[(2, 4)], matrix[(5, 3)]), (5.0, 6.0, 13.0, 17.0));
        assert_eq!(Covariance::from(&matrix), covariance);
        assert_eq!(covariance.position(), Matrix2::new(0.0, 3.0, 3.0, 15.0));
        (0..36).map(|i| (i / 6, i % 6)).for_each(|index| assert_eq!(covariance[index], matrix[index]));
        let v = Vector6::from_fn(|i, _| 1.0 - i as f64);
        assert_eq!((covariance.times(&v), Covariance::outer(&v).matrix()), (matrix * v, v * v.transpose()));
        assert_eq!(covariance.variances(), [0.0, 6.0, 11.0, 15.0, 18.0, 20.0]);
        let diagonal = Covariance::from_diagonal([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).matrix();
        assert_eq!(diagonal, Matrix6::from_diagonal(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0].into()));
    }

    #[test]
    fn sums_and_multiples_match_those_of_the_matrices() {
        let covariance = Covariance::from_upper_triangle(&core::array::from_fn(|i| (i * i) as f64));
        let mut sum = covariance;
        sum += covariance * 2.0;
        assert_eq!(sum.matrix(), covariance.matrix() * 3.0);
    }
}
