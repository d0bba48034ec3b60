//! What an agent keeps between steps, whichever UAV it is; and how a UAV decides from it.

use crate::agent::{Agent, Diagnostics, LookAt, Step};
use crate::coordination::event::Event;
use crate::coordination::group::Group;
use crate::coordination::membership::OnDuty;
use crate::frame::{Position, Velocity};
use crate::guidance::heading::{OnOrbit, Orbit, Steering, steer};
use crate::guidance::spacing::{is_in_transit, spacing_error_rad, spacing_speed_m_s};
use crate::guidance::standoff_distance::Ramp;
use crate::inbox::Inbox;
use crate::message::Message;
use crate::param::ParamError;
use crate::picture::{News, Picture, Scratch};
use crate::target::Transition;
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::{Command, UavId, UavState};

/// The picture and what it is made from.
#[derive(Debug, Clone)]
pub(crate) struct Mind {
    params: TeamParams,
    /// The picture of the instant before this one.
    previous: Picture,
    picture: Picture,
    pub(crate) inbox: Inbox,
    /// The target model over the time since the previous picture.
    transition: Transition,
    scratch: Scratch,
    started: bool,
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
            previous: Picture::default(),
            picture: Picture::default(),
            inbox: Inbox::default(),
            transition: Transition::none(),
            scratch: Scratch::default(),
            started: false,
            refused_instants: 0,
        })
    }

    pub(crate) fn picture(&self) -> &Picture {
        &self.picture
    }

    /// What changed in the picture of this instant.
    pub(crate) fn events(&self) -> &[Event] {
        &self.scratch.events
    }

    /// `now` may follow the picture's instant: it is later, and by no more than [`Agent::GAP_MAX`].
    pub(crate) fn may_follow(&self, now: Time) -> bool {
        let gap = now - self.picture.time;
        !self.started || gap > Duration::ZERO && gap <= Agent::GAP_MAX
    }

    /// Turns to `now` if that is a new instant, and says so; an instant that is neither that nor the picture's own is
    /// counted.
    pub(crate) fn turn_to(&mut self, now: Time) -> bool {
        let is_new = self.may_follow(now);
        if is_new {
            self.open(now);
        } else if now != self.picture.time {
            self.refused_instants = self.refused_instants.saturating_add(1);
        }
        is_new
    }

    /// Forgets all that is known and was heard; what was refused stays counted.
    pub(crate) fn reset(&mut self) {
        (self.previous, self.picture) = (Picture::default(), Picture::default());
        (self.transition, self.scratch) = (Transition::none(), Scratch::default());
        self.inbox.reset();
        self.started = false;
    }

    fn open(&mut self, now: Time) {
        core::mem::swap(&mut self.previous, &mut self.picture);
        let dt = if self.started { now - self.previous.time } else { Duration::ZERO };
        self.started = true;
        if dt != self.transition.dt {
            self.transition = self.params.track.transition(dt);
        }
        self.picture.time = now;
        self.inbox.open(now);
    }

    /// Makes the picture of this instant from all that was heard by now.
    pub(crate) fn follow(&mut self) {
        let news = News { now: self.picture.time, inbox: &self.inbox, transition: &self.transition };
        self.picture.follow(&self.previous, &news, &self.params, &mut self.scratch);
    }

    /// What UAV `id` is to do.
    pub(crate) fn decide<'a>(&'a self, id: UavId, own: &UavState, outbox: &'a [Message]) -> Step<'a> {
        let own_state_invalid = !own.is_finite();
        let group = self.picture.group_of(id).filter(|_| !own_state_invalid);
        let (wanted, spacing_error_rad, steering) = match group {
            _ if own_state_invalid => {
                (Command { speed_m_s: self.params.uav.speed_m_s, turn_rate_rad_s: 0.0 }, 0.0, None)
            }
            Some(group) => self.fly_orbit(id, own, group),
            None => (self.wait(id, own), 0.0, None),
        };
        Step {
            command: self.params.uav.limit(wanted),
            altitude_m: group.map(|group| group.altitude_m),
            look_at: self.look_at(id, own, group),
            outbox,
            events: &self.scratch.events,
            diagnostics: Diagnostics {
                group: group.map(|group| group.id),
                steering,
                orbit_is_feasible: group.is_none_or(Group::is_feasible),
                spacing_error_rad,
                separation_m: group.and_then(|group| {
                    let mates = self.teammates(id, group);
                    let others = mates.map(|(mate, _)| mate.state.position.distance_m(own.position));
                    others.reduce(f64::min)
                }),
                unassigned_targets: self.picture.unassigned,
                refused_messages: self.inbox.refused(),
                refused_instants: self.refused_instants,
                own_state_invalid,
            },
        }
    }

    /// The other UAVs of a group, and where they are on its orbit.
    fn teammates<'a>(&'a self, id: UavId, group: &'a Group) -> impl Iterator<Item = (&'a OnDuty, &'a OnOrbit)> {
        let crew = self.scratch.on_duty.iter().zip(&self.scratch.on_orbit);
        crew.filter(move |(mate, _)| mate.group == Some(group.id) && mate.uav != id)
    }

    /// Where a UAV is on its group's orbit, if it is where it said.
    fn on_orbit_as_said(&self, id: UavId, position: Position) -> Option<&OnOrbit> {
        let mut crew = self.scratch.on_duty.iter().zip(&self.scratch.on_orbit);
        crew.find(|(mate, _)| mate.uav == id && mate.state.position == position).map(|(_, on_orbit)| on_orbit)
    }

    fn fly_orbit(&self, id: UavId, own: &UavState, group: &Group) -> (Command, f64, Option<Steering>) {
        let guidance = &self.params.guidance;
        let anew;
        let on_orbit = match self.on_orbit_as_said(id, own.position) {
            Some(known) => known,
            None => {
                anew = OnOrbit::of(guidance, own.position, &group.orbit(&self.params));
                &anew
            }
        };
        let orbit = &on_orbit.orbit;
        let is_away = |mate: &OnOrbit| is_in_transit(mate.centre_distance_m(), orbit.distance_m);
        let others = self.teammates(id, group).filter(|(_, mate)| !is_away(mate));
        let others = others.map(|(mate, on_orbit)| (mate.uav, on_orbit.phase));
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

    /// With nothing to watch: a circle of the smallest orbit, about where something was last known to be, or where the
    /// UAV is.
    fn wait(&self, id: UavId, own: &UavState) -> Command {
        let (speed_m_s, radius_m) = (self.params.uav.speed_m_s, self.params.group.standoff.radius_min_m);
        let Some(last) = self.nearest_known(id, own) else {
            return Command { speed_m_s, turn_rate_rad_s: self.params.guidance.sense.sign() * speed_m_s / radius_m };
        };
        let orbit = Orbit {
            centre: last.position,
            centre_velocity: Velocity::ZERO,
            distance_m: radius_m,
            rate_m_s: 0.0,
            steered: Ramp { radius_m, rate_m_s: 0.0 },
        };
        Command { speed_m_s, turn_rate_rad_s: steer(&self.params.guidance, own, &orbit, speed_m_s).turn_rate_rad_s }
    }

    /// The group's centre; without a group, where something was last known to be.
    fn look_at(&self, id: UavId, own: &UavState, group: Option<&Group>) -> Option<LookAt> {
        let Some(group) = group else { return self.nearest_known(id, own) };
        let centre = group.centre.estimate().state;
        Some(LookAt { position: centre.position(), velocity: centre.velocity() })
    }

    /// The nearest track, a lost one where it was lost if there are no others; `None` for a UAV that the team does not
    /// hear: it knows nothing.
    fn nearest_known(&self, id: UavId, own: &UavState) -> Option<LookAt> {
        self.scratch.on_duty.binary_search_by_key(&id, |duty| duty.uav).ok()?;
        let nearest = |lost: bool| {
            let tracks = self.picture.known.iter().map(|known| &known.track).filter(|track| track.is_lost() == lost);
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
