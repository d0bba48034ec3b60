#!/usr/bin/env python3
"""Replay who belongs to which group of a flown record, and which UAV serves it, in plain NumPy, and compare.

Usage: check_coordination.py <record folder>

An implementation of its own of section IV of the paper that check_equations.py names, with the rules that the project
adds to it. At each instant it starts from where everybody belonged at the last one, as recorded, and from the recorded
estimates: it clusters (30), hands over with dwell (34), discards, takes back, founds and dissolves groups, assigns
UAVs (31-33), and compares with what the record says of the instant: places, events, crews, altitudes, alarms.

Prints lines like check_equations.py. Of a clustering from nothing and of an assignment only the worth is compared, with
the best of many random starts and of all assignments. Exits with 1 and a message if a tolerance is exceeded.

Not checked: assignments of more than EXHAUSTIVE_MAX UAVs, teams whose UAVs come and go, the words of a reason beyond
its first number. With `groups.count = "needed"`, where no group was there before: that half as many clusters as UAVs do
not hold everybody, if the record founds one group after the other instead. With `groups.search = "lost"`: who is sent to
search for whom and when a search ends, both taken as recorded.
"""

import re
import sys
from collections import Counter
from itertools import product
from types import SimpleNamespace

import numpy as np

from check_equations import (
    POSITION, ROUNDING, VELOCITY, Outline, circle_spread, climb_of, direction, equation_7, equation_15, equations_13_20,
    equation_22, equations_28_29, is_by_circle, last_furthest, lemma_3_1, main, margin_in_metres, minima, needed_radius,
    smallest_circle, unit, wanted_state, wrap)

EXHAUSTIVE_MAX = 8  # UAVs up to which all assignments are tried
FILLED = 0.85  # of the largest radius: what others' orbits may need to hold the members of a group that is wound up
LN_DET_FLOOR = np.log(1e-24)  # what a target counts for of which nobody tells anything
LN_DET_STEP = 1e-6  # in which scores are rounded
STARTS = 60  # of the clusterings that the recorded ones are compared with
NOT_THE_BEST = 0.05  # of the cost (30): so much worse than the best a clustering may be
SAME_M = 1e-6  # distances that differ by rounding alone
REPLAYED = ["group-founded", "group-dissolved", "joined", "handoff-requested", "handoff-completed", "handoff-withdrawn",
            "discarded", "taken-back", "left-out", "regrouped"]
STATED = {"handoff-requested": 0.05}  # rounding of the number in a reason; of others 0.5
UNASSIGNED, DISCARDED = ("unassigned", None, None), ("discarded", None, None)


def member(group):
    return "member", group, None


def check_places(record, compare):
    """Where every target belongs, and every event of groups and their members."""

    def key(event):
        return event.kind, event.target, event.group, event.to_group

    memory = SimpleNamespace(steered=equation_22(record), dwells={}, barred={}, diverging={}, outrun={}, next_group=0,
                             next_review=0, winding_up=None, random=np.random.default_rng(1))
    for before, time in zip([None, *record.times], record.times):
        instant = Instant(record, before, time, memory, compare)
        instant.settle()
        recorded = {target: (row.place, row.group, row.to_group) for target, row in record.tracks[time].items()}
        wrong = [target for target in recorded if instant.places[target] != recorded[target]]
        compare("section IV: place and groups of a target", 0, np.isin(list(recorded), wrong))
        told = [event for event in record.events[time] if event.kind in REPLAYED]
        compare("section IV: events not recorded, or others", 0, differing(map(key, told), map(key, instant.events)))
        for event in instant.events:
            same = [other for other in told if key(other) == key(event)]
            if same and event.number is not None:
                compare(f"{event.kind}: number in the reason", stated(same[0]), event.number, scale=1.0,
                        tolerance=STATED.get(event.kind, 0.5) + ROUNDING)
        instant.remember_diverging()


def differing(recorded, computed):
    """How many things are only in one of the two, in whatever order."""
    recorded, computed = Counter(recorded), Counter(computed)
    return ((recorded - computed) + (computed - recorded)).total()


def stated(event):
    """The first number in the reason of an event."""
    number = re.search(r"-?\d+(\.\d+)?", event.reason)
    return float(number[0]) if number else None


class Instant:
    """One instant's settling of who belongs where; a place is what it is called, the group, the receiving group."""

    def __init__(self, record, before, time, memory, compare):
        self.record, self.scenario, self.before, self.time = record, record.scenario, before, time
        self.memory, self.compare, self.events = memory, compare, []
        self.by_need = record.scenario["groups"]["count"] == "needed"
        self.tracks, self.orbit, self.rules = record.tracks[time], record.scenario["orbit"], record.scenario["groups"]
        old = record.tracks[before] if before is not None else {}
        self.places = {target: (row.place, row.group, row.to_group) for target, row in old.items()}
        self.old_groups = set(record.groups[before]) if before is not None else set()
        self.crew = {group: [row for uav, row in record.uavs[time].items() if record.uavs[before][uav].group == group]
                     for group in self.old_groups}

    def settle(self):
        before = dict(self.places)
        for target in set(self.places) - set(self.tracks):
            self.withdraw(target, lost=True)
            del self.places[target]
        for target in self.tracks:
            self.places.setdefault(target, UNASSIGNED)
        # Half as many groups as UAVs, halves rounded up, and never more than targets; by need up to one for each UAV.
        uavs = len(self.record.uavs[self.time])
        self.half = min((uavs + 1) // 2, len(self.tracks))
        wanted = min(uavs, len(self.tracks)) if self.by_need else self.half
        if not self.groups():
            self.found_first(wanted)
        else:
            while len(self.groups()) > max(wanted, 1):
                self.dissolve_smallest()
            self.go_on_winding_up()
            self.take_in()
            self.review(wanted)
            while len(self.groups()) < wanted and self.found_another():
                pass
            self.hand_over()
        self.outside_before_discard = self.outside()
        self.discard()
        dissolved = {event.group for event in self.events if event.kind == "group-dissolved"}
        for group in self.old_groups - set(self.groups()) - dissolved:
            self.tell("group-dissolved", group=group)
        # A target in dwell cannot be split off: the next group waits for it.
        in_dwell = any(place[0] == "dwell" for place in [*before.values(), *self.places.values()])
        waits = len(self.groups()) < wanted and in_dwell
        # By need the others are founded only for who would else be in no group, and may end when they hold nobody.
        waits |= self.by_need and self.half <= len(self.groups()) < wanted and not self.outside_before_discard
        self.compare("(30) number of groups", wanted if waits else len(self.groups()), wanted)

    def tell(self, kind, target=None, group=None, to_group=None, number=None):
        self.events.append(SimpleNamespace(kind=kind, target=target, group=group, to_group=to_group, number=number))

    def groups(self):
        return sorted({group for place in self.places.values() for group in place[1:] if group is not None})

    def members(self, group):
        return [target for target, place in sorted(self.places.items()) if group in place[1:]]

    def outside(self):
        return [target for target, place in sorted(self.places.items()) if place[0] in ["unassigned", "discarded"]]

    def position(self, target):
        return self.tracks[target].position

    def positions(self, targets):
        return np.array([self.position(target) for target in targets]).reshape(-1, 2)

    def need(self, targets):
        """What an orbit about these targets needs, by their centroid; without the printed margin (16)."""
        rows = {target: self.tracks[target] for target in targets}
        centre = wanted_state(self.scenario, rows)
        distances = {target: np.hypot(*(row.position - centre[POSITION])) for target, row in rows.items()}
        furthest = self.furthest(distances)
        apart = rows[furthest].position - centre[POSITION]
        toward = unit(direction(apart)) if apart.any() else np.zeros(2)
        mahalanobis = self.orbit["margin"] == "mahalanobis"
        margin = 0.0 if mahalanobis else margin_in_metres(self.orbit["margin_sds"], toward, furthest, rows)
        spread_rate = toward @ (rows[furthest].velocity - centre[VELOCITY])
        spread = distances[furthest]
        if is_by_circle(self.scenario):
            velocities = np.array([row.velocity for row in rows.values()])
            spread, spread_rate = circle_spread(self.positions(rows), velocities)
        unclamped, radius, rate = equation_15(self.scenario, spread, spread_rate, margin)
        has_room = (unclamped <= self.orbit["take_back_fraction"] * self.orbit["radius_max_m"]
                    and radius * rate <= self.rules["convergence_limit_m2_s"] / 2)
        return SimpleNamespace(centre=centre[POSITION], furthest=furthest, spread=spread, unclamped=unclamped,
                               radius=radius, rate=rate, has_room=has_room)

    def room_for(self, group, target):
        """What a group's orbit needs with a further target, if it has room; one inside a smallest circle widens nothing."""
        members = self.members(group)
        need = self.need([*members, target])
        inside = is_by_circle(self.scenario) and need.unclamped <= self.need(members).unclamped * (1 + 1e-9)
        return need if need.has_room or inside else None

    def first_to_go(self, targets):
        """Of targets that one orbit cannot hold: the furthest, or with `discard = "widening"` who widens the circle most."""
        furthest = self.need(targets).furthest
        if self.rules["discard"] != "widening":
            return furthest

        def needed(without):
            rest = [target for target in targets if target != without]
            return self.need(rest).unclamped if rest else 0.0

        # Only who is on the rim can.
        first, least = furthest, needed(furthest)
        for target in [list(targets)[i] for i in smallest_circle(self.positions(targets))[1]]:
            if needed(target) < least * (1 - 1e-9):
                first, least = target, needed(target)
        return first

    def furthest(self, distances):
        """The last of equals, as the two of a pair always are: there rounding decides, and the record is believed."""
        tied = [target for target, distance in distances.items() if distance > max(distances.values()) - SAME_M]
        if is_by_circle(self.scenario):
            return tied[-1]
        return max(tied, key=lambda target: (self.tracks[target].group is None,
                                             self.tracks[target].group != self.places[target][1], target))

    def reach(self):
        """How far from the centre a target can be in an orbit with room to spare and without a margin."""
        radius_per_metre, _, _ = equation_15(self.scenario, 1.0, 0.0, 0.0)
        return self.orbit["take_back_fraction"] * self.orbit["radius_max_m"] / radius_per_metre

    def found_first(self, wanted):
        """Targets of which none is watched are clustered; groups are numbered by their first targets."""
        founded = {}
        self.memory.next_review = self.time + self.rules["review_period_s"] * 1e6
        causes = {event.cause for event in self.record.events[self.time] if event.kind == "group-founded"}
        if self.by_need and "first" not in causes:
            # Half as many clusters did not hold all: of that the record is believed.
            while len(self.groups()) < wanted and self.found_another():
                pass
            return
        for target, row in sorted(self.tracks.items()):
            group = self.recorded_founder(target)
            founded.setdefault(group, self.memory.next_group + len(founded))
            self.places[target] = member(founded[group])
        self.memory.next_group += len(founded)
        for group in founded.values():
            self.tell("group-founded", group=group, number=len(self.members(group)))
        self.compare_cost(sorted(self.tracks), [self.places[target][1] for target in sorted(self.tracks)], self.half)
        if self.by_need:
            held = [self.need(self.members(group)).has_room for group in founded.values()]
            self.compare("groups.count: clusters too wide to begin with", 0, held.count(False))

    def recorded_founder(self, target):
        """The group that a target was in when it was founded at this instant, even if it left at once."""
        left = [event.group for event in self.record.events[self.time] if event.target == target
                and event.kind in ["discarded", "handoff-completed"]]
        return left[0] if left else self.tracks[target].group

    def compare_cost(self, targets, groups, count):
        """A clustering from nothing with the best of many."""
        positions = self.positions(targets)
        clusters = np.unique(groups, return_inverse=True)[1]
        costs = [clustered(positions, count, self.memory.random) for _ in range(STARTS if count else 0)]
        best = min(costs, default=0.0)
        above = max(equation_30(positions, clusters) / best - 1.0, 0.0) if best > 0.0 else 0.0
        self.compare("(30) cost of a clustering above the best found", 0.0, above, tolerance=NOT_THE_BEST)

    def dissolve_smallest(self):
        """Ends the group with the fewest members; of equals the youngest."""
        self.dissolve(min(self.groups(), key=lambda group: (len(self.members(group)), -group)))

    def dissolve(self, group, number=None, into=None):
        """Ends a group; another one may take in its targets."""
        self.tell("group-dissolved", group=group, number=number)
        for target in self.members(group):
            _, passing, receiving = self.places[target]
            if receiving == group:
                self.withdraw(target)
            elif receiving is not None:
                self.complete(target)
            elif into is not None:
                self.receive(target, into)
                self.tell("regrouped", target, group, into)
            else:
                self.places[target] = UNASSIGNED
                self.tell("left-out", target, group)

    def take_in(self):
        """Targets outside join the nearest groups that have room to spare."""
        outside, pairs = self.slow_enough(self.outside()), []
        for group in [group for group in self.groups() if outside and group != self.memory.winding_up]:
            members = self.members(group)
            need = self.need(members)
            distances = np.hypot(*(self.positions(outside) - need.centre).T)
            # Judged before anybody joins: who joins alone draws the centroid to itself. A circle that holds both it and
            # somebody across the centre has no diameter shorter than they are apart.
            reach = self.reach() * (len(members) + 1) / len(members)
            if is_by_circle(self.scenario):
                reach = np.sqrt(max(4 * self.reach() ** 2 - need.spread**2, 0.0))
            pairs += [(distance, target, group) for distance, target in zip(distances, outside)
                      if distance <= reach and not self.is_barred(target, group)]
        for _, target, group in sorted(pairs):
            if self.places[target] in [UNASSIGNED, DISCARDED] and self.room_for(group, target):
                self.tell("joined" if self.places[target] == UNASSIGNED else "taken-back", target, group)
                self.receive(target, group)

    def receive(self, target, group):
        """A target from no group is a member once it is in view."""
        at_once = self.rules["dwell_max_s"] == 0.0 or self.is_held(target, group)
        self.places[target] = member(group) if at_once else ("dwell", None, group)
        self.memory.dwells[target] = self.time, 0

    def review(self, wanted):
        """From time to time, a group ends whose UAVs could watch half as many again of its own targets and those outside,
        or any outside, if another group can hold its own."""
        period = self.rules["review_period_s"] * 1e6
        is_due = period > 0 and self.time >= self.memory.next_review and len(self.groups()) >= wanted
        if not is_due or not self.outside() or self.memory.winding_up is not None:
            return
        self.memory.next_review = self.time + period
        if self.by_need and (not self.is_worth_a_group(len(self.gather(self.outside()))) or self.wind_up_one()):
            return
        found = {}
        for group in self.groups():
            members = self.members(group)
            own = [target for target in members if self.places[target] == member(group)]
            soon = [target for target in self.outside() if self.is_soon_seen(target, members)]
            others = [other for other in self.groups() if other != group
                      and self.need(sorted({*self.members(other), *members})).has_room]
            together = len(self.gather(soon if others else own + soon))
            gain = together if others else together - len(members)
            if (gain >= (1 if others else max(2, len(members) / 2))
                    and (not self.by_need or not others or self.is_worth_a_group(together))):
                away = self.away_from_unwatched(self.need(members).centre) if self.by_need else 0.0
                found[group] = gain, together, others[:1], away
        if found:
            group = max(found, key=lambda group: (found[group][0], -found[group][3], -group))
            members, (_, together, others) = self.members(group), found[group]
            centre = self.need(members).centre
            self.dissolve(group, together, *others)
            self.found(self.gather([target for target in self.outside() if self.is_soon_seen(target, centre=centre)]))

    def wind_up_one(self):
        """With `count = "needed"`, of the groups that others could hold that which is nearest to somebody unwatched passes
        its members to them, and ends."""
        last = self.record.groups[self.before]
        away = {group: self.away_from_unwatched(last[group].position) if group in last else np.inf for group in self.groups()}
        for group in sorted(self.groups(), key=lambda group: (away[group], -group)):
            receivers = self.who_could_hold_each(group)
            if receivers is None:
                continue
            self.memory.winding_up = group
            for target, (_, passing, receiving) in sorted(self.places.items()):
                if receiving == group and passing is not None:
                    self.withdraw(target)
            for target, to in receivers:
                if self.places[target][1] == group:
                    self.request(target, group, to)
                else:
                    self.receive(target, to)
                    self.tell("regrouped", target, group, to)
            return True
        return False

    def is_worth_a_group(self, together):
        """Two unwatched that one orbit holds, or a tenth of all targets that are not lost."""
        return together >= 2 or 10 * together >= len(self.places)

    def away_from_unwatched(self, place):
        return min((np.hypot(*(self.position(target) - place)) for target in self.outside()), default=np.inf)

    def who_could_hold_each(self, group):
        """The other group that needs least with it, of each target that has to go, all together; None: not all of them."""
        held = {other: self.members(other) for other in self.groups() if other != group}
        receivers = []
        for target in self.members(group):
            if self.home(target) != group or self.places[target][1] not in [None, group]:
                continue
            needed = {}
            for other, targets in held.items():
                need = self.need([*targets, target])
                if (need.has_room and need.unclamped <= FILLED * self.orbit["radius_max_m"]
                        and not self.is_barred(target, other)):
                    needed[other] = need.unclamped
            if not needed:
                return None
            receivers.append((target, min(needed, key=needed.get)))
            held[receivers[-1][1]].append(target)
        return receivers

    def go_on_winding_up(self):
        """One that could not pass all of its members on stays, at least until the next review."""
        group = self.memory.winding_up
        members = self.members(group) if group is not None else []
        if group is not None and not (members and all(self.home(target) != group for target in members)):
            self.memory.winding_up = None
            self.memory.next_review = self.time + self.rules["review_period_s"] * 1e6

    def is_soon_seen(self, target, members=(), centre=None):
        """Within sensing range after a while, even if it drives away."""
        centre = self.need(members).centre if centre is None else centre
        scenario, distance = self.scenario, np.hypot(*(self.position(target) - centre))
        closing = max(scenario["uavs"]["speed_m_s"] - self.speed(target), 0.0)
        return distance <= scenario["sensor"]["sensing_range_m"] + self.rules["reach_ahead_s"] * closing

    def speed(self, target):
        return np.hypot(*self.tracks[target].velocity)

    def slow_enough(self, targets):
        uavs = self.scenario["uavs"]
        return [target for target in targets if self.speed(target) <= uavs["speed_m_s"] + uavs["speed_change_max_m_s"]]

    def gather(self, targets):
        """The most of these targets that one orbit about one of them could hold."""
        targets = sorted(self.slow_enough(targets))
        if not targets:
            return []
        positions = self.positions(targets)
        near = np.hypot(*(positions[:, None] - positions).T) <= self.reach()
        together = [target for target, is_near in zip(targets, near[np.argmax(near.sum(axis=1))]) if is_near]
        while len(together) > 1 and not self.need(together).has_room:
            together.remove(self.first_to_go(together))
        return together

    def found_another(self):
        """One more group: of targets outside, or else by splitting the one with the largest sum of squares."""
        founders = self.gather(self.outside()) or self.outside()[:1]
        if founders:
            self.found(founders)
        elif len(self.groups()) >= self.half:
            return False
        else:
            own = {group: [target for target in self.members(group) if self.places[target] == member(group)]
                   for group in self.groups()}
            own = {group: targets for group, targets in own.items() if len(targets) > 1}
            if not own:
                return False
            widest = max(own, key=lambda group: (len(own[group]) * equation_30(self.positions(own[group]), 0), -group))
            founders = [target for target in own[widest] if self.recorded_founder(target) == self.memory.next_group]
            some = 0 < 2 * len(founders) <= len(own[widest])
            self.compare("(30) part that splits off: some, at most half", True, some)
            self.compare_cost(own[widest], [target in founders for target in own[widest]], 2)
            for target in founders:
                self.tell("regrouped", target, widest, self.memory.next_group)
            self.found(founders, tell_each=False, at_once=True)
        return True

    def found(self, founders, tell_each=True, at_once=False):
        for target in founders:
            if self.by_need and not at_once:
                # UAVs have yet to come.
                self.receive(target, self.memory.next_group)
            else:
                self.places[target] = member(self.memory.next_group)
            if tell_each:
                self.tell("joined", target, self.memory.next_group)
        self.tell("group-founded", group=self.memory.next_group, number=len(founders))
        self.memory.next_group += 1

    def hand_over(self):
        """Clusters on from the last clustering; requests handoffs, and ends those whose dwell is over."""
        groups = [group for group in self.groups() if group != self.memory.winding_up]
        for group in groups:
            members = self.members(group)
            if all(self.home(target) != group for target in members):
                self.withdraw(members[0])
        targets = [target for target, place in sorted(self.places.items()) if place not in [UNASSIGNED, DISCARDED]]
        clusters = algorithm_1(self.positions(targets), np.searchsorted(groups, [self.home(t) for t in targets]),
                               len(groups), self.rules["handoff_margin_m"])
        for target, wanted in zip(targets, np.array(groups)[clusters]):
            place, passing, receiving = self.places[target]
            if place == "dwell":
                self.end_dwell(target, wanted)
            elif passing != wanted:
                self.request(target, passing, wanted)

    def home(self, target):
        """Where clustering has put a target last."""
        _, passing, receiving = self.places[target]
        return passing if receiving is None else receiving

    def request(self, target, passing, receiving):
        need = self.room_for(receiving, target)
        if need is None or self.is_barred(target, receiving):
            return
        longest = self.rules["dwell_max_s"]
        times = [self.equation_34(uav.position, need) for uav in self.crew.get(receiving, [])]
        dwell = np.clip(max(times, default=longest), self.rules["dwell_min_s"], longest)
        self.tell("handoff-requested", target, passing, receiving, dwell)
        self.places[target], self.memory.dwells[target] = ("dwell", passing, receiving), (self.time, round(dwell * 1e6))
        if longest == 0.0:
            self.complete(target)

    def equation_34(self, uav, orbit):
        """T_hd, with the radial speed of the field (20)."""
        r = max(np.hypot(*(uav - orbit.centre)), 1.0)
        inward = (r**2 - orbit.radius**2) / self.scenario["guidance"]["radial_gain"]
        radial_speed = -self.scenario["uavs"]["speed_m_s"] * inward / np.hypot(inward, 2 * r * orbit.radius)
        closing = abs(radial_speed - orbit.radius / r * orbit.rate)
        if r == orbit.radius:
            return 0.0
        return abs(r - orbit.radius) / closing if closing > 0.0 else np.inf

    def end_dwell(self, target, wanted):
        """After the dwell, when all receiving UAVs have the target in view; after the longest, when one has."""
        _, passing, receiving = self.places[target]
        requested, dwell = self.memory.dwells[target]
        if self.time - requested < dwell:
            return
        views, is_last = self.views(target, receiving), self.time - requested >= self.rules["dwell_max_s"] * 1e6
        if passing is not None and wanted != receiving and passing != self.memory.winding_up:
            self.withdraw(target)
        elif self.is_held(target, receiving) or is_last and any(views):
            self.complete(target)
        elif is_last:
            self.withdraw(target)

    def is_barred(self, target, group):
        """A handoff to that group was withdrawn not long ago."""
        barred, until = self.memory.barred.get(target, (None, 0))
        return barred == group and self.time < until

    def is_held(self, target, group):
        """All of the group's UAVs see it; and where orbits move, it is where that keeps targets in view from all around, and
        none of the UAVs can get out of sensing range of the centre by turning away first, or they are near the orbit."""
        views = self.views(target, group)
        last = self.record.groups[self.before].get(group) if self.before is not None else None
        half_view = np.radians(self.scenario["sensor"]["field_of_view_deg"]) / 2
        uavs, near = self.scenario["uavs"], 0.0
        if last is not None:
            turn = uavs["speed_m_s"] / uavs["turn_rate_max_rad_s"]
            near = max(self.scenario["sensor"]["sensing_range_m"] - 2 * turn, last.standoff_distance_m + turn)
        holds = (self.orbit["response_s"] == 0 or last is None
                 or np.hypot(*(self.position(target) - last.position))
                 <= last.standoff_distance_m * np.sin(min(half_view, np.pi / 2))
                 and all(np.hypot(*(uav.position - last.position)) <= near for uav in self.crew.get(group, [])))
        return bool(views) and all(views) and bool(holds)

    def views(self, target, group):
        """Of each UAV of a group, whether it has the target in view, with one standard deviation to spare."""
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
            self.tell("handoff-completed", target, passing, receiving)

    def withdraw(self, target, lost=False):
        place, passing, receiving = self.places[target]
        if place == "dwell":
            self.places[target] = DISCARDED if passing is None else member(passing)
            dwell = max(self.memory.dwells[target][1], self.rules["dwell_min_s"] * 1e6)
            self.memory.barred[target] = receiving, self.time + dwell
            if passing is not None:
                self.tell("handoff-withdrawn", target, passing, receiving)
            elif not lost:
                self.tell("left-out", target, receiving)

    def discard(self):
        """Furthest targets of groups whose orbit runs away from the UAVs, or needs more than the largest radius."""
        for group in self.groups():
            since, threshold = self.memory.diverging.get(group, (0, None))
            if since > self.rules["convergence_patience_s"] * 1e6 and len(self.members(group)) > 1:
                self.let_go(group, self.first_to_go(self.members(group)), threshold)
            if self.memory.outrun.get(group, 0) > self.rules["convergence_patience_s"] * 1e6:
                self.discard_fastest(group)
            while len(self.members(group)) > 1:
                need = self.need(self.members(group))
                if need.unclamped <= self.orbit["radius_max_m"]:
                    break
                self.let_go(group, self.first_to_go(self.members(group)), need.unclamped)

    def discard_fastest(self, group):
        """Of a group that outruns the UAVs."""
        fastest = max(self.members(group), key=lambda target: (self.speed(target), target))
        if len(self.members(group)) > 1:
            self.let_go(group, fastest, self.speed(fastest))

    def let_go(self, group, furthest, number):
        """A target being received goes first if it widens the orbit; one being passed on is passed at once, where orbits move
        if the other group holds it."""
        members = self.members(group)
        needed, incoming = self.need(members).unclamped, [target for target in members if self.places[target][2] == group]
        widening = [target for target in incoming
                    if self.need([other for other in members if other != target]).unclamped < needed]
        if widening or furthest in incoming:
            self.withdraw([*widening, furthest][0])
        elif self.places[furthest][2] is not None and (
                self.orbit["response_s"] == 0 or self.is_held(furthest, self.places[furthest][2])):
            self.complete(furthest)
        else:
            self.places[furthest] = DISCARDED
            self.tell("discarded", furthest, group, number=number)

    def remember_diverging(self):
        """For how long Lemma 3.1's threshold of every UAV of a group, at nominal speed, has been below the limit."""
        diverging, outrun, speed = {}, {}, self.scenario["uavs"]["speed_m_s"]
        elapsed = self.time - self.before if self.before is not None else 0
        for group, row in self.record.groups[self.time].items():
            radius, rate, thresholds = row.standoff_distance_m, row.standoff_rate_m_s, []
            for uav in self.record.uavs[self.time].values():
                if uav.group == group:
                    relative = uav.position - row.position
                    field = equations_13_20(self.scenario, relative, self.memory.steered[self.time][group][0])
                    over_ground, too_fast = equations_28_29(field, row.velocity, speed)
                    radial_speed = (over_ground - row.velocity) @ unit(direction(relative))
                    if not too_fast:
                        thresholds.append(lemma_3_1(np.hypot(*relative), radial_speed, radius, rate))
            self.compare("Lemma 3.1: threshold of a group", row.convergence_threshold_m2_s, max(thresholds, default=None))
            old = self.memory.diverging.get(group, (0, None))[0] if self.kept_members(group) else 0
            # An orbit that moves also shrinks for a while.
            runs_away = self.orbit["response_s"] == 0 or rate > 0
            if runs_away and thresholds and max(thresholds) < -self.rules["convergence_limit_m2_s"]:
                diverging[group] = old + elapsed, max(thresholds)
            if np.hypot(*row.velocity) > speed + self.scenario["uavs"]["speed_change_max_m_s"]:
                outrun[group] = elapsed + (self.memory.outrun.get(group, 0) if self.kept_members(group) else 0)
        self.memory.diverging, self.memory.outrun = diverging, outrun

    def kept_members(self, group):
        """With other members it is another orbit."""
        now, then = ({target for target, row in self.record.tracks[time].items() if group in [row.group, row.to_group]}
                     for time in [self.time, self.before])
        return now == then


def equation_30(positions, clusters):
    """Mean of the squared distances from the centroids."""
    clusters = np.broadcast_to(clusters, len(positions))
    squares = [np.sum((positions[clusters == c] - positions[clusters == c].mean(axis=0)) ** 2) for c in set(clusters)]
    return sum(squares) / len(positions)


def algorithm_1(positions, clusters, count, margin):
    """K-means on from these clusters: a target moves for more than the margin, and never leaves a cluster empty."""
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
    """Cost (30) of a K-means from random centroids."""
    centroids = positions[random.choice(len(positions), count, replace=False)]
    # Where targets coincide there may be fewer clusters.
    clusters = np.unique(np.hypot(*(positions[:, None] - centroids).T).argmin(axis=0), return_inverse=True)[1]
    return equation_30(positions, algorithm_1(positions, clusters, clusters.max() + 1, 0.0))


def check_crews(record, compare):
    """Who serves which group: carried on, or assigned anew where groups came or went, by all possible assignments."""
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
        at_hand = [uav for uav in uavs if uav not in searching]
        if searching:
            compare("groups.search: searchers in a group", 0, sum(crew[uav] is not None for uav in searching))
            compare("groups.search: more searchers than can be spared", 0, max(len(groups) - len(at_hand), 0))
        ended = bool(groups) and any(old_crew[uav] is None for uav in at_hand)
        if groups == old_groups and not changed and not ended:
            compare("crew carried on", 0, sum(crew[uav] != old_crew[uav] for uav in at_hand))
        elif groups:
            when_assigned = numbers
            sizes = [list(crew.values()).count(group) for group in groups]
            compare("UAVs in no group", 0, [crew[uav] for uav in at_hand].count(None))
            compare("(33) groups unserved, or served by too many", 0,
                    sum(not 1 <= size <= max(2, -(-len(at_hand) // len(groups))) for size in sizes))
            if len(at_hand) <= EXHAUSTIVE_MAX:
                worth, best = equation_32(record, time, groups, old_crew, at_hand)
                which = record.scenario["groups"]["objective"]
                compare(f"(32) ln det that another crew gains, {which}", 0.0, max(best - worth, 0.0),
                        tolerance=LN_DET_STEP * len(groups))
        moved = [(str(uav), old_crew[uav], crew[uav]) for uav in uavs
                 if old_crew[uav] is not None and crew[uav] not in [old_crew[uav], None]]
        told = [(event.uavs, event.group, event.to_group) for event in record.events[time]
                if event.kind == "reassigned"]
        compare("re-assignments not recorded, or others", 0, differing(told, moved))


def equation_31(sensor, uav, target):
    """Fisher information of range and azimuth about the target's position."""
    (dx, dy), (distance, _) = target - uav, equation_7(uav, target)
    if distance <= 1.0:
        return np.zeros((2, 2))
    h = np.array([[dx / distance, dy / distance], [-dy / distance**2, dx / distance**2]])
    return h.T @ np.diag([sensor["range_sd_m"] ** -2, np.radians(sensor["bearing_sd_deg"]) ** -2]) @ h


def equation_32(record, time, groups, old_crew, at_hand):
    """Worth of the recorded assignment, and the largest of all that serve every group by at most so many UAVs."""
    sensor, uavs = record.scenario["filter"], [record.uavs[time][uav] for uav in at_hand]
    told = [np.array([[equation_31(sensor, uav.position, row.position) for row in record.members(time, group).values()]
                      for uav in uavs]) for group in groups]
    most, n = max(2, -(-len(uavs) // len(groups))), len(groups)
    crews = [np.array(choice) for choice in product(range(n), repeat=len(uavs))]
    crews = [crew for crew in crews if all(1 <= size <= most for size in np.bincount(crew, minlength=n))]
    of_block = {}

    def worth(crew):
        sums = []
        for group in range(n):
            block = tuple(map(int, np.flatnonzero(crew == group)))
            if (group, block) not in of_block:
                of_block[group, block] = information_of(told[group][list(block)].sum(axis=0))
            sums.append(of_block[group, block])
        return ln_det(sum(sums)) if printed else sum(sums) + inertia * staying[crew, range(len(crew))].sum()

    printed, inertia = (record.scenario["groups"][key] for key in ["objective", "assignment_inertia"])
    printed = printed == "printed"
    information_of = (lambda terms: terms.sum(axis=0)) if printed else (lambda terms: ln_det(terms).sum())
    recorded = np.array([groups.index(uav.group) for uav in uavs])
    # A UAV that stays counts for more, by the number of its group's targets.
    staying = np.array([[told[g].shape[1] * (old_crew[uav] == group) for uav in at_hand]
                        for g, group in enumerate(groups)])
    return worth(recorded), max(worth(crew) for crew in crews)


def ln_det(information):
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.log(np.linalg.det(information))
    return np.clip(np.nan_to_num(value, nan=LN_DET_FLOOR), LN_DET_FLOOR, -LN_DET_FLOOR)


CLEAR_MINIMA = 6.0  # nobody climbs or descends past who is nearer than so many least distances


def check_altitudes(record, compare):
    """A group keeps its altitude; a new one takes the lowest that is free; or each UAV has its own, or all have one."""
    rules, altitudes, climb = record.scenario["groups"], {}, climb_of(record.scenario)
    lowest, step = rules["altitude_lowest_m"], rules["altitude_step_m"]
    for time in record.times:
        altitudes = {group: altitudes[group] for group in record.groups[time] if group in altitudes}
        for group, row in record.groups[time].items():
            free = next(altitude for altitude in (lowest + step * n for n in range(len(altitudes) + 1))
                        if altitude not in altitudes.values() or rules["altitudes"] == "one")
            altitudes.setdefault(group, free)
            compare("altitude of a group", row.altitude_m, altitudes[group])
        uavs = record.uavs[time]
        for uav in uavs.values():
            wanted = {"by-group": altitudes.get(uav.group), "by-uav": lowest + step * uav.uav, "one": lowest}[rules["altitudes"]]
            if climb and wanted is not None:
                wanted = np.clip(wanted, climb["altitude_min_m"], climb["altitude_max_m"])
            if "separation" in record.scenario and wanted is not None and uav.altitude_m != wanted:
                # It waits for who is in between and near.
                clear, vertical = (minima(record)[key] for key in ["minimum_m", "vertical_m"])
                near = [other for other in uavs.values() if other is not uav
                        and np.hypot(*(other.position - uav.position)) < CLEAR_MINIMA * clear]
                compare("altitude asked of a UAV that has nobody to wait for", 0, not near)
                past = [np.sign(wanted - uav.flown_altitude_m) * (uav.altitude_m - end)
                        for end in [uav.flown_altitude_m, wanted]]
                compare("altitude asked of a UAV that waits, out of its way", 0, not past[0] >= 0 >= past[1])
                height = min([abs(other.flown_altitude_m - uav.altitude_m) for other in near], default=0.0)
                stays = uav.altitude_m == uav.flown_altitude_m
                compare("altitude asked of a UAV that waits, too near", 0, height < vertical * (1 - 1e-9) and not stays)
            else:
                compare("altitude asked of a UAV", uav.altitude_m, wanted)


PLACES = 72  # of an orbit, of which each may be in a zone or not


def orbit_left(outlines, row):
    """Which share of an orbit zones leave, and the first that takes some."""
    angles = 2 * np.pi * np.arange(PLACES) / PLACES
    places = [row.position + row.standoff_distance_m * unit(angle) for angle in angles]
    taking = [[number for number, outline in enumerate(outlines) if outline.forbids(at)] for at in places]
    return np.mean([not zones for zones in taking]), next((zones[0] for zones in taking if zones), None)


def cut(left, was):
    """What zones leave of an orbit in words; what was told is taken back with some room to spare."""
    barred, in_part = {"orbit-clear": (0.05, 0.95), "orbit-cut": (0.05, 0.99), "orbit-barred": (0.15, 0.99)}[was]
    return "orbit-barred" if left < barred else "orbit-cut" if left < in_part else "orbit-clear"


def check_cuts(record, compare):
    """What is told of orbits of which zones take a part."""
    outlines, cuts = [Outline(zone) for zone in record.scenario.get("zones", [])], {}
    for time in record.times:
        old, cuts, expected = cuts, {}, []
        for group, row in record.groups[time].items() if outlines else []:
            left, zone = orbit_left(outlines, row)
            was = old.get(group, "orbit-clear")
            cuts[group] = now = cut(left, was)
            if now != was:
                expected.append((now, group, None if now == "orbit-clear" else zone,
                                 round(left, 9) if now == "orbit-cut" else None))
        told = [(event.kind, event.group, event.zone,
                 None if event.clear_fraction is None else round(event.clear_fraction, 9))
                for event in record.events[time] if event.kind in ["orbit-cut", "orbit-barred", "orbit-clear"]]
        compare("zones: cut orbits not recorded, or others", 0, differing(told, expected))


def check_alarms(record, compare):
    """Distances between UAVs of a group; what is told of UAVs too close, and of orbits that cannot be flown."""
    orbit, alarms = record.scenario["orbit"], {}
    for before, time in zip([None, *record.times], record.times):
        old, alarms, expected = alarms, {}, []
        previous = record.groups[before] if before is not None else {}
        for group, row in record.groups[time].items():
            uavs = [uav.position for uav in record.uavs[time].values() if uav.group == group]
            separation = min([np.hypot(*(a - b)) for i, a in enumerate(uavs) for b in uavs[:i]], default=None)
            compare("separation of the UAVs of a group", row.separation_m, separation)
            turn_limit = np.inf if row.turn_limit_m is None else row.turn_limit_m
            members, needed = record.members(time, group), row.standoff_unclamped_m
            if group in previous and orbit["response_s"] > 0:
                wanted = wanted_state(record.scenario, members)
                centre = np.array(row.position)
                furthest = members[last_furthest({target: np.hypot(*(track.position - centre))
                                                  for target, track in members.items()})]
                needed = needed_radius(record.scenario, members, wanted, furthest, row.margin_m)
            smallest = max(needed, orbit["radius_min_m"], turn_limit)
            largest = min(orbit["radius_max_m"], record.scenario["sensor"]["sensing_range_m"] - row.spread_m)
            infeasible, close = old.get(group, (False, False))
            alarm = record.scenario["groups"]["separation_alarm_m"] * (1.2 if close else 1.0)
            alarms[group] = (bool(smallest > largest * (0.95 if infeasible else 1.0)),
                             bool(separation is not None and separation < alarm))
            words = [("orbit-feasible", "orbit-infeasible"), ("uavs-apart", "uavs-close")]
            expected += [(kinds[now], group) for kinds, was, now in zip(words, (infeasible, close), alarms[group])
                         if now != was]
        alarming = ["orbit-feasible", "orbit-infeasible", "uavs-apart", "uavs-close"]
        told = [(event.kind, event.group) for event in record.events[time] if event.kind in alarming]
        compare("alarms not recorded, or others", 0, differing(told, expected))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], __doc__, [check_places, check_crews, check_altitudes, check_alarms, check_cuts]))
