//! The example of docs/user/embedding.md as separate processes over UDP. They agree although messages are lost and processes
//! are stopped, killed and restarted.

use std::collections::BTreeMap;
use std::env::consts::EXE_SUFFIX;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio, id};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{sleep, spawn};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Time of the last change in a folder.
fn changed(folder: &Path) -> SystemTime {
    let entries = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let times =
        entries.map(|path| if path.is_dir() { changed(&path) } else { path.metadata().unwrap().modified().unwrap() });
    times.max().unwrap()
}

/// Path of the example program. `cargo test` builds examples together with the tests, but `cargo test --test udp` does
/// not. Therefore the program is built here if it is older than its sources.
static COMPANION: LazyLock<PathBuf> = LazyLock::new(|| {
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().unwrap().parent().unwrap();
    let built = profile.join("examples").join(format!("companion{EXE_SUFFIX}"));
    // Not the folder at compile time: a copied build is of another one.
    let here = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap());
    let sources = ["src", "examples"].map(|folder| changed(&here.join(folder)));
    if built.metadata().and_then(|file| file.modified()).is_ok_and(|time| sources.iter().all(|source| *source <= time))
    {
        return built;
    }
    let name = profile.file_name().unwrap().to_str().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(here).args(["build", "--quiet", "--example", "companion", "--target-dir"]);
    cargo.arg(profile.parent().unwrap()).args(["--profile", if name == "debug" { "dev" } else { name }]);
    assert!(cargo.status().unwrap().success());
    built
});

/// A line printed by a UAV, one per second.
#[derive(Debug, Clone, PartialEq)]
struct Line {
    t_s: u32,
    at: String,
    assigned_uavs_by_group: String,
    /// Digest and time of the committed team state.
    team_state: String,
    damaged: u32,
}

impl Line {
    fn of(text: &str) -> Self {
        let between = |from: &str, to: &str| {
            let rest = text.split(from).nth(1).unwrap_or_else(|| panic!("{text}"));
            rest.split(to).next().unwrap().to_owned()
        };
        Self {
            t_s: text.split(" s").next().unwrap().trim().parse().unwrap(),
            at: between("  at ", " "),
            assigned_uavs_by_group: between("assigned ", ";"),
            team_state: between("; committed ", ";"),
            damaged: between("; damaged ", ";").parse().unwrap(),
        }
    }
}

/// Digests of the printed committed team states, by time.
fn digests_by_time<'a>(lines: impl Iterator<Item = &'a Line>) -> BTreeMap<&'a str, Vec<&'a str>> {
    let mut digests = BTreeMap::<_, Vec<_>>::new();
    for (digest, time) in lines.filter_map(|line| line.team_state.split_once(" at ")) {
        digests.entry(time).or_default().push(digest);
    }
    digests
}

/// A process that is killed at the end of its test.
struct Process {
    child: Child,
    printed: Arc<Mutex<Vec<Line>>>,
}

impl Process {
    fn signal(&self, name: &str) {
        let script = format!("kill -{name} {}", self.child.id());
        assert!(Command::new("sh").args(["-c", &script]).status().unwrap().success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Team {
    start: SystemTime,
    port: u16,
    uavs: Vec<Process>,
}

/// Number of UAVs. Each loses a fifth of the messages sent to it.
const UAVS: usize = 4;

/// Mission time per time of the machine's clock.
const SPEED: u32 = 3;

impl Team {
    fn new(port: u16) -> Self {
        // Below the range of ephemeral ports.
        let is_free =
            |port: &u16| (0..UAVS as u16).all(|uav| UdpSocket::bind((Ipv4Addr::LOCALHOST, port + uav)).is_ok());
        let first = port + (id() % 500) as u16 * 8;
        let port = (0..200).map(|more| first + 8 * more).find(is_free).unwrap();
        // Build the program before the start time is set.
        LazyLock::force(&COMPANION);
        let start = SystemTime::now() + Duration::from_millis(500);
        let mut team = Self { start, port, uavs: Vec::new() };
        team.uavs = (0..UAVS).map(|uav| team.started(uav, &[])).collect();
        team
    }

    fn started(&self, uav: usize, more: &[&str]) -> Process {
        let start_us = self.start.duration_since(UNIX_EPOCH).unwrap().as_micros();
        let (team, port) = (UAVS, self.port);
        // The limited duration ends the processes even if the test is aborted.
        let options = format!(
            "--uav {uav} --team {team} --port {port} --seconds 120 --lose 20 --speed {SPEED} --start-us {start_us}"
        );
        let mut command = Command::new(&*COMPANION);
        let mut child = command.args(options.split(' ')).args(more).stdout(Stdio::piped()).spawn().unwrap();
        let (printed, lines) = (Arc::<Mutex<Vec<Line>>>::default(), BufReader::new(child.stdout.take().unwrap()));
        let output = Arc::clone(&printed);
        spawn(move || {
            lines.lines().map_while(Result::ok).for_each(|line| output.lock().unwrap().push(Line::of(&line)))
        });
        Process { child, printed }
    }

    /// Mission time.
    fn now_s(&self) -> f64 {
        self.start.elapsed().unwrap_or_default().as_secs_f64() * f64::from(SPEED)
    }

    fn printed(&self, uav: usize) -> Vec<Line> {
        self.uavs[uav].printed.lock().unwrap().clone()
    }

    /// Returns the first second from which these UAVs agree: they print the same assignments for three seconds, and
    /// from then on no two print different committed team states of the same time.
    fn agree_at(&self, uavs: &[usize], after_s: f64) -> Option<u32> {
        let printed: Vec<Vec<Line>> = uavs.iter().map(|uav| self.printed(*uav)).collect();
        let assigned_uavs_by_group = |lines: &[Line], t_s| {
            lines.iter().find(|line| line.t_s == t_s).map(|line| line.assigned_uavs_by_group.clone())
        };
        let same_assignments = |t_s: u32| {
            let first = assigned_uavs_by_group(&printed[0], t_s)
                .filter(|assigned_uavs_by_group| !assigned_uavs_by_group.is_empty());
            first.is_some() && printed.iter().all(|lines| assigned_uavs_by_group(lines, t_s) == first)
        };
        let same_states = |from: u32| {
            let since = printed.iter().flatten().filter(|line| line.t_s >= from);
            digests_by_time(since).values().all(|digests| digests.iter().all(|digest| *digest == digests[0]))
        };
        let last = printed[0].last()?.t_s;
        let seconds = (after_s.ceil() as u32)..=last.saturating_sub(2);
        seconds.into_iter().find(|from| (*from..from + 3).all(same_assignments) && same_states(*from))
    }

    /// Waits until these UAVs agree, which must happen within `within_s` after `after_s`.
    fn agree(&self, uavs: &[usize], after_s: f64, within_s: f64, case: &str) {
        while self.now_s() < after_s + within_s + 15.0 {
            sleep(Duration::from_millis(100));
            if let Some(at_s) = self.agree_at(uavs, after_s) {
                let took_s = f64::from(at_s) - after_s;
                println!("{case}: agreed after {took_s:.1} s");
                assert!(took_s <= within_s, "{case}: agreed only after {took_s:.1} s");
                return;
            }
        }
        let tails = uavs.iter().map(|uav| (uav, self.printed(*uav))).flat_map(|(uav, lines)| {
            let from = lines.len().saturating_sub(25);
            lines[from..].iter().map(|line| format!("\n{uav}: {line:?}")).collect::<Vec<_>>()
        });
        panic!("{case}: no agreement: {}", tails.collect::<String>());
    }

    fn wait_until(&self, t_s: f64) {
        sleep(Duration::from_secs_f64((t_s - self.now_s()).max(0.0) / f64::from(SPEED)));
    }

    /// Stops the process of a UAV for `for_s`. The other UAVs must agree without it, and all UAVs afterwards.
    fn stop(&self, uav: usize, for_s: f64, within_s: f64) {
        let (others, stopped_s): (Vec<usize>, f64) = ((0..UAVS).filter(|other| *other != uav).collect(), self.now_s());
        self.uavs[uav].signal("STOP");
        self.wait_until(stopped_s + for_s);
        self.agree(&others, stopped_s, for_s, "UAVs that were not stopped");
        self.uavs[uav].signal("CONT");
        self.agree(&[0, 1, 2, 3], self.now_s(), within_s, "all UAVs after the stop");
    }
}

#[test]
fn a_team_agrees_despite_a_paused_uav_a_restart_and_random_datagrams() {
    let mut team = Team::new(20_000);
    let stranger = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let send_random_datagrams = |to: &Team| {
        for (length, uav) in (0..200).zip((0..UAVS as u16).cycle()) {
            let bytes: Vec<u8> = (0..length).map(|byte| (byte * 31 + length) as u8).collect();
            stranger.send_to(&bytes, (Ipv4Addr::LOCALHOST, to.port + uav)).unwrap();
        }
    };
    team.wait_until(2.0);
    send_random_datagrams(&team);
    team.wait_until(8.0);
    team.agree(&[0, 1, 2, 3], 2.0, 10.0, "all UAVs");
    // While all UAVs are live, team states are committed continuously, and several UAVs print the same ones.
    let printed: Vec<Line> = (0..UAVS).flat_map(|uav| team.printed(uav)).collect();
    let digests = digests_by_time(printed.iter().filter(|line| line.t_s >= 4));
    assert!(digests.values().filter(|digests| digests.len() > 1).count() > 2, "{digests:?}");
    team.stop(2, 5.0, 8.0);

    // A computer fails; its aircraft flies on meanwhile.
    let before = team.printed(0);
    team.uavs.remove(0);
    team.wait_until(team.now_s() + 1.5);
    let at = &before.last().unwrap().at;
    let restarted = team.started(0, &["--restart-count", "1", "--at", at]);
    team.uavs.insert(0, restarted);
    team.agree(&[0, 1, 2, 3], team.now_s(), 10.0, "all UAVs after the restart");

    // 50 random datagrams were sent to each UAV; about a fifth was lost.
    let damaged = before.last().unwrap().damaged;
    assert!((25..=50).contains(&damaged), "{damaged}");
}

/// After a long pause the time jumps by more than an agent accepts, and the UAV recovers. Then another UAV announces
/// that it leaves, and is dropped before the teammate timeout.
#[test]
fn a_uav_recovers_from_a_long_pause_and_a_leaving_uav_is_dropped_immediately() {
    let end_s = 25;
    let mut team = Team::new(25_000);
    team.uavs.pop();
    team.uavs.push(team.started(3, &["--seconds", "25"]));
    team.agree(&[0, 1, 2, 3], 0.0, 10.0, "all UAVs");
    team.stop(0, 11.0, 10.0);

    team.wait_until(f64::from(end_s) + 3.9);
    for uav in 0..3 {
        let printed = team.printed(uav);
        let assigned_uavs_at = |t_s| &printed.iter().rfind(|line| line.t_s <= t_s).unwrap().assigned_uavs_by_group;
        assert!(
            assigned_uavs_at(end_s - 2).contains('3') && !assigned_uavs_at(end_s + 3).contains('3'),
            "{uav}: {printed:#?}"
        );
    }
}
