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
