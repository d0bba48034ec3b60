//! End-to-end tests with malicious or damaged files: each is refused with exit status 2 and one message that states the
//! place and the remedy, within 256 MiB of memory and 5 s of CPU time, and without leaving files behind.

use std::cell::Cell;
use std::fs::{self, File};
use std::io::Write;
use std::panic;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::LazyLock;

use crate::common::{names, standoff as standoff_unlimited};
use flate2::Compression;
use flate2::write::GzEncoder;
use standoff_io::parquet_file::panic_is_expected;
use standoff_record::{EventRow, Frame, Record, Writer};
use tempfile::TempDir;

/// Limits: virtual memory, KiB (never less than the resident memory), and CPU time, s.
const LIMITS: &str = "ulimit -v 262144; ulimit -t 5; exec \"$0\" \"$@\"";

const XML: &str = "<fcd-export>\n<timestep time=\"1\">\n<vehicle id=\"v\" x=\"3\" y=\"4\"/>\n</timestep></fcd-export>";
const CSV: &str = "t,id,x,y\n1,v,3,4\n2,v,4,4\n";

fn standoff(folder: &Path, args: &[&str]) -> Output {
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-c", LIMITS, env!("CARGO_BIN_EXE_standoff")]).args(args).output().unwrap()
}

/// Checks for one message that contains all of `expected` and is safe to print on a terminal.
#[track_caller]
fn check_refused(folder: &Path, args: &[&str], expected: &[&str]) {
    let before = names(folder);
    let output = standoff(folder, args);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {:?} {message}", output.status);
    assert!(output.stdout.is_empty(), "{args:?}");
    let line = message.strip_suffix('\n').unwrap();
    assert!(line.starts_with("error: ") && line.chars().count() <= 2000, "{args:?}: {message}");
    assert!(!line.contains(upsets), "{args:?}: {message:?}");
    for expected in expected {
        assert!(line.contains(expected), "{args:?}: {message}");
    }
    assert!(!line.contains("panicked"), "{args:?}: {message}");
    assert_eq!(names(folder), before, "{args:?} left something behind");
}

/// True for characters that a terminal may interpret as a command or as the end of a line.
fn upsets(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// Like `check_refused` for a scenario, whose messages list all errors on several lines.
#[track_caller]
fn check_scenario(bytes: &[u8], expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("f.toml"), bytes).unwrap();
    let output = standoff(folder.path(), &["run", "f.toml"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{:?} {message}", output.status);
    assert!(output.stdout.is_empty() && message.starts_with("error: "), "{message}");
    assert!(message.chars().count() <= 20_000 && !message.contains("panicked"), "{message}");
    assert!(!message.contains(|c| c != '\n' && upsets(c)), "{message:?}");
    for expected in expected {
        assert!(message.contains(expected), "{message}");
    }
    assert_eq!(names(folder.path()), ["f.toml"], "files are left behind");
}

#[test]
fn invalid_scenarios_are_refused() {
    let nested = |open: &str| format!("a = {}", open.repeat(99_000)).into_bytes();
    let targets = b"[[targets.start]]\nvx_m_s = 3\n".as_slice();
    let with = |text: &str| [text.as_bytes(), b"\n", targets].concat();
    check_scenario(b"", &["f.toml: targets: no targets; give [targets.random], [[targets.start]] or [traffic]"]);
    check_scenario(&nested("["), &["f.toml:1:85", "cannot recurse further"]);
    check_scenario(&nested("{b="), &["f.toml:1:", "cannot recurse further"]);
    check_scenario(&b"[".repeat(100_000), &["f.toml:1:"]);
    check_scenario(&vec![0; 1000], &["f.toml:1:1"]);
    check_scenario(&utf_16("duration_s = 3"), &["UTF-16 text", "save it again"]);
    check_scenario(&[b"\xff\xfe".as_slice(), &utf_16("a = 3")].concat(), &["UTF-16 text"]);
    check_scenario(&[b"\xff\xfe\0\0".as_slice(), &utf_32("a = 3")].concat(), &["UTF-32 text"]);
    check_scenario(&vec![b' '; 5 << 20], &["it has 5120 KiB; at most 2048 KiB"]);
    check_scenario(&with(&format!("about = {}", "x".repeat(2_000_000))), &["f.toml:1:9", "not a value"]);
    check_scenario(&with(&format!("{} = 3", "x".repeat(2_000_000))), &["there is no such key", "xxx..."]);
    check_scenario(&with("about = \"\u{1b}[2J\""), &["f.toml:1:10"]);
    check_scenario(&with("\"\\u001b[2J\\u202e\" = 3"), &["\\u{1b}[2J\\u{202e}: there is no such key"]);
    check_scenario(&with("[uavs]\n\"a.\\n\\u001b.b\" = 3"), &["uavs.a.\\n\\u{1b}.b: there is no such key"]);
    check_scenario(&with("[guidance]\nlaw = \"\\u001b[2J\""), &["guidance.law = \"\\u{1b}[2J\": must be"]);
    check_scenario(&with("about = \"a\\u001b[2J\""), &["about = \"a\\u{1b}[2J\": must be one line"]);
    check_scenario(
        &with("duration = 3 # \u{9b}2J\u{85}\u{2028}\u{2029}\u{202a}\u{2066}\u{feff}"),
        &["f.toml:1:1", "1 | duration = 3 # �2J������"],
    );
    check_scenario(&with("\"\u{9b}2J\u{2028}\" = 3"), &[r"\u{9b}2J\u{2028}: there is no such key", "1 | \"�2J�\" = 3"]);
    check_scenario(&with("duration_s = nan"), &["duration_s = nan: must be a finite number"]);
    check_scenario(&with("duration_s = -inf"), &["duration_s = -inf: must be a finite number"]);
    check_scenario(&with("duration_s = 1e999"), &["f.toml:1:14", "1e999: too large"]);
    check_scenario(&with("duration_s = 99999999999999999999"), &["f.toml:1:14", "99999999999999999999: too large"]);
    check_scenario(&with("duration_s = 1\nduration_s = 2"), &["f.toml:2:1", "duplicate key"]);
    check_scenario(&with(&"a = 3\r\n".repeat(50_000)), &["f.toml:1:1"]);
    check_scenario(&"[[targets.start]]\nz = 1\n".repeat(10_000).into_bytes(), &["f.toml:2:1", "targets.start.0.z"]);
    check_scenario(
        b"duration_s = 50000\n[targets.random]\ncount = 1000\nx_m = 0\ny_m = 0\nvx_m_s = 0\nvy_m_s = 0",
        &["the record could have 100001000 rows of targets; at most 100000000: choose a shorter duration_s"],
    );
    check_scenario(&with("duration_s = \"x, expected ABCD\""), &["must be a number, {"]);
    check_scenario(
        b"[traffic]\nfile = \"../\\u001bx<img onerror=1>\"",
        &["../\\u{1b}x<img onerror=1>", "No such file"],
    );
}

#[test]
fn oversized_scenarios_are_refused_within_the_same_limits() {
    let within = |unit: &str, signs: usize| unit.repeat(199_000 / signs);
    let numbered = |unit: fn(usize) -> String, signs: usize| (0..199_000 / signs).map(unit).collect::<String>();
    let at = "[[targets.start]]\nx_m = 1\ny_m = 2\nvx_m_s = 3\nvy_m_s = 4\n";
    let far = at.replace(" = ", " = 1e99 # ");
    let dotted = |n: usize| format!("a{n}{} = 1\n", ".a".repeat(70));
    for (text, expected) in [
        ("\n".repeat(2 << 20), "more than 2097152 bytes, or more than 200000 line ends and punctuation characters"),
        ("duration_s = -1\n".to_owned() + &within(at, 16), "duration_s = -1: must be at least"),
        (within(&far, 20), "there may be more: reading stops after "),
        (
            within("[[targets.start]]\nx_m = {normal={mean=nan,sd=1}}\n", 18),
            "targets.start.0.x_m: must be normal with a finite",
        ),
        (within("[[targets.start]]\nx_m = \"a\"\n", 12), "targets.start.0.x_m = \"a\": must be a number"),
        ("x = = 1\n".to_owned() + &within(at, 16), "f.toml:1:5"),
        (within("x = = 1\n", 3), "f.toml:20:5"),
        (numbered(|n| format!("k{n} = 1\n"), 2), "k0: there is no such key"),
        (numbered(|n| format!("[t{n}]\nx = 1\n"), 5), "t0: there is no such key"),
        (numbered(dotted, 212), "a0: there is no such key"),
        (format!("a = [{}]", within("1,", 1)), "a: there is no such key"),
        (format!("a{} = 1", within(".a", 3)), "recursion limit"),
        (format!("about = \"{}\"", within("\\q", 1)), "f.toml:1:"),
        (within("\r", 1), "f.toml:1:2"),
        (within("=", 1), "f.toml:1:2"),
        ("a ".repeat(1_000_000), "f.toml:1:3"),
        (format!("a = {}", "a ".repeat(1_000_000)), "not a value"),
    ] {
        check_scenario(text.as_bytes(), &[expected]);
    }
}

#[test]
fn keys_and_names_on_the_command_line_have_limits() {
    let folder = tempfile::tempdir().unwrap();
    let deep = format!("{}=1", vec!["a"; 2_000].join("."));
    let many: Vec<_> = (0..5_000).flat_map(|n| ["--set".to_owned(), format!("x{n}=1")]).collect();
    for (set, expected) in [(&["--set".to_owned(), deep][..], "is nested too deeply"), (&many, "there may be more")] {
        let args = ["run", "tour/01-one-uav"].into_iter().chain(set.iter().map(String::as_str)).collect::<Vec<_>>();
        let output = standoff(folder.path(), &args);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{:?}", output.status);
        assert!(message.contains(expected) && message.len() < 10_000, "{message}");
    }
    let output = standoff(folder.path(), &["run", "tour/01-one-uav", "--set", "duration_s=5\nperiod_s=1"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{:?}", output.status);
    assert!(message.contains("must be one line; give --set once for each value"), "{message}");
    let long = "x\u{1b}".repeat(40_000);
    for args in [["run", &long].as_slice(), &["compare", "a", &long], &["monte-carlo", "a", "--metrics", &long]] {
        check_refused(folder.path(), args, &["\"x\\u{1b}x", "an argument of 80000 bytes; at most 4096"]);
    }
    let long = "\u{1b}".repeat(4_096);
    check_refused(folder.path(), &["run", "tour/01-one-uav", "--traffic", &long], &["File name too long"]);
    check_refused(folder.path(), &["report", &long], &["File name too long"]);
    let output = standoff(folder.path(), &["run", "--seed", "\u{1b}[31m\u{202e}"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{:?}", output.status);
    assert!(message.starts_with(r#"error: --seed "\u{1b}[31m\u{202e}": must be a whole number"#), "{message:?}");
    // The name of a traffic file may contain any characters.
    fs::write(folder.path().join("y\n\u{1b}z.csv"), CSV).unwrap();
    let output = standoff(folder.path(), &["run", "--traffic", "y\n\u{1b}z.csv", "--out", "o"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn too_many_simultaneous_vehicles_are_refused() {
    let crowd = |vehicles: usize| {
        let rows = (0..vehicles).map(|n| format!("0,v{n},{},{}\n1,v{n},{},{}\n", n % 300, n / 300, n % 300, n / 300));
        "t,id,x,y\n".to_owned() + &rows.collect::<String>()
    };
    let expected = "f: more than 16384 vehicles at time = 0 s; at most 16384; select a smaller area";
    check_traffic(crowd(16_385).as_bytes(), expected);
    // The limit does not apply to vehicles that exist at different times.
    let later = (0..17_000).map(|n| format!("{n},v{n},3,4\n{n}.4,v{n},3,4\n")).collect::<String>();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("f"), "t,id,x,y\n".to_owned() + &later).unwrap();
    let args = ["run", "--traffic", "f", "--set", "duration_s=1", "--out", "o"];
    assert_eq!(standoff(folder.path(), &args).status.code(), Some(0));
}

#[track_caller]
fn check_traffic(bytes: &[u8], expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("f"), bytes).unwrap();
    check_refused(folder.path(), &["run", "--traffic", "f"], &[expected]);
}

fn gzip(head: &str, unit: &str, bytes: usize) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(head.as_bytes()).unwrap();
    let piece = unit.repeat((1 << 20) / unit.len());
    (0..bytes / piece.len()).for_each(|_| encoder.write_all(piece.as_bytes()).unwrap());
    encoder.finish().unwrap()
}

fn utf_16(text: &str) -> Vec<u8> {
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

fn utf_32(text: &str) -> Vec<u8> {
    text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect()
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn invalid_traffic_is_refused() {
    let inside =
        |vehicle: &str| format!("<fcd-export>\n<timestep time=\"1\">\n{vehicle}</timestep></fcd-export>").into_bytes();
    let vehicle = |x: &str| inside(&format!("<vehicle id=\"v\" x=\"{x}\" y=\"4\"/>\n"));
    let twice = |time: &str| {
        format!("<fcd-export><timestep time=\"1\"/>\n<timestep time=\"{time}\"/></fcd-export>").into_bytes()
    };
    for (bytes, expected) in [
        (vec![], "f: is empty; must be SUMO FCD (XML, CSV or Parquet), CSV tracks or GPX"),
        (b" \r\n ".to_vec(), "f: contains no text"),
        (b"t,id,x,y\n".to_vec(), "f: contains no vehicles; must contain at least one; was the right file chosen?"),
        (b"<fcd-export/>".to_vec(), "f: contains no vehicles"),
        (vec![0; 1000], "f:1:1: a NUL byte"),
        (b"t,id,x,y\n1,v\0,3,4\n".to_vec(), "f:2:4: a NUL byte"),
        (utf_16(XML), "f:1:1: is UTF-16 text; must be UTF-8; save"),
        (utf_16(&format!("\u{feff}{CSV}")), "f:1:1: is UTF-16 text"),
        (utf_32(&format!("\u{feff}{CSV}")), "f:1:1: is UTF-32 text; must be UTF-8; save"),
        (
            b"\x28\xb5\x2f\xfd\x24\x12\x91\0\0".to_vec(),
            "f: is compressed with zstd; must be plain text or gzip; decompress it",
        ),
        (packed(&packed(CSV.as_bytes())), "f: is compressed with gzip twice; decompress it once"),
        ([packed(CSV.as_bytes()), b"end".to_vec()].concat(), "other bytes follow the gzip data; remove them"),
        (
            b"t,id,x,y\n0,\"v,0,0\n1,\"v\",1,0\n".to_vec(),
            "f:2:3: a quote opens here and is closed at 3:3, in the middle of a field",
        ),
        (b"t,id,x,y\r0,v,0,0\r1,v,here,0\r".to_vec(), "f:3:5: vehicle \"v\": x = \"here\" is not a number"),
        (b"t,id,x,y\n1,\xff,3,4\n".to_vec(), "f:2:3: not text; must be UTF-8"),
        (XML.as_bytes()[..60].to_vec(), "f:3:1: not well-formed XML"),
        (
            vehicle("nan"),
            r#"f:3:17: vehicle "v": x = "nan" is not finite; -100000000 to 100000000 m, or degrees; remove"#,
        ),
        (vehicle("1e999"), r#"x = "1e999" is not finite"#),
        (vehicle("-inf"), r#"x = "-inf" is not finite"#),
        (vehicle("1e9"), r#"f:3:17: vehicle "v": x = "1e9" is out of range"#),
        (inside("<vehicle id=\"v\" x=\"1\" x=\"2\" y=\"3\"/>"), "f:3:1: not well-formed XML"),
        (vehicle("1"), "f: its x and y may be metres or degrees: SUMO's header comment is missing"),
        (
            inside("<vehcle id=\"v\" x=\"1\" y=\"4\"/>"),
            "f:3:1: element = \"vehcle\" would be ignored; did you mean vehicle?",
        ),
        (b"t;id;x;y\n0;v;1,5;0\n1;v;2.5;0\n".to_vec(), "f:3:5: vehicle \"v\": x = \"2.5\" has a decimal point, others"),
        (twice("1"), "f:2:11: time = 1 s is not after the previous time step (1 s); must increase"),
        (twice("0.5"), "f:2:11: time = 0.5 s is not after"),
        (b"t,id,x,y\n2,v,0,0\n1,v,0,0\n".to_vec(), "f:3:1: vehicle \"v\": time = 1 s comes after 2 s"),
        (b"t,id,x,x,y\n0,v,0,0,0\n".to_vec(), "f:1:8: column \"x\" occurs twice"),
        (b"t,id,x,lat\n0,v,0,0\n".to_vec(), "f:1:1: no column for both coordinates"),
        (b"t,id,x,y\n0,v,11.3,44.5\n1,v,685000,4930000\n".to_vec(), "degrees and metres"),
        (
            inside("<vehicle id=\"\u{1b}]0;x\u{7}\u{202e}\" x=\"?\" y=\"1\"/>"),
            r#"vehicle "\u{1b}]0;x\u{7}\u{202e}": x = "?""#,
        ),
        (
            inside(&format!("<vehicle id=\"{}\" x=\"1\" y=\"1\"/>", "n".repeat(10_000))),
            "has 10000 characters; 1 to 200",
        ),
        (format!("t,id,x,y\n0,{},0,0", "n".repeat(10_000)).into_bytes(), "f:2:3: id = "),
    ] {
        check_traffic(&bytes, expected);
    }
}

#[test]
fn oversized_traffic_is_refused() {
    let attribute = format!("<fcd-export>\n<timestep time=\"{}\"/></fcd-export>", "1".repeat(5_000_000));
    for (bytes, expected) in [
        (attribute.as_bytes().to_vec(), "f:2:1: one XML element or CSV row is too long; at most 1 MiB"),
        (format!("<fcd-export>{}", "<a>".repeat(100_000)).into_bytes(), "nested too deeply; at most 50"),
        (format!("<fcd-export {}/>", "a=\"\" ".repeat(150_000)).into_bytes(), "contains no vehicles"),
        (format!("{CSV}{}", "x".repeat(5_000_000)).into_bytes(), "f:4:1: one XML element or CSV row is too long"),
        (format!("t,id,x,y{}\n", ",".repeat(900_000)).into_bytes(), "f: contains no vehicles"),
        (format!("t,id,x,y\n{}\n", ",".repeat(900_000)).into_bytes(), "f:2:1: fields = 900001; must be 4"),
        (" ".repeat(5_000_000).into_bytes(), "f:1:1: more than 1 MiB of blanks in one place; at most 1 MiB"),
        (
            format!("{CSV}3,\"v,5,4\n{}", "4,w,5,4\n".repeat(500_000)).into_bytes(),
            "f:4:3: a quote opens here and is not closed; quotes must enclose a whole field; close it",
        ),
        (format!("{CSV}{}", "\n".repeat(5_000_000)).into_bytes(), "f:4:1: more than 1 MiB of blanks"),
        (("\u{1b}".repeat(60) + ",").repeat(3000).into_bytes(), "f:1:1: no column for the time; found"),
        (
            format!("t,id,x,y\r{}", (0..100_000).map(|n| format!("{},v,{n},0\r", n % 99_999)).collect::<String>())
                .into_bytes(),
            "f:100001:1: vehicle \"v\": time = 0 s comes after 99998 s",
        ),
    ] {
        check_traffic(&bytes, expected);
    }
}

#[test]
fn traffic_of_years_is_flown_only_with_an_explicit_duration() {
    let years = "t,id,x,y\n0,v,0,0\n1e9,v,1,0\n";
    check_traffic(
        years.as_bytes(),
        "f: spans 1000000000 s; its times are 0 s to 1000000000 s, with 11574 days between vehicle \"v\" at 0 s",
    );
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("f"), years).unwrap();
    let output = standoff(folder.path(), &["run", "improved/figure-9", "--traffic", "f", "--out", "o"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{message}");
    let warning = "warning: the traffic lasts 1000000000 s, but duration_s = 100: the rest is not flown";
    assert!(message.contains(warning), "{message}");
}

#[test]
fn gzip_bombs_are_refused() {
    for (head, unit, expected) in [
        ("", "\0", "f:1:1: a NUL byte"),
        ("", " ", "f:1:1: more than 1 MiB of blanks"),
        ("<fcd-export>\n<!--", "x", "f:2:1: one XML element or CSV row is too long"),
        ("<fcd-export>\n<a b=\"", "x", "f:2:1: one XML element or CSV row is too long"),
        ("<fcd-export>\n", "<a>", "nested too deeply"),
        (CSV, "x", "f:4:1: one XML element or CSV row is too long"),
    ] {
        check_traffic(&gzip(head, unit, 100 << 20), expected);
    }
}

#[test]
fn truncated_gzip_files_are_refused() {
    let whole = gzip(CSV, "#\n", 1 << 20);
    for length in [2, 10, 18, whole.len() / 2, whole.len() - 1] {
        check_traffic(&whole[..length], "the gzip data end too early; the file is cut off");
    }
}

/// The files are sparse, so that they need no disk space.
#[test]
fn huge_files_are_refused_by_their_size() {
    let folder = tempfile::tempdir().unwrap();
    for (name, head) in [("f.xml", XML), ("f.gz", "\u{1f}\u{8b}"), ("f.csv", CSV)] {
        let mut file = File::create(folder.path().join(name)).unwrap();
        file.write_all(head.as_bytes()).unwrap();
        file.set_len(1_000_000_000).unwrap();
        let expected = format!("{name}: cannot be read: it has 954 MiB; at most 512 MiB");
        check_refused(folder.path(), &["run", "--traffic", name], &[&expected]);
    }
}

#[test]
fn pipes_devices_and_folders_are_refused_without_waiting() {
    let folder = tempfile::tempdir().unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    for name in ["pipe", "/dev/zero", "/dev/full"] {
        check_refused(folder.path(), &["run", "--traffic", name], &[name, "it is a pipe or a device, not a file"]);
    }
    check_refused(folder.path(), &["run", "--traffic", "."], &["it is a folder, not a file"]);
}

/// A traffic file can be well-formed but contain malicious names: it is flown, and the terminal output is safe.
#[test]
fn malicious_vehicle_names_are_printed_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let name = "../x<img onerror=alert(1)>\u{1b}[2J\u{9b}2J\u{2028}\u{2029}\u{202e}\u{2066}\u{feff}";
    let mut csv = "t,id,x,y\n".to_owned();
    (0..20).for_each(|second| csv += &format!("{second},{name},{},0\n", 10 * second));
    fs::write(folder.path().join("f.csv"), csv).unwrap();
    let output = standoff_unlimited(folder.path(), &["run", "--traffic", "f.csv", "--uavs", "1", "--out", "o"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert!(!printed.contains(|c| c != '\n' && upsets(c)), "{printed:?}");
    assert_eq!(names(folder.path()), ["f.csv", "o"]);
}

/// A folder with a valid record, `run`, and the valid results of a batch, `batch`.
static GOOD: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    for args in [
        &["run", "tour/01-one-uav", "--out", "run"][..],
        &["monte-carlo", "tour/01-one-uav", "--runs", "3", "--out", "batch"],
    ] {
        assert!(standoff_unlimited(folder.path(), args).status.success());
    }
    folder
});

/// Returns a folder with a copy of the record or the batch, modified by `change`.
fn damaged(which: &str, change: impl FnOnce(&Path)) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join(which);
    fs::create_dir(&copy).unwrap();
    for name in names(&GOOD.path().join(which)) {
        fs::copy(GOOD.path().join(which).join(&name), copy.join(&name)).unwrap();
    }
    change(&copy);
    folder
}

#[track_caller]
fn check_record(name: &str, bytes: &[u8], expected: &str) {
    let folder = damaged("run", |run| fs::write(run.join(name), bytes).unwrap());
    check_refused(folder.path(), &["report", "run"], &[&format!("run/{name}"), expected]);
}

#[test]
fn invalid_manifests_are_refused() {
    let good = fs::read_to_string(GOOD.path().join("run/run.json")).unwrap();
    let with = |old: &str, new: &str| good.replacen(old, new, 1).into_bytes();
    for (bytes, expected) in [
        (vec![], "EOF while parsing a value at line 1 column 0"),
        (b"[".repeat(100_000), "it has 98 KiB; at most 64 KiB"),
        (b"[".repeat(10_000), "damaged"),
        (b"{\"format\":".repeat(5_000), "damaged"),
        (vec![0; 100], "damaged"),
        (utf_16(&good), "damaged: key must be a string at line 1 column 2"),
        (with("\"seed\": 1", "\"seed\": 1e400"), "out of range at line"),
        (with("\"seed\": 1", "\"seed\": -1"), "invalid value"),
        (with("\"seed\": 1", "\"seed\": \"\\u001b[2J\""), "invalid type"),
        (with("\"seed\": 1", "\"\\u001b[2J\": 1"), "unknown field"),
        (with("\"duration_s\": ", "\"duration_s\": -"), "is out of range; must be 0e0 to 1e9"),
        (with("\"format\": 7", "\"format\": 99"), "has record format 99"),
        (with("\"time_steps\": ", "\"time_steps\": -"), "invalid value"),
        (vec![b' '; 100_000], "it has 98 KiB; at most 64 KiB"),
        (with("\"seed\": 1", "\"seed\": 1,\n  \"seed\": 1"), "duplicate field `seed` at line 6 column 8"),
        (with("\"scenario\": \"", &format!("\"scenario\": \"{}", "x".repeat(60_000))), "at most 1000"),
        (with("\"version\": \"", &format!("\"version\": \"{}", "\\u001b".repeat(200))), "at most 100"),
    ] {
        check_record("run.json", &bytes, expected);
    }
}

thread_local! {
    static PANICKED: Cell<bool> = const { Cell::new(false) };
}

/// The Parquet library panics on some damaged files. The test flips bits of a valid file until it does.
#[test]
fn a_panic_of_the_parquet_library_is_reported_as_damage_and_prints_nothing() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |what| if panic_is_expected() { PANICKED.set(true) } else { print(what) }));
    let good = fs::read(GOOD.path().join("run/targets.parquet")).unwrap();
    let folder = damaged("run", |_| ());
    let run = folder.path().join("run");
    let changes = (0..good.len()).rev().flat_map(|at| (0..8).map(move |bit| (at, 1 << bit)));
    let panics = changes.map(|(at, bit)| [&good[..at], &[good[at] ^ bit], &good[at + 1..]].concat()).find(|bytes| {
        fs::write(run.join("targets.parquet"), bytes).unwrap();
        Record::open(&run).is_err() && PANICKED.get()
    });
    assert!(panics.is_some(), "no bit flip makes the library panic: the panic hook may be obsolete");
    check_refused(folder.path(), &["report", "run"], &["run/targets.parquet", "its bytes cannot be decoded"]);
}

/// A flipped bit gives an error, or changes a value if it is in the data.
#[test]
fn a_flipped_bit_in_a_table_never_crashes_the_command() {
    let mut refused = 0;
    for name in ["uavs.parquet", "targets.parquet"] {
        let good = fs::read(GOOD.path().join("run").join(name)).unwrap();
        for part in 0..16 {
            let mut bytes = good.clone();
            bytes[good.len() * part / 16] ^= 1 << (part % 8);
            let folder = damaged("run", |run| fs::write(run.join(name), bytes).unwrap());
            let output = standoff_unlimited(folder.path(), &["report", "run"]);
            let message = String::from_utf8(output.stderr).unwrap();
            match output.status.code() {
                Some(0) => {}
                Some(2) => assert!(message.starts_with("error: run/") && message.contains(".parquet"), "{message}"),
                other => panic!("{name}, part {part}: {other:?}: {message}"),
            }
            refused += usize::from(!output.status.success());
        }
    }
    assert!(refused > 8, "only {refused} of 32 damaged tables were refused");
}

#[test]
fn damaged_tables_are_refused() {
    let tracks = fs::read(GOOD.path().join("run/tracks.parquet")).unwrap();
    let uavs = fs::read(GOOD.path().join("run/uavs.parquet")).unwrap();
    for length in [0, 3, 100, tracks.len() / 2, tracks.len() - 1] {
        check_record("tracks.parquet", &tracks[..length], "damaged");
    }
    check_record("tracks.parquet", &uavs, "column target is missing");
    check_record("events.parquet", &vec![b'x'; 100_000], "damaged: Invalid Parquet file");
    let mut long_footer = tracks.clone();
    let at = long_footer.len() - 8;
    long_footer[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    check_record("tracks.parquet", &long_footer, "damaged: Parquet file too small");
    for (bytes, expected) in [(1_000_000_000, "damaged: Invalid Parquet file"), (33 << 30, "at most 32768 MiB")] {
        let folder = damaged("run", |run| File::create(run.join("uavs.parquet")).unwrap().set_len(bytes).unwrap());
        check_refused(folder.path(), &["report", "run"], &["run/uavs.parquet", expected]);
    }
}

/// A table that another program has rewritten is not damaged, so the message must not advise copying it again.
#[test]
fn unsupported_table_formats_are_refused_with_advice() {
    // In the table's metadata: the name of a column and its codec, Snappy (1).
    let advice =
        "save it again with the types that it had, plain or dictionary encoding, and compressed by snappy or not";
    let name = b"\x19\x18\x03uav\x15\x02";
    let uavs = fs::read(GOOD.path().join("run/uavs.parquet")).unwrap();
    let at = uavs.windows(name.len()).rposition(|bytes| bytes == name).unwrap();
    for (codec, codec_name) in [(2, "gzip"), (4, "brotli"), (5, "lz4"), (6, "zstd"), (7, "lz4")] {
        let mut table = uavs.clone();
        table[at + name.len() - 1] = 2 * codec;
        check_record("uavs.parquet", &table, &format!("cannot be read: its compression is {codec_name}; {advice}"));
    }
}

#[test]
fn truncated_files_and_files_of_another_run_are_refused() {
    let other = tempfile::tempdir().unwrap();
    let flight = ["run", "tour/02-two-uavs", "--set", "duration_s=150", "--out", "run"];
    assert!(standoff_unlimited(other.path(), &flight).status.success());
    let files = ["run.json", "scenario.toml", "uavs.parquet", "tracks.parquet", "groups.parquet", "truth.parquet"];
    for name in files {
        let bytes = fs::read(other.path().join("run").join(name)).unwrap();
        let folder = damaged("run", |run| fs::write(run.join(name), &bytes).unwrap());
        // If two files contradict each other, the message names both.
        let expected = if name == "run.json" { "but run.json contains 3".to_owned() } else { format!("run/{name}") };
        check_refused(folder.path(), &["report", "run"], &[&expected]);
        if name.ends_with("parquet") {
            let good = fs::read(GOOD.path().join("run").join(name)).unwrap();
            (0..20).for_each(|part| check_record(name, &good[..good.len() * part / 20], "damaged"));
        }
    }
}

#[test]
fn terminal_control_sequences_in_names_are_printed_escaped() {
    let name = "\\u001b[2J\\n\\u202e".to_owned() + &"x".repeat(900);
    let folder = damaged("run", |run| {
        let text = fs::read_to_string(run.join("run.json")).unwrap();
        fs::write(run.join("run.json"), text.replace("tour/01-one-uav", &name)).unwrap();
    });
    let output = standoff(folder.path(), &["report", "run"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8(output.stdout).unwrap();
    let first = printed.lines().next().unwrap();
    assert!(first.starts_with("\\u{1b}[2J\\n\\u{202e}xxx") && first.contains("xxx..., seed 1: 1 UAV"), "{first}");
    assert!(first.len() < 300, "{first}");
}

/// A record without rows has nothing to report; the message names the table of UAVs.
#[test]
fn tables_without_rows_are_refused() {
    let empty = tempfile::tempdir().unwrap();
    let path = empty.path().join("empty");
    let record = Record::open(&GOOD.path().join("run")).unwrap();
    let names = record.target_names();
    Writer::create(&path, record.manifest(), record.scenario_toml(), names).unwrap().finish().unwrap();
    check_refused(empty.path(), &["report", "empty"], &["empty/uavs.parquet is damaged: it has no rows"]);
    check_refused(empty.path(), &["view", "empty"], &["empty/uavs.parquet is damaged: it has no rows"]);
    let uavs = fs::read(path.join("uavs.parquet")).unwrap();
    check_record("uavs.parquet", &uavs, "it has 0 rows, but run.json contains");
}

/// Identical rows take very little space in a file.
#[test]
fn of_very_many_events_the_first_are_listed_and_all_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let record = Record::open(&GOOD.path().join("run")).unwrap();
    let path = folder.path().join("run");
    let mut writer = Writer::create(&path, record.manifest(), record.scenario_toml(), record.target_names()).unwrap();
    let event = EventRow {
        kind: "lost".to_owned(),
        target: Some(0),
        uavs: (0..50).collect(),
        reason: "\u{1b}".repeat(1000),
        ..EventRow::default()
    };
    for frame in record.frames().unwrap().take(20) {
        let frame = Frame { events: vec![event.clone(); 20_000], ..frame.unwrap() };
        writer.frame(&frame).unwrap();
    }
    writer.finish().unwrap();
    let bytes: u64 = fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < 200_000, "{bytes}");
    let output = standoff(folder.path(), &["report", "run"]);
    assert!(output.status.success(), "{:?}", output.status);
    // The limit is 8 MiB; each event takes 1,812 bytes.
    let notes = String::from_utf8(output.stderr).unwrap();
    assert_eq!(notes, "note: the run has many events: 395371 of them are in events.parquet only\n");
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(printed.contains("\n  all: 400000 lost\n") && printed.contains("395371 later events"), "{printed}");
    let summary = fs::read(path.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert_eq!((summary["events"].as_array().unwrap().len(), &summary["events_left_out"]), (4629, &395_371.into()));
}

#[test]
fn pipes_and_huge_files_in_a_record_are_refused() {
    for name in ["run.json", "scenario.toml", "uavs.parquet", "targets.parquet"] {
        let folder = damaged("run", |run| {
            fs::remove_file(run.join(name)).unwrap();
            assert!(Command::new("mkfifo").arg(run.join(name)).status().unwrap().success());
        });
        check_refused(folder.path(), &["report", "run"], &[name, "it is a pipe or a device, not a file"]);
    }
    for name in ["run.json", "scenario.toml"] {
        let folder = damaged("run", |run| File::create(run.join(name)).unwrap().set_len(1_000_000_000).unwrap());
        check_refused(folder.path(), &["report", "run"], &[name, "it has 954 MiB; at most"]);
    }
}

#[test]
fn damaged_batch_results_are_refused() {
    let good = fs::read_to_string(GOOD.path().join("batch/monte-carlo.json")).unwrap();
    let with = |old: &str, new: &str| good.replacen(old, new, 1).into_bytes();
    for (name, bytes, expected) in [
        ("monte-carlo.json", vec![], "EOF"),
        ("monte-carlo.json", b"[".repeat(100_000), "damaged"),
        ("monte-carlo.json", with("\"runs\": 3", "\"runs\": 18446744073709551615"), "the last seed must be at most"),
        ("monte-carlo.json", with("\"runs\": 3", "\"runs\": 1000000000000"), "too many"),
        ("monte-carlo.json", with("\"runs\": 3", "\"runs\": 3, \"shard\": {\"index\": 0, \"of\": 0}"), "must be I/N"),
        ("monte-carlo.json", with("\"metrics\": [", "\"metrics\": [\"\\u001b[2J\","), "must be lowercase letters"),
        ("monte-carlo.json", with("\"format\": 2", "\"format\": 99"), "has format 99"),
        ("runs.parquet", vec![b'x'; 1000], "it was changed since it was written"),
    ] {
        let folder = damaged("batch", |batch| fs::write(batch.join(name), bytes).unwrap());
        check_refused(folder.path(), &["compare", "batch", "batch"], &[&format!("batch/{name}"), expected]);
    }
    for name in ["monte-carlo.json", "runs.parquet"] {
        let folder = damaged("batch", |batch| File::create(batch.join(name)).unwrap().set_len(1_000_000_000).unwrap());
        check_refused(folder.path(), &["compare", "batch", "batch"], &[name]);
    }
}

#[test]
fn damaged_journals_are_refused_and_not_modified() {
    let again = ["monte-carlo", "tour/01-one-uav", "--runs", "3", "--out", "batch"];
    let preamble = |length: u32| {
        let mut head = b"standoff journal".to_vec();
        head.extend(length.to_le_bytes());
        head.extend([0; 4]);
        head
    };
    for bytes in [vec![b'x'; 1000], vec![0; 100], [preamble(u32::MAX), vec![0; 100]].concat()] {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("batch")).unwrap();
        let journal = folder.path().join("batch/monte-carlo.journal");
        fs::write(&journal, &bytes).unwrap();
        check_refused(folder.path(), &again, &["batch/monte-carlo.journal is damaged", "remove it"]);
        assert_eq!(fs::read(&journal).unwrap(), bytes);
    }
}
