//! Who belongs to a group: targets that fit on one orbit; those that do not are discarded, and taken back when they do
//! (section IV.B.2).
//!
//! The furthest target is discarded while the unclamped standoff distance exceeds r_d,max. A discarded target keeps
//! its track; it is taken back, nearest first, when the orbit with it needs no more than a fraction of r_d,max: the
//! gap between the two keeps a target on the limit from coming and going. The paper leaves it lost.

use crate::coordination::event::{Event, EventKind};
use crate::coordination::group::{GroupId, GroupParams, margin_m};
use crate::estimation::group_centre::Centroid;
use crate::estimation::track::Track;
use crate::guidance::standoff_distance::Spread;

/// A target's place in the team's work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Membership {
    /// In no group: new, or its track was lost.
    #[default]
    Free,
    /// Member of a group.
    Member(GroupId),
    /// Removed from its group, still predicted.
    Discarded,
}

/// A track and its place in the team's work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// The track.
    pub track: Track,
    /// Its place.
    pub membership: Membership,
}

impl Known {
    /// A new target: in no group yet.
    pub(crate) fn free(track: Track) -> Self {
        Self { track, membership: Membership::Free }
    }

    /// The group it belongs to.
    pub fn group(&self) -> Option<GroupId> {
        match self.membership {
            Membership::Member(group) => Some(group),
            _ => None,
        }
    }
}

/// Settles who is a member of `group`; `known` by ascending target.
///
/// Implements section IV.B.2's discard by range.
pub(crate) fn settle(known: &mut [Known], group: GroupId, params: &GroupParams, events: &mut Vec<Event>) {
    for target in known.iter_mut().filter(|target| target.track.is_lost()) {
        target.membership = Membership::Free;
    }
    let founded = !known.iter().any(|target| target.group() == Some(group));
    if founded {
        for target in known.iter_mut().filter(|target| !target.track.is_lost()) {
            target.membership = Membership::Member(group);
        }
    } else {
        while let Some(index) = next_to_take_in(known, group, params) {
            let kind = match known[index].membership {
                Membership::Discarded => EventKind::TakenBack,
                _ => EventKind::Joined,
            };
            events.push(Event { kind, target: Some(known[index].track.target), group: Some(group) });
            known[index].membership = Membership::Member(group);
        }
    }
    while let Some((index, needed_m)) = furthest_beyond_reach(known, group, params) {
        let kind = EventKind::Discarded { needed_m, allowed_m: params.standoff.radius_max_m };
        events.push(Event { kind, target: Some(known[index].track.target), group: Some(group) });
        known[index].membership = Membership::Discarded;
    }
}

/// The member to discard, and the radius that keeping it would need, m.
fn furthest_beyond_reach(known: &[Known], group: GroupId, params: &GroupParams) -> Option<(usize, f64)> {
    let need = Need::of(known, |target| target.group() == Some(group), params)?;
    (need.members > 1 && need.radius_m > params.standoff.radius_max_m).then_some((need.furthest, need.radius_m))
}

/// The nearest outsider, if an orbit with room to spare holds it too.
fn next_to_take_in(known: &[Known], group: GroupId, params: &GroupParams) -> Option<usize> {
    let is_member = |target: &Known| target.group() == Some(group);
    let centroid = Centroid::of(known.iter().filter(|target| is_member(target)).map(|k| k.track.estimate()))?;
    let centre = centroid.mean.state.position();
    let distance_m = |target: &Known| target.track.estimate().state.position().distance_m(centre);
    let (nearest, _) = known
        .iter()
        .enumerate()
        .filter(|(_, target)| !target.track.is_lost() && !is_member(target))
        .min_by(|(_, a), (_, b)| distance_m(a).total_cmp(&distance_m(b)))?;
    let with_it = known[nearest].track.target;
    let need = Need::of(known, |target| is_member(target) || target.track.target == with_it, params)?;
    (need.radius_m <= params.take_back_fraction * params.standoff.radius_max_m).then_some(nearest)
}

/// What an orbit about a set of targets needs.
struct Need {
    members: u32,
    furthest: usize,
    radius_m: f64,
}

impl Need {
    fn of(known: &[Known], is_in: impl Fn(&Known) -> bool, params: &GroupParams) -> Option<Self> {
        let centroid = Centroid::of(known.iter().filter(|target| is_in(target)).map(|k| k.track.estimate()))?;
        let centre = centroid.mean.state.position();
        let mut furthest: Option<(usize, f64)> = None;
        for (index, target) in known.iter().enumerate().filter(|(_, target)| is_in(target)) {
            let distance_m = target.track.estimate().state.position().distance_m(centre);
            if furthest.is_none_or(|(_, largest_m)| distance_m > largest_m) {
                furthest = Some((index, distance_m));
            }
        }
        let (furthest, distance_m) = furthest?;
        let margin_m = margin_m(params.margin, 0.0, &centroid, known[furthest].track.estimate(), centre);
        let radius_m = params.standoff.distance(Spread { distance_m, rate_m_s: 0.0 }, margin_m).unclamped_m;
        Some(Self { members: centroid.members, furthest, radius_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Cue;
    use crate::target::TargetId;
    use crate::time::Time;
    use crate::{Position, TeamParams, Velocity};

    const GROUP: GroupId = GroupId(0);

    fn known(id: u32, x_m: f64) -> Known {
        let cue = Cue {
            target: TargetId(id),
            time: Time::START,
            position: Position::from_m(x_m, 0.0),
            velocity: Velocity::ZERO,
            position_sd_m: 1.0,
            velocity_sd_m_s: 1.0,
        };
        Known::free(Track::from_cue(&cue, &TeamParams::table_1().track, Time::START).unwrap())
    }

    fn moved(known: &Known, x_m: f64) -> Known {
        Known { track: self::known(known.track.target.0, x_m).track, ..*known }
    }

    /// Settles, and gives the members' ids and the kinds of events.
    fn settled(targets: &mut [Known]) -> (Vec<u32>, Vec<&'static str>) {
        let mut events = Vec::new();
        settle(targets, GROUP, &TeamParams::table_1().group, &mut events);
        let members = targets.iter().filter(|target| target.group().is_some());
        (members.map(|target| target.track.target.0).collect(), events.iter().map(|event| event.kind.name()).collect())
    }

    /// Checks section IV.B.2, range rule: with Table I an orbit of 700 m holds a spread of 350 m, margin included; the
    /// furthest goes until the rest fits.
    #[test]
    fn the_furthest_is_discarded_until_the_orbit_fits() {
        let mut targets = [known(0, 0.0), known(1, 100.0), known(2, 200.0), known(3, 2000.0), known(4, 900.0)];
        assert_eq!(settled(&mut targets), (vec![0, 1, 2], vec!["discarded", "discarded"]));
        let mut fits = [known(0, 0.0), known(1, 690.0)];
        assert_eq!(settled(&mut fits).0, [0, 1]);
        let mut too_wide = [known(0, 0.0), known(1, 710.0)];
        assert_eq!(settled(&mut too_wide).0.len(), 1);
    }

    /// Checks section IV.B.2, range rule, beyond the paper: a discarded target comes back when there is room to spare,
    /// not as soon as it barely fits.
    #[test]
    fn a_discarded_target_is_taken_back_with_room_to_spare() {
        let mut targets = [known(0, 0.0), known(1, 100.0), known(2, 1200.0)];
        assert_eq!(settled(&mut targets), (vec![0, 1], vec!["discarded"]));
        // At 570 m the three need an orbit of some 695 m, more than 0.9 of 700 m; at 510 m, some 620 m.
        let barely = targets[2];
        targets[2] = moved(&barely, 570.0);
        assert_eq!(settled(&mut targets), (vec![0, 1], vec![]));
        targets[2] = moved(&barely, 510.0);
        assert_eq!(settled(&mut targets), (vec![0, 1, 2], vec!["taken-back"]));
    }

    #[test]
    fn a_newcomer_joins_if_it_fits_and_stays_outside_if_not() {
        let mut targets = [known(0, 0.0), known(1, 100.0)];
        settled(&mut targets);
        let mut targets = [targets[0], targets[1], known(2, 300.0), known(3, 3000.0)];
        assert_eq!(settled(&mut targets), (vec![0, 1, 2], vec!["joined"]));
    }

    #[test]
    fn no_targets_and_coinciding_targets_are_no_trouble() {
        assert_eq!(settled(&mut []), (vec![], vec![]));
        let mut targets = [known(0, 5.0), known(1, 5.0), known(2, 5.0)];
        assert_eq!(settled(&mut targets).0, [0, 1, 2]);
    }
}
