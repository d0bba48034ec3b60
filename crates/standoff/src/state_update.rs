//! State update: advances the team state by one time step.
//!
//! ```text
//! reports -> team -> tracks -> group members -> groups and orbits -> searches -> UAV assignment -> alarms
//! ```

mod groups;
mod team;
mod uav_assignment;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::coordination::assignment::AssignmentLaw;
use crate::coordination::event::{Event, EventKind};
use crate::coordination::grouping::{Grouping, GroupingBuffers};
use crate::coordination::memberships::GroupIndex;
use crate::grid::Grid;
use crate::message::TARGETS_MAX;
use crate::params::TeamParams;
use crate::priority::{AreaOfInterest, PRIORITY};
use crate::safety::fallback::FallbackModel;
use crate::safety::geofence::Geofence;
use crate::safety::team_geofence::TeamGeofence;
use crate::safety::zones::GeofenceSafety;
use crate::step_messages::StepMessages;
use crate::target::Transition;
use crate::team_state::TeamState;
use crate::time::{Duration, Time};
use crate::tracking::input::{Scans, TrackerInput};
use crate::tracking::pose_error::PoseError;
use crate::tracking::track::{TrackChange, TrackChangeKind};
use crate::tracking::tracker::Tracker;
use crate::uav::{UavId, UavState};
use crate::validation::ParamError;
use crate::wind::Wind;

/// Computes the next team state from the previous one and the messages of one time step; keeps no state itself.
#[derive(Debug, Clone)]
pub(crate) struct TeamStateUpdater {
    pub(crate) params: TeamParams,
    /// Target model over the last time difference between two team states.
    transition: Transition,
    tracker: Tracker,
    buffers: Buffers,
    pub(crate) assignment: Option<Arc<dyn AssignmentLaw>>,
    /// Geofence; `None` without zones.
    geofence: Option<TeamGeofence>,
    /// Areas of interest.
    areas: Vec<AreaOfInterest>,
    /// Fallbacks of UAVs that no zone binds; `None` without collision avoidance.
    pub(crate) fallbacks: Option<FallbackModel>,
}

/// Input of one time step: everything that changed since the previous team state.
struct StepInput<'a> {
    /// Time of the new team state.
    now: Time,
    messages: &'a StepMessages,
    /// Custom assignment law; `None` for the built-in one.
    assignment: Option<&'a dyn AssignmentLaw>,
    /// Target model over the time since the previous team state.
    transition: &'a Transition,
    /// Geofence; `None` without zones.
    geofence: Option<&'a Geofence>,
}

/// Reused buffers, so that a time step allocates nothing; the contents are valid within one time step.
#[derive(Debug, Clone, Default)]
struct Buffers {
    /// Members of each group before the grouping.
    members_before: GroupIndex,
    grouping: GroupingBuffers,
    /// UAVs whose report is implausible; usually empty.
    implausible: Vec<UavId>,
    /// UAVs whose detections start no tracks; usually empty.
    newcomers: Vec<UavId>,
    /// Index of the reports' positions.
    places: Grid,
}

impl TeamStateUpdater {
    pub(crate) fn new(params: TeamParams) -> Result<Self, Vec<ParamError>> {
        let errors = params.errors();
        if !errors.is_empty() {
            return Err(errors);
        }
        let fallbacks = params.separation.map(|_| FallbackModel::in_air(params.airframe(), params.log.period_s));
        Ok(Self {
            params,
            fallbacks,
            transition: Transition::none(),
            tracker: Tracker::default(),
            buffers: Buffers::default(),
            assignment: None,
            geofence: None,
            areas: Vec::new(),
        })
    }

    /// Adds a geofence. Fails if a UAV cannot circle in it.
    pub(crate) fn with_geofence_zones(self, geofence: Geofence) -> Result<Self, Vec<ParamError>> {
        Ok(Self { geofence: TeamGeofence::new(geofence, &self.params)?, ..self })
    }

    /// Replaces the areas of interest. Fails if a priority is out of range.
    pub(crate) fn set_areas_of_interest(&mut self, areas: Vec<AreaOfInterest>) -> Result<(), Vec<ParamError>> {
        let outside = areas.iter().enumerate().filter(|(_, area)| !PRIORITY.contains(area.priority));
        let error = |(index, area): (usize, &AreaOfInterest)| ParamError {
            path: format!("areas[{index}].priority"),
            value: area.priority,
            allowed: PRIORITY,
        };
        let errors: Vec<ParamError> = outside.map(error).collect();
        if !errors.is_empty() {
            return Err(errors);
        }
        self.areas = areas;
        Ok(())
    }

    /// Geofence safety function of a UAV in a state, in the wind that it assumes; `None` if no zone binds it. `own_zones`
    /// replace those of the team.
    pub(crate) fn geofence_safety(
        &mut self,
        own_zones: Option<&mut TeamGeofence>,
        uav: UavId,
        own: &UavState,
        wind: Option<Wind>,
    ) -> Option<Arc<GeofenceSafety>> {
        let Self { geofence, params, .. } = self;
        own_zones.or(geofence.as_mut())?.safety(params.altitudes_m(uav, own.vertical), params, wind)
    }

    /// Computes the team state `next` at the time of `messages`, `dt` after `previous`.
    pub(crate) fn advance(
        &mut self,
        previous: &TeamState,
        dt: Duration,
        messages: &StepMessages,
        next: &mut TeamState,
    ) {
        self.step(previous, dt, messages, false, next);
    }

    /// Computes the team state `next` like [`Self::advance`], but keeps groups and assignments unchanged; only the
    /// estimates of targets and UAVs advance.
    pub(crate) fn extrapolate(
        &mut self,
        previous: &TeamState,
        dt: Duration,
        messages: &StepMessages,
        next: &mut TeamState,
    ) {
        self.step(previous, dt, messages, true, next);
    }

    fn step(
        &mut self,
        previous: &TeamState,
        dt: Duration,
        messages: &StepMessages,
        is_extrapolated: bool,
        next: &mut TeamState,
    ) {
        if dt != self.transition.dt {
            self.transition = self.params.track.transition(dt);
        }
        let Self { params, transition, tracker, buffers, assignment, geofence, areas, fallbacks: _ } = self;
        let input = StepInput {
            now: messages.time,
            messages,
            assignment: assignment.as_deref(),
            transition,
            geofence: geofence.as_ref().map(|geofence| &geofence.zones),
        };
        next.continue_from(previous, input.now);
        next.gather_team(previous, &input, params, &mut buffers.implausible);
        let newcomers = next.teammates.iter().filter(|teammate| teammate.starts_tracks_from > input.now);
        buffers.newcomers.clear();
        buffers.newcomers.extend(newcomers.map(|teammate| teammate.uav));
        next.update_tracks(previous, &input, params, tracker, buffers);
        next.memberships.update_priorities(areas);
        (next.implausible, next.gated) = (buffers.implausible.len() as u32 + tracker.log.rejected, tracker.gated());

        buffers.members_before.copy(next.memberships.index());
        if !is_extrapolated {
            Grouping {
                now: input.now,
                memberships: &mut next.memberships,
                state: &mut next.grouping_state,
                previous: &previous.groups,
                team: &next.teammates,
                params,
                events: &mut next.events,
                buffers: &mut buffers.grouping,
            }
            .update();
        }
        next.ungrouped_count = next.tracks().iter().filter(|track| track.is_ungrouped()).count() as u32;
        next.form_groups(previous, &input, params, &buffers.members_before);
        next.search_assignments.clone_from(&previous.search_assignments);
        if is_extrapolated {
            next.assignments.clear();
            next.keep_assignments(previous);
        } else {
            next.update_searches(params);
            next.assign_uavs(previous, &input, params);
        }
        next.emit_uav_events(previous);
        if params.separation.is_some() {
            next.reported_places.rebuild(&next.teammates);
        }
        next.check_groups(previous, params, input.geofence);
    }
}

impl TeamState {
    /// Takes over the tracks and memberships of the previous team state.
    fn continue_from(&mut self, previous: &Self, now: Time) {
        self.events.clear();
        self.time = now;
        self.memberships.copy(&previous.memberships);
        self.unlabelled.clone_from(&previous.unlabelled);
        self.grouping_state = previous.grouping_state;
    }

    /// Advances the tracks and emits their events.
    fn update_tracks(
        &mut self,
        previous: &TeamState,
        input: &StepInput,
        params: &TeamParams,
        tracker: &mut Tracker,
        Buffers { implausible, newcomers, places, .. }: &mut Buffers,
    ) {
        let unlabelled = &mut self.unlabelled;
        self.memberships.update_tracks(|tracks| {
            let (sensor, reports) = (&params.track.sensor, input.messages.reports());
            let pose_error = PoseError::new(sensor, input.transition.dt);
            places.fill(reports.iter().map(|report| report.state.position), 0.5 * sensor.sensing_range_m);
            let scans = Scans { sensor, pose_error, reports, implausible, newcomers, places };
            let cues = input.messages.cues();
            let (now, transition, params) = (input.now, input.transition, &params.track);
            let is_first_scan = previous.teammates.is_empty();
            let tracks_max = TARGETS_MAX;
            let input = TrackerInput { now, transition, scans, cues, is_first_scan, params, tracks_max };
            tracker.step(tracks, unlabelled, previous.memberships.track_table(), &input)
        });
        for TrackChange { track, kind } in &tracker.log.changes {
            let kind = match *kind {
                TrackChangeKind::Cued => EventKind::Cued,
                TrackChangeKind::Started | TrackChangeKind::Confirmed => EventKind::Acquired,
                TrackChangeKind::Lost(reason) => EventKind::Lost(reason),
                TrackChangeKind::Reacquired => EventKind::Reacquired,
            };
            let (group, to_group) =
                self.track(*track).map_or((None, None), |track| (track.group(), track.receiving_group()));
            self.events.push(Event { to_group, ..Event::of_track(kind, *track, group) });
        }
    }
}
