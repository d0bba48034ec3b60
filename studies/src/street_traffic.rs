//! Random traffic on streets, drawn from the seed; it needs no traffic file.

use standoff_sim::random::{Draw, Draws, Stream};
use standoff_sim::traffic::{Options, Traffic, read_from};

use crate::error::Failure;

/// Distance between crossings, m.
const BLOCK_M: f64 = 150.0;
/// Duration of the traffic, s.
const SPAN_S: f64 = 300.0;
/// Time between samples, s.
const STEP_S: f64 = 0.5;
/// Acceleration and deceleration of cars, m/s2.
const ACCELERATION_M_S2: f64 = 2.0;
/// Maximum speed at a crossing, m/s.
const CROSSING_M_S: f64 = 3.0;
/// Range of cruise speeds, m/s.
const CRUISE_M_S: [f64; 2] = [5.0, 15.0];
/// Probability that a car drives straight on without drawing a direction.
const STRAIGHT_PROBABILITY: f64 = 0.4;
/// Probability that a car waits at a crossing.
const WAIT_PROBABILITY: f64 = 0.2;
/// Range of waiting times at a crossing, s.
const WAIT_S: [f64; 2] = [1.0, 15.0];

/// A square grid of streets with crossings every 150 m, and cars that turn at random.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Streets {
    /// Number of blocks along each side; at least one.
    pub(crate) blocks: i32,
    pub(crate) cars: u32,
}

impl Streets {
    /// Creates the traffic of a seed.
    pub(crate) fn traffic(&self, seed: u64) -> Result<Traffic, Failure> {
        let mut rows = "t_s,vehicle,x_m,y_m\n".to_owned();
        let draws = Draws::new(seed);
        for number in 0..self.cars {
            let mut car = Car::new(self.blocks, draws.at(Stream::Scenario, number.into(), 0));
            for step in 0..=(SPAN_S / STEP_S) as u32 {
                let [x_m, y_m] = car.position_m();
                rows += &format!("{},car-{number},{x_m:.3},{y_m:.3}\n", f64::from(step) * STEP_S);
                car.step(self.blocks);
            }
        }
        read_from(rows.as_bytes(), "streets", &Options::default()).map_err(Failure::running)
    }
}

/// A car between two crossings.
struct Car {
    draw: Draw,
    /// The last crossing, in blocks.
    from: [i32; 2],
    /// Direction: one block along one axis.
    way: [i32; 2],
    driven_m: f64,
    speed_m_s: f64,
    cruise_m_s: f64,
    wait_s: f64,
}

impl Car {
    fn new(blocks: i32, mut draw: Draw) -> Self {
        let from = [0; 2].map(|_: i32| (draw.uniform() * f64::from(blocks + 1)) as i32);
        let cruise_m_s = between(&mut draw, CRUISE_M_S);
        let mut car = Self { draw, from, way: [0; 2], driven_m: 0.0, speed_m_s: 0.0, cruise_m_s, wait_s: 0.0 };
        car.turn(blocks);
        car
    }

    fn position_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| f64::from(self.from[axis]) * BLOCK_M + f64::from(self.way[axis]) * self.driven_m)
    }

    fn step(&mut self, blocks: i32) {
        if self.wait_s > 0.0 {
            (self.wait_s, self.speed_m_s) = (self.wait_s - STEP_S, 0.0);
            return;
        }
        let left_m = BLOCK_M - self.driven_m;
        let braking_m_s = (CROSSING_M_S * CROSSING_M_S + 2.0 * ACCELERATION_M_S2 * left_m).sqrt();
        self.speed_m_s = (self.speed_m_s + ACCELERATION_M_S2 * STEP_S).min(self.cruise_m_s).min(braking_m_s);
        self.driven_m += self.speed_m_s * STEP_S;
        if self.driven_m >= BLOCK_M {
            self.from = [0, 1].map(|axis| self.from[axis] + self.way[axis]);
            self.driven_m = 0.0;
            self.turn(blocks);
            if self.draw.uniform() < WAIT_PROBABILITY {
                self.wait_s = between(&mut self.draw, WAIT_S);
            }
        }
    }

    /// Draws the direction at a crossing, excluding the way back and ways off the grid.
    fn turn(&mut self, blocks: i32) {
        let back = self.way.map(|step| -step);
        let is_possible = |way: &[i32; 2]| {
            *way != back && [0, 1].iter().all(|&axis: &usize| (0..=blocks).contains(&(self.from[axis] + way[axis])))
        };
        let ways: Vec<[i32; 2]> = [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().filter(is_possible).collect();
        if ways.contains(&self.way) && self.draw.uniform() < STRAIGHT_PROBABILITY {
            return;
        }
        let chosen = (self.draw.uniform() * ways.len() as f64) as usize;
        self.way = ways.get(chosen).copied().unwrap_or(back);
    }
}

fn between(draw: &mut Draw, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * draw.uniform()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every time step, cars are on a street (one coordinate is a multiple of 150 m) inside the square and not
    /// faster than 15 m/s. They turn, and only equal seeds give equal traffic.
    #[test]
    fn cars_stay_on_the_streets_and_turn() {
        let streets = Streets { blocks: 4, cars: 12 };
        let traffic = streets.traffic(101).map_err(|_| ()).unwrap();
        assert_eq!((traffic.vehicles.len(), traffic.span_s()), (12, SPAN_S));
        assert!(traffic.places().all(|place| {
            place.iter().all(|m| (0.0..=600.0).contains(m)) && place.iter().any(|m| m % BLOCK_M == 0.0)
        }));
        for number in 0..12 {
            let mut car = Car::new(4, Draws::new(101).at(Stream::Scenario, number, 0));
            let (mut axes, mut driven_m) = ([0; 2], 0.0);
            for _ in 0..600 {
                let before = car.position_m();
                car.step(4);
                let [dx_m, dy_m] = [0, 1].map(|axis| (car.position_m()[axis] - before[axis]).abs());
                assert!(dx_m + dy_m <= 15.0 * STEP_S + 1e-9);
                axes[0] += u32::from(dx_m > 0.0);
                axes[1] += u32::from(dy_m > 0.0);
                driven_m += dx_m + dy_m;
            }
            assert!(axes.iter().all(|steps| *steps > 20), "{axes:?}");
            assert!(driven_m > 5.0 * BLOCK_M, "{driven_m}");
        }
        let crc32 = |seed| streets.traffic(seed).map_err(|_| ()).unwrap().crc32();
        assert_eq!(crc32(101), traffic.crc32());
        assert_ne!(crc32(102), traffic.crc32());
    }
}
