//! How a UAV decides from what its team knows and intends: the command, and where to look.

use crate::angle::Angle;
use crate::coordination::group::Group;
use crate::coordination::memberships::Known;
use crate::coordination::search::SearchArea;
use crate::frame::{Displacement, Position, Velocity};
use crate::group_id::GroupId;
use crate::guidance::aim::{middle, middle_of_most};
use crate::guidance::borders::Borders;
use crate::guidance::course::Intent;
use crate::guidance::heading::{OnOrbit, Orbit, Steering, steer};
use crate::guidance::separation::{Avoidance, Keeper, Other, SeparationParams};
use crate::guidance::spacing::{is_in_transit, spacing_error_rad, spacing_speed_m_s};
use crate::guidance::standoff_distance::Ramp;
use crate::intruders::Intruders;
use crate::picture::Picture;
use crate::step::{Diagnostics, LookAt, Observation, Refused, Step};
use crate::team::{Aim, Radio, TeamParams};
use crate::uav::{Aircraft, Command, LimitedCommand, UavId, UavState};

/// So near to an orbit, as a part of its radius, a UAV of another group is a neighbour on it.
const NEAR_ORBIT: f64 = 0.25;

/// Decides for any UAV of a team, from one picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pilot<'a> {
    pub(crate) params: &'a TeamParams,
    pub(crate) picture: &'a Picture,
    /// What keeps it within its airspace, where that is not everywhere.
    pub(crate) borders: Option<&'a Borders>,
    /// Who else flies there.
    pub(crate) intruders: &'a Intruders,
}

impl Pilot<'_> {
    /// What the UAV that was observed is to do.
    pub(crate) fn decide(&self, observation: &Observation, refused: Refused) -> Step {
        let Observation { uav: id, ref own, .. } = *observation;
        let own_state_invalid = !own.is_finite();
        let group = self.picture.group_of(id).filter(|_| !own_state_invalid);
        let (wanted, spacing_error_rad, steering) = match group {
            _ if own_state_invalid => {
                (Command { speed_m_s: self.params.uav.speed_m_s, turn_rate_rad_s: 0.0 }, 0.0, None)
            }
            Some(group) => self.fly_orbit(observation, group),
            None => (self.wait(id, own), 0.0, None),
        };
        let borders = self.borders.filter(|_| !own_state_invalid);
        let around = borders.and_then(|borders| {
            let (orbit, largest_m) = match group {
                Some(group) => (group.orbit(self.params), group.largest_m),
                None => (self.waiting_orbit(id, own)?, f64::INFINITY),
            };
            borders.ways.around(&self.params.guidance, own, &orbit, self.params.uav.speed_m_s, largest_m)
        });
        let wanted = around.map_or(wanted, |detour| detour.command);
        let LimitedCommand { command, speed_limited, turn_rate_limited } = self.params.uav.limit(wanted);
        // Nothing that is wanted of a UAV takes it where it may not be, and nothing that keeps it from others.
        let (command, kept_off) = borders.map_or((command, None), |borders| borders.keep(own, command));
        let border = kept_off.or(around.map(|detour| detour.zone));
        // What is flown because of a zone is not what the orbit wants.
        let intended = steering.as_ref().filter(|_| border.is_none());
        let altitude_m = self.altitude_m(id, group);
        let (command, altitude_m, avoids) = match self.params.separation.as_ref().filter(|_| !own_state_invalid) {
            Some(separation) => self.keep_apart(separation, observation, (command, intended), altitude_m),
            None => (command, altitude_m, None),
        };
        // What is flown counts, whatever asked for it.
        let is_at_limit = || command.turn_rate_rad_s.abs() >= self.params.uav.turn_rate_max_rad_s;
        let is_changed = avoids.is_some() || border.is_some();
        let turn_rate_limited = if is_changed { is_at_limit() } else { turn_rate_limited };
        Step {
            command,
            altitude_m,
            look_at: self.look_at(id, own, group),
            diagnostics: Diagnostics {
                group: group.map(|group| group.id),
                group_number: group.and_then(|group| self.picture.number(group.id)),
                steering,
                speed_limited,
                turn_rate_limited,
                orbit_is_infeasible: group.is_some_and(|group| !group.is_feasible()),
                spacing_error_rad,
                separation_m: group.and_then(|group| {
                    let mates = self.mates(id, group.id);
                    let others = mates.map(|(at, _, _)| at.distance_m(own.position));
                    others.reduce(f64::min)
                }),
                unassigned_targets: self.picture.unassigned,
                refused,
                own_state_invalid,
                avoids,
                border: border.map(|zone| zone as u32),
            },
        }
    }

    /// What to fly, and at which altitude, so that all stay apart; and who is avoided by that.
    fn keep_apart(
        &self,
        separation: &SeparationParams,
        observation: &Observation,
        wanted: (Command, Option<&Steering>),
        altitude_m: Option<f64>,
    ) -> (Command, Option<f64>, Option<Avoidance>) {
        let Observation { uav: id, ref own, time } = *observation;
        let keeper = Keeper { separation, uav: &self.params.uav, id, own };
        let mates = self.picture.team.iter().filter(|mate| mate.uav != id && keeper.may_come_near(&mate.said));
        let mates = mates.map(|mate| {
            let age_s = (time - mate.said_at).s().max(0.0);
            Other { aircraft: Aircraft::Uav(mate.uav), said: mate.said, age_s }
        });
        let others = mates.chain(self.intruders.others(time));
        let altitude_m = altitude_m.map(|altitude_m| keeper.altitude_m(altitude_m, others.clone()));
        let is_allowed = |command| self.borders.is_none_or(|borders| borders.allows(own, command));
        let (command, avoids) = keeper.keep_apart(wanted, altitude_m, others, |mate| self.intent_of(mate), is_allowed);
        (command, altitude_m, avoids)
    }

    /// What a UAV of a group was about to fly when it last spoke, if it flies as the group's orbit wants.
    fn intent_of(&self, mate: UavId) -> Option<Intent> {
        let mate = self.picture.teammate(mate)?;
        let (state, group) = (&mate.said, mate.group?);
        let guidance = &self.params.guidance;
        let steering = match self.on_orbit_as_heard(mate.uav, group) {
            Some(known) => known.steer(guidance, state, state.speed_m_s),
            None => steer(guidance, state, &self.picture.group(group)?.orbit(self.params), state.speed_m_s),
        };
        let command = Command { speed_m_s: state.speed_m_s, turn_rate_rad_s: steering.turn_rate_rad_s };
        Some(Intent::of(self.params.uav.limit(command).command, state.heading, &steering))
    }

    /// The other UAVs of a group: where they are, who they are, and where on its orbit.
    fn mates(&self, id: UavId, group: GroupId) -> impl Iterator<Item = (Position, UavId, &OnOrbit)> {
        let crew = self.picture.on_orbit_of(group).filter(move |(mate, _)| mate.uav != id);
        crew.map(|(mate, on_orbit)| (mate.state.position, mate.uav, on_orbit))
    }

    /// Where a UAV is on its group's orbit, if it was heard of the picture's very instant: then that is known.
    fn on_orbit_as_heard(&self, uav: UavId, group: GroupId) -> Option<&OnOrbit> {
        let mut crew = self.picture.on_orbit_of(group);
        crew.find(|(mate, _)| mate.uav == uav && mate.is_heard).map(|(_, on_orbit)| on_orbit)
    }

    fn fly_orbit(&self, observation: &Observation, group: &Group) -> (Command, f64, Option<Steering>) {
        let Observation { uav: id, ref own, .. } = *observation;
        let guidance = &self.params.guidance;
        let anew;
        let known = self.on_orbit_as_heard(id, group.id).filter(|_| observation.time == self.picture.time);
        let on_orbit = match known {
            Some(known) => known,
            None => {
                anew = OnOrbit::of(guidance, own.position, &group.orbit(self.params));
                &anew
            }
        };
        let orbit = &on_orbit.orbit;
        let is_away = |mate: &OnOrbit| is_in_transit(mate.centre_distance_m(), orbit.distance_m);
        let spacing = |others: &mut dyn Iterator<Item = (UavId, Angle)>| {
            spacing_error_rad((id, on_orbit.phase), others, guidance.separation_rad, guidance.sense)
        };
        let error_rad = match self.params.radio {
            _ if is_away(on_orbit) => 0.0,
            Radio::Perfect => {
                let others = self.mates(id, group.id).filter(|(.., mate)| !is_away(mate));
                spacing(&mut others.map(|(_, mate, on_orbit)| (mate, on_orbit.phase)))
            }
            // Whoever is near the orbit is to be kept from, whomever it serves.
            Radio::Fallible => {
                let others = self.picture.team.iter().filter(|mate| mate.uav != id);
                let others = others.map(|mate| (mate, OnOrbit::of(guidance, mate.state.position, orbit)));
                let is_near = |on_orbit: &OnOrbit| {
                    (on_orbit.centre_distance_m() - orbit.distance_m).abs() <= NEAR_ORBIT * orbit.distance_m
                };
                let others = others.filter(|(mate, on_orbit)| match mate.group == Some(group.id) {
                    true => !is_away(on_orbit),
                    false => is_near(on_orbit),
                });
                spacing(&mut others.map(|(mate, on_orbit)| (mate.uav, on_orbit.phase)))
            }
        };
        let nominal_m_s = self.params.uav.speed_m_s;
        let centre_m_s = orbit.centre_velocity.speed_m_s();
        let wanted_m_s =
            spacing_speed_m_s(error_rad, guidance.spacing_gain_1_s, orbit.distance_m, nominal_m_s, centre_m_s);
        let wanted_m_s = on_orbit.ground_speed_m_s(guidance, wanted_m_s);
        // The field is flown at the speed that the limits leave, so that (25) and (29) hold for it.
        let (flown_m_s, _) = self.params.uav.limit_speed_m_s(wanted_m_s);
        let steering = on_orbit.steer(guidance, own, flown_m_s);
        let wanted = Command { speed_m_s: wanted_m_s, turn_rate_rad_s: steering.turn_rate_rad_s };
        (wanted, error_rad, Some(steering))
    }

    /// That of the group's orbit, or the UAV's own.
    fn altitude_m(&self, id: UavId, group: Option<&Group>) -> Option<f64> {
        let altitude_m = self.params.own_altitude_m(id).or(group.map(|group| group.altitude_m))?;
        Some(self.params.limit_altitude_m(altitude_m))
    }

    /// With nothing to watch: a circle about where it searches; else of the smallest orbit, about where something was last
    /// known to be, or where the UAV is.
    fn wait(&self, id: UavId, own: &UavState) -> Command {
        let speed_m_s = self.params.uav.speed_m_s;
        let Some(orbit) = self.waiting_orbit(id, own) else { return self.params.smallest_circle() };
        Command { speed_m_s, turn_rate_rad_s: steer(&self.params.guidance, own, &orbit, speed_m_s).turn_rate_rad_s }
    }

    fn waiting_orbit(&self, id: UavId, own: &UavState) -> Option<Orbit> {
        let smallest_m = self.params.group.standoff.radius_min_m;
        let searched = self.search_area(id).map(|area| (area.about, area.radius_m));
        let last = || self.nearest_known(id, own).map(|last| (last.position, smallest_m));
        let (centre, radius_m) = searched.or_else(last)?;
        Some(Orbit {
            centre,
            centre_velocity: Velocity::ZERO,
            distance_m: radius_m,
            rate_m_s: 0.0,
            steered: Ramp { radius_m, rate_m_s: 0.0 },
        })
    }

    fn search_area(&self, id: UavId) -> Option<SearchArea> {
        SearchArea::of(self.picture.searched_by(id)?, 0.0, self.params)
    }

    /// The group's centre, or the middle of its members; without a group, where it searches, or where something was last
    /// known to be.
    fn look_at(&self, id: UavId, uav: &UavState, group: Option<&Group>) -> Option<LookAt> {
        let Some(group) = group else {
            let searched = self.search_area(id).map(|area| {
                let sensor = &self.params.track.sensor;
                let boresight = area.boresight(id, uav.position, self.picture.time, sensor.field_of_view_rad);
                let ahead = Displacement::from_polar(sensor.sensing_range_m, boresight);
                LookAt { position: uav.position + ahead, velocity: Velocity::ZERO }
            });
            return searched.or_else(|| self.nearest_known(id, uav));
        };
        let centre = group.centre.estimate().state;
        let centre = LookAt { position: centre.position(), velocity: centre.velocity() };
        if self.params.group.aim == Aim::Centre {
            return Some(centre);
        }
        let members = self.picture.members_of(group.id);
        let own = members.clone().filter(|known| known.membership.group() == Some(group.id));
        let state = |known: &Known| known.estimate().state;
        let with_variance = |known: &Known| {
            let sd_m = known.estimate().position_sd_max_m();
            (state(known), sd_m * sd_m)
        };
        let fits_rad = self.params.track.sensor.field_of_view_rad;
        // Whose view is its duty comes before who is on the way, until the orbit has made room for all.
        middle(uav, centre.position, members.map(state), fits_rad)
            .or_else(|| middle(uav, centre.position, own.clone().map(state), fits_rad))
            .or_else(|| middle_of_most(uav, own.map(with_variance), fits_rad))
            .or(Some(centre))
    }

    /// The nearest track, a lost one where it was lost if there are no others; `None` for a UAV that the team does not
    /// hear: nobody counts on it.
    fn nearest_known(&self, id: UavId, own: &UavState) -> Option<LookAt> {
        self.picture.teammate(id)?;
        let nearest = |lost: bool| {
            let tracks = self.picture.known().iter().map(|known| &known.track).filter(|track| track.is_lost() == lost);
            let places = tracks.map(|track| {
                let state = track.estimate().state;
                let velocity = if lost { Velocity::ZERO } else { state.velocity() };
                LookAt { position: state.position(), velocity }
            });
            let squared_m2 = |place: &LookAt| place.position.squared_distance_m2(own.position);
            places.min_by(|a, b| squared_m2(a).total_cmp(&squared_m2(b)))
        };
        nearest(false).or_else(|| nearest(true))
    }
}
