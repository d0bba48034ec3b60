"""The library's components by name: filter, vector field, standoff distance, minimum enclosing circle, clustering,
assignment, pair information.

Arguments are anything that NumPy converts to arrays (lists, integers, any strides). Leading axes broadcast by NumPy's
rules, and results are arrays. Frame: x east, y north, metres; angles in radians, anticlockwise from east; the unit is the
suffix of a name. :class:`Parameters` contains numbers such as gains; the defaults are the recommended parameters, which scenarios use by default.

Two UAVs orbit three vehicles; the turn rates that the law commands:

>>> from standoff import components
>>> centre_m, radius_m = components.enclosing_circle([[0, 0], [160, 0], [0, 120]])
>>> print(centre_m, radius_m)
[80. 60.] 100.0
>>> orbit = components.standoff_distance(radius_m, margin_m=50)
>>> print(orbit.distance_m.round(3))
300.0
>>> steering = components.steer([[380, 60], [80, -240]], [1.5, 0.0], centre_m, distance_m=orbit.distance_m)
>>> print(steering.turn_rate_rad_s.round(3))
[0.204 0.133]
"""

from standoff._standoff import (
    Filter,
    Parameters,
    StandoffDistance,
    Steering,
    assignment,
    optimal_phase_difference_rad,
    clustering,
    group_count,
    information_1_m2,
    steered_radius,
    measure,
    pair_information_1_m4,
    enclosing_circle,
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
    "optimal_phase_difference_rad",
    "clustering",
    "group_count",
    "information_1_m2",
    "steered_radius",
    "measure",
    "pair_information_1_m4",
    "enclosing_circle",
    "standoff_distance",
    "steer",
    "vector_field",
    "wrapped_angle_rad",
]
