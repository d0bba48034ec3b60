//! Reads a recorded run for an export.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use chrono::{DateTime, Utc};
use standoff::{Angle, Covariance, Displacement, Position};
use standoff_io::geodesy::LocalPlane;
use standoff_record::{Frame, Record, target_name};
use standoff_score::{FrameScorer, Gaps};
use standoff_sim::scenario::Settings;

use super::model::{Degrees, Export, Fix, Gap, Outline, Path};
use crate::error::Failure;

/// Least duration of a gap, s.
pub(crate) const GAP_MIN_S: f64 = 2.0;

/// Number of points of a full circle.
const CIRCLE_POINTS: u32 = 72;

/// Mahalanobis distance of the ellipse that contains a position with a probability of 95 %.
const ELLIPSE_SDS: f64 = 2.447_746_830_680_816;

/// Reads a run time step by time step.
pub(crate) struct Reader<'a> {
    plane: LocalPlane,
    settings: &'a Settings,
    names: &'a [String],
    interval_s: f64,
    next_outline_s: f64,
    time_s: f64,
    uavs: BTreeMap<u32, Path>,
    tracks: BTreeMap<u32, Path>,
    outlines: Vec<Outline>,
    scorer: FrameScorer,
    gaps: Gaps,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(plane: LocalPlane, settings: &'a Settings, record: &'a Record, interval_s: f64) -> Self {
        Self {
            plane,
            settings,
            names: record.target_names(),
            interval_s,
            next_outline_s: 0.0,
            time_s: 0.0,
            uavs: BTreeMap::new(),
            tracks: BTreeMap::new(),
            outlines: Vec::new(),
            scorer: FrameScorer::new(settings.score_config()),
            gaps: Gaps::new(settings.period.s()),
        }
    }

    fn degrees(&self, position: Position) -> Result<Degrees, Failure> {
        // To 0.1 mm, so that files stay small.
        let rounded = |degrees: f64| (degrees * 1e9).round() / 1e9;
        let [latitude_deg, longitude_deg] = self.plane.degrees_at(position).map_err(Failure::running)?;
        Ok([longitude_deg, latitude_deg].map(rounded))
    }

    pub(crate) fn frame(&mut self, frame: &Frame) -> Result<(), Failure> {
        self.time_s = frame.time_us as f64 * 1e-6;
        for row in &frame.uavs {
            let at = self.degrees(Position::from_m(row.x_m, row.y_m))?;
            let altitude_m = row.altitude_m.or(row.commanded_altitude_m);
            let fix = Fix { time_s: self.time_s, at, altitude_m, position_sd_m: None };
            let new = || Path { kind: "uav", name: format!("UAV {}", row.uav), fixes: Vec::new() };
            self.uavs.entry(row.uav).or_insert_with(new).fixes.push(fix);
        }
        for row in &frame.tracks {
            let at = self.degrees(Position::from_m(row.state[0], row.state[3]))?;
            let covariance = Covariance::from_upper_triangle(&row.covariance);
            let position_sd_m = Some(covariance.position_sd_max_m());
            let new = || Path { kind: "track", name: target_name(row.target, self.names), fixes: Vec::new() };
            let fix = Fix { time_s: self.time_s, at, altitude_m: None, position_sd_m };
            self.tracks.entry(row.track).or_insert_with(new).fixes.push(fix);
        }
        self.gaps.add(frame, &self.scorer.frame(frame));
        if self.time_s >= self.next_outline_s {
            self.next_outline_s += self.interval_s;
            self.outline(frame)?;
        }
        Ok(())
    }

    /// Adds the outlines of this time.
    fn outline(&mut self, frame: &Frame) -> Result<(), Failure> {
        for row in &frame.groups {
            let centre = Position::from_m(row.x_m, row.y_m);
            self.add("orbit", format!("group {}", row.group), circle(centre, row.standoff_distance_m))?;
        }
        let sensor = &self.settings.team.track.sensor;
        for row in &frame.uavs {
            let Some(boresight_rad) = row.boresight_rad else { continue };
            let at = Position::from_m(row.x_m, row.y_m);
            let ring = sector(at, boresight_rad, sensor.half_field_of_view_rad(), sensor.sensing_range_m);
            self.add("field of view", format!("UAV {}", row.uav), ring)?;
        }
        for row in &frame.tracks {
            let covariance = Covariance::from_upper_triangle(&row.covariance).position();
            let Some(root) = covariance.cholesky() else { continue };
            let at = Position::from_m(row.state[0], row.state[3]);
            let scaled = |of: Position| root.l() * of.vector();
            let ring = circle(Position::default(), ELLIPSE_SDS).into_iter().map(scaled);
            let ring = ring.map(|of| at + Displacement::from_m(of.x, of.y)).collect();
            self.add("uncertainty", target_name(row.target, self.names), ring)?;
        }
        Ok(())
    }

    fn add(&mut self, kind: &'static str, name: String, ring: Vec<Position>) -> Result<(), Failure> {
        let ring = ring.into_iter().map(|at| self.degrees(at)).collect::<Result<Vec<_>, _>>()?;
        let (begin_s, end_s) = (self.time_s, self.time_s + self.interval_s);
        self.outlines.push(Outline { kind, name, begin_s, end_s, ring });
        Ok(())
    }

    /// Returns the times out of view.
    fn gaps(&self) -> Result<Vec<Gap>, Failure> {
        let seconds = |time_us: i64| time_us as f64 * 1e-6;
        let all = self.gaps.all().into_iter().map(|gap| {
            Ok(Gap {
                name: target_name(gap.target, self.names),
                begin_s: seconds(gap.begin_us),
                end_s: seconds(gap.end_us),
                at: self.degrees(Position::from_m(gap.x_m, gap.y_m))?,
                cause: gap.cause.text(),
            })
        });
        all.filter(|gap| gap.as_ref().map_or(true, |gap| gap.end_s - gap.begin_s >= GAP_MIN_S)).collect()
    }

    pub(crate) fn finish(mut self, name: String, begin: DateTime<Utc>) -> Result<Export, Failure> {
        let (gaps, end_s) = (self.gaps()?, self.time_s);
        self.outlines.iter_mut().for_each(|of| of.end_s = of.end_s.min(end_s));
        let paths = self.uavs.into_values().chain(self.tracks.into_values()).collect();
        Ok(Export { name, begin, end_s, paths, outlines: self.outlines, gaps })
    }
}

/// A closed circle.
fn circle(centre: Position, radius_m: f64) -> Vec<Position> {
    let at = |k: u32| {
        centre + Displacement::from_polar(radius_m, Angle::from_rad(TAU * f64::from(k) / f64::from(CIRCLE_POINTS)))
    };
    (0..=CIRCLE_POINTS).map(|k| at(k % CIRCLE_POINTS)).collect()
}

/// A closed sector about a boresight.
fn sector(apex: Position, boresight_rad: f64, half_width_rad: f64, range_m: f64) -> Vec<Position> {
    let points = (half_width_rad / TAU * 2.0 * f64::from(CIRCLE_POINTS)).ceil() as u32;
    let angle_rad = |k: u32| boresight_rad + half_width_rad * (2.0 * f64::from(k) / f64::from(points) - 1.0);
    let arc = (0..=points).map(|k| apex + Displacement::from_polar(range_m, Angle::from_rad(angle_rad(k))));
    core::iter::once(apex).chain(arc).chain([apex]).collect()
}
