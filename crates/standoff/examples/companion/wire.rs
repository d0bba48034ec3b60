//! A report as bytes, for a radio that carries nothing else.

use standoff::{Angle, Detection, Position, RangeBearing, Report, TargetLabel, Time, UavId, UavState};

/// 68 bytes and 20 for each detection, little-endian; numbers go as they are, for all must compute with the same bits.
pub(crate) fn encode(report: &Report) -> Vec<u8> {
    let Report { uav, epoch, sequence, time, state, boresight, detections } = report;
    let UavState { position, heading, speed_m_s, turn_rate_rad_s } = state;
    let mut bytes = [uav.0, *epoch, *sequence].map(u32::to_le_bytes).concat();
    bytes.extend(time.us().to_le_bytes());
    let boresight_rad = boresight.map_or(f64::NAN, Angle::rad);
    let numbers = [position.x_m(), position.y_m(), heading.rad(), *speed_m_s, *turn_rate_rad_s, boresight_rad];
    bytes.extend(numbers.map(f64::to_le_bytes).concat());
    for Detection { label, measurement } in detections {
        bytes.extend(label.0.to_le_bytes());
        bytes.extend([measurement.range_m, measurement.bearing.rad()].map(f64::to_le_bytes).concat());
    }
    bytes
}

/// `None` for what is no report. What is one and makes no sense, the agent refuses itself.
pub(crate) fn decode(mut bytes: &[u8]) -> Option<Report> {
    fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
        let (first, rest) = bytes.split_first_chunk()?;
        *bytes = rest;
        Some(*first)
    }
    let id = |bytes: &mut &[u8]| take(bytes).map(u32::from_le_bytes);
    let number = |bytes: &mut &[u8]| take(bytes).map(f64::from_le_bytes);
    let angle = |bytes: &mut &[u8]| number(bytes).map(Angle::from_rad);
    let from = &mut bytes;
    let (uav, epoch, sequence) = (UavId(id(from)?), id(from)?, id(from)?);
    let time = Time::from_us(i64::from_le_bytes(take(from)?));
    let position = Position::from_m(number(from)?, number(from)?);
    let (heading, speed_m_s, turn_rate_rad_s) = (angle(from)?, number(from)?, number(from)?);
    let boresight = Some(angle(from)?).filter(|boresight| boresight.rad().is_finite());
    let state = UavState { position, heading, speed_m_s, turn_rate_rad_s };
    let mut detections = Vec::new();
    while !from.is_empty() {
        let label = TargetLabel(id(from)?);
        detections
            .push(Detection { label, measurement: RangeBearing { range_m: number(from)?, bearing: angle(from)? } });
    }
    Some(Report { uav, epoch, sequence, time, state, boresight, detections })
}
