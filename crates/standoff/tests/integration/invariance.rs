//! Invariance under isometries: rotated, shifted and mirrored worlds give rotated, shifted and mirrored results.

use crate::common::{Draw, OwnedScan};
use proptest::prelude::*;
use standoff::params::CentreEstimate;
use standoff::params::Feedforward;
use standoff::params::GroupCount;
use standoff::params::Pointing;
use standoff::params::RemovalRule;
use standoff::*;

/// An isometry of the plane: optional north-south mirroring, then a rotation around the origin, then a shift.
#[derive(Debug, Clone, Copy)]
struct Isometry {
    is_mirrored: bool,
    turn: Angle,
    shift: Displacement,
}

impl Isometry {
    fn angle(&self, angle: Angle) -> Angle {
        (if self.is_mirrored { -angle } else { angle }) + self.turn
    }

    fn vector(&self, x: f64, y: f64) -> (f64, f64) {
        let y = if self.is_mirrored { -y } else { y };
        let (sin, cos) = self.turn.sin_cos();
        (cos * x - sin * y, sin * x + cos * y)
    }

    fn position(&self, position: Position) -> Position {
        let (x_m, y_m) = self.vector(position.x_m(), position.y_m());
        Position::from_m(x_m, y_m) + self.shift
    }

    fn velocity(&self, velocity: Velocity) -> Velocity {
        let (x_m_s, y_m_s) = self.vector(velocity.x_m_s(), velocity.y_m_s());
        Velocity::from_m_s(x_m_s, y_m_s)
    }

    fn turn_rate(&self, rad_s: f64) -> f64 {
        if self.is_mirrored { -rad_s } else { rad_s }
    }

    fn sense(&self, sense: OrbitDirection) -> OrbitDirection {
        match (self.is_mirrored, sense) {
            (false, sense) => sense,
            (true, OrbitDirection::Anticlockwise) => OrbitDirection::Clockwise,
            (true, OrbitDirection::Clockwise) => OrbitDirection::Anticlockwise,
        }
    }

    fn uav(&self, uav: &UavState) -> UavState {
        UavState {
            position: self.position(uav.position),
            heading: self.angle(uav.heading),
            speed_m_s: uav.speed_m_s,
            turn_rate_rad_s: self.turn_rate(uav.turn_rate_rad_s),
            vertical: None,
        }
    }
}

/// Initial state of a target that moves on a straight line.
#[derive(Debug, Clone, Copy)]
struct Vehicle {
    position: Position,
    velocity: Velocity,
}

/// Initial state of a world.
#[derive(Debug, Clone)]
struct Start {
    uavs: Vec<UavState>,
    vehicles: Vec<Vehicle>,
    team: TeamParams,
    noise_seed: u64,
}

prop_compose! {
    fn any_start()(
        seed in 1..u64::MAX,
        uavs in 1..6u32,
        vehicles in 1..10usize,
        field_m in prop_oneof![Just(80.0), Just(600.0), Just(2500.0)],
        speed_m_s in 0.0..14.0f64,
        law in prop_oneof![Just(Law::Standoff), Just(Law::Oh2015)],
        feedforward in prop_oneof![Just(Feedforward::StaticCentre), Just(Feedforward::Paper)],
        centre in prop_oneof![Just(CentreEstimate::Filtered), Just(CentreEstimate::EnclosingCircle)],
        aim in prop_oneof![Just(Pointing::GroupCentre), Just(Pointing::AngularMidpoint)],
        removal in prop_oneof![Just(RemovalRule::FurthestFromCentre), Just(RemovalRule::LargestRadiusReduction)],
        sense in prop_oneof![Just(OrbitDirection::Anticlockwise), Just(OrbitDirection::Clockwise)],
        moves in any::<bool>(),
        count in prop_oneof![Just(GroupCount::HalfOfUavs), Just(GroupCount::AsNeeded)],
    ) -> Start {
        let mut draw = Draw(seed);
        let mut team = TeamParams::paper();
        (team.guidance.law, team.guidance.feedforward, team.guidance.orbit_direction) = (law, feedforward, sense);
        team.group.centre = centre;
        (team.group.pointing, team.group.removal, team.group.count) = (aim, removal, count);
        // A filtered centre cannot have an orbit motion model in addition.
        team.group.motion.time_constant_s = if moves && centre != CentreEstimate::Filtered { 1.5 } else { 0.0 };
        let vehicles = (0..vehicles).map(|_| Vehicle {
            position: Position::from_m(field_m * draw.next(), field_m * draw.next()),
            velocity: Velocity::from_m_s(speed_m_s * draw.next(), speed_m_s * draw.next()),
        });
        let vehicles: Vec<Vehicle> = vehicles.collect();
        let uavs = (0..uavs).map(|_| UavState {
            position: Position::from_m(900.0 * draw.next(), 900.0 * draw.next()),
            heading: Angle::from_rad(3.1 * draw.next()),
            speed_m_s: 40.0 + 5.0 * draw.next(),
            turn_rate_rad_s: 0.1 * draw.next(),
            vertical: None,
        });
        Start { uavs: uavs.collect(), vehicles, team, noise_seed: seed ^ 0x5555 }
    }
}

/// A running world, transformed by an isometry. The same random numbers give the same range and bearing noise, and the
/// same cue errors, transformed.
struct World {
    through: Isometry,
    fleet: TeamAgent,
    team: TeamParams,
    uavs: Vec<UavState>,
    vehicles: Vec<Vehicle>,
    pointing_target: Vec<Option<PointingTarget>>,
    commands: Vec<Command>,
    noise: Draw,
    tick: i64,
}

const PERIOD: Duration = Duration::from_us(500_000);

impl World {
    fn new(start: &Start, through: Isometry) -> Self {
        let mut team = start.team;
        team.guidance.orbit_direction = through.sense(team.guidance.orbit_direction);
        let vehicle = |vehicle: &Vehicle| Vehicle {
            position: through.position(vehicle.position),
            velocity: through.velocity(vehicle.velocity),
        };
        Self {
            through,
            fleet: TeamAgent::new(team).unwrap(),
            team,
            uavs: start.uavs.iter().map(|uav| through.uav(uav)).collect(),
            vehicles: start.vehicles.iter().map(vehicle).collect(),
            pointing_target: vec![None; start.uavs.len()],
            commands: Vec::new(),
            noise: Draw(start.noise_seed),
            tick: 0,
        }
    }

    /// All sensor scans. Noise is drawn for every UAV and target, in view or not.
    fn scans(&mut self) -> Vec<OwnedScan> {
        let sensor = self.team.track.sensor;
        let mut scans = Vec::new();
        for (uav, pointing_target) in self.uavs.iter().zip(&self.pointing_target) {
            let boresight = pointing_target.map(|look| look.boresight(uav.position, PERIOD));
            let mut detections = Vec::new();
            for (id, vehicle) in (0..).zip(&self.vehicles) {
                let (range_m, bearing_rad) =
                    (1.5 * sensor.range_sd_m * self.noise.next(), 1.5 * sensor.bearing_sd_rad * self.noise.next());
                let seen = boresight.and_then(|boresight| sensor.measure(uav.position, boresight, vehicle.position));
                let Some(mut measurement) = seen else { continue };
                measurement.range_m += range_m;
                measurement.bearing = measurement.bearing + Angle::from_rad(self.through.turn_rate(bearing_rad));
                detections.push(Detection { label: Some(TargetLabel(id)), measurement, range_rate_m_s: None });
            }
            scans.push((boresight, detections));
        }
        scans
    }

    fn cues(&mut self, now: Time) -> Vec<Message> {
        let cue = |(id, vehicle): (u32, &Vehicle)| {
            let [dx_m, dy_m, dvx_m_s, dvy_m_s] = core::array::from_fn(|_| self.noise.next());
            let (dx_m, dy_m) = self.through.vector(20.0 * dx_m, 20.0 * dy_m);
            let (dvx_m_s, dvy_m_s) = self.through.vector(2.0 * dvx_m_s, 2.0 * dvy_m_s);
            let Vehicle { position, velocity } = vehicle;
            Message::Cue(Cue {
                source: 0,
                issued_at: now,
                sequence: id as u16,
                label: Some(TargetLabel(id)),
                time: now,
                position: *position + Displacement::from_m(dx_m, dy_m),
                velocity: Velocity::from_m_s(velocity.x_m_s() + dvx_m_s, velocity.y_m_s() + dvy_m_s),
                position_sd_m: 20.0,
                velocity_sd_m_s: 2.0,
                priority: None,
            })
        };
        (0..).zip(&self.vehicles).map(cue).collect()
    }

    fn tick(&mut self) {
        let now = Time::from_us(self.tick * PERIOD.us());
        let cues = if self.tick == 0 { self.cues(now) } else { Vec::new() };
        let scans = self.scans();
        let observed = crate::common::observe_all(&mut self.fleet, now, &self.uavs, &scans, &cues);
        let response = self.team.uav.response(PERIOD);
        self.commands.clear();
        for (index, uav) in self.uavs.iter_mut().enumerate() {
            let step = self.fleet.decide(&observed[index]);
            self.pointing_target[index] = step.pointing_target;
            self.commands.push(step.command);
            *uav = response.step(uav, step.command);
        }
        for vehicle in &mut self.vehicles {
            vehicle.position = vehicle.position + vehicle.velocity * PERIOD.s();
        }
        self.tick += 1;
    }

    /// All discrete decisions as text: memberships, assignments, events and groups, without measured numbers.
    fn decisions(&self) -> String {
        let team_state = self.fleet.team_state();
        let memberships = team_state.tracks().iter().map(|known| {
            (known.track.id, known.track.status, known.membership.group(), known.membership.receiving_group())
        });
        let events = team_state
            .events
            .iter()
            .map(|event| (event.kind.name(), event.track, event.group, event.to_group, event.uav));
        let groups = team_state.groups.iter().map(|group| (group.id, group.members, group.altitude_m));
        let all = (
            memberships.collect::<Vec<_>>(),
            &team_state.assignments,
            events.collect::<Vec<_>>(),
            groups.collect::<Vec<_>>(),
        );
        format!("{all:?}")
    }

    /// Largest difference of a number to the transformed number of `plain`, in metres, metres per second or radians.
    fn max_difference(&self, plain: &World) -> f64 {
        let mut largest = 0.0f64;
        let distance_m = |one: Position, other: Position| one.distance_m(self.through.position(other));
        for (own, other) in self.uavs.iter().zip(&plain.uavs) {
            largest = largest.max(distance_m(own.position, other.position));
            largest = largest.max((own.heading - self.through.angle(other.heading)).abs_rad());
        }
        for (own, other) in self.commands.iter().zip(&plain.commands) {
            largest = largest.max((own.speed_m_s - other.speed_m_s).abs());
            largest = largest.max((own.turn_rate_rad_s - self.through.turn_rate(other.turn_rate_rad_s)).abs());
        }
        let (team_state, other) = (self.fleet.team_state(), plain.fleet.team_state());
        for (own, other) in team_state.tracks().iter().zip(other.tracks()) {
            let (own, other) = (own.track.estimate(), other.track.estimate());
            largest = largest.max(distance_m(own.state.position(), other.state.position()));
            let velocity = self.through.velocity(other.state.velocity());
            largest = largest.max((own.state.velocity().vector() - velocity.vector()).norm());
            largest = largest.max((own.position_sd_max_m() - other.position_sd_max_m()).abs());
        }
        for (own, other) in team_state.groups.iter().zip(&other.groups) {
            let positions = [own, other].map(|group| group.centre().state.position());
            largest = largest.max(distance_m(positions[0], positions[1]));
            largest = largest.max((own.standoff.distance_m - other.standoff.distance_m).abs());
        }
        largest
    }
}

fn any_isometry() -> impl Strategy<Value = Isometry> {
    (any::<bool>(), -3.2..3.2f64, -1e5..1e5f64, -1e5..1e5f64).prop_map(|(is_mirrored, turn, x_m, y_m)| Isometry {
        is_mirrored,
        turn: Angle::from_rad(turn),
        shift: Displacement::from_m(x_m, y_m),
    })
}

const TICKS: u32 = 300;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(100) })]
    /// Over 150 s in worlds rotated by any angle, shifted by up to 140 km and optionally mirrored: every membership,
    /// status, event and assignment is the same. Every position, heading, speed, command, covariance and radius is the
    /// same to a millionth (of a metre, a radian, their rates); the largest difference in 75 worlds was 2e-8.
    ///
    /// Rounding does not decide ties: both members of a pair are equally far from their centroid, and then the higher
    /// id counts as furthest. Other ties would need a specially constructed world; the random worlds have none.
    #[test]
    fn a_rotated_shifted_and_mirrored_world_gives_the_same_mission(start in any_start(), through in any_isometry()) {
        let identity = Isometry { is_mirrored: false, turn: Angle::ZERO, shift: Displacement::from_m(0.0, 0.0) };
        let (mut plain, mut moved) = (World::new(&start, identity), World::new(&start, through));
        for tick in 0..TICKS {
            plain.tick();
            moved.tick();
            prop_assert_eq!(plain.decisions(), moved.decisions(), "tick {}", tick);
            let difference = moved.max_difference(&plain);
            prop_assert!(difference < 1e-6, "tick {tick}: {difference:e}");
        }
    }
}
