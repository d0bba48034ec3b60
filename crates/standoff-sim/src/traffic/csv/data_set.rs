//! Published data sets of trajectories, recognised by their columns.

use super::super::model::Options;
use super::super::validate::Quantity;
use super::clock::Numbers;

/// Frame rate of the drone data sets, 1/s.
const FRAME_RATE_HZ: f64 = 25.0;
/// Length of a US survey foot, m: the unit of NGSIM's coordinates.
const US_SURVEY_FOOT_M: f64 = 1_200.0 / 3_937.0;

/// A time as the number of a frame.
const FRAME: Quantity = Quantity::new(0.0, 1e9, "frames", "give whole numbers");
/// A time in milliseconds since 1970.
const MILLISECONDS: Quantity = Quantity::new(-9e12, 9e12, "ms", "correct the row");

/// A published data set of trajectories.
pub(super) struct DataSet {
    /// Columns that only this data set has.
    header: &'static [&'static str],
    /// Columns of time, vehicle, x and y.
    pub(super) columns: [&'static str; 4],
    /// Columns with the size of the box whose corner x and y are; `None` if they are a point of the vehicle.
    pub(super) box_size: Option<[&'static str; 2]>,
    /// True if the time is the number of a frame; otherwise it is in milliseconds.
    has_frames: bool,
    /// Unit of the coordinates, m.
    unit_m: f64,
    /// True if y increases downwards, as in images.
    is_y_down: bool,
}

static DATA_SETS: [DataSet; 3] = [
    // highD (Krajewski et al., 2018): x and y are the upper left corner of the vehicle in the image, m.
    DataSet {
        header: &["frame", "id", "x", "y", "width", "height", "xVelocity", "yVelocity"],
        columns: ["frame", "id", "x", "y"],
        box_size: Some(["width", "height"]),
        has_frames: true,
        unit_m: 1.0,
        is_y_down: true,
    },
    // inD, rounD, exiD and uniD (Bock et al., 2020): the centre of the vehicle in a local frame, m.
    DataSet {
        header: &["trackId", "frame", "xCenter", "yCenter"],
        columns: ["frame", "trackId", "xCenter", "yCenter"],
        box_size: None,
        has_frames: true,
        unit_m: 1.0,
        is_y_down: false,
    },
    // NGSIM (US Federal Highway Administration, 2006): the centre of the front in state-plane coordinates, feet.
    DataSet {
        header: &["Vehicle_ID", "Frame_ID", "Global_Time", "Global_X", "Global_Y"],
        columns: ["Global_Time", "Vehicle_ID", "Global_X", "Global_Y"],
        box_size: None,
        has_frames: false,
        unit_m: US_SURVEY_FOOT_M,
        is_y_down: false,
    },
];

impl DataSet {
    /// Returns the data set with these columns.
    pub(super) fn with(header: &[&str]) -> Option<&'static Self> {
        let has = |name: &&str| header.iter().any(|found| found.eq_ignore_ascii_case(name));
        DATA_SETS.iter().find(|set| set.header.iter().all(has))
    }

    /// Parses `text`, the value of `key`, as a time; returns microseconds.
    pub(super) fn time_us(
        &self,
        key: &str,
        text: &str,
        numbers: &mut Numbers,
        options: &Options,
    ) -> Result<i64, String> {
        let unit_us = match self.has_frames {
            true => 1e6 / options.frame_rate_hz.unwrap_or(FRAME_RATE_HZ),
            false => 1e3,
        };
        let quantity = if self.has_frames { &FRAME } else { &MILLISECONDS };
        Ok((numbers.parse(key, text, quantity)? * unit_us).round() as i64)
    }

    /// Converts coordinates to metres east and north.
    pub(super) fn metres(&self, x: f64, y: f64) -> (f64, f64) {
        (x * self.unit_m, if self.is_y_down { -y } else { y } * self.unit_m)
    }
}
