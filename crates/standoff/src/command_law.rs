//! Command law of a UAV: computes the command and the sensor pointing from the team state.

use crate::angle::Angle;
use crate::coordination::group::Group;
use crate::coordination::lost_target_search::SearchArea;
use crate::coordination::memberships::GroupedTrack;
use crate::frame::{Displacement, Position, Velocity};
use crate::group_id::GroupId;
use crate::guidance::followed::Followed;
use crate::guidance::heading::{DesiredPath, Orbit, OrbitRelativeState, Steering};
use crate::guidance::phase_control::{is_in_transit, phase_control_speed_m_s, phase_error_rad, phase_gap_min_rad};
use crate::guidance::phase_control_in_wind::phase_control_in_wind;
use crate::guidance::sensor_pointing::{angular_midpoint, angular_midpoint_of_most};
use crate::guidance::standoff_distance::Ramp;
use crate::intruders::Intruders;
use crate::message::Manoeuvre;
use crate::output::{AgentOutput, Diagnostics, Observation, PointingTarget, Rejected};
use crate::params::{AltitudePolicy, GroupingParams, LinkModel, Pointing, SeparationParams, TeamParams};
use crate::safety::fallback::{FallbackModel, Plan};
use crate::safety::flown::Flown;
use crate::safety::motion::Motion;
use crate::safety::other_aircraft::OtherAircraft;
use crate::safety::predicted_trajectory::Intent;
use crate::safety::separation::{Avoidance, CollisionAvoidance, DesiredCommands, reach_over_ground_m};
use crate::safety::zones::GeofenceSafety;
use crate::team_state::TeamState;
use crate::uav::{Command, LimitedCommand, UavId, UavState, Vertical};
use crate::wind::Wind;

/// Maximum distance to an orbit, as a fraction of its radius, at which a UAV of another group counts as a neighbour on
/// it.
const NEAR_ORBIT: f64 = 0.25;

/// Decides for any UAV of a team, from one team state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommandLaw<'a> {
    pub(crate) params: &'a TeamParams,
    pub(crate) team_state: &'a TeamState,
    /// Geofence safety function of the observed UAV; `None` if no zone binds it.
    pub(crate) geofence_safety: Option<&'a GeofenceSafety>,
    /// Aircraft outside the team.
    pub(crate) intruders: &'a Intruders,
    /// Fallbacks of UAVs that no zone binds; `None` without collision avoidance.
    pub(crate) fallbacks: Option<&'a FallbackModel>,
    /// Wind that the observed UAV assumes; `None`: calm air. Guidance is over ground: courses, ground speeds and course
    /// rates. Safety selects commands relative to the air, as all commands to the autopilot are.
    pub(crate) wind: Option<Wind>,
}

/// What a UAV flies since its last decision.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LastDecision {
    /// Manoeuvre for the next report.
    pub(crate) manoeuvre: Option<Manoeuvre>,
    /// Motion, command and plan; `None` without geofence and collision avoidance.
    flown: Option<Box<Flown>>,
    /// Motion of near teammates at their last reports, in wind or if they bank.
    teammates: Vec<(UavId, Flown)>,
}

/// Command of a UAV without collision avoidance.
struct Desired {
    /// Command relative to the air, within the limits and the geofence; and until when it is held.
    intent: Intent,
    speed_limited: bool,
    turn_rate_limited: bool,
    steering: Option<Steering>,
    /// Path that the command follows, unless a zone or a limit changes the turn.
    path: Option<DesiredPath>,
    phase_error_rad: f64,
    /// Index of the zone that changes the command.
    zone: Option<usize>,
}

/// What a UAV follows without zones and other aircraft.
struct LawCommand {
    followed: Followed,
    steering: Option<Steering>,
    path: Option<DesiredPath>,
    phase_error_rad: f64,
}

impl LawCommand {
    /// A turn of a UAV in the state `own`, without orbit.
    fn turn(own: &UavState, command: Command) -> Self {
        Self { followed: Followed::turn(own, command), steering: None, path: None, phase_error_rad: 0.0 }
    }
}

/// Motion of a UAV, and its state over ground.
#[derive(Clone, Copy)]
struct Own<'a> {
    observation: &'a Observation,
    motion: &'a Motion,
    /// Fallback that it has planned.
    plan: Option<Plan>,
    /// Teammates that may come near.
    teammates: &'a [OtherAircraft],
}

impl CommandLaw<'_> {
    /// Returns the command of the observed UAV, relative to the air, and what it flies until its next decision.
    pub(crate) fn decide(
        &self,
        observation: &Observation,
        refused: Rejected,
        last: &LastDecision,
    ) -> (AgentOutput, LastDecision) {
        let Observation { ref own, time, .. } = *observation;
        let flown = last.flown.as_deref();
        let law = Self { wind: self.wind.filter(|_| own.is_finite()), ..*self };
        let uav = &self.params.uav;
        let acceleration_m_s2 =
            |airspeed_m_s: f64| flown.map_or(0.0, |flown| flown.acceleration_m_s2(time, airspeed_m_s));
        let air = law.wind.map_or(*own, |wind| wind.relative_to_air(own, acceleration_m_s2));
        let motion = Flown::motion(flown, uav, &air, time).in_wind(law.wind);
        let plan = flown.and_then(|flown| flown.plan);
        let before = &last.teammates[..];
        let teammates = law.teammates_near(observation, before);
        let output = law.decide_safely(Own { observation, motion: &motion, plan, teammates: &teammates }, refused);
        let has_safety = own.is_finite() && (self.fallbacks.is_some() || self.geofence_safety.is_some());
        let flown = has_safety.then(|| {
            let plan = self
                .geofence_safety
                .and_then(|geofence| geofence.plan_after(&motion, output.command, plan, self.params.log.period_s));
            Box::new(Flown { from: time, motion, command: output.command, plan })
        });
        let manoeuvre = output.manoeuvre(own.is_finite() && uav.bank.is_some() && self.fallbacks.is_some());
        let has_memory = self.wind.is_some() || uav.bank.is_some();
        let teammates = teammates.iter().filter(|_| has_memory).filter_map(|other| other.as_flown(time)).collect();
        (output, LastDecision { manoeuvre, flown, teammates })
    }

    /// Returns the output of a UAV; its command is relative to the air.
    fn decide_safely(&self, of: Own, refused: Rejected) -> AgentOutput {
        let Observation { uav: id, ref own, .. } = *of.observation;
        let own_state_invalid = !own.is_finite();
        let group = self.team_state.group_of(id).filter(|_| !own_state_invalid);
        let geofence_safety = self.geofence_safety.filter(|_| !own_state_invalid);
        let desired = self.desired(of, group, geofence_safety);
        let altitude_m = self.altitude_m(id, group);
        let separation = self.params.separation.as_ref().zip(self.fallbacks).filter(|_| !own_state_invalid);
        let (command, altitude_m, avoids) = match separation {
            Some(separation) => self.avoid_aircraft(separation, of, desired.intent, altitude_m),
            None => (desired.intent.command, altitude_m, None),
        };
        let Desired { speed_limited, turn_rate_limited, steering, path, phase_error_rad, zone: border, .. } = desired;
        // The diagnostics describe the command in effect, whatever its source.
        let is_at_limit = || command.turn_rate_rad_s.abs() >= self.params.uav.turn_rate_max_rad_s;
        let is_changed = avoids.is_some() || border.is_some();
        let turn_rate_limited = if is_changed { is_at_limit() } else { turn_rate_limited };
        AgentOutput {
            command,
            path: path.filter(|_| avoids.is_none()),
            altitude_m,
            pointing_target: self.pointing_target(id, own, group),
            diagnostics: Diagnostics {
                group: group.map(|group| group.id),
                group_number: group.and_then(|group| self.team_state.group_number(group.id)),
                steering,
                speed_limited,
                turn_rate_limited,
                orbit_is_infeasible: group.is_some_and(|group| !group.has_feasible_orbit()),
                phase_error_rad,
                nearest_groupmate_m: group.and_then(|group| {
                    let teammates = self.groupmates(id, group.id);
                    let others = teammates.map(|(at, _, _)| at.distance_m(own.position));
                    others.reduce(f64::min)
                }),
                ungrouped_targets: self.team_state.ungrouped_count,
                rejected: refused,
                own_state_invalid,
                avoiding: avoids,
                limiting_zone: border.map(|zone| zone as u32),
                wind: self.wind.map(|wind| wind.velocity),
            },
        }
    }

    /// Command relative to the air that follows guidance, within the limits. `own` is the state over ground.
    fn air_command(&self, own: &UavState, followed: &Followed) -> LimitedCommand {
        match self.wind {
            Some(wind) if own.is_finite() => wind.air_command(self.params, own, followed),
            _ => {
                let speed_m_s = followed.guidance.speed_m_s;
                self.params.uav.limit(Command { speed_m_s, turn_rate_rad_s: followed.course_rate_rad_s() })
            }
        }
    }

    /// Intent of a UAV that flies a command relative to the air, and that follows the law over ground.
    fn intent(&self, own: &UavState, command: Command, followed: &Followed, steering: Option<&Steering>) -> Intent {
        let Some(steering) = steering else { return Intent::held(command) };
        let speed_m_s = followed.guidance.speed_m_s;
        let turn_rate_rad_s = followed.course_rate_rad_s();
        let ground = self.params.uav.limit(Command { speed_m_s, turn_rate_rad_s }).command;
        let Intent { for_s, turn_rate_after_rad_s, .. } = Intent::of(ground, own.heading, steering);
        let after = Followed::turn(own, Command { speed_m_s, turn_rate_rad_s: turn_rate_after_rad_s });
        Intent { command, for_s, turn_rate_after_rad_s: self.air_command(own, &after).command.turn_rate_rad_s }
    }

    /// Command of a UAV without collision avoidance; straight flight if its state is invalid.
    fn desired(&self, of: Own, group: Option<&Group>, geofence_safety: Option<&GeofenceSafety>) -> Desired {
        let Own { observation, motion, plan, .. } = of;
        let Observation { uav: id, ref own, .. } = *observation;
        let law = match group {
            _ if !own.is_finite() => {
                LawCommand::turn(own, Command { speed_m_s: self.params.uav.speed_m_s, turn_rate_rad_s: 0.0 })
            }
            Some(group) => self.fly_orbit(observation, group),
            None => self.wait(observation),
        };
        let detour = geofence_safety.and_then(|geofence_safety| {
            let (orbit, largest_m) = match group {
                Some(group) => (group.orbit(), group.radius_max_m),
                None => (self.waiting_orbit(id, own)?, f64::INFINITY),
            };
            geofence_safety.detours.detour(&self.params.guidance, own, &orbit, self.params.uav.speed_m_s, largest_m)
        });
        let LawCommand { followed, steering, path, phase_error_rad } = law;
        let followed = detour.map_or(followed, |detour| detour.followed);
        let LimitedCommand { command, speed_limited, turn_rate_limited } = self.air_command(own, &followed);
        // Only collision avoidance looks beyond the command.
        let foreseen = steering.as_ref().filter(|_| detour.is_none() && self.params.separation.is_some());
        let mut intent = self.intent(own, command, &followed, foreseen);
        // The geofence limits the command before and after collision avoidance.
        let stopped_by = geofence_safety.and_then(|geofence_safety| {
            let (safe, zone) = geofence_safety.make_safe(motion, intent.command, plan.as_ref());
            zone.inspect(|_| intent = Intent::held(safe))
        });
        let zone = stopped_by.or(detour.map(|detour| detour.zone));
        let path = path.filter(|_| zone.is_none() && !turn_rate_limited);
        Desired { intent, speed_limited, turn_rate_limited, steering, path, phase_error_rad, zone }
    }

    /// Returns the command and altitude that keep the minimum separation, and the aircraft avoided.
    fn avoid_aircraft(
        &self,
        (separation, in_air): (&SeparationParams, &FallbackModel),
        of: Own,
        desired: Intent,
        altitude_m: Option<f64>,
    ) -> (Command, Option<f64>, Option<Avoidance>) {
        let Own { observation, motion, plan, teammates } = of;
        let Observation { uav: id, time, .. } = *observation;
        let manoeuvre = self.team_state.teammate(id).and_then(|own| own.manoeuvre);
        let geofence = self.geofence_safety;
        let fallbacks = geofence.map_or(in_air, |geofence| &geofence.model);
        let keeper = CollisionAvoidance { separation, fallbacks, geofence, id, own: motion, manoeuvre, plan };
        let intruder = |other: OtherAircraft| self.wind.map_or(other, |wind| other.in_air(wind, &self.params.uav));
        let near = teammates.iter().copied().filter(|other| keeper.may_come_near(&other.motion.state));
        let others = near.chain(self.intruders.others(time).map(intruder));
        let altitude_m = altitude_m.map(|altitude_m| keeper.altitude_m(altitude_m, others.clone()));
        let (command, avoids) = keeper.avoid(desired, altitude_m, others, self);
        (command, altitude_m, avoids)
    }

    /// Teammates that may come near, and their motion at their last reports. `before` contains earlier motions.
    fn teammates_near(&self, observation: &Observation, before: &[(UavId, Flown)]) -> Vec<OtherAircraft> {
        let Observation { uav: id, ref own, time } = *observation;
        let Some((separation, fallbacks)) = self.params.separation.as_ref().zip(self.fallbacks) else {
            return Vec::new();
        };
        let (mut buffer, places) = (Vec::new(), &self.team_state.reported_places);
        let wind_m_s = self.wind.map_or(0.0, |wind| wind.velocity.speed_m_s());
        let reach_m = reach_over_ground_m(separation, &fallbacks.airframe, places.fastest_m_s, wind_m_s);
        let near = places.near(own.position, reach_m, &mut buffer).map(|index| &self.team_state.teammates[index]);
        let near = near.filter(|teammate| teammate.uav != id);
        near.map(|teammate| {
            let age_s = (time - teammate.last_report_at).s().max(0.0);
            let before = before.iter().find(|(uav, _)| *uav == teammate.uav).map(|(_, flown)| flown);
            OtherAircraft::teammate(teammate, age_s, self.wind, &self.params.uav, before)
        })
        .collect()
    }

    /// Other UAVs of a group: position, id and position relative to the orbit.
    fn groupmates(&self, id: UavId, group: GroupId) -> impl Iterator<Item = (Position, UavId, &OrbitRelativeState)> {
        let assigned_uavs = self.team_state.on_orbit_of(group).filter(move |(teammate, _)| teammate.uav != id);
        assigned_uavs.map(|(teammate, on_orbit)| (teammate.state.position, teammate.uav, on_orbit))
    }

    /// Position of a UAV relative to its group's orbit; `None` unless the UAV has reported at this time step.
    fn on_orbit_as_reported(&self, uav: UavId, group: GroupId) -> Option<&OrbitRelativeState> {
        let mut assigned_uavs = self.team_state.on_orbit_of(group);
        assigned_uavs.find(|(teammate, _)| teammate.uav == uav && teammate.reported_now).map(|(_, on_orbit)| on_orbit)
    }

    fn fly_orbit(&self, observation: &Observation, group: &Group) -> LawCommand {
        let Observation { uav: id, ref own, .. } = *observation;
        let guidance = &self.params.guidance;
        let computed;
        let known = self.on_orbit_as_reported(id, group.id).filter(|_| observation.time == self.team_state.time);
        let on_orbit = match known {
            Some(known) => known,
            None => {
                computed = OrbitRelativeState::of(guidance, own.position, &group.orbit());
                &computed
            }
        };
        let orbit = &on_orbit.orbit;
        let is_away = |teammate: &OrbitRelativeState| is_in_transit(teammate.centre_distance_m(), orbit.distance_m);
        let error_rad = if is_away(on_orbit) { 0.0 } else { self.phase_error_rad(id, group, on_orbit) };
        let nominal_m_s = self.params.uav.speed_m_s;
        let centre_m_s = orbit.centre_velocity.speed_m_s();
        let in_wind = self.wind.and_then(|wind| {
            let groupmates = self.groupmates(id, group.id).map(|(.., teammate)| teammate);
            phase_control_in_wind(wind, self.params, on_orbit, groupmates.filter(|mate| !is_away(mate)), error_rad)
        });
        // The field is followed at the speed that the limits allow, so that (25) and (29) hold for it.
        let (desired_m_s, limited_m_s) = in_wind.unwrap_or_else(|| {
            let desired_m_s =
                phase_control_speed_m_s(error_rad, guidance.phase_gain_1_s, orbit.distance_m, nominal_m_s, centre_m_s);
            let desired_m_s = on_orbit.ground_speed_m_s(guidance, desired_m_s);
            (desired_m_s, self.params.uav.limit_speed_m_s(desired_m_s).0)
        });
        let followed = on_orbit.follow(guidance, &self.params.uav, own, limited_m_s);
        LawCommand {
            steering: Some(on_orbit.steering(&followed, limited_m_s)),
            followed: followed.at_speed(desired_m_s),
            path: Some(DesiredPath { law: *guidance, orbit: *orbit, speed_m_s: limited_m_s }),
            phase_error_rad: error_rad,
        }
    }

    /// Phase error of a UAV that is on its orbit, against the other UAVs on it.
    fn phase_error_rad(&self, id: UavId, group: &Group, on_orbit: &OrbitRelativeState) -> f64 {
        let (guidance, orbit) = (&self.params.guidance, &on_orbit.orbit);
        let is_away = |teammate: &OrbitRelativeState| is_in_transit(teammate.centre_distance_m(), orbit.distance_m);
        let spacing = |others: &mut dyn Iterator<Item = (UavId, Angle)>| {
            let separation_min_m = self.params.separation.map_or(0.0, |separation| separation.horizontal_min_m);
            let gap_min_rad = || phase_gap_min_rad(separation_min_m, orbit.distance_m);
            let (desired_rad, sense) = (guidance.desired_phase_rad, guidance.orbit_direction);
            phase_error_rad((id, on_orbit.phase), others, desired_rad, gap_min_rad, sense)
        };
        match self.params.link {
            LinkModel::Ideal => {
                let others = self.groupmates(id, group.id).filter(|(.., teammate)| !is_away(teammate));
                spacing(&mut others.map(|(_, teammate, on_orbit)| (teammate, on_orbit.phase)))
            }
            // Every UAV near the orbit needs phase control, whatever its assignment.
            LinkModel::Lossy => {
                let others = self.team_state.teammates.iter().filter(|teammate| teammate.uav != id);
                let others =
                    others.map(|teammate| (teammate, OrbitRelativeState::of(guidance, teammate.state.position, orbit)));
                let is_near = |on_orbit: &OrbitRelativeState| {
                    (on_orbit.centre_distance_m() - orbit.distance_m).abs() <= NEAR_ORBIT * orbit.distance_m
                };
                let others = others.filter(|(teammate, on_orbit)| match teammate.group == Some(group.id) {
                    true => !is_away(on_orbit),
                    false => is_near(on_orbit),
                });
                spacing(&mut others.map(|(teammate, on_orbit)| (teammate.uav, on_orbit.phase)))
            }
        }
    }

    /// Altitude of the group's orbit, or the UAV's own altitude.
    fn altitude_m(&self, id: UavId, group: Option<&Group>) -> Option<f64> {
        let altitude_m = self.params.own_altitude_m(id).or(group.map(|group| group.altitude_m))?;
        Some(self.params.limit_altitude_m(altitude_m))
    }

    /// Command without a group: a circle around the search area; otherwise the smallest orbit around the last known
    /// position of a target, or around the UAV's own position.
    fn wait(&self, observation: &Observation) -> LawCommand {
        let Observation { uav: id, ref own, .. } = *observation;
        let (law, speed_m_s) = (self.params.guidance, self.params.uav.speed_m_s);
        let Some(orbit) = self.waiting_orbit(id, own) else {
            return LawCommand::turn(own, self.params.fallback_command());
        };
        let followed =
            OrbitRelativeState::of(&law, own.position, &orbit).follow(&law, &self.params.uav, own, speed_m_s);
        let path = Some(DesiredPath { law, orbit, speed_m_s });
        LawCommand { followed, steering: None, path, phase_error_rad: 0.0 }
    }

    fn waiting_orbit(&self, id: UavId, own: &UavState) -> Option<Orbit> {
        let smallest_m = self.params.stationary_orbit_bounds().radius_min_m;
        let search_area = self.search_area(id).map(|area| (area.centre, area.radius_m));
        let last_known = || self.nearest_known(id, own).map(|last_known| (last_known.position, smallest_m));
        let (centre, radius_m) = search_area.or_else(last_known)?;
        Some(Orbit {
            centre,
            centre_velocity: Velocity::ZERO,
            distance_m: radius_m,
            rate_m_s: 0.0,
            steered: Ramp { radius_m, rate_m_s: 0.0 },
        })
    }

    fn search_area(&self, id: UavId) -> Option<SearchArea> {
        SearchArea::of(self.team_state.search_target_of(id)?, 0.0, self.params)
    }

    /// Points at the centre of the group or the angular midpoint of its members; without a group, at the search area or
    /// at the last known position of a target.
    fn pointing_target(&self, id: UavId, uav: &UavState, group: Option<&Group>) -> Option<PointingTarget> {
        let Some(group) = group else {
            let in_search_area = self.search_area(id).map(|area| {
                let sensor = &self.params.track.sensor;
                let boresight = area.boresight(id, uav.position, self.team_state.time, sensor.field_of_view_rad);
                let ahead = Displacement::from_polar(sensor.sensing_range_m, boresight);
                PointingTarget { position: uav.position + ahead, velocity: Velocity::ZERO }
            });
            return in_search_area.or_else(|| self.nearest_known(id, uav));
        };
        let centre = group.centre.estimate().state;
        let centre = PointingTarget { position: centre.position(), velocity: centre.velocity() };
        if self.params.group.pointing == Pointing::GroupCentre {
            return Some(centre);
        }
        let members = self.team_state.members_of(group.id);
        let own = members.clone().filter(|known| known.membership.group() == Some(group.id));
        let state = |known: &GroupedTrack| known.estimate().state;
        let weighed = |known: &GroupedTrack| {
            let sd_m = known.estimate().position_sd_max_m();
            (state(known), sd_m * sd_m, known.priority)
        };
        let fits_rad = self.params.track.sensor.field_of_view_rad;
        // Members of the group come first; targets in handoff to it follow once the orbit has room for all. If they differ
        // in priority, those that no other group has in view count like members.
        let priorities = || members.clone().map(|known| known.priority);
        let are_equal = priorities().all(|priority| Some(priority) == priorities().next());
        let alone =
            members.clone().filter(|known| !are_equal && known.membership.group().is_none_or(|of| of == group.id));
        angular_midpoint(uav, centre.position, members.map(state), fits_rad)
            .or_else(|| angular_midpoint_of_most(uav, alone.map(weighed), fits_rad))
            .or_else(|| angular_midpoint(uav, centre.position, own.clone().map(state), fits_rad))
            .or_else(|| angular_midpoint_of_most(uav, own.map(weighed), fits_rad))
            .or(Some(centre))
    }

    /// Nearest track; a lost one, at its last position, if there are no others. `None` if the team state contains no
    /// report of this UAV, because no teammate expects it to do anything.
    fn nearest_known(&self, id: UavId, own: &UavState) -> Option<PointingTarget> {
        self.team_state.teammate(id)?;
        let nearest = |lost: bool| {
            let tracks =
                self.team_state.tracks().iter().map(|known| &known.track).filter(|track| track.is_lost() == lost);
            let positions = tracks.map(|track| {
                let state = track.estimate().state;
                let velocity = if lost { Velocity::ZERO } else { state.velocity() };
                PointingTarget { position: state.position(), velocity }
            });
            let squared_m2 = |target: &PointingTarget| target.position.squared_distance_m2(own.position);
            positions.min_by(|a, b| squared_m2(a).total_cmp(&squared_m2(b)))
        };
        nearest(false).or_else(|| nearest(true))
    }
}

impl DesiredCommands for CommandLaw<'_> {
    fn intent_of(&self, teammate: UavId) -> Option<Intent> {
        let teammate = self.team_state.teammate(teammate)?;
        let (state, group) = (&teammate.last_report, teammate.group?);
        let (guidance, uav, speed_m_s) = (&self.params.guidance, &self.params.uav, state.speed_m_s);
        let computed;
        let on_orbit = match self.on_orbit_as_reported(teammate.uav, group) {
            Some(known) => known,
            None => {
                let orbit = self.team_state.group(group)?.orbit();
                computed = OrbitRelativeState::of(guidance, state.position, &orbit);
                &computed
            }
        };
        let followed = on_orbit.follow(guidance, uav, state, speed_m_s);
        let steering = on_orbit.steering(&followed, speed_m_s);
        let command = self.air_command(state, &followed).command;
        Some(self.intent(state, command, &followed, Some(&steering)))
    }

    fn desired(&self, teammate: UavId, motion: &Motion) -> Intent {
        let own = self.wind.map_or(motion.state, |wind| wind.over_ground(&motion.state, 0.0));
        let observation = &Observation { uav: teammate, time: self.team_state.time, own };
        let of = Own { observation, motion, plan: None, teammates: &[] };
        CommandLaw::desired(self, of, self.team_state.group_of(teammate), self.geofence_safety).intent
    }
}

impl TeamParams {
    /// Command of a UAV that knows no targets or whose computer is off: the smallest orbit at its position.
    pub fn fallback_command(&self) -> Command {
        let (speed_m_s, radius_m) = (self.uav.speed_m_s, self.stationary_orbit_bounds().radius_min_m);
        Command { speed_m_s, turn_rate_rad_s: self.guidance.orbit_direction.sign() * speed_m_s / radius_m }
    }

    /// Altitude of a UAV that is not assigned to a group yet, m: the lowest one, or its own; within the limits.
    pub fn initial_altitude_m(&self, uav: UavId) -> f64 {
        self.limit_altitude_m(self.own_altitude_m(uav).unwrap_or(self.group.altitude_lowest_m))
    }

    /// Altitude of a UAV that does not depend on its assignment, m; `None` if its group determines it.
    pub(crate) fn own_altitude_m(&self, uav: UavId) -> Option<f64> {
        let GroupingParams { altitude_lowest_m, altitude_step_m, altitude_policy: altitudes, .. } = self.group;
        match (altitudes, self.link) {
            (AltitudePolicy::PerGroup, LinkModel::Ideal) => None,
            (AltitudePolicy::PerGroup, LinkModel::Lossy) | (AltitudePolicy::PerUav, _) => {
                Some(altitude_lowest_m + f64::from(uav.0) * altitude_step_m)
            }
            (AltitudePolicy::Common, _) => Some(altitude_lowest_m),
        }
    }

    /// Lowest and highest altitude that a UAV may be commanded to fly at, m: its own one, or those of all groups that it
    /// may be assigned to. The number of groups is unknown, so the highest one is the limit of altitude, or infinite.
    pub(crate) fn commanded_altitudes_m(&self, uav: UavId) -> [f64; 2] {
        let own_m = self.own_altitude_m(uav);
        own_m
            .map_or([self.group.altitude_lowest_m, f64::INFINITY], |own_m| [own_m; 2])
            .map(|altitude_m| self.limit_altitude_m(altitude_m))
    }

    /// Lowest and highest altitude that a UAV may have from now on, m: those that it may be commanded to fly at, and
    /// those on the way to them. UAVs level off without overshoot.
    pub fn altitudes_m(&self, uav: UavId, now: Option<Vertical>) -> [f64; 2] {
        let [low_m, high_m] = self.commanded_altitudes_m(uav);
        let Some(Vertical { altitude_m, climb_rate_m_s }) = now else { return [low_m, high_m] };
        // A UAV that climbs away from these altitudes first levels off.
        let level_m = altitude_m + climb_rate_m_s * self.uav.climb.map_or(0.0, |climb| climb.lag_s);
        [low_m.min(altitude_m).min(level_m), high_m.max(altitude_m).max(level_m)]
    }

    /// Limits an altitude to the allowed range, m.
    pub(crate) fn limit_altitude_m(&self, altitude_m: f64) -> f64 {
        self.uav.climb.map_or(altitude_m, |climb| climb.limit_m(altitude_m))
    }
}
