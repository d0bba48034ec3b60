"""The library's track filter, standoff distance and turn-rate law on NumPy arrays, for custom laws.

Arguments are anything that NumPy converts to arrays of real numbers. Each has a row for each of n items, or a single row
for all of them. Frame: x east, y north, metres; angles in radians, anticlockwise from east; the unit is the suffix of a
name. The parameters, such as gains, are those of ``mission``, the :class:`standoff.MissionInfo` of a law; by default the
recommended ones, which scenarios use by default.

Two UAVs orbit a group whose furthest member is 100 m from the centre; the turn rates that the law commands, if the
UAVs turn at 0.133 rad/s:

>>> from standoff import components
>>> orbit = components.standoff_distance(100, margin_m=50)
>>> print(orbit.distance_m.round(3))
300.0
>>> uav_state = [[380, 60, 1.5, 40, 0.133], [80, -240, 0.0, 40, 0.133]]
>>> steering = components.steer(uav_state, [80, 60, 0, 0], orbit.distance_m)
>>> print(steering.turn_rate_rad_s.round(3))
[0.266 0.134]
"""

from standoff._standoff import Filter, StandoffDistance, Steering, standoff_distance, steer

__all__ = ["Filter", "StandoffDistance", "Steering", "standoff_distance", "steer"]
