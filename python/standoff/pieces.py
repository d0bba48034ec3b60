"""The library's pieces by name: filter, vector field, standoff distance, smallest circle, clustering, assignment, pair
information.

They take whatever NumPy makes arrays of (lists, integers, any strides), work over leading axes by NumPy's broadcasting,
and give arrays. Frame: x east, y north, metres; angles in radians, anticlockwise from east; the unit is the last part of
a name. Numbers such as gains come in :class:`Parameters`; left out, they are the paper's Table I.

Two UAVs about three vehicles, and what the law wants of them:

>>> from standoff import pieces
>>> centre_m, radius_m = pieces.smallest_circle([[0, 0], [160, 0], [0, 120]])
>>> print(centre_m, radius_m)
[80. 60.] 100.0
>>> orbit = pieces.standoff_distance(radius_m, margin_m=50)
>>> print(orbit.distance_m.round(3))
300.0
>>> steering = pieces.steer([[380, 60], [80, -240]], [1.5, 0.0], centre_m, distance_m=orbit.distance_m)
>>> print(steering.turn_rate_rad_s.round(3))
[0.275 0.133]
"""

from standoff._standoff import (
    Filter,
    Parameters,
    StandoffDistance,
    Steering,
    assignment,
    best_separation_rad,
    clustering,
    group_count,
    information_1_m2,
    led_distance,
    measure,
    pair_information_1_m4,
    smallest_circle,
    standoff_distance,
    steer,
    vector_field,
    wrapped_angle_rad,
)

__all__ = [
    "Filter",
    "Parameters",
    "StandoffDistance",
    "Steering",
    "assignment",
    "best_separation_rad",
    "clustering",
    "group_count",
    "information_1_m2",
    "led_distance",
    "measure",
    "pair_information_1_m4",
    "smallest_circle",
    "standoff_distance",
    "steer",
    "vector_field",
    "wrapped_angle_rad",
]
