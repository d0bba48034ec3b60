//! Traffic of streets, drawn from the seed: what needs no file.

use standoff_sim::draws::{Draw, Draws, Stream};
use standoff_sim::traffic::{Options, Traffic, read_from};

use crate::failure::Failure;

/// From one crossing to the next, m.
const BLOCK_M: f64 = 150.0;
/// How long cars are there, s.
const SPAN_S: f64 = 300.0;
/// From one sample to the next, s.
const STEP_S: f64 = 0.5;
/// Cars speed up and brake by so much, m/s2.
const ACCELERATION_M_S2: f64 = 2.0;
/// How fast they cross, at most, m/s.
const CROSSING_M_S: f64 = 3.0;
/// Slowest and fastest cruise, m/s.
const CRUISE_M_S: [f64; 2] = [5.0, 15.0];
/// Share of crossings at which a car goes straight on without asking where else it could go.
const STRAIGHT: f64 = 0.4;
/// Share of crossings at which a car waits.
const WAITS: f64 = 0.2;
/// Shortest and longest wait at a crossing, s.
const WAIT_S: [f64; 2] = [1.0, 15.0];

/// A square of streets with crossings every 150 m, and cars that turn at random.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Streets {
    /// Blocks along each side; at least one.
    pub(crate) blocks: i32,
    pub(crate) cars: u32,
}

impl Streets {
    /// The traffic of a seed.
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
    /// The crossing it comes from, in blocks.
    from: [i32; 2],
    /// Where it drives: one block along one axis.
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
            if self.draw.uniform() < WAITS {
                self.wait_s = between(&mut self.draw, WAIT_S);
            }
        }
    }

    /// Draws where it drives from a crossing: not back, and not off the streets.
    fn turn(&mut self, blocks: i32) {
        let back = self.way.map(|step| -step);
        let leads_on = |way: &[i32; 2]| {
            *way != back && [0, 1].iter().all(|&axis: &usize| (0..=blocks).contains(&(self.from[axis] + way[axis])))
        };
        let ways: Vec<[i32; 2]> = [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().filter(leads_on).collect();
        if ways.contains(&self.way) && self.draw.uniform() < STRAIGHT {
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

    /// Cars are on a street at every instant (one coordinate is a multiple of 150 m), within the square, never faster
    /// than 15 m/s, turn, and are the same for the same seed alone.
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
