//! The program with its sockets, in real time, against the double of the vehicle on the loopback interface.

use std::io::Write;
use std::net::{TcpListener, UdpSocket};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::common::{flight, live, plane};
use standoff::{Duration, LinkModel, Position, UavId};
use standoff_fly::address::LinkAddress;
use standoff_fly::codec::{SigningKey, clock_stamp};
use standoff_fly::config::Config;
use standoff_fly::run::{Devices, run};
use standoff_record::Frame;

/// An address on the loopback interface that is free now.
fn free_address() -> String {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

/// Flies aircraft with the program for a time; returns for each what was seen, its double, and its status lines.
fn fly(count: u32, seconds: f64) -> Vec<(live::Seen, plane::Plane, Vec<String>)> {
    let key = || SigningKey { key: [3; 32], link_id: 191 };
    let radios: Vec<_> = (0..count).map(|_| free_address()).collect();
    let aircraft = (0..count).map(|id| {
        let (link, feed) = (free_address(), free_address());
        let others = || (0..count).filter(move |other| *other != id);
        let mut config = Config { uav: UavId(id), teammates: others().map(UavId).collect(), ..flight::config() };
        config.params.link = LinkModel::Lossy;
        let devices = Devices {
            link: LinkAddress::UdpIn(link.clone()),
            signing: Some(key()),
            time_stamps: None,
            feed: feed.clone(),
            listen: radios[id as usize].clone(),
            teammates: others().map(|other| radios[other as usize].clone()).collect(),
            sumo: None,
            cot: None,
            commanded_file: None,
        };
        let lines = Arc::new(Mutex::new(Vec::new()));
        let report = Arc::clone(&lines);
        let program = thread::spawn(move || {
            let mut report = |line: &str| report.lock().unwrap().push(line.to_owned());
            run(config, &devices, &AtomicBool::new(false), Some(Duration::from_s(seconds)), &mut report, &mut |_| {})
        });
        let vehicle = thread::spawn(move || {
            let mut vehicle = plane::Plane::new(flight::local_plane(), Some(&key()));
            vehicle.aircraft.position = Position::from_m(-400.0 + 700.0 * f64::from(id), -300.0);
            let seen = live::fly(&mut vehicle, &flight::local_plane(), &link, &feed, seconds);
            (seen, vehicle)
        });
        (program, vehicle, lines)
    });
    let aircraft: Vec<_> = aircraft.collect();
    let ended = aircraft.into_iter().map(|(program, vehicle, lines)| {
        let (seen, vehicle) = vehicle.join().unwrap();
        program.join().unwrap().unwrap();
        let lines = lines.lock().unwrap().clone();
        (seen, vehicle, lines)
    });
    ended.collect()
}

/// Flies one aircraft with the program for some seconds, and with devices and a double that are changed before; returns the
/// status lines. `disturb` may send to the link in the meantime.
fn fly_changed(
    seconds: f64,
    change: impl FnOnce(&mut Devices, &mut plane::Plane),
    disturb: impl FnOnce(&str) + Send + 'static,
) -> Vec<String> {
    let (link, feed, key) = (free_address(), free_address(), SigningKey { key: [3; 32], link_id: 191 });
    let mut devices = Devices {
        link: LinkAddress::UdpIn(link.clone()),
        signing: Some(key.clone()),
        time_stamps: None,
        feed: feed.clone(),
        listen: free_address(),
        teammates: Vec::new(),
        sumo: None,
        cot: None,
        commanded_file: None,
    };
    let mut vehicle = plane::Plane::new(flight::local_plane(), Some(&key));
    change(&mut devices, &mut vehicle);
    let to = link.clone();
    let double = thread::spawn(move || live::fly(&mut vehicle, &flight::local_plane(), &link, &feed, seconds));
    let other = thread::spawn(move || disturb(&to));
    let mut lines = Vec::new();
    let mut report = |line: &str| lines.push(line.to_owned());
    let (stop, length) = (AtomicBool::new(false), Some(Duration::from_s(seconds)));
    // The team's time begins with 2026, 1,767,225,600 s of UNIX time.
    let mut record = |frame: Frame| {
        let unix_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64();
        assert!((unix_s - 1_767_225_600.0 - 1e-6 * frame.time_us as f64).abs() < 5.0, "{}", frame.time_us);
    };
    run(flight::config(), &devices, &stop, length, &mut report, &mut record).unwrap();
    double.join().unwrap();
    other.join().unwrap();
    lines
}

/// True if one of the status lines of the first 3 s shows a heartbeat. The first line is that of the start.
fn is_heard_within_3_s(lines: &[String]) -> bool {
    lines.iter().take(4).any(|line| line.contains("age, s: heartbeat 0."))
}

/// The time stamps of a program that was killed are 3 s ahead, and the vehicle's follow what it receives. A vehicle that
/// was silent for long is behind the clock. Neither sends anything new until it hears the program.
#[test]
fn a_signed_vehicle_is_heard_within_3_s_after_the_program_was_killed() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("key.hex.link-191");
    for (vehicle_s, saved_s) in [(12, Some(15)), (-5, Some(-2)), (-100, Some(-97)), (-600, None)] {
        let stamp = |s: i64| clock_stamp().saturating_add_signed(s * 100_000);
        let _ = std::fs::remove_file(&file);
        if let Some(saved_s) = saved_s {
            // The vehicle, and this program.
            let saved = stamp(saved_s);
            std::fs::write(&file, format!("0 1 1 {saved}\n191 1 191 {saved}\n")).unwrap();
        }
        let lines = fly_changed(
            4.5,
            |devices, vehicle| (devices.time_stamps, vehicle.stamp) = (Some(file.clone()), stamp(vehicle_s)),
            |_| {},
        );
        assert!(is_heard_within_3_s(&lines), "{vehicle_s}: {lines:#?}");
    }
}

#[test]
fn heartbeats_of_a_second_vehicle_from_another_address_are_stated() {
    let lines = fly_changed(
        3.5,
        |devices, vehicle| {
            (devices.signing, *vehicle) = (None, plane::Plane::new(flight::local_plane(), None));
        },
        |link| {
            let mut other = plane::Plane::new(flight::local_plane(), None);
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            thread::sleep(std::time::Duration::from_millis(1000));
            for _ in 0..100 {
                for datagram in other.advance() {
                    socket.send_to(&datagram, link).unwrap();
                }
                thread::sleep(std::time::Duration::from_millis(20));
            }
        },
    );
    let warnings =
        lines.iter().filter(|line| line.starts_with("warning: heartbeats of system 1 arrive from 127.0.0.1:"));
    assert_eq!(warnings.count(), 1, "{lines:#?}");
}

/// The autopilot restarts: its server closes the connection, and listens again.
#[test]
fn a_tcp_connection_that_ends_is_opened_again_while_the_program_waits() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap().to_string();
    let lines = fly_changed(
        5.0,
        move |devices, _| (devices.signing, devices.link) = (None, LinkAddress::Tcp(address)),
        move |_| {
            let mut autopilot = plane::Plane::new(flight::local_plane(), None);
            for steps in [80, 150] {
                let (mut stream, _) = server.accept().unwrap();
                for _ in 0..steps {
                    autopilot.advance().iter().for_each(|frame| {
                        let _ = stream.write_all(frame);
                    });
                    thread::sleep(std::time::Duration::from_millis(20));
                }
            }
        },
    );
    // The reason is that of the system.
    let is_end =
        |line: &String| line.starts_with("warning: link to the autopilot: ") && line.ends_with("; it is opened again");
    let ended_at = lines.iter().position(is_end).unwrap_or_else(|| panic!("{lines:#?}"));
    let (before, after) = lines.split_at(ended_at);
    let is_heard = |lines: &[String]| lines.iter().any(|line| line.contains("age, s: heartbeat 0."));
    assert!(is_heard(before) && after.iter().skip(2).any(|line| is_heard(std::slice::from_ref(line))), "{lines:#?}");
}

/// On a machine that is too busy for real time, the program stops commanding; then only the last rule is checked.
#[test]
fn two_signed_aircraft_receive_heartbeats_over_udp_and_no_command_in_another_mode() {
    for (_, vehicle, lines) in fly(2, 5.0) {
        assert!(vehicle.received > 0 && lines.len() > 1, "{lines:#?}");
        // The team flies at 300 and 350 m, and the fence of the double ends at 200 m.
        let shared = "warning: --altitude and the fence make UAV 0 fly at 190 m and UAV 1 at 190 m: ";
        assert_eq!(lines.iter().filter(|line| line.starts_with(shared)).count(), 1, "{lines:#?}");
        assert_eq!(vehicle.violations, Vec::<String>::new(), "{lines:#?}");
    }
}

#[test]
#[ignore = "long: for .ci/long"]
fn two_aircraft_engage_and_the_orbit_error_and_the_latency_are_within_the_limits() {
    for (mut seen, vehicle, lines) in fly(2, 120.0) {
        assert!(lines.iter().any(|line| line.starts_with("engaged; mode GUIDED; group 0: ")), "{lines:#?}");
        seen.latencies_s.sort_by(f64::total_cmp);
        let at = |share: f64| 1e3 * seen.latencies_s[(share * (seen.latencies_s.len() - 1) as f64) as usize];
        let settled = &seen.ranges_m[seen.ranges_m.len() / 2..];
        let squares = settled.iter().map(|range_m| (range_m - 250.0) * (range_m - 250.0)).sum::<f64>();
        let rms_m = (squares / settled.len() as f64).sqrt();
        let count = seen.latencies_s.len();
        println!("{count} commands; latency, ms: median {:.2}, p99 {:.2}, max {:.2}", at(0.5), at(0.99), at(1.0));
        println!("orbit error rms {rms_m:.2} m; {}", lines.last().unwrap());
        assert!(rms_m <= 10.0 && at(0.99) <= 5.0 && vehicle.violations.is_empty());
    }
}
