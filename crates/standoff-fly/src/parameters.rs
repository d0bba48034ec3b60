//! Parameters of the autopilot that limit commands, or bring the aircraft home without this program.

use std::collections::BTreeMap;

/// Largest roll that is commanded below `ROLL_LIMIT_DEG`, degrees: the autopilot keeps this much for itself.
const ROLL_MARGIN_DEG: f64 = 5.0;

/// Parameters that are read, with their names in older versions of ArduPlane.
pub const NAMES: [&str; 16] = [
    "ROLL_LIMIT_DEG",
    "LIM_ROLL_CD",
    "AIRSPEED_MIN",
    "ARSPD_FBW_MIN",
    "AIRSPEED_MAX",
    "ARSPD_FBW_MAX",
    "WP_LOITER_RAD",
    "FS_GCS_ENABL",
    "FS_LONG_ACTN",
    "FENCE_ENABLE",
    "FENCE_ACTION",
    "FENCE_TYPE",
    "FENCE_RADIUS",
    "FENCE_ALT_MAX",
    "FENCE_ALT_MIN",
    "GUIDED_P",
];

/// Values read so far, by name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parameters {
    values: BTreeMap<&'static str, f64>,
}

/// Limits of the vehicle that commands stay within.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Maximum roll that is commanded, rad.
    pub roll_max_rad: f64,
    /// Minimum airspeed, m/s.
    pub airspeed_min_m_s: f64,
    /// Maximum airspeed, m/s.
    pub airspeed_max_m_s: f64,
    /// Radius of a safe orbit, m.
    pub loiter_radius_m: f64,
}

impl Parameters {
    /// Stores a value that the autopilot sent. Other names, and values that are not finite, are ignored.
    pub fn store(&mut self, name: &str, value: f64) {
        if let Some(known) = NAMES.iter().find(|known| **known == name).filter(|_| value.is_finite()) {
            self.values.insert(known, value);
        }
    }

    /// Names that have not been read, without those that a name of another version replaces.
    pub fn missing(&self) -> impl Iterator<Item = &'static str> {
        NAMES.into_iter().filter(|name| {
            let other = OTHER_NAMES.iter().find_map(|(a, b)| match () {
                () if a == name => Some(*b),
                () if b == name => Some(*a),
                () => None,
            });
            !self.values.contains_key(name) && !other.is_some_and(|other| self.values.contains_key(other))
        })
    }

    fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Value of a parameter that limits commands. The error states what is missing or wrong.
    fn required(&self, name: &'static str, value: Option<f64>, min: f64, max: f64) -> Result<f64, String> {
        let value = value.ok_or_else(|| format!("{name}: not received from the autopilot"))?;
        if (min..=max).contains(&value) {
            return Ok(value);
        }
        Err(format!("{name} = {value} on the autopilot: must be between {min} and {max}; correct it there"))
    }

    /// Limits for commands. The error names the first parameter that is missing or implausible.
    pub fn limits(&self) -> Result<Limits, String> {
        let roll_deg = self.value("ROLL_LIMIT_DEG").or(self.value("LIM_ROLL_CD").map(|cd| 0.01 * cd));
        let roll_deg = self.required("ROLL_LIMIT_DEG", roll_deg, 15.0, 80.0)?;
        let min_m_s = self.value("AIRSPEED_MIN").or(self.value("ARSPD_FBW_MIN"));
        let airspeed_min_m_s = self.required("AIRSPEED_MIN", min_m_s, 3.0, 200.0)?;
        let max_m_s = self.value("AIRSPEED_MAX").or(self.value("ARSPD_FBW_MAX"));
        let airspeed_max_m_s = self.required("AIRSPEED_MAX", max_m_s, airspeed_min_m_s, 300.0)?;
        let radius_m = self.value("WP_LOITER_RAD").map(f64::abs);
        let loiter_radius_m = self.required("WP_LOITER_RAD", radius_m, 10.0, 5000.0)?;
        let roll_max_rad = (roll_deg - ROLL_MARGIN_DEG).to_radians();
        Ok(Limits { roll_max_rad, airspeed_min_m_s, airspeed_max_m_s, loiter_radius_m })
    }

    /// Roll per error of the course, rad/rad, with which the autopilot follows course commands.
    pub fn course_gain(&self) -> Result<f64, String> {
        // Hundredths of a degree per rad.
        let gain = self.required("GUIDED_P", self.value("GUIDED_P"), 500.0, 20_000.0)?;
        Ok((0.01 * gain).to_radians())
    }

    /// Highest altitude above home that the fence allows, m; `None` if the fence has no ceiling or is unknown.
    pub fn fence_altitude_max_m(&self) -> Option<f64> {
        self.has_fence_of_type(1).then(|| self.value("FENCE_ALT_MAX")).flatten().filter(|max_m| *max_m > 0.0)
    }

    /// Lowest altitude above home that the fence allows, m; `None` if the fence has no floor or is unknown.
    pub fn fence_altitude_min_m(&self) -> Option<f64> {
        self.has_fence_of_type(8).then(|| self.value("FENCE_ALT_MIN")).flatten()
    }

    /// True once it is known which fences the vehicle has.
    pub fn has_fence_type(&self) -> bool {
        self.value("FENCE_TYPE").is_some_and(|kind| (0.0..256.0).contains(&kind))
    }

    /// True if the vehicle has a circular fence around home.
    pub fn has_fence_circle(&self) -> bool {
        self.has_fence_of_type(2)
    }

    /// True if the vehicle has a fence of polygons and circles, which the mission protocol reads.
    pub fn has_fence_items(&self) -> bool {
        self.has_fence_of_type(4)
    }

    /// Radius of the fence around home, m.
    pub fn fence_radius_m(&self) -> Option<f64> {
        self.value("FENCE_RADIUS")
    }

    fn has_fence_of_type(&self, bit: u32) -> bool {
        self.value("FENCE_TYPE").is_some_and(|kind| (0.0..256.0).contains(&kind) && kind as u32 & bit != 0)
    }

    /// True once the parameters that [`Self::warnings`] checks were read.
    pub fn has_failsafes(&self) -> bool {
        ["FS_GCS_ENABL", "FS_LONG_ACTN", "FENCE_ENABLE", "FENCE_ACTION"].iter().all(|name| self.value(name).is_some())
    }

    /// Warnings about parameters without which nothing brings the aircraft home when this program fails.
    pub fn warnings(&self) -> Vec<String> {
        let is_on = |name| self.value(name).is_some_and(|value| value >= 1.0);
        let wrong = [
            ("FS_GCS_ENABL", "loss of the ground station does not start a failsafe"),
            ("FS_LONG_ACTN", "the long failsafe does not return to launch"),
            ("FENCE_ENABLE", "no fence bounds the flight"),
            ("FENCE_ACTION", "a breach of the fence is only reported"),
        ];
        let wrong = wrong.into_iter().filter(|(name, _)| !is_on(name));
        wrong.map(|(name, effect)| format!("{name} is not set on the autopilot: {effect}; set it to 1")).collect()
    }
}

/// Names of the same parameter in newer and older versions.
const OTHER_NAMES: [(&str, &str); 3] =
    [("ROLL_LIMIT_DEG", "LIM_ROLL_CD"), ("AIRSPEED_MIN", "ARSPD_FBW_MIN"), ("AIRSPEED_MAX", "ARSPD_FBW_MAX")];

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> Parameters {
        let mut parameters = Parameters::default();
        for (name, value) in
            [("ROLL_LIMIT_DEG", 65.0), ("AIRSPEED_MIN", 10.0), ("AIRSPEED_MAX", 30.0), ("WP_LOITER_RAD", -80.0)]
        {
            parameters.store(name, value);
        }
        parameters
    }

    #[test]
    fn limits_follow_from_new_and_old_names() {
        let limits = plane().limits().unwrap();
        assert!((limits.roll_max_rad.to_degrees() - 60.0).abs() < 1e-9);
        let Limits { airspeed_min_m_s, airspeed_max_m_s, loiter_radius_m, .. } = limits;
        assert_eq!((airspeed_min_m_s, airspeed_max_m_s, loiter_radius_m), (10.0, 30.0, 80.0));
        let mut old = Parameters::default();
        for (name, value) in
            [("LIM_ROLL_CD", 6500.0), ("ARSPD_FBW_MIN", 10.0), ("ARSPD_FBW_MAX", 30.0), ("WP_LOITER_RAD", 80.0)]
        {
            old.store(name, value);
        }
        assert_eq!(old.limits(), Ok(limits));
        assert!(!old.missing().any(|name| name == "ROLL_LIMIT_DEG"));
        assert_eq!((plane().missing().count(), Parameters::default().missing().count()), (9, NAMES.len()));
    }

    #[test]
    fn implausible_and_missing_limits_are_errors_that_name_the_parameter() {
        for (name, value, error) in [
            ("ROLL_LIMIT_DEG", 0.0, "ROLL_LIMIT_DEG = 0 on the autopilot: must be between 15 and 80"),
            ("AIRSPEED_MIN", -1.0, "AIRSPEED_MIN = -1"),
            ("AIRSPEED_MAX", 9.0, "AIRSPEED_MAX = 9 on the autopilot: must be between 10 and 300"),
            ("WP_LOITER_RAD", 1.0, "WP_LOITER_RAD = 1"),
        ] {
            let mut parameters = plane();
            parameters.store(name, value);
            let stated = parameters.limits().unwrap_err();
            assert!(stated.starts_with(error), "{stated}");
        }
        let mut parameters = plane();
        parameters.store("AIRSPEED_MIN", f64::NAN);
        assert_eq!(parameters, plane());
        assert_eq!(Parameters::default().limits(), Err("ROLL_LIMIT_DEG: not received from the autopilot".to_owned()));
    }

    #[test]
    fn the_gain_of_course_commands_is_read_and_checked() {
        let mut parameters = plane();
        assert_eq!(parameters.course_gain(), Err("GUIDED_P: not received from the autopilot".to_owned()));
        parameters.store("GUIDED_P", 5000.0);
        assert_eq!(parameters.course_gain(), Ok(50f64.to_radians()));
        parameters.store("GUIDED_P", 0.0);
        assert!(parameters.course_gain().unwrap_err().starts_with("GUIDED_P = 0 on the autopilot"));
    }

    #[test]
    fn missing_failsafes_are_warnings() {
        let mut parameters = plane();
        assert_eq!(parameters.warnings().len(), 4);
        for name in ["FS_GCS_ENABL", "FS_LONG_ACTN", "FENCE_ENABLE", "FENCE_ACTION"] {
            parameters.store(name, 1.0);
        }
        assert_eq!(parameters.warnings(), Vec::<String>::new());
    }
}
