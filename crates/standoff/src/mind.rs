//! What an agent keeps between steps, whichever UAV it is; and how a UAV decides from it.

use std::sync::Arc;

use crate::coordination::assignment::AssignmentLaw;
use crate::coordination::group::Group;
use crate::coordination::group_id::GroupId;
use crate::coordination::memberships::Known;
use crate::coordination::search::SearchArea;
use crate::frame::{Displacement, Position, Velocity};
use crate::guidance::aim::{middle, middle_of_most};
use crate::guidance::heading::{OnOrbit, Orbit, Steering, steer};
use crate::guidance::spacing::{is_in_transit, spacing_error_rad, spacing_speed_m_s};
use crate::guidance::standoff_distance::Ramp;
use crate::inbox::Inbox;
use crate::message::{Message, Scan};
use crate::param::ParamError;
use crate::picture::{News, Picture, Scratch};
use crate::step::{Diagnostics, LookAt, Observation, Step};
use crate::target::Transition;
use crate::team::{Aim, TeamParams};
use crate::time::{Duration, Time};
use crate::uav::{Command, LimitedCommand, UavId, UavState};

/// See [`Agent::GAP_MAX`](crate::Agent::GAP_MAX).
pub(crate) const GAP_MAX: Duration = Duration::from_us(10_000_000);

/// The picture and what it is made from.
#[derive(Debug, Clone)]
pub(crate) struct Mind {
    params: TeamParams,
    now: Time,
    /// The picture of the instant before this one.
    previous: Picture,
    /// That of this instant, once one was asked for; until then an older one, to be written over.
    picture: Picture,
    inbox: Inbox,
    /// The target model over the time since the previous picture.
    transition: Transition,
    scratch: Scratch,
    assignment: Option<Arc<dyn AssignmentLaw>>,
    started: bool,
    /// Something was heard that the picture does not know yet.
    is_stale: bool,
    /// Counts the instants.
    sequence: u32,
    refused_instants: u32,
}

impl Mind {
    pub(crate) fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let errors = params.errors();
        if !errors.is_empty() {
            return Err(errors);
        }
        Ok(Self {
            params,
            now: Time::START,
            previous: Picture::default(),
            picture: Picture::default(),
            inbox: Inbox::new(Duration::from_s(params.teammate_timeout_s)),
            transition: Transition::none(),
            scratch: Scratch::default(),
            assignment: None,
            started: false,
            is_stale: false,
            sequence: 0,
            refused_instants: 0,
        })
    }

    /// The same, with an assignment law of one's own.
    pub(crate) fn assigned_by(self, law: Arc<dyn AssignmentLaw>) -> Self {
        Self { assignment: Some(law), ..self }
    }

    /// The picture as of the last decision, or of the last instant that another one followed.
    pub(crate) fn picture(&self) -> &Picture {
        if self.picture.time == self.now { &self.picture } else { &self.previous }
    }

    /// Counts the instants up to this one.
    pub(crate) fn sequence(&self) -> u32 {
        self.sequence
    }

    /// Turns to `now` if that is a new instant, and takes a UAV's own scan in, which its report will say with this epoch.
    /// The first observation of an instant that a UAV speaks of counts. An instant that is neither new nor the picture's
    /// own is counted, and nothing can be heard of it.
    pub(crate) fn observe(&mut self, now: Time, uav: UavId, own: &UavState, scan: Option<(u32, Scan)>) -> Observation {
        let gap = now - self.now;
        if !self.started || gap > Duration::ZERO && gap <= GAP_MAX {
            self.open(now);
        } else if now != self.now {
            self.refused_instants = self.refused_instants.saturating_add(1);
            return Observation { uav, time: now, own: *own };
        }
        // Who does not know where it is has nothing to say.
        if let Some((epoch, scan)) = scan.filter(|_| own.is_finite() && self.inbox.state_of(uav).is_none()) {
            self.inbox.hear_scan(uav, (epoch, self.sequence), now, own, scan);
            self.is_stale = true;
        }
        Observation { uav, time: now, own: *self.inbox.state_of(uav).unwrap_or(own) }
    }

    /// Forgets all that is known and was heard; what was refused stays counted.
    pub(crate) fn reset(&mut self) {
        (self.previous, self.picture) = (Picture::default(), Picture::default());
        (self.transition, self.scratch) = (Transition::none(), Scratch::default());
        self.inbox.reset();
        (self.started, self.is_stale) = (false, false);
    }

    fn open(&mut self, now: Time) {
        // An instant of which nobody asked for a decision is part of the past all the same.
        if self.is_stale {
            self.follow();
        }
        core::mem::swap(&mut self.previous, &mut self.picture);
        let dt = if self.started { now - self.now } else { Duration::ZERO };
        (self.started, self.is_stale) = (true, true);
        self.sequence = self.sequence.wrapping_add(1);
        if dt != self.transition.dt {
            self.transition = self.params.track.transition(dt);
        }
        self.now = now;
        self.inbox.open(now);
    }

    /// `observation` is of this instant.
    pub(crate) fn is_of_now(&self, observation: &Observation) -> bool {
        self.started && observation.time == self.now
    }

    /// The observed UAV has said where it is at this instant.
    pub(crate) fn has_heard(&self, observation: &Observation) -> bool {
        self.is_of_now(observation) && self.inbox.state_of(observation.uav).is_some()
    }

    /// Takes a message in; nothing of an instant that is over or was refused.
    pub(crate) fn hear(&mut self, observation: &Observation, message: &Message) {
        if self.is_of_now(observation) {
            self.inbox.hear(message);
            self.is_stale = true;
        }
    }

    /// Makes the picture of this instant from all that was heard by now.
    fn follow(&mut self) {
        let news = News {
            now: self.now,
            inbox: &self.inbox,
            transition: &self.transition,
            assignment: self.assignment.as_deref(),
        };
        self.picture.follow(&self.previous, &news, &self.params, &mut self.scratch);
        self.is_stale = false;
    }

    /// What the UAV that was observed is to do.
    pub(crate) fn decide(&mut self, observation: &Observation) -> Step {
        if self.is_stale {
            self.follow();
        }
        let Observation { uav: id, ref own, .. } = *observation;
        let own_state_invalid = !own.is_finite();
        let group = self.picture().group_of(id).filter(|_| !own_state_invalid);
        let (wanted, spacing_error_rad, steering) = match group {
            _ if own_state_invalid => {
                (Command { speed_m_s: self.params.uav.speed_m_s, turn_rate_rad_s: 0.0 }, 0.0, None)
            }
            Some(group) => self.fly_orbit(observation, group),
            None => (self.wait(id, own), 0.0, None),
        };
        let LimitedCommand { command, speed_limited, turn_rate_limited } = self.params.uav.limit(wanted);
        Step {
            command,
            altitude_m: group.map(|group| group.altitude_m),
            look_at: self.look_at(id, own, group),
            diagnostics: Diagnostics {
                group: group.map(|group| group.id),
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
                unassigned_targets: self.picture().unassigned,
                refused_messages: self.inbox.refused(),
                refused_instants: self.refused_instants,
                own_state_invalid,
            },
        }
    }

    /// The other UAVs of a group: where they are, who they are, and where on its orbit.
    fn mates(&self, id: UavId, group: GroupId) -> impl Iterator<Item = (Position, UavId, &OnOrbit)> {
        let crew = self.picture().on_orbit_of(group).filter(move |(mate, _)| mate.uav != id);
        crew.map(|(mate, on_orbit)| (mate.state.position, mate.uav, on_orbit))
    }

    /// Where an observed UAV is on its group's orbit, if it was heard of this very instant: then that is known.
    fn on_orbit_as_heard(&self, observation: &Observation, group: GroupId) -> Option<&OnOrbit> {
        let mut crew = self.picture().on_orbit_of(group);
        let own = crew.find(|(mate, _)| mate.uav == observation.uav && mate.is_heard && self.is_of_now(observation));
        own.map(|(_, on_orbit)| on_orbit)
    }

    fn fly_orbit(&self, observation: &Observation, group: &Group) -> (Command, f64, Option<Steering>) {
        let Observation { uav: id, ref own, .. } = *observation;
        let guidance = &self.params.guidance;
        let anew;
        let on_orbit = match self.on_orbit_as_heard(observation, group.id) {
            Some(known) => known,
            None => {
                anew = OnOrbit::of(guidance, own.position, &group.orbit(&self.params));
                &anew
            }
        };
        let orbit = &on_orbit.orbit;
        let is_away = |mate: &OnOrbit| is_in_transit(mate.centre_distance_m(), orbit.distance_m);
        let others = self.mates(id, group.id).filter(|(.., mate)| !is_away(mate));
        let others = others.map(|(_, mate, on_orbit)| (mate, on_orbit.phase));
        let error_rad = match is_away(on_orbit) {
            true => 0.0,
            false => spacing_error_rad((id, on_orbit.phase), others, guidance.separation_rad, guidance.sense),
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

    /// With nothing to watch: a circle about where it searches; else of the smallest orbit, about where something was last
    /// known to be, or where the UAV is.
    fn wait(&self, id: UavId, own: &UavState) -> Command {
        let (speed_m_s, smallest_m) = (self.params.uav.speed_m_s, self.params.group.standoff.radius_min_m);
        let searched = self.search_area(id).map(|area| (area.about, area.radius_m));
        let last = || self.nearest_known(id, own).map(|last| (last.position, smallest_m));
        let Some((centre, radius_m)) = searched.or_else(last) else {
            let radius_m = smallest_m;
            return Command { speed_m_s, turn_rate_rad_s: self.params.guidance.sense.sign() * speed_m_s / radius_m };
        };
        let orbit = Orbit {
            centre,
            centre_velocity: Velocity::ZERO,
            distance_m: radius_m,
            rate_m_s: 0.0,
            steered: Ramp { radius_m, rate_m_s: 0.0 },
        };
        Command { speed_m_s, turn_rate_rad_s: steer(&self.params.guidance, own, &orbit, speed_m_s).turn_rate_rad_s }
    }

    fn search_area(&self, id: UavId) -> Option<SearchArea> {
        SearchArea::of(self.picture().searched_by(id)?, 0.0, &self.params)
    }

    /// The group's centre, or the middle of its members; without a group, where it searches, or where something was last
    /// known to be.
    fn look_at(&self, id: UavId, uav: &UavState, group: Option<&Group>) -> Option<LookAt> {
        let Some(group) = group else {
            let searched = self.search_area(id).map(|area| {
                let sensor = &self.params.track.sensor;
                let boresight = area.boresight(id, uav.position, self.now, sensor.field_of_view_rad);
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
        let members = self.picture().members_of(group.id);
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
        self.picture().teammate(id)?;
        let nearest = |lost: bool| {
            let tracks =
                self.picture().known().iter().map(|known| &known.track).filter(|track| track.is_lost() == lost);
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
