//! No direction, no place and no handedness is special: turned, moved and mirrored worlds give turned, moved and
//! mirrored results.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{Draw, OwnedScan};
use proptest::prelude::*;
use standoff::*;

/// A motion of the plane: mirrored north-south if so, then turned about the origin, then moved.
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

    fn position(&self, place: Position) -> Position {
        let (x_m, y_m) = self.vector(place.x_m(), place.y_m());
        Position::from_m(x_m, y_m) + self.shift
    }

    fn velocity(&self, velocity: Velocity) -> Velocity {
        let (x_m_s, y_m_s) = self.vector(velocity.x_m_s(), velocity.y_m_s());
        Velocity::from_m_s(x_m_s, y_m_s)
    }

    fn turn_rate(&self, rad_s: f64) -> f64 {
        if self.is_mirrored { -rad_s } else { rad_s }
    }

    fn sense(&self, sense: Sense) -> Sense {
        match (self.is_mirrored, sense) {
            (false, sense) => sense,
            (true, Sense::Anticlockwise) => Sense::Clockwise,
            (true, Sense::Clockwise) => Sense::Anticlockwise,
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

/// A target on a straight line, at the start.
#[derive(Debug, Clone, Copy)]
struct Vehicle {
    position: Position,
    velocity: Velocity,
}

/// A world as it starts.
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
        feedforward in prop_oneof![Just(Feedforward::Flown), Just(Feedforward::Actual), Just(Feedforward::Exact), Just(Feedforward::Printed)],
        lead in prop_oneof![Just(Lead::Constant(3.0)), Just(Lead::Scheduled), Just(Lead::Predicted)],
        speed_reference in prop_oneof![Just(SpeedReference::Ground), Just(SpeedReference::Centre)],
        centre in prop_oneof![
            Just(CentreEstimate::Filtered),
            Just(CentreEstimate::Centroid),
            Just(CentreEstimate::SmallestCircle),
        ],
        aim in prop_oneof![Just(Aim::Centre), Just(Aim::Middle)],
        discard in prop_oneof![Just(Discard::Furthest), Just(Discard::Widening)],
        sense in prop_oneof![Just(Sense::Anticlockwise), Just(Sense::Clockwise)],
        moves in any::<bool>(),
        count in prop_oneof![Just(GroupCount::Half), Just(GroupCount::Needed)],
    ) -> Start {
        let mut draw = Draw(seed);
        let mut team = TeamParams::table_1();
        (team.guidance.feedforward, team.guidance.lead, team.guidance.sense) = (feedforward, lead, sense);
        (team.guidance.speed_reference, team.group.centre) = (speed_reference, centre);
        (team.group.aim, team.group.discard, team.group.count) = (aim, discard, count);
        // A filtered centre has no motion besides.
        team.group.motion.response_s = if moves && centre != CentreEstimate::Filtered { 1.5 } else { 0.0 };
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

/// A world in flight, seen through an isometry: the same draws make the same noise in range and bearing, and the same
/// errors of cues, turned.
struct World {
    through: Isometry,
    fleet: Fleet,
    team: TeamParams,
    uavs: Vec<UavState>,
    vehicles: Vec<Vehicle>,
    look_at: Vec<Option<LookAt>>,
    commands: Vec<Command>,
    noise: Draw,
    tick: i64,
}

const PERIOD: Duration = Duration::from_us(500_000);

impl World {
    fn new(start: &Start, through: Isometry) -> Self {
        let mut team = start.team;
        team.guidance.sense = through.sense(team.guidance.sense);
        let vehicle = |vehicle: &Vehicle| Vehicle {
            position: through.position(vehicle.position),
            velocity: through.velocity(vehicle.velocity),
        };
        Self {
            through,
            fleet: Fleet::new(team).unwrap(),
            team,
            uavs: start.uavs.iter().map(|uav| through.uav(uav)).collect(),
            vehicles: start.vehicles.iter().map(vehicle).collect(),
            look_at: vec![None; start.uavs.len()],
            commands: Vec::new(),
            noise: Draw(start.noise_seed),
            tick: 0,
        }
    }

    /// What every sensor says: noise is drawn for every UAV and target, seen or not.
    fn scans(&mut self) -> Vec<OwnedScan> {
        let sensor = self.team.track.sensor;
        let mut scans = Vec::new();
        for (uav, look_at) in self.uavs.iter().zip(&self.look_at) {
            let boresight = look_at.map(|look| look.boresight(uav.position, PERIOD));
            let mut detections = Vec::new();
            for (id, vehicle) in (0..).zip(&self.vehicles) {
                let (range_m, bearing_rad) =
                    (1.5 * sensor.range_sd_m * self.noise.next(), 1.5 * sensor.bearing_sd_rad * self.noise.next());
                let seen = boresight.and_then(|boresight| sensor.look(uav.position, boresight, vehicle.position));
                let Some(mut measurement) = seen else { continue };
                measurement.range_m += range_m;
                measurement.bearing = measurement.bearing + Angle::from_rad(self.through.turn_rate(bearing_rad));
                detections.push(Detection { label: TargetLabel(id), measurement });
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
                searcher: 0,
                said: now,
                number: id as u16,
                label: TargetLabel(id),
                time: now,
                position: *position + Displacement::from_m(dx_m, dy_m),
                velocity: Velocity::from_m_s(velocity.x_m_s() + dvx_m_s, velocity.y_m_s() + dvy_m_s),
                position_sd_m: 20.0,
                velocity_sd_m_s: 2.0,
            })
        };
        (0..).zip(&self.vehicles).map(cue).collect()
    }

    fn tick(&mut self) {
        let now = Time::from_us(self.tick * PERIOD.us());
        let cues = if self.tick == 0 { self.cues(now) } else { Vec::new() };
        let scans = self.scans();
        let observed = common::observe_all(&mut self.fleet, now, &self.uavs, &scans, &cues);
        let response = self.team.uav.response(PERIOD);
        self.commands.clear();
        for (index, uav) in self.uavs.iter_mut().enumerate() {
            let step = self.fleet.decide(&observed[index]);
            self.look_at[index] = step.look_at;
            self.commands.push(step.command);
            *uav = response.step(uav, step.command);
        }
        for vehicle in &mut self.vehicles {
            vehicle.position = vehicle.position + vehicle.velocity * PERIOD.s();
        }
        self.tick += 1;
    }

    /// What was decided: who is a member where, who serves whom, what happened; without numbers that are measured.
    fn decisions(&self) -> String {
        let picture = self.fleet.picture();
        let places = picture
            .known()
            .iter()
            .map(|known| (known.track.id, known.track.status, known.group(), known.receiving_group()));
        let events =
            picture.events.iter().map(|event| (event.kind.name(), event.track, event.group, event.to, event.uav));
        let groups = picture.groups.iter().map(|group| (group.id, group.members, group.altitude_m));
        let all = (places.collect::<Vec<_>>(), &picture.crew, events.collect::<Vec<_>>(), groups.collect::<Vec<_>>());
        format!("{all:?}")
    }

    /// How far the numbers are from those of `plain`, transformed: metres, metres per second, radians, all alike.
    fn apart(&self, plain: &World) -> f64 {
        let mut most = 0.0f64;
        let places = |one: Position, other: Position| one.distance_m(self.through.position(other));
        for (own, other) in self.uavs.iter().zip(&plain.uavs) {
            most = most.max(places(own.position, other.position));
            most = most.max((own.heading - self.through.angle(other.heading)).abs_rad());
        }
        for (own, other) in self.commands.iter().zip(&plain.commands) {
            most = most.max((own.speed_m_s - other.speed_m_s).abs());
            most = most.max((own.turn_rate_rad_s - self.through.turn_rate(other.turn_rate_rad_s)).abs());
        }
        let (picture, other) = (self.fleet.picture(), plain.fleet.picture());
        for (own, other) in picture.known().iter().zip(other.known()) {
            let (own, other) = (own.track.estimate(), other.track.estimate());
            most = most.max(places(own.state.position(), other.state.position()));
            most = most
                .max((own.state.velocity().vector() - self.through.velocity(other.state.velocity()).vector()).norm());
            most = most.max((own.position_sd_max_m() - other.position_sd_max_m()).abs());
        }
        for (own, other) in picture.groups.iter().zip(&other.groups) {
            let positions = [own, other].map(|group| group.centre.estimate().state.position());
            most = most.max(places(positions[0], positions[1]));
            most = most.max((own.standoff.distance_m - other.standoff.distance_m).abs());
        }
        most
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
    /// Over 150 s in worlds turned by any angle, moved by up to 140 km and mirrored or not: every membership, status,
    /// event and assignment is the same, and every position, heading, speed, command, covariance and radius to a
    /// millionth (of a metre, a radian, their rates); 2e-8 is the most that was seen in 75 worlds.
    ///
    /// Nothing is left to rounding where it ties: both of a pair are equally far from their centroid, and there the
    /// higher id counts as furthest. Other ties would need a world drawn by rule; of these, none ties.
    #[test]
    fn a_world_turned_moved_and_mirrored_gives_the_same_mission(start in any_start(), through in any_isometry()) {
        let here = Isometry { is_mirrored: false, turn: Angle::ZERO, shift: Displacement::from_m(0.0, 0.0) };
        let (mut plain, mut moved) = (World::new(&start, here), World::new(&start, through));
        for tick in 0..TICKS {
            plain.tick();
            moved.tick();
            prop_assert_eq!(plain.decisions(), moved.decisions(), "tick {}", tick);
            prop_assert!(moved.apart(&plain) < 1e-6, "tick {tick}: {:e}", moved.apart(&plain));
        }
    }
}
