//! UAVs and tracks as Cursor-on-Target events for operator maps (ATAK, WinTAK), one datagram each.

use std::net::{SocketAddr, UdpSocket};
use std::time::Duration as StdDuration;

use cottak_core::detail::{Contact, Track};
use cottak_core::event::how;
use cottak_core::{CotType, Event, Point, timestamp};
use standoff::{Angle, Displacement, Duration, Position, Time};
use standoff_io::geodesy::LocalPlane;
use standoff_record::{Frame, TrackRow, UavRow};

use crate::period::is_due;
use crate::team_clock::unix_us;
use crate::transport::resolve;

/// Shortest time between two sets of events.
const PERIOD: Duration = Duration::from_us(1_000_000);

/// Time after which a map marks an object as out of date.
const STALE: StdDuration = StdDuration::from_secs(10);

/// Maximum number of events of a set, which bounds the load of the network.
const EVENTS_MAX: usize = 500;

/// Type of a friendly fixed-wing UAV.
const UAV: &str = "a-f-A-M-F-Q";

/// Type of an unknown object on the ground.
const TARGET: &str = "a-u-G";

/// An estimate that a machine has made from several measurements.
const ESTIMATED: &str = "m-f";

/// Sends events to one address.
pub(crate) struct CotSender {
    socket: UdpSocket,
    to: SocketAddr,
    plane: LocalPlane,
    sent_at: Option<Time>,
}

impl CotSender {
    pub(crate) fn open(to: &str, plane: LocalPlane) -> std::io::Result<Self> {
        let to = resolve(to)?;
        let any: SocketAddr = if to.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
        let socket = UdpSocket::bind(any)?;
        // A full buffer must not delay commands.
        socket.set_nonblocking(true)?;
        Ok(Self { socket, to, plane, sent_at: None })
    }

    /// Sends the events of a time step, at most once per second. Lost datagrams are not errors.
    pub(crate) fn send(&mut self, frame: &Frame) {
        let now = Time::from_us(frame.time_us);
        if !is_due(self.sent_at, now, PERIOD) {
            return;
        }
        self.sent_at = Some(now);
        for event in events(frame, &self.plane, unix_us(frame.time_us)) {
            let _ = self.socket.send_to(event.as_bytes(), self.to);
        }
    }
}

/// Events of a time step as XML: UAVs, then tracks. `unix_us` is the time of the frame.
pub fn events(frame: &Frame, plane: &LocalPlane, unix_us: i64) -> Vec<String> {
    let uavs = frame.uavs.iter().filter_map(|row| uav(row, plane, unix_us));
    let tracks = frame.tracks.iter().filter_map(|row| track(row, plane, unix_us));
    uavs.chain(tracks).take(EVENTS_MAX).collect()
}

fn uav(row: &UavRow, plane: &LocalPlane, unix_us: i64) -> Option<String> {
    let point = point(plane, Position::from_m(row.x_m, row.y_m))?;
    let motion = motion(Angle::from_rad(row.heading_rad), row.speed_m_s);
    let (uid, name) = (format!("standoff-uav-{}", row.uav), format!("UAV {}", row.uav));
    event((uid, UAV, how::MACHINE_GPS), point, unix_us, motion, name)
}

/// Event of a track. All aircraft of a team give the same track the same uid.
fn track(row: &TrackRow, plane: &LocalPlane, unix_us: i64) -> Option<String> {
    let [x_m, vx_m_s, _, y_m, vy_m_s, _] = row.state;
    // Elements (x, x), (x, y) and (y, y) of the upper triangle.
    let [var_x_m2, cov_m2, var_y_m2] = [0, 3, 15].map(|index| row.covariance[index]);
    // Standard deviation along the longer axis of the error ellipse.
    let half_difference_m2 = 0.5 * (var_x_m2 - var_y_m2);
    let largest_m2 = 0.5 * (var_x_m2 + var_y_m2) + (half_difference_m2 * half_difference_m2 + cov_m2 * cov_m2).sqrt();
    let point = point(plane, Position::from_m(x_m, y_m))?;
    // The crate writes missing errors as unknown.
    let sd_m = Some(largest_m2.sqrt()).filter(|sd_m| sd_m.is_finite());
    let point = Point { ce: sd_m.map(rounded), ..point };
    let velocity = Displacement::from_m(vx_m_s, vy_m_s);
    let motion = motion(velocity.direction(), velocity.length_m());
    let (uid, name) = match row.track_uid {
        Some(uid) => {
            (format!("standoff-track-{uid:016x}"), format!("track {}", row.track & !standoff_record::NO_TARGET))
        }
        None => (format!("standoff-target-{}", row.track), format!("target {}", row.track)),
    };
    event((uid, TARGET, ESTIMATED), point, unix_us, motion, name)
}

/// Point of a position. The height above the ellipsoid is not known: the autopilot reports that above home.
fn point(plane: &LocalPlane, position: Position) -> Option<Point> {
    let [latitude_deg, longitude_deg] = plane.degrees_at(position).ok()?;
    // 1e-7 degrees are 1 cm.
    let [latitude_deg, longitude_deg] = [latitude_deg, longitude_deg].map(|deg| (deg * 1e7).round() / 1e7);
    Point::new(latitude_deg, longitude_deg).ok()
}

/// Course, degrees clockwise from north, and speed.
fn motion(direction: Angle, speed_m_s: f64) -> Track {
    Track::new(rounded((90.0 - direction.deg()).rem_euclid(360.0)), rounded(speed_m_s))
}

fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn event(
    (uid, kind, how): (String, &str, &str),
    point: Point,
    unix_us: i64,
    motion: Track,
    name: String,
) -> Option<String> {
    let epoch = timestamp::parse("1970-01-01T00:00:00Z").ok()?;
    let at = epoch + StdDuration::from_micros(u64::try_from(unix_us).ok()?);
    let mut event = Event::new(uid, kind.parse::<CotType>().ok()?, point).with_how(how);
    (event.time, event.start) = (at, at);
    event.with_stale_in(STALE.try_into().ok()?).with(Contact::new(name)).with(motion).to_xml_string().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff_record::NO_TARGET;

    #[test]
    fn events_have_position_error_course_speed_and_the_same_uid_on_all_aircraft() {
        let plane = LocalPlane::about(47.4, 8.5).unwrap();
        let uav = UavRow { uav: 3, heading_rad: 0.0, speed_m_s: 23.456, ..UavRow::default() };
        let mut covariance = [0.0; 21];
        (covariance[0], covariance[3], covariance[15]) = (10.0, 6.0, 10.0);
        let track = TrackRow {
            target: NO_TARGET,
            track: 7,
            state: [0.0, 0.0, 0.0, 0.0, -5.0, 0.0],
            covariance,
            ..TrackRow::default()
        };
        let lost = TrackRow { state: [f64::NAN; 6], ..track };
        let unlabelled = TrackRow { track_uid: Some(9), track: NO_TARGET + 2, ..track };
        let frame = Frame { uavs: vec![uav], tracks: vec![track, lost, unlabelled], ..Frame::default() };
        let events: Vec<Event> =
            events(&frame, &plane, 1_767_225_600_250_000).iter().map(|xml| xml.parse().unwrap()).collect();
        let uids: Vec<&str> = events.iter().map(|event| event.uid.as_str()).collect();
        assert_eq!(uids, ["standoff-uav-3", "standoff-target-7", "standoff-track-0000000000000009"]);
        let motion = |event: &Event| event.detail.get::<Track>().map(|track| (track.course, track.speed));
        assert_eq!(motion(&events[0]), Some((Some(90.0), Some(23.46))));
        assert_eq!(motion(&events[1]), Some((Some(180.0), Some(5.0))));
        assert_eq!((events[1].point.ce, events[0].point.ce), (Some(4.0), None));
        assert!((events[1].point.lat - 47.4).abs() < 1e-6 && (events[1].point.lon - 8.5).abs() < 1e-6);
        assert_eq!(timestamp::format(events[1].time).unwrap(), "2026-01-01T00:00:00.250Z");
        assert_eq!(timestamp::format(events[1].stale).unwrap(), "2026-01-01T00:00:10.250Z");
        assert_eq!(events[2].detail.get::<Contact>().unwrap().callsign.as_deref(), Some("track 2"));
    }

    #[test]
    fn a_set_of_events_is_sent_once_per_second_and_is_limited() {
        let plane = LocalPlane::about(47.4, 8.5).unwrap();
        let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
        receiver.set_read_timeout(Some(StdDuration::from_millis(300))).unwrap();
        let mut sender = CotSender::open(&receiver.local_addr().unwrap().to_string(), plane).unwrap();
        for time_us in [0, 500_000, 999_999, 1_000_000] {
            sender.send(&Frame { time_us, uavs: vec![UavRow::default()], ..Frame::default() });
        }
        let mut datagram = [0; 2048];
        let received = core::iter::from_fn(|| receiver.recv(&mut datagram).ok()).count();
        assert_eq!(received, 2);
        let many = Frame { uavs: vec![UavRow::default(); 2000], ..Frame::default() };
        assert_eq!(events(&many, &LocalPlane::about(0.0, 0.0).unwrap(), 0).len(), EVENTS_MAX);
    }
}
