//! Joint plan of UAVs near each other: each computes the commands of those before it.

use crate::message::Manoeuvre;
use crate::safety::fallback::{Path, Paths, Sense, choose_senses};
use crate::safety::motion::Motion;
use crate::safety::other_aircraft::{OtherAircraft, SILENT_MAX_S};
use crate::safety::predicted_trajectory::{Intent, PredictedTrajectory, SampledTrajectory};
use crate::safety::selection::Neighbours;
use crate::safety::separation::{
    AHEAD_S, Avoidance, BUFFER_M, CollisionAvoidance, DRIFT_M_S, DesiredCommands, FALLBACK_BUFFER_M, Near, avoiding,
};
use crate::safety::zones::{Of, Outlines};
use crate::uav::{Aircraft, Command, UavId};

/// Maximum number of UAVs that are planned together: the nearest ones.
const PLANNED_MAX: usize = 10;

/// Shortfall of a fallback that the geofence forbids; larger than any other.
const IMPOSSIBLE: f64 = 10.0;

/// A UAV whose command is planned together with those of its neighbours.
#[derive(Debug, Clone, Copy)]
struct Planned {
    uav: UavId,
    /// Current motion, extrapolated from the last report.
    motion: Motion,
    /// Age of the last report, s.
    age_s: f64,
    levels_m: Option<[f64; 2]>,
    manoeuvre: Option<Manoeuvre>,
    /// Predicted from its report.
    as_reported: PredictedTrajectory,
    /// Command that it flies if no aircraft is near, and the path of that.
    desired: (Command, PredictedTrajectory),
}

/// Plan of a UAV and its neighbours, by ascending id: each takes the commands of those before it as known. All UAVs
/// compute the same plan from the same reports.
pub(crate) struct JointPlan<'a> {
    own: &'a CollisionAvoidance<'a>,
    planned: Vec<Planned>,
    /// For each UAV, those whose fallbacks its own may meet.
    meets: Vec<Vec<usize>>,
    intruders: Vec<OtherAircraft>,
    /// Outlines near each UAV; empty without a geofence.
    outlines: Vec<Outlines>,
}

impl CollisionAvoidance<'_> {
    /// Returns the command to fly instead of the intended one, and the aircraft that it avoids, if any. The intended
    /// command must be within the limits. `altitude_m` is the commanded altitude.
    pub(crate) fn avoid(
        &self,
        intent: Intent,
        altitude_m: Option<f64>,
        others: impl Iterator<Item = OtherAircraft> + Clone,
        team: &impl DesiredCommands,
    ) -> (Command, Option<Avoidance>) {
        let levels = self.levels_m(altitude_m);
        let others = others.filter(|other| !self.is_separated(levels, other.levels_m(AHEAD_S)));
        let (desired, course) = self.with_path(self.own, intent);
        let meets = |other: &OtherAircraft| other.uav().is_some() && self.can_meet(&other.motion.state, other.age_s);
        if !others.clone().any(|other| meets(&other)) {
            let near = others.clone().filter_map(|other| self.near(&other, Some(&course), |uav| team.intent_of(uav)));
            let near: Vec<Near> = near.collect();
            if near.is_empty() || self.shortfall(&course.sampled(), &near, f64::INFINITY).1.is_none() {
                return (desired, None);
            }
        }
        JointPlan::new(self, (desired, course), others, team).command()
    }
}

impl<'a> JointPlan<'a> {
    /// A plan of the UAV `own`, which desires a command with a path, and others.
    pub(crate) fn new(
        own: &'a CollisionAvoidance<'a>,
        desired: (Command, PredictedTrajectory),
        others: impl Iterator<Item = OtherAircraft> + Clone,
        team: &impl DesiredCommands,
    ) -> Self {
        let itself =
            OtherAircraft { aircraft: Aircraft::Uav(own.id), motion: *own.own, age_s: 0.0, manoeuvre: own.manoeuvre };
        let intruders = others.clone().filter(|other| other.uav().is_none()).collect();
        let mut nearest: Vec<(UavId, OtherAircraft, Motion)> =
            others.chain([itself]).filter_map(|other| Some((other.uav()?, other, own.now(&other)))).collect();
        if nearest.len() >= PLANNED_MAX {
            let far_m2 = |motion: &Motion| motion.state.position.squared_distance_m2(own.own.state.position);
            nearest.sort_by(|a, b| far_m2(&a.2).total_cmp(&far_m2(&b.2)));
            nearest.truncate(PLANNED_MAX);
        }
        let planned = nearest.into_iter().map(|(uav, other, motion)| Planned {
            uav,
            motion,
            age_s: other.age_s.min(SILENT_MAX_S),
            levels_m: other.levels_m(AHEAD_S),
            manoeuvre: other.manoeuvre,
            as_reported: own.predicted(&other, team.intent_of(uav)),
            desired: if uav == own.id { desired } else { own.with_path(&motion, team.desired(uav, &motion)) },
        });
        let mut planned: Vec<Planned> = planned.collect();
        // UAVs that avoid an intruder have right of way.
        planned.sort_by_key(|planned| {
            let avoids = planned.manoeuvre.and_then(|manoeuvre| manoeuvre.avoids);
            (matches!(avoids, Some(Aircraft::Intruder(_))), planned.uav)
        });
        let outlines =
            own.geofence.map_or(Vec::new(), |of| planned.iter().map(|planned| of.outlines(&planned.motion)).collect());
        let mut plan = Self { own, planned, meets: Vec::new(), intruders, outlines };
        let all = 0..plan.planned.len();
        plan.meets =
            all.clone().map(|index| all.clone().filter(|other| plan.can_meet(index, *other)).collect()).collect();
        plan
    }

    /// Returns the command of the UAV, and the aircraft that it avoids.
    #[cold]
    pub(crate) fn command(&self) -> (Command, Option<Avoidance>) {
        let mut fallbacks = self.fallbacks();
        let mut courses: Vec<SampledTrajectory> =
            self.planned.iter().map(|planned| planned.as_reported.sampled()).collect();
        for (index, planned) in self.planned.iter().enumerate() {
            let uav = self.avoidance_of(index);
            let near = self.near(index, &courses);
            let met = self.meets[index].iter();
            let met = met.filter_map(|other| {
                Some((self.planned[*other].uav, fallbacks[*other].as_ref()?, self.required_m(index, *other)))
            });
            let neighbours = Neighbours { near: &near, fallbacks: met.collect() };
            let turns = |paths: &Paths| Sense::BOTH.map(|sense| self.is_clear(index, || paths.of(sense)));
            let (flown, sense, avoidance) = uav.nearest_command(planned.desired, &neighbours, turns);
            if planned.uav == self.own.id {
                return (flown, avoidance);
            }
            let (command, course) = planned.desired;
            let course = if flown == command { course } else { course.with(Intent::held(flown)) };
            courses[index] = course.sampled();
            if !self.meets[index].is_empty() {
                fallbacks[index] = Some(self.own.fallbacks.path(&planned.motion, flown, sense));
            }
        }
        self.planned.iter().find(|planned| planned.uav == self.own.id).map_or_else(
            || (Command { speed_m_s: self.own.own.state.speed_m_s, turn_rate_rad_s: 0.0 }, None),
            |own| (own.desired.0, None),
        )
    }

    /// Sum of the ages of the reports of two UAVs, s.
    fn age_s(&self, i: usize, j: usize) -> f64 {
        self.planned[i].age_s + self.planned[j].age_s
    }

    /// Distance that the fallbacks of two UAVs keep, m.
    fn required_m(&self, i: usize, j: usize) -> f64 {
        let minimum_m = self.own.separation.horizontal_min_m + FALLBACK_BUFFER_M + self.own.fallbacks.error_m;
        minimum_m + DRIFT_M_S * self.age_s(i, j)
    }

    fn can_meet(&self, i: usize, j: usize) -> bool {
        let [one, other] = [i, j].map(|index| &self.planned[index]);
        i != j
            && self.avoidance_of(i).can_meet(&other.motion.state, self.age_s(i, j))
            && !self.own.is_separated(one.levels_m, other.levels_m)
    }

    /// Collision avoidance of a planned UAV.
    fn avoidance_of(&self, index: usize) -> CollisionAvoidance<'_> {
        let Planned { uav: id, motion: ref own, manoeuvre, .. } = self.planned[index];
        CollisionAvoidance { id, own, manoeuvre, plan: self.own.plan.filter(|_| id == self.own.id), ..*self.own }
    }

    /// True if the geofence allows a path of a UAV.
    fn is_clear<'b>(&self, index: usize, path: impl FnOnce() -> &'b Path) -> bool {
        let Some((geofence, outlines)) = self.own.geofence.zip(self.outlines.get(index)) else { return true };
        let of = if self.planned[index].uav == self.own.id { Of::Avoidance } else { Of::Flown };
        outlines.are_far() || geofence.is_clear(path(), outlines, of)
    }

    /// Fallbacks of all UAVs after their desired commands or, if these fall short together, from now on. `None` for
    /// those that are not compared with any.
    fn fallbacks(&self) -> Vec<Option<Path>> {
        let (short, after_desired) = self.fallbacks_after(|index, _| self.planned[index].desired.0, false);
        if short <= 0.0 {
            return after_desired;
        }
        let now = |index: usize, sense| self.own.fallbacks.command(&self.planned[index].motion, sense, None);
        self.fallbacks_after(now, true).1
    }

    /// Largest shortfall of the best combination of fallbacks after commands, and these fallbacks.
    fn fallbacks_after(&self, command_of: impl Fn(usize, Sense) -> Command, is_now: bool) -> (f64, Vec<Option<Path>>) {
        let is_met = |index: usize| !self.meets[index].is_empty() || self.meets.iter().any(|met| met.contains(&index));
        let all = 0..self.planned.len();
        let path = |index: usize, sense| {
            let is_needed = is_met(index) || self.outlines.get(index).is_some_and(|outlines| !outlines.are_far());
            is_needed.then(|| self.own.fallbacks.path(&self.planned[index].motion, command_of(index, sense), sense))
        };
        let mut paths: Vec<[Option<Path>; 2]> =
            all.clone().map(|index| Sense::BOTH.map(|sense| path(index, sense))).collect();
        let is_possible: Vec<[bool; 2]> = all
            .map(|index| {
                let is_clear = |path: &Option<Path>| path.as_ref().is_none_or(|path| self.is_clear(index, || path));
                let possible = [0, 1].map(|sense| is_clear(&paths[index][sense]));
                if is_now && possible == [false; 2] { self.avoidance_of(index).last_turn() } else { possible }
            })
            .collect();
        let preferred: Vec<Sense> = self.planned.iter().map(Planned::preferred_sense).collect();
        let (short, senses) = choose_senses(&preferred, |i, s, j, t| {
            if !is_possible[i][s as usize] {
                return IMPOSSIBLE;
            }
            match (&paths[i][s as usize], &paths[j][t as usize]) {
                (Some(a), Some(b)) if is_possible[j][t as usize] && self.meets[i].contains(&j) => {
                    self.own.fallbacks.shortfall(a, b, self.required_m(i, j), self.own.own.wind)
                }
                _ => 0.0,
            }
        });
        let chosen = senses.iter().zip(&mut paths).map(|(sense, paths)| paths[*sense as usize].take());
        (short, chosen.collect())
    }

    /// Aircraft that may come near a planned UAV; those before it fly `courses`.
    fn near(&self, index: usize, courses: &[SampledTrajectory]) -> Vec<Near> {
        let uav = self.avoidance_of(index);
        let teammate = |other: usize, course: SampledTrajectory| {
            let Planned { uav: teammate, motion: Motion { ref state, .. }, levels_m, .. } = self.planned[other];
            let required = uav.required(AHEAD_S, BUFFER_M, self.age_s(index, other));
            let is_near = uav.is_within_reach(state, 0.0, required)
                && !self.own.is_separated(self.planned[index].levels_m, levels_m);
            let aircraft = Aircraft::Uav(teammate);
            let required = uav.kept(aircraft, required);
            is_near.then_some(Near { aircraft, course, pursuer: None, required })
        };
        let teammates = (0..self.planned.len()).filter(|other| *other != index);
        let teammates = teammates.filter_map(|other| teammate(other, courses[other]));
        // A teammate whose last report is old may have planned from others, and fly on as reported.
        let as_reported = (0..index).filter(|other| self.age_s(index, *other) > 0.0);
        let as_reported = as_reported.filter_map(|other| teammate(other, self.planned[other].as_reported.sampled()));
        let intruders = self.intruders.iter().filter_map(|other| uav.near(other, None, |_| None));
        teammates.chain(as_reported).chain(intruders).collect()
    }
}

impl Planned {
    /// Sense of the fallback that it keeps, or of its turn.
    fn preferred_sense(&self) -> Sense {
        let turns_left = self.motion.state.turn_rate_rad_s >= 0.0;
        Sense::of(avoiding(self.manoeuvre).map_or(turns_left, |manoeuvre| manoeuvre.is_left))
    }
}
