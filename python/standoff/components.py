"""The library's components on NumPy arrays: track filter, standoff distance and turn-rate law.

Arguments are anything that NumPy converts to arrays (lists, integers, any strides). Leading axes broadcast by NumPy's
rules, and results are arrays. Frame: x east, y north, metres; angles in radians, anticlockwise from east; the unit is the
suffix of a name. :class:`Parameters` contains numbers such as gains; the defaults are the recommended parameters, which
scenarios use by default.

Two UAVs orbit a group whose furthest member is 100 m from the centre; the turn rates that the law commands, if the
UAVs turn at 0.133 rad/s:

>>> from standoff import components
>>> orbit = components.standoff_distance(100, margin_m=50)
>>> print(orbit.distance_m.round(3))
300.0
>>> steering = components.steer(
...     [[380, 60], [80, -240]], [1.5, 0.0], [80, 60], distance_m=orbit.distance_m, turn_rate_rad_s=0.133
... )
>>> print(steering.turn_rate_rad_s.round(3))
[0.266 0.134]
"""

from standoff._standoff import (
    Filter,
    Parameters,
    StandoffDistance,
    Steering,
    steered_radius,
    standoff_distance,
    steer,
)

__all__ = [
    "Filter",
    "Parameters",
    "StandoffDistance",
    "Steering",
    "steered_radius",
    "standoff_distance",
    "steer",
]
