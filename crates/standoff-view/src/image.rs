//! Image of one time step for environments of reinforcement learning: the map of the replay page, without texts.

use std::error::Error;

use plotters::prelude::*;
use standoff::SensorParams;
use standoff::math::{TAU, cos, sin};
use standoff_record::Frame;

use crate::colours::{GROUPS, UAVS};
use crate::figures::arc;

/// Least distance from the centre to an edge, m.
const REACH_MIN_M: f64 = 100.0;
/// Steps in which the map zooms out, so that it rarely changes its scale.
const ZOOM: f64 = 1.25;

/// Returns the centre of the image, and the distance from there to its edges, m.
fn extent(frame: &Frame) -> ((f64, f64), f64) {
    let uavs = frame.uavs.iter().map(|row| (row.x_m, row.y_m, 0.0));
    let tracks = frame.tracks.iter().map(|row| (row.state[0], row.state[3], 0.0));
    let truth = frame.truth.iter().map(|row| (row.x_m, row.y_m, 0.0));
    let orbits = frame.groups.iter().map(|row| (row.x_m, row.y_m, row.standoff_distance_m));
    let all: Vec<(f64, f64, f64)> = uavs.chain(tracks).chain(truth).chain(orbits).collect();
    let bounds = |part: fn(&(f64, f64, f64)) -> f64| {
        let low = all.iter().map(|at| part(at) - at.2).fold(f64::INFINITY, f64::min);
        let high = all.iter().map(|at| part(at) + at.2).fold(f64::NEG_INFINITY, f64::max);
        (0.5 * (low + high), 0.5 * (high - low))
    };
    let ((centre_x_m, half_x_m), (centre_y_m, half_y_m)) = (bounds(|at| at.0), bounds(|at| at.1));
    let mut reach_m = REACH_MIN_M;
    while reach_m < 1.1 * half_x_m.max(half_y_m) {
        reach_m *= ZOOM;
    }
    ((centre_x_m, centre_y_m), reach_m)
}

/// Draws a square of `size` px as rows of red, green and blue from the top. North is up; all objects are in the image.
pub fn rgb(frame: &Frame, sensor: &SensorParams, size: u32) -> Result<Vec<u8>, Box<dyn Error>> {
    let ((centre_x_m, centre_y_m), reach_m) = extent(frame);
    let scale = 0.5 * f64::from(size) / reach_m;
    let px = |(x_m, y_m): (f64, f64)| {
        let half = 0.5 * f64::from(size);
        ((half + (x_m - centre_x_m) * scale) as i32, (half - (y_m - centre_y_m) * scale) as i32)
    };
    let uav_colour = |uav: u32| UAVS[uav as usize % UAVS.len()];
    let group_colour = |group: Option<u32>| group.map_or(BLACK, |group| GROUPS[group as usize % GROUPS.len()]);

    let mut pixels = vec![255; 3 * size as usize * size as usize];
    {
        let map = BitMapBackend::with_buffer(&mut pixels, (size, size)).into_drawing_area();
        for row in &frame.uavs {
            let Some(boresight_rad) = row.boresight_rad else { continue };
            let apex = (row.x_m, row.y_m);
            // Rays end at the edge of the image, because plotters moves points outside it to the edge.
            let share = |from_m: f64, to_m: f64, centre_m: f64| {
                let edge_m = centre_m + reach_m.copysign(to_m - from_m);
                ((edge_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0)
            };
            let cut = |(x_m, y_m): (f64, f64)| {
                let share = share(apex.0, x_m, centre_x_m).min(share(apex.1, y_m, centre_y_m));
                (apex.0 + share * (x_m - apex.0), apex.1 + share * (y_m - apex.1))
            };
            let view = arc(apex, sensor.sensing_range_m, boresight_rad, 2.0 * sensor.half_field_of_view_rad());
            let view = view.map(cut).chain([apex]).map(px);
            map.draw(&Polygon::new(view.collect::<Vec<_>>(), uav_colour(row.uav).mix(0.15)))?;
        }
        for row in &frame.groups {
            let orbit = arc((row.x_m, row.y_m), row.standoff_distance_m, 0.0, TAU).map(px);
            map.draw(&PathElement::new(orbit.collect::<Vec<_>>(), group_colour(Some(row.group))))?;
        }
        for row in &frame.truth {
            map.draw(&Circle::new(px((row.x_m, row.y_m)), 3, BLACK.mix(0.4).filled()))?;
        }
        for row in &frame.tracks {
            map.draw(&Circle::new(px((row.state[0], row.state[3])), 5, group_colour(row.group)))?;
        }
        for row in &frame.uavs {
            let corner = |angle_rad: f64| {
                let (length_m, angle_rad) = (9.0 / scale, row.heading_rad + angle_rad);
                px((row.x_m + length_m * cos(angle_rad), row.y_m + length_m * sin(angle_rad)))
            };
            map.draw(&Polygon::new([0.0, 2.5, -2.5].map(corner).to_vec(), uav_colour(row.uav)))?;
        }
        map.present()?;
    }
    Ok(pixels)
}

#[cfg(test)]
mod tests {
    use standoff::TeamParams;

    use super::*;
    use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};

    #[test]
    fn the_image_has_every_object_in_its_colour() {
        let sensor = TeamParams::recommended().track.sensor;
        let frame = Frame {
            uavs: vec![standoff_record::UavRow { x_m: -300.0, ..uav_row(1) }],
            truth: vec![truth_row(0, 200.0, 0.0)],
            tracks: vec![track_row(0, Some(0))],
            groups: vec![group_row(0)],
            ..Frame::default()
        };
        let pixels = rgb(&frame, &sensor, 200).unwrap();
        let colour = |x: usize, y: usize| <[u8; 3]>::try_from(&pixels[3 * (200 * y + x)..][..3]).unwrap();
        let has = |RGBColor(red, green, blue): RGBColor| pixels.chunks(3).any(|pixel| pixel == [red, green, blue]);
        assert_eq!((pixels.len(), colour(0, 0)), (120_000, [255, 255, 255]));
        assert!(has(UAVS[1]) && has(GROUPS[0]) && !has(UAVS[0]));
        // The UAV in the west looks east; north of it, there is nothing.
        assert!(colour(30, 100) != colour(30, 20));
        // Objects without a finite distance between them give an image, too.
        let far = Frame { truth: vec![truth_row(0, -1e300, 1e300), truth_row(1, 1e300, 0.0)], ..frame };
        assert_eq!(rgb(&far, &sensor, 10).unwrap().len(), 300);
    }
}
