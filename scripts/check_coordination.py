#!/usr/bin/env python3
"""Replay the group memberships and assignments of a record in plain NumPy, and compare.

Usage: check_coordination.py <record folder>

This is an independent implementation of section IV of the paper (see check_equations.py), with the rules that the
project adds. Each time step starts from the recorded memberships of the last one and from the recorded estimates: it
clusters (30), hands off with dwell (34), removes and readmits targets, creates and retires groups, and assigns UAVs
(31-33). The results are compared with the record: memberships, events, assignments, altitudes, alerts.

Prints lines like check_equations.py. For initial clusterings and assignments, only the objective is compared, with the
best of many random starts and of all assignments. Exits with 1 and a message if a tolerance is exceeded.

Not checked: assignments of more than EXHAUSTIVE_MAX UAVs, teams whose UAVs leave and join, and the text of a reason
after its first number. With `groups.count = "as-needed"` and no previous group: that half as many clusters as UAVs do not
cover all targets, if the record creates groups one by one instead. With `groups.search_lost_targets = true`: which UAV searches for
which target and when a search ends, both taken as recorded.
"""

import re
import sys
from collections import Counter
from itertools import product
from types import SimpleNamespace

import numpy as np

from check_equations import (
    POSITION, ROUNDING, VELOCITY, Outline, circle_spread, climb_of, direction, equation_7, equation_15, equations_13_20,
    equation_22, equations_28_29, is_by_circle, last_furthest, lemma_3_1, main, margin_in_metres, minima, required_radius,
    enclosing_circle, turn_limit, unit, desired_state, wrap)

EXHAUSTIVE_MAX = 8  # UAVs up to which all assignments are tried
RECEIVING_RADIUS_FRACTION = 0.85  # maximum radius of other orbits that receive members of a retiring group, relative to radius_max_m
LN_DET_FLOOR = np.log(1e-24)  # score of a target without information
LN_DET_STEP = 1e-6  # rounding of scores
STARTS = 60  # number of random starts of the clusterings for comparison
CLUSTERING_COST_TOLERANCE = 0.05  # allowed relative excess of the cost (30) over the best clustering found
SAME_M = 1e-6  # distances with a smaller difference count as equal
REPLAYED = ["group-created", "group-retired", "admitted", "handoff-started", "handoff-completed", "handoff-cancelled",
            "removed", "readmitted", "not-admitted", "regrouped"]
STATED = {"handoff-started": 0.05}  # rounding of the number in a reason; 0.5 for other events
UNGROUPED, REMOVED = ("ungrouped", None, None), ("removed", None, None)


def member(group):
    return "member", group, None


def check_memberships(record, compare):
    """Checks the membership of every target, and all events of groups and their members."""

    def key(event):
        return event.kind, event.target, event.group, event.to_group

    memory = SimpleNamespace(steered=equation_22(record), dwells={}, blocked={}, diverging_for={}, outrun_for={}, next_group=0,
                             next_review=0, retiring=None, random=np.random.default_rng(1))
    for before, time in zip([None, *record.times], record.times):
        step = TimeStep(record, before, time, memory, compare)
        step.regroup()
        recorded = {target: (row.membership, row.group, row.receiving_group) for target, row in record.tracks[time].items()}
        wrong = [target for target in recorded if step.places[target] != recorded[target]]
        compare("section IV: membership and groups of a target", 0, np.isin(list(recorded), wrong))
        events = [event for event in record.events[time] if event.kind in REPLAYED]
        compare("section IV: missing or unexpected events", 0, differing(map(key, events), map(key, step.events)))
        for event in step.events:
            same = [other for other in events if key(other) == key(event)]
            if same and event.number is not None:
                compare(f"{event.kind}: number in the reason", stated(same[0]), event.number, scale=1.0,
                        tolerance=STATED.get(event.kind, 0.5) + ROUNDING)
        step.update_divergence()


def differing(recorded, computed):
    """Returns the number of elements that are in only one of the two collections, in any order."""
    recorded, computed = Counter(recorded), Counter(computed)
    return ((recorded - computed) + (computed - recorded)).total()


def stated(event):
    """Returns the first number in the reason of an event."""
    number = re.search(r"-?\d+(\.\d+)?", event.reason)
    return float(number[0]) if number else None


class TimeStep:
    """Grouping at one time step. A place is a tuple: membership, group, receiving group."""

    def __init__(self, record, before, time, memory, compare):
        self.record, self.scenario, self.before, self.time = record, record.scenario, before, time
        self.memory, self.compare, self.events = memory, compare, []
        self.by_need = record.scenario["groups"]["count"] == "as-needed"
        self.tracks, self.orbit, self.rules = record.tracks[time], record.scenario["orbit"], record.scenario["groups"]
        old = record.tracks[before] if before is not None else {}
        self.places = {target: (row.membership, row.group, row.receiving_group) for target, row in old.items()}
        self.old_groups = set(record.groups[before]) if before is not None else set()
        self.crew = {group: [row for uav, row in record.uavs[time].items() if record.uavs[before][uav].group == group]
                     for group in self.old_groups}

    def regroup(self):
        before = dict(self.places)
        for target in set(self.places) - set(self.tracks):
            self.cancel(target, lost=True)
            del self.places[target]
        for target in self.tracks:
            self.places.setdefault(target, UNGROUPED)
        # Half as many groups as UAVs, rounded up, and never more than targets; as needed, up to one per UAV.
        uavs = len(self.record.uavs[self.time])
        self.half = min((uavs + 1) // 2, len(self.tracks))
        desired = min(uavs, len(self.tracks)) if self.by_need else self.half
        if not self.groups():
            self.create_first(desired)
        else:
            while len(self.groups()) > max(desired, 1):
                self.retire_smallest()
            self.continue_retiring()
            self.admit()
            self.review(desired)
            while len(self.groups()) < desired and self.create_another():
                pass
            self.hand_over()
        self.ungrouped_before_removal = self.ungrouped()
        self.remove_members()
        dissolved = {event.group for event in self.events if event.kind == "group-retired"}
        for group in self.old_groups - set(self.groups()) - dissolved:
            self.emit("group-retired", group=group)
        # A target in dwell cannot be split off: the creation of the next group waits for it.
        in_dwell = any(place[0] == "in-handoff" for place in [*before.values(), *self.places.values()])
        waits = len(self.groups()) < desired and in_dwell
        # As needed, further groups are created only for ungrouped targets, and may end when they are empty.
        waits |= self.by_need and self.half <= len(self.groups()) < desired and not self.ungrouped_before_removal
        self.compare("(30) number of groups", desired if waits else len(self.groups()), desired)

    def emit(self, kind, target=None, group=None, to_group=None, number=None):
        self.events.append(SimpleNamespace(kind=kind, target=target, group=group, to_group=to_group, number=number))

    def groups(self):
        return sorted({group for place in self.places.values() for group in place[1:] if group is not None})

    def members(self, group):
        return [target for target, place in sorted(self.places.items()) if group in place[1:]]

    def ungrouped(self):
        return [target for target, place in sorted(self.places.items()) if place[0] in ["ungrouped", "removed"]]

    def position(self, target):
        return self.tracks[target].position

    def positions(self, targets):
        return np.array([self.position(target) for target in targets]).reshape(-1, 2)

    def required_orbit(self, targets):
        """Returns the orbit that these targets require, without the margin (16) as published."""
        rows = {target: self.tracks[target] for target in targets}
        centre = desired_state(self.scenario, rows)
        distances = {target: np.hypot(*(row.position - centre[POSITION])) for target, row in rows.items()}
        furthest = self.furthest(distances)
        offset = rows[furthest].position - centre[POSITION]
        toward = unit(direction(offset)) if offset.any() else np.zeros(2)
        mahalanobis = self.orbit["margin"] == "mahalanobis"
        margin = 0.0 if mahalanobis else margin_in_metres(self.orbit["margin_sds"], toward, furthest, rows)
        spread_rate = toward @ (rows[furthest].velocity - centre[VELOCITY])
        spread = distances[furthest]
        if is_by_circle(self.scenario):
            velocities = np.array([row.velocity for row in rows.values()])
            spread, spread_rate = circle_spread(self.positions(rows), velocities)
        unclamped, radius, rate = equation_15(self.scenario, spread, spread_rate, margin, turn_limit(self.scenario["uavs"], centre[VELOCITY]))
        has_room = (unclamped <= self.orbit["readmission_radius_fraction"] * self.orbit["radius_max_m"]
                    and radius * rate <= self.rules["divergence_limit_m2_s"] / 2)
        return SimpleNamespace(centre=centre[POSITION], furthest=furthest, spread=spread, unclamped=unclamped,
                               radius=radius, rate=rate, has_room=has_room)

    def orbit_with(self, group, target):
        """Returns the orbit of a group with a further target if it has room; a target inside the enclosing circle needs
        none."""
        members = self.members(group)
        required = self.required_orbit([*members, target])
        inside = is_by_circle(self.scenario) and required.unclamped <= self.required_orbit(members).unclamped * (1 + 1e-9)
        return required if required.has_room or inside else None

    def first_to_remove(self, targets):
        """Returns the first target to remove if one orbit cannot cover all: the furthest, or with `removal = "largest-radius-reduction"` the
        one whose removal reduces the radius most."""
        furthest = self.required_orbit(targets).furthest
        if self.rules["removal"] != "largest-radius-reduction":
            return furthest

        def radius_without(target):
            rest = [other for other in targets if other != target]
            return self.required_orbit(rest).unclamped if rest else 0.0

        # Only support points of the circle affect its radius.
        first, least = furthest, radius_without(furthest)
        for target in [list(targets)[i] for i in enclosing_circle(self.positions(targets))[1]]:
            if radius_without(target) < least * (1 - 1e-9):
                first, least = target, radius_without(target)
        return first

    def furthest(self, distances):
        """Returns the furthest target, of equal ones the last. The two targets of a pair are always equally far, so that
        rounding decides; the recorded choice is accepted."""
        tied = [target for target, distance in distances.items() if distance > max(distances.values()) - SAME_M]
        if is_by_circle(self.scenario):
            return tied[-1]
        return max(tied, key=lambda target: (self.tracks[target].group is None,
                                             self.tracks[target].group != self.places[target][1], target))

    def reach(self):
        """Returns the maximum distance of a target from the centre of an orbit with room to spare and without margin."""
        radius_per_metre, _, _ = equation_15(self.scenario, 1.0, 0.0, 0.0, 0.0)
        return self.orbit["readmission_radius_fraction"] * self.orbit["radius_max_m"] / radius_per_metre

    def create_first(self, desired):
        """Clusters the targets if no group exists; groups are numbered by their first targets."""
        founded = {}
        self.memory.next_review = self.time + self.rules["regrouping_period_s"] * 1e6
        causes = {event.cause for event in self.record.events[self.time] if event.kind == "group-created"}
        if self.by_need and "first" not in causes:
            # Half as many clusters did not cover all targets; this is taken from the record.
            while len(self.groups()) < desired and self.create_another():
                pass
            return
        for target, row in sorted(self.tracks.items()):
            group = self.recorded_new_group(target)
            founded.setdefault(group, self.memory.next_group + len(founded))
            self.places[target] = member(founded[group])
        self.memory.next_group += len(founded)
        for group in founded.values():
            self.emit("group-created", group=group, number=len(self.members(group)))
        self.compare_cost(sorted(self.tracks), [self.places[target][1] for target in sorted(self.tracks)], self.half)
        if self.by_need:
            held = [self.required_orbit(self.members(group)).has_room for group in founded.values()]
            self.compare("groups.count: initial clusters that are too wide", 0, held.count(False))

    def recorded_new_group(self, target):
        """Returns the group in which a target was when it was created at this time step, even if it left immediately."""
        left = [event.group for event in self.record.events[self.time] if event.target == target
                and event.kind in ["removed", "handoff-completed"]]
        return left[0] if left else self.tracks[target].group

    def compare_cost(self, targets, groups, count):
        """Compares an initial clustering with the best of many."""
        positions = self.positions(targets)
        clusters = np.unique(groups, return_inverse=True)[1]
        costs = [clustered(positions, count, self.memory.random) for _ in range(STARTS if count else 0)]
        best = min(costs, default=0.0)
        above = max(equation_30(positions, clusters) / best - 1.0, 0.0) if best > 0.0 else 0.0
        self.compare("(30) cost of a clustering above the best found", 0.0, above, tolerance=CLUSTERING_COST_TOLERANCE)

    def retire_smallest(self):
        """Retires the group with the fewest members, of equal ones the youngest."""
        self.retire(min(self.groups(), key=lambda group: (len(self.members(group)), -group)))

    def retire(self, group, number=None, into=None):
        """Retires a group; another one may admit its targets."""
        self.emit("group-retired", group=group, number=number)
        for target in self.members(group):
            _, passing, receiving = self.places[target]
            if receiving == group:
                self.cancel(target)
            elif receiving is not None:
                self.complete(target)
            elif into is not None:
                self.receive(target, into)
                self.emit("regrouped", target, group, into)
            else:
                self.places[target] = UNGROUPED
                self.emit("not-admitted", target, group)

    def admit(self):
        """Admits ungrouped targets to the nearest groups that have room to spare."""
        outside, pairs = self.slow_enough(self.ungrouped()), []
        for group in [group for group in self.groups() if outside and group != self.memory.retiring]:
            members = self.members(group)
            required = self.required_orbit(members)
            distances = np.hypot(*(self.positions(outside) - required.centre).T)
            # Evaluated before any target is admitted: an admitted target moves the centroid toward itself. For a circle,
            # the diameter is at least the distance of the target from a member on the opposite side.
            reach = self.reach() * (len(members) + 1) / len(members)
            if is_by_circle(self.scenario):
                reach = np.sqrt(max(4 * self.reach() ** 2 - required.spread**2, 0.0))
            pairs += [(distance, target, group) for distance, target in zip(distances, outside)
                      if distance <= reach and not self.is_blocked(target, group)]
        for _, target, group in sorted(pairs):
            if self.places[target] in [UNGROUPED, REMOVED] and self.orbit_with(group, target):
                self.emit("admitted" if self.places[target] == UNGROUPED else "readmitted", target, group)
                self.receive(target, group)

    def receive(self, target, group):
        """Admits an ungrouped target; it becomes a member once it is in view."""
        immediately = self.rules["dwell_max_s"] == 0.0 or self.is_covered(target, group)
        self.places[target] = member(group) if immediately else ("in-handoff", None, group)
        self.memory.dwells[target] = self.time, 0

    def review(self, desired):
        """Periodically retires a group whose UAVs could cover half as many targets again (own and ungrouped ones), or any
        ungrouped targets if another group can cover its own."""
        period = self.rules["regrouping_period_s"] * 1e6
        is_due = period > 0 and self.time >= self.memory.next_review and len(self.groups()) >= desired
        if not is_due or not self.ungrouped() or self.memory.retiring is not None:
            return
        self.memory.next_review = self.time + period
        if self.by_need and (not self.justifies_a_group(len(self.largest_coverable(self.ungrouped()))) or self.retire_one()):
            return
        found = {}
        for group in self.groups():
            members = self.members(group)
            own = [target for target in members if self.places[target] == member(group)]
            soon = [target for target in self.ungrouped() if self.is_soon_in_range(target, members)]
            others = [other for other in self.groups() if other != group
                      and self.required_orbit(sorted({*self.members(other), *members})).has_room]
            together = len(self.largest_coverable(soon if others else own + soon))
            gain = together if others else together - len(members)
            if (gain >= (1 if others else max(2, len(members) / 2))
                    and (not self.by_need or not others or self.justifies_a_group(together))):
                away = self.distance_to_ungrouped(self.required_orbit(members).centre) if self.by_need else 0.0
                found[group] = gain, together, others[:1], away
        if found:
            group = max(found, key=lambda group: (found[group][0], -found[group][3], -group))
            members, (_, together, others) = self.members(group), found[group]
            centre = self.required_orbit(members).centre
            self.retire(group, together, *others)
            self.create(self.largest_coverable([target for target in self.ungrouped() if self.is_soon_in_range(target, centre=centre)]))

    def retire_one(self):
        """With `count = "as-needed"`, retires the group that is nearest to an ungrouped target, among those whose members other
        groups can cover; its members are passed to these groups."""
        last = self.record.groups[self.before]
        away = {group: self.distance_to_ungrouped(last[group].position) if group in last else np.inf for group in self.groups()}
        for group in sorted(self.groups(), key=lambda group: (away[group], -group)):
            receivers = self.receivers_of_members(group)
            if receivers is None:
                continue
            self.memory.retiring = group
            for target, (_, passing, receiving) in sorted(self.places.items()):
                if receiving == group and passing is not None:
                    self.cancel(target)
            for target, to in receivers:
                if self.places[target][1] == group:
                    self.request(target, group, to)
                else:
                    self.receive(target, to)
                    self.emit("regrouped", target, group, to)
            return True
        return False

    def justifies_a_group(self, together):
        """Returns true for two ungrouped targets on one orbit, or a tenth of all targets that are not lost."""
        return together >= 2 or 10 * together >= len(self.places)

    def distance_to_ungrouped(self, place):
        return min((np.hypot(*(self.position(target) - place)) for target in self.ungrouped()), default=np.inf)

    def receivers_of_members(self, group):
        """Returns for each member the other group with the smallest required orbit including it; None if not all members find
        a group."""
        held = {other: self.members(other) for other in self.groups() if other != group}
        receivers = []
        for target in self.members(group):
            if self.home(target) != group or self.places[target][1] not in [None, group]:
                continue
            radii = {}
            for other, targets in held.items():
                required = self.required_orbit([*targets, target])
                if (required.has_room and required.unclamped <= RECEIVING_RADIUS_FRACTION * self.orbit["radius_max_m"]
                        and not self.is_blocked(target, other)):
                    radii[other] = required.unclamped
            if not radii:
                return None
            receivers.append((target, min(radii, key=radii.get)))
            held[receivers[-1][1]].append(target)
        return receivers

    def continue_retiring(self):
        """A retiring group that could not pass on all of its members stays, at least until the next review."""
        group = self.memory.retiring
        members = self.members(group) if group is not None else []
        if group is not None and not (members and all(self.home(target) != group for target in members)):
            self.memory.retiring = None
            self.memory.next_review = self.time + self.rules["regrouping_period_s"] * 1e6

    def is_soon_in_range(self, target, members=(), centre=None):
        """Returns true if a target is within sensing range after `assignment_reach_s`, even if it drives away."""
        centre = self.required_orbit(members).centre if centre is None else centre
        scenario, distance = self.scenario, np.hypot(*(self.position(target) - centre))
        closing = max(scenario["uavs"]["speed_m_s"] - self.speed(target), 0.0)
        return distance <= scenario["sensor"]["sensing_range_m"] + self.rules["assignment_reach_s"] * closing

    def speed(self, target):
        return np.hypot(*self.tracks[target].velocity)

    def slow_enough(self, targets):
        uavs = self.scenario["uavs"]
        return [target for target in targets if self.speed(target) <= uavs["speed_m_s"] + uavs["speed_change_max_m_s"]]

    def largest_coverable(self, targets):
        """Returns the largest set of these targets that one orbit around one of them could cover."""
        targets = sorted(self.slow_enough(targets))
        if not targets:
            return []
        positions = self.positions(targets)
        near = np.hypot(*(positions[:, None] - positions).T) <= self.reach()
        together = [target for target, is_near in zip(targets, near[np.argmax(near.sum(axis=1))]) if is_near]
        while len(together) > 1 and not self.required_orbit(together).has_room:
            together.remove(self.first_to_remove(together))
        return together

    def create_another(self):
        """Creates one more group from ungrouped targets, or by splitting the group with the largest sum of squares."""
        founders = self.largest_coverable(self.ungrouped()) or self.ungrouped()[:1]
        if founders:
            self.create(founders)
        elif len(self.groups()) >= self.half:
            return False
        else:
            own = {group: [target for target in self.members(group) if self.places[target] == member(group)]
                   for group in self.groups()}
            own = {group: targets for group, targets in own.items() if len(targets) > 1}
            if not own:
                return False
            widest = max(own, key=lambda group: (len(own[group]) * equation_30(self.positions(own[group]), 0), -group))
            founders = [target for target in own[widest] if self.recorded_new_group(target) == self.memory.next_group]
            some = 0 < 2 * len(founders) <= len(own[widest])
            self.compare("(30) split-off part: not empty, at most half", True, some)
            self.compare_cost(own[widest], [target in founders for target in own[widest]], 2)
            for target in founders:
                self.emit("regrouped", target, widest, self.memory.next_group)
            self.create(founders, emit_each=False, immediately=True)
        return True

    def create(self, founders, emit_each=True, immediately=False):
        for target in founders:
            if self.by_need and not immediately:
                # The UAVs have not arrived yet.
                self.receive(target, self.memory.next_group)
            else:
                self.places[target] = member(self.memory.next_group)
            if emit_each:
                self.emit("admitted", target, self.memory.next_group)
        self.emit("group-created", group=self.memory.next_group, number=len(founders))
        self.memory.next_group += 1

    def hand_over(self):
        """Continues the last clustering; starts handoffs, and ends those whose dwell is over."""
        groups = [group for group in self.groups() if group != self.memory.retiring]
        for group in groups:
            members = self.members(group)
            if all(self.home(target) != group for target in members):
                self.cancel(members[0])
        targets = [target for target, place in sorted(self.places.items()) if place not in [UNGROUPED, REMOVED]]
        clusters = algorithm_1(self.positions(targets), np.searchsorted(groups, [self.home(t) for t in targets]),
                               len(groups), self.rules["handoff_margin_m"])
        for target, desired in zip(targets, np.array(groups)[clusters]):
            place, passing, receiving = self.places[target]
            if place == "in-handoff":
                self.end_dwell(target, desired)
            elif passing != desired:
                self.request(target, passing, desired)

    def home(self, target):
        """Returns the group that the last clustering gave a target."""
        _, passing, receiving = self.places[target]
        return passing if receiving is None else receiving

    def request(self, target, passing, receiving):
        required = self.orbit_with(receiving, target)
        if required is None or self.is_blocked(target, receiving):
            return
        longest = self.rules["dwell_max_s"]
        times = [self.equation_34(uav.position, required) for uav in self.crew.get(receiving, [])]
        dwell = np.clip(max(times, default=longest), self.rules["dwell_min_s"], longest)
        self.emit("handoff-started", target, passing, receiving, dwell)
        self.places[target], self.memory.dwells[target] = ("in-handoff", passing, receiving), (self.time, round(dwell * 1e6))
        if longest == 0.0:
            self.complete(target)

    def equation_34(self, uav, orbit):
        """Returns T_hd, with the radial speed of the field (20)."""
        r = max(np.hypot(*(uav - orbit.centre)), 1.0)
        inward = (r**2 - orbit.radius**2) / self.scenario["guidance"]["radial_gain"]
        radial_speed = -self.scenario["uavs"]["speed_m_s"] * inward / np.hypot(inward, 2 * r * orbit.radius)
        closing = abs(radial_speed - orbit.radius / r * orbit.rate)
        if r == orbit.radius:
            return 0.0
        return abs(r - orbit.radius) / closing if closing > 0.0 else np.inf

    def end_dwell(self, target, desired):
        """Completes a handoff after the dwell if all receiving UAVs have the target in view; after the longest dwell, if one
        has."""
        _, passing, receiving = self.places[target]
        requested, dwell = self.memory.dwells[target]
        if self.time - requested < dwell:
            return
        views, is_last = self.views(target, receiving), self.time - requested >= self.rules["dwell_max_s"] * 1e6
        if passing is not None and desired != receiving and passing != self.memory.retiring:
            self.cancel(target)
        elif self.is_covered(target, receiving) or is_last and any(views):
            self.complete(target)
        elif is_last:
            self.cancel(target)

    def is_blocked(self, target, group):
        """Returns true if a handoff to that group was cancelled recently."""
        barred, until = self.memory.blocked.get(target, (None, 0))
        return barred == group and self.time < until

    def is_covered(self, target, group):
        """Returns true if all UAVs of the group have the target in view. With moving orbits, the orbit must also keep it in
        view from all directions, and each UAV must be near the orbit or unable to leave sensing range of the centre by
        turning away first."""
        views = self.views(target, group)
        last = self.record.groups[self.before].get(group) if self.before is not None else None
        half_view = np.radians(self.scenario["sensor"]["field_of_view_deg"]) / 2
        uavs, near = self.scenario["uavs"], 0.0
        if last is not None:
            turn = uavs["speed_m_s"] / uavs["turn_rate_max_rad_s"]
            near = max(self.scenario["sensor"]["sensing_range_m"] - 2 * turn, last.standoff_distance_m + turn)
        holds = (self.orbit["time_constant_s"] == 0 or last is None
                 or np.hypot(*(self.position(target) - last.position))
                 <= last.standoff_distance_m * np.sin(min(half_view, np.pi / 2))
                 and all(np.hypot(*(uav.position - last.position)) <= near for uav in self.crew.get(group, [])))
        return bool(views) and all(views) and bool(holds)

    def views(self, target, group):
        """Returns for each UAV of a group whether it has the target in view, with one standard deviation to spare."""
        sensor, row = self.scenario["sensor"], self.tracks[target]
        spare = np.sqrt(np.linalg.eigvalsh(row.p_position)[-1])
        views = []
        for uav in self.crew.get(group, []):
            distance, azimuth = equation_7(uav.position, row.position)
            views.append(uav.boresight_rad is not None and distance > max(spare, 1.0)
                         and distance + spare <= sensor["sensing_range_m"]
                         and abs(wrap(azimuth - uav.boresight_rad)) + spare / distance
                         <= np.radians(sensor["field_of_view_deg"]) / 2)
        return views

    def complete(self, target):
        _, passing, receiving = self.places[target]
        self.places[target] = member(receiving)
        if passing is not None:
            self.emit("handoff-completed", target, passing, receiving)

    def cancel(self, target, lost=False):
        place, passing, receiving = self.places[target]
        if place == "in-handoff":
            self.places[target] = REMOVED if passing is None else member(passing)
            dwell = max(self.memory.dwells[target][1], self.rules["dwell_min_s"] * 1e6)
            self.memory.blocked[target] = receiving, self.time + dwell
            if passing is not None:
                self.emit("handoff-cancelled", target, passing, receiving)
            elif not lost:
                self.emit("not-admitted", target, receiving)

    def remove_members(self):
        """Removes members from groups whose orbit outruns the UAVs, or requires more than the largest radius."""
        for group in self.groups():
            since, threshold = self.memory.diverging_for.get(group, (0, None))
            if since > self.rules["divergence_time_s"] * 1e6 and len(self.members(group)) > 1:
                self.remove_one(group, self.first_to_remove(self.members(group)), threshold)
            if self.memory.outrun_for.get(group, 0) > self.rules["divergence_time_s"] * 1e6:
                self.remove_fastest(group)
            while len(self.members(group)) > 1:
                required = self.required_orbit(self.members(group))
                if required.unclamped <= self.orbit["radius_max_m"]:
                    break
                self.remove_one(group, self.first_to_remove(self.members(group)), required.unclamped)

    def remove_fastest(self, group):
        """Removes the fastest target of a group that outruns the UAVs."""
        fastest = max(self.members(group), key=lambda target: (self.speed(target), target))
        if len(self.members(group)) > 1:
            self.remove_one(group, fastest, self.speed(fastest))

    def remove_one(self, group, furthest, number):
        """Removes a target. A target being received is removed first if it widens the orbit. One being passed on is passed
        immediately; with moving orbits, only if the other group covers it."""
        members = self.members(group)
        radius = self.required_orbit(members).unclamped
        incoming = [target for target in members if self.places[target][2] == group]
        widening = [target for target in incoming
                    if self.required_orbit([other for other in members if other != target]).unclamped < radius]
        if widening or furthest in incoming:
            self.cancel([*widening, furthest][0])
        elif self.places[furthest][2] is not None and (
                self.orbit["time_constant_s"] == 0 or self.is_covered(furthest, self.places[furthest][2])):
            self.complete(furthest)
        else:
            self.places[furthest] = REMOVED
            self.emit("removed", furthest, group, number=number)

    def update_divergence(self):
        """Updates the time for which the threshold of Lemma 3.1 of all UAVs of a group, at nominal speed, is below the
        limit."""
        diverging_for, outrun_for, speed = {}, {}, self.scenario["uavs"]["speed_m_s"]
        elapsed = self.time - self.before if self.before is not None else 0
        for group, row in self.record.groups[self.time].items():
            radius, rate, thresholds = row.standoff_distance_m, row.standoff_rate_m_s, []
            for uav in self.record.uavs[self.time].values():
                if uav.group == group:
                    relative = uav.position - row.position
                    field = equations_13_20(self.scenario, relative, self.memory.steered[self.time][group][0])
                    ground_track, too_fast = equations_28_29(field, row.velocity, speed)
                    radial_speed = (ground_track - row.velocity) @ unit(direction(relative))
                    if not too_fast:
                        thresholds.append(lemma_3_1(np.hypot(*relative), radial_speed, radius, rate))
            self.compare("Lemma 3.1: threshold of a group", row.convergence_threshold_m2_s, max(thresholds, default=None))
            old = self.memory.diverging_for.get(group, (0, None))[0] if self.has_same_members(group) else 0
            # A moving orbit also shrinks temporarily.
            runs_away = self.orbit["time_constant_s"] == 0 or rate > 0
            if runs_away and thresholds and max(thresholds) < -self.rules["divergence_limit_m2_s"]:
                diverging_for[group] = old + elapsed, max(thresholds)
            if np.hypot(*row.velocity) > speed + self.scenario["uavs"]["speed_change_max_m_s"]:
                outrun_for[group] = elapsed + (self.memory.outrun_for.get(group, 0) if self.has_same_members(group) else 0)
        self.memory.diverging_for, self.memory.outrun_for = diverging_for, outrun_for

    def has_same_members(self, group):
        """Returns true if the members are the same; otherwise the orbit is a different one."""
        now, then = ({target for target, row in self.record.tracks[time].items() if group in [row.group, row.receiving_group]}
                     for time in [self.time, self.before])
        return now == then


def equation_30(positions, clusters):
    """Returns the mean of the squared distances from the centroids."""
    clusters = np.broadcast_to(clusters, len(positions))
    squares = [np.sum((positions[clusters == c] - positions[clusters == c].mean(axis=0)) ** 2) for c in set(clusters)]
    return sum(squares) / len(positions)


def algorithm_1(positions, clusters, count, margin):
    """Continues K-means from these clusters: a target moves only if it gains more than the margin, and never leaves a cluster
    empty."""
    clusters, before = clusters.copy(), None
    while not np.array_equal(clusters, before):
        before = clusters.copy()
        centroids = np.array([positions[clusters == c].mean(axis=0) for c in range(count)])
        distances = np.hypot(*(positions[:, None] - centroids).T).T
        for i, (own, nearest) in enumerate(zip(before, distances.argmin(axis=1))):
            if distances[i, own] - distances[i, nearest] > margin and np.sum(clusters == own) > 1:
                clusters[i] = nearest
    return clusters


def clustered(positions, count, random):
    """Returns the cost (30) of K-means from random centroids."""
    centroids = positions[random.choice(len(positions), count, replace=False)]
    # If targets coincide, there may be fewer clusters.
    clusters = np.unique(np.hypot(*(positions[:, None] - centroids).T).argmin(axis=0), return_inverse=True)[1]
    return equation_30(positions, algorithm_1(positions, clusters, clusters.max() + 1, 0.0))


def check_assignments(record, compare):
    """Checks the assignment of UAVs to groups: unchanged, or after changes of groups the best of all assignments."""
    known, when_assigned, searching = 0, {}, set()
    for before, time in zip([None, *record.times], record.times):
        for event in record.events[time]:
            if event.kind in ["search-started", "search-ended"]:
                (searching.add if event.kind == "search-started" else searching.discard)(int(event.uavs))
        groups, uavs = list(record.groups[time]), record.uavs[time]
        old_groups = list(record.groups[before]) if before is not None else []
        crew = {uav: row.group for uav, row in uavs.items()}
        old_crew = {uav: record.uavs[before][uav].group if before is not None else None for uav in uavs}
        ids = sorted(set(groups) - set(old_groups))
        compare("ids of new groups", ids, known + np.arange(len(ids)))
        known += len(ids)
        numbers = {group: row.members for group, row in record.groups[time].items()}
        changed = any(abs(now - when_assigned[group]) >= 2 and max(now, when_assigned[group]) >= 2 * min(now, when_assigned[group])
                      for group, now in numbers.items() if group in when_assigned)
        available = [uav for uav in uavs if uav not in searching]
        if searching:
            compare("groups.search_lost_targets: searchers in a group", 0, sum(crew[uav] is not None for uav in searching))
            compare("groups.search_lost_targets: too few UAVs left for the groups", 0, max(len(groups) - len(available), 0))
        ended = bool(groups) and any(old_crew[uav] is None for uav in available)
        if groups == old_groups and not changed and not ended:
            compare("assignment unchanged", 0, sum(crew[uav] != old_crew[uav] for uav in available))
        elif groups:
            when_assigned = numbers
            sizes = [list(crew.values()).count(group) for group in groups]
            compare("UAVs in no group", 0, [crew[uav] for uav in available].count(None))
            compare("(33) groups with too few or too many UAVs", 0,
                    sum(not 1 <= size <= max(2, -(-len(available) // len(groups))) for size in sizes))
            if len(available) <= EXHAUSTIVE_MAX:
                score, best = equation_32(record, time, groups, old_crew, available)
                which = record.scenario["groups"]["objective"]
                compare(f"(32) ln det below the best assignment, {which}", 0.0, max(best - score, 0.0),
                        tolerance=LN_DET_STEP * len(groups))
        moved = [(str(uav), old_crew[uav], crew[uav]) for uav in uavs
                 if old_crew[uav] is not None and crew[uav] not in [old_crew[uav], None]]
        events = [(event.uavs, event.group, event.to_group) for event in record.events[time]
                  if event.kind == "reassigned"]
        compare("missing or unexpected reassignments", 0, differing(events, moved))


def equation_31(sensor, uav, target):
    """Returns the Fisher information of range and azimuth about the target's position."""
    (dx, dy), (distance, _) = target - uav, equation_7(uav, target)
    if distance <= 1.0:
        return np.zeros((2, 2))
    h = np.array([[dx / distance, dy / distance], [-dy / distance**2, dx / distance**2]])
    return h.T @ np.diag([sensor["range_sd_m"] ** -2, np.radians(sensor["bearing_sd_deg"]) ** -2]) @ h


def equation_32(record, time, groups, old_crew, available):
    """Returns the score of the recorded assignment, and the best of all that respect the limits of (33)."""
    sensor, uavs = record.scenario["filter"], [record.uavs[time][uav] for uav in available]
    terms = [np.array([[equation_31(sensor, uav.position, row.position) for row in record.members(time, group).values()]
                       for uav in uavs]) for group in groups]
    most, n = max(2, -(-len(uavs) // len(groups))), len(groups)
    crews = [np.array(choice) for choice in product(range(n), repeat=len(uavs))]
    crews = [crew for crew in crews if all(1 <= size <= most for size in np.bincount(crew, minlength=n))]
    of_block = {}

    def score(crew):
        sums = []
        for group in range(n):
            block = tuple(map(int, np.flatnonzero(crew == group)))
            if (group, block) not in of_block:
                of_block[group, block] = information_of(terms[group][list(block)].sum(axis=0))
            sums.append(of_block[group, block])
        return ln_det(sum(sums)) if as_published else sum(sums) + switching_cost * staying[crew, range(len(crew))].sum()

    objective, switching_cost = (record.scenario["groups"][key] for key in ["objective", "assignment_switching_cost"])
    as_published = objective == "paper"
    information_of = (lambda by_target: by_target.sum(axis=0)) if as_published else (
        lambda by_target: ln_det(by_target).sum())
    recorded = np.array([groups.index(uav.group) for uav in uavs])
    # A UAV that keeps its group gets a bonus in proportion to the number of the group's targets.
    staying = np.array([[terms[g].shape[1] * (old_crew[uav] == group) for uav in available]
                        for g, group in enumerate(groups)])
    return score(recorded), max(score(crew) for crew in crews)


def ln_det(information):
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.log(np.linalg.det(information))
    return np.clip(np.nan_to_num(value, nan=LN_DET_FLOOR), LN_DET_FLOOR, -LN_DET_FLOOR)


CLEAR_MINIMA = 6.0  # UAVs do not climb or descend past UAVs within this multiple of the minimum distance


def check_altitudes(record, compare):
    """Checks altitudes: a group keeps its altitude and a new one takes the lowest free one; or each UAV has its own, or all
    have the same."""
    rules, altitudes, climb = record.scenario["groups"], {}, climb_of(record.scenario)
    lowest, step = rules["altitude_lowest_m"], rules["altitude_step_m"]
    for time in record.times:
        altitudes = {group: altitudes[group] for group in record.groups[time] if group in altitudes}
        for group, row in record.groups[time].items():
            free = next(altitude for altitude in (lowest + step * n for n in range(len(altitudes) + 1))
                        if altitude not in altitudes.values() or rules["altitude_policy"] == "common")
            altitudes.setdefault(group, free)
            compare("altitude of a group", row.altitude_m, altitudes[group])
        uavs = record.uavs[time]
        for uav in uavs.values():
            desired = {"per-group": altitudes.get(uav.group), "per-uav": lowest + step * uav.uav, "common": lowest}[rules["altitude_policy"]]
            if climb and desired is not None:
                desired = np.clip(desired, climb["altitude_min_m"], climb["altitude_max_m"])
            if record.scenario.get("separation") and desired is not None and uav.commanded_altitude_m != desired:
                # The UAV waits for near UAVs at altitudes in between.
                clear, vertical = (minima(record)[key] for key in ["horizontal_min_m", "vertical_min_m"])
                near = [other for other in uavs.values() if other is not uav
                        and np.hypot(*(other.position - uav.position)) < CLEAR_MINIMA * clear]
                compare("commanded altitude: waits without a reason", 0, not near)
                past = [np.sign(desired - uav.altitude_m) * (uav.commanded_altitude_m - end)
                        for end in [uav.altitude_m, desired]]
                compare("commanded altitude: waits outside its way", 0, not past[0] >= 0 >= past[1])
                height = min([abs(other.altitude_m - uav.commanded_altitude_m) for other in near], default=0.0)
                stays = uav.commanded_altitude_m == uav.altitude_m
                compare("commanded altitude: waits too near", 0, height < vertical * (1 - 1e-9) and not stays)
            else:
                compare("commanded altitude", uav.commanded_altitude_m, desired)


PLACES = 72  # number of points on an orbit that are checked against the zones


def altitudes_of(record, uav):
    """Returns the lowest and highest altitude that a UAV may have from now on."""
    rules, climb = record.scenario["groups"], climb_of(record.scenario)
    lowest, step = rules["altitude_lowest_m"], rules["altitude_step_m"]
    ends = {"per-group": [lowest, np.inf], "per-uav": [lowest + step * uav.uav] * 2, "common": [lowest] * 2}[rules["altitude_policy"]]
    if climb is None:
        return ends
    levelled = uav.altitude_m + climb["lag_s"] * uav.climb_rate_m_s
    low, high = np.clip(ends, climb["altitude_min_m"], climb["altitude_max_m"])
    return [min(low, uav.altitude_m, levelled), max(high, uav.altitude_m, levelled)]


def binding_zones(outlines, record, time, group, row):
    """Returns the zones that bind a UAV of a group; those at the group's altitude if it has no UAV."""
    crew = [altitudes_of(record, uav) for uav in record.uavs[time].values() if uav.group == group]
    return {number for number, outline in enumerate(outlines)
            if any(outline.binds(*ends) for ends in crew or [[row.altitude_m] * 2])}


def orbit_left(outlines, row, binding):
    """Returns the fraction of an orbit outside forbidden areas, and the first zone that blocks a part of it."""
    angles = 2 * np.pi * np.arange(PLACES) / PLACES
    places = [row.position + row.standoff_distance_m * unit(angle) for angle in angles]
    taking = [[number for number, outline in enumerate(outlines) if number in binding and outline.forbids(at)] for at in places]
    return np.mean([not zones for zones in taking]), next((zones[0] for zones in taking if zones), None)


def blocked_state(left, was):
    """Returns the state of an orbit as an event kind, with hysteresis."""
    blocked, in_part = {"orbit-unblocked": (0.05, 0.95), "orbit-partly-blocked": (0.05, 0.99), "orbit-blocked": (0.15, 0.99)}[was]
    return "orbit-blocked" if left < blocked else "orbit-partly-blocked" if left < in_part else "orbit-unblocked"


def check_blocked_orbits(record, compare):
    """Checks the events of orbits that zones block in part or in full."""
    outlines, blocked = [Outline(zone) for zone in record.scenario.get("geofence", [])], {}
    for time in record.times:
        old, blocked, expected = blocked, {}, []
        for group, row in record.groups[time].items() if outlines else []:
            left, zone = orbit_left(outlines, row, binding_zones(outlines, record, time, group, row))
            was = old.get(group, "orbit-unblocked")
            blocked[group] = now = blocked_state(left, was)
            if now != was:
                expected.append((now, group, None if now == "orbit-unblocked" else zone,
                                 round(left, 9) if now == "orbit-partly-blocked" else None))
        events = [(event.kind, event.group, event.zone,
                   None if event.clear_fraction is None else round(event.clear_fraction, 9))
                  for event in record.events[time] if event.kind in ["orbit-partly-blocked", "orbit-blocked", "orbit-unblocked"]]
        compare("zones: missing or unexpected orbit events", 0, differing(events, expected))


def check_proximity_and_feasibility(record, compare):
    """Checks distances between UAVs of a group, proximity alerts, and events of infeasible orbits."""
    orbit, alert_states = record.scenario["orbit"], {}
    for before, time in zip([None, *record.times], record.times):
        old, alert_states, expected = alert_states, {}, []
        previous = record.groups[before] if before is not None else {}
        for group, row in record.groups[time].items():
            uavs = [uav.position for uav in record.uavs[time].values() if uav.group == group]
            nearest_m = min([np.hypot(*(a - b)) for i, a in enumerate(uavs) for b in uavs[:i]], default=None)
            compare("distance of the nearest two UAVs of a group", row.nearest_groupmate_m, nearest_m)
            turn_limit = np.inf if row.turn_limit_m is None else row.turn_limit_m
            members, required = record.members(time, group), row.standoff_unclamped_m
            if group in previous and orbit["time_constant_s"] > 0:
                desired = desired_state(record.scenario, members)
                centre = np.array(row.position)
                furthest = members[last_furthest({target: np.hypot(*(track.position - centre))
                                                  for target, track in members.items()})]
                required = required_radius(record.scenario, members, desired, furthest, row.margin_m)
            smallest = max(required, orbit["radius_min_m"], turn_limit)
            largest = min(orbit["radius_max_m"], record.scenario["sensor"]["sensing_range_m"] - row.spread_m)
            infeasible, close = old.get(group, (False, False))
            alert_m = record.scenario["groups"]["proximity_alert_m"] * (1.2 if close else 1.0)
            alert_states[group] = (bool(smallest > largest * (0.95 if infeasible else 1.0)),
                             bool(nearest_m is not None and nearest_m < alert_m))
            alert_kinds = [("orbit-feasible", "orbit-infeasible"), ("proximity-cleared", "proximity-alert")]
            expected += [(kinds[now], group) for kinds, was, now in zip(alert_kinds, (infeasible, close), alert_states[group])
                         if now != was]
        alarming = ["orbit-feasible", "orbit-infeasible", "proximity-cleared", "proximity-alert"]
        events = [(event.kind, event.group) for event in record.events[time] if event.kind in alarming]
        compare("missing or unexpected alerts", 0, differing(events, expected))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], __doc__, [check_memberships, check_assignments, check_altitudes, check_proximity_and_feasibility, check_blocked_orbits]))
