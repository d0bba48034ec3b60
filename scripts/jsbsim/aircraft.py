"""Aircraft of JSBSim with inner loops for roll, altitude and airspeed, as an autopilot has them."""

import math
import os
from pathlib import Path
from typing import NamedTuple

# Without it, JSBSim prints a banner for each aircraft.
os.environ["JSBSIM_DEBUG"] = "0"
import jsbsim  # noqa: E402

FT_M = 0.3048
KNOT_M_S = 0.514444
GRAVITY_M_S2 = 9.80665
# Period of the inner loops and step of JSBSim, s.
LOOP_S = 0.02
STEP_S = 0.005
# Roll error is removed with this time constant (s), at a limited rate (rad/s), as by ArduPlane.
ROLL_TIME_CONSTANT_S = 0.5
ROLL_RATE_MAX_RAD_S = math.radians(60)
CLIMB_RATE_MAX_M_S = 3.0


class Kind(NamedTuple):
    """An airframe: its model, limits, and gains of the inner loops, which were tuned by hand."""

    model: str
    folder: str | None
    has_engine: bool
    airspeed_m_s: float
    airspeed_min_m_s: float
    airspeed_max_m_s: float
    loiter_radius_m: float
    # Deflection (1 is full) per rad/s, rad and rad s of error, at the nominal airspeed.
    aileron: tuple
    elevator: tuple
    # Throttle per m/s and m of error of the airspeed, and at the nominal airspeed in level flight.
    throttle: tuple
    # Pitch per climb rate over airspeed, and its integral, 1/s.
    climb: tuple
    pitch_max_rad: float


KINDS = {
    "c172x": Kind("c172x", None, True, 50, 38, 62, 400, (1.4, 0.6), (2.4, 4.0, 0.8), (0.06, 0.012, 0.65),
                  (0.5, 0.1), math.radians(12)),
    "small-uav": Kind("small-uav", str(Path(__file__).resolve().parent), False, 22, 14, 30, 80, (0.6, 0.4),
                      (0.9, 1.0, 1.0), (0.08, 0.02, 0.45), (0.7, 0.2), math.radians(15)),
}


def clamp(value, lowest, highest):
    return max(lowest, min(highest, value))


def wrap(angle_rad):
    """The angle in (-pi, pi]."""
    return math.remainder(angle_rad, math.tau)


class Aircraft:
    """One aircraft in the air. `wind_m_s` is the velocity of the air, north and east."""

    def __init__(self, kind, latitude_deg, longitude_deg, sea_level_m, altitude_m, yaw_deg, wind_m_s):
        self.kind = KINDS[kind]
        fdm = self.fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
        fdm.set_debug_level(0)
        if self.kind.folder:
            fdm.set_aircraft_path(self.kind.folder)
        fdm.load_model(self.kind.model)
        fdm.set_dt(STEP_S)
        self.sea_level_m = sea_level_m
        fdm["ic/lat-geod-deg"], fdm["ic/long-gc-deg"] = latitude_deg, longitude_deg
        fdm["ic/h-sl-ft"] = (sea_level_m + altitude_m) / FT_M
        fdm["ic/psi-true-deg"] = yaw_deg
        fdm["ic/vc-kts"] = self.kind.airspeed_m_s / KNOT_M_S
        fdm["ic/theta-deg"] = 3
        fdm["atmosphere/wind-north-fps"], fdm["atmosphere/wind-east-fps"] = (w / FT_M for w in wind_m_s)
        fdm.run_ic()
        if self.kind.has_engine:
            fdm["propulsion/set-running"] = -1
            fdm["fcs/mixture-cmd-norm"] = 0.9
        self.roll_target_rad = 0.0
        self.altitude_target_m = altitude_m
        self.airspeed_target_m_s = self.kind.airspeed_m_s
        self.aileron_integral = self.elevator_integral = self.throttle_integral = self.pitch_integral = 0.0
        self.read()

    def read(self):
        """Reads the state from JSBSim."""
        fdm = self.fdm
        self.latitude_deg, self.longitude_deg = fdm["position/lat-geod-deg"], fdm["position/long-gc-deg"]
        self.altitude_m = fdm["position/h-sl-ft"] * FT_M - self.sea_level_m
        self.north_m_s, self.east_m_s = fdm["velocities/v-north-fps"] * FT_M, fdm["velocities/v-east-fps"] * FT_M
        self.climb_rate_m_s = -fdm["velocities/v-down-fps"] * FT_M
        self.airspeed_m_s = fdm["velocities/vc-kts"] * KNOT_M_S
        self.roll_rad, self.pitch_rad = fdm["attitude/phi-rad"], fdm["attitude/theta-rad"]
        self.yaw_rad = fdm["attitude/psi-rad"]
        self.rates_rad_s = [fdm[f"velocities/{axis}-rad_sec"] for axis in "pqr"]

    def advance(self):
        """Advances by the period of the loops."""
        kind, fdm, dt = self.kind, self.fdm, LOOP_S
        roll_rate, pitch_rate, _ = self.rates_rad_s
        # The effect of the surfaces grows with the square of the airspeed.
        scale = clamp((kind.airspeed_m_s / max(self.airspeed_m_s, 5.0)) ** 2, 0.5, 2.0)

        desired = clamp(wrap(self.roll_target_rad - self.roll_rad) / ROLL_TIME_CONSTANT_S,
                        -ROLL_RATE_MAX_RAD_S, ROLL_RATE_MAX_RAD_S)
        gain, integral = kind.aileron
        error = desired - roll_rate
        self.aileron_integral = clamp(self.aileron_integral + integral * error * dt, -0.4, 0.4)
        fdm["fcs/aileron-cmd-norm"] = clamp(scale * (gain * error + self.aileron_integral), -1, 1)

        # Altitude to climb rate to pitch.
        climb = clamp(0.25 * (self.altitude_target_m - self.altitude_m), -CLIMB_RATE_MAX_M_S, CLIMB_RATE_MAX_M_S)
        speed = max(self.airspeed_m_s, 5.0)
        error = (climb - self.climb_rate_m_s) / speed
        gain, integral = kind.climb
        self.pitch_integral = clamp(self.pitch_integral + integral * error * dt, -0.15, 0.15)
        # More lift in turns.
        turn_pitch = 0.07 * (1 / max(math.cos(self.roll_rad), 0.5) - 1)
        pitch = clamp(climb / speed + gain * error + self.pitch_integral + turn_pitch,
                      -kind.pitch_max_rad, kind.pitch_max_rad)

        proportional, integral, damping = kind.elevator[1], kind.elevator[2], kind.elevator[0]
        error = pitch - self.pitch_rad
        # In a turn, level flight needs a pitch rate.
        turn_rate = GRAVITY_M_S2 / speed * math.sin(self.roll_rad) * math.tan(self.roll_rad)
        self.elevator_integral = clamp(self.elevator_integral + integral * error * dt, -0.5, 0.5)
        up = scale * (proportional * error + damping * (turn_rate - pitch_rate) + self.elevator_integral)
        fdm["fcs/elevator-cmd-norm"] = clamp(-up, -1, 1)

        gain, integral, trim = kind.throttle
        error = self.airspeed_target_m_s - self.airspeed_m_s
        self.throttle_integral = clamp(self.throttle_integral + integral * error * dt, -0.4, 0.4)
        turn = 0.25 * (1 / max(math.cos(self.roll_rad), 0.5) ** 2 - 1)
        throttle = trim + gain * error + self.throttle_integral + 0.06 * climb + turn
        fdm["fcs/throttle-cmd-norm" if kind.has_engine else "fcs/motor-cmd-norm"] = clamp(throttle, 0, 1)

        for _ in range(round(LOOP_S / STEP_S)):
            fdm.run()
        self.read()
