//! Fuzz targets: traffic files as FCD XML, CSV and gzip.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

use crate::fuzz_harness::{Choices, corpus, refused, run};
use crate::traffic::{Coordinates, Options, Persons, read_from};

const XML: [&str; 43] = [
    "<fcd-export>",
    "</fcd-export>",
    "<timestep time=\"",
    "</timestep>",
    "<vehicle id=\"",
    "\"/>",
    "/>",
    "<a>",
    "</a>",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?xml version=\"1.0\"?>",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "&b;",
    "&amp;",
    "&#x10ffff;",
    "time",
    "vehicle",
    "timestep",
    "id",
    "x",
    "y",
    "speed",
    "angle",
    " x=\"1\"",
    "person",
    "<fcd-output.geo value=\"true\"/>",
    "<fcd-output value=\"a\"/>",
    "vehcle",
    "timesteps",
    "<timestep time=\"9\"><vehicle id=\"v\" x=\"1\" y=\"2\"/></timestep>",
    "<gpx>",
    "<trk>",
    "</trk>",
    "<name>",
    "</name>",
    "<trkpt lat=\"44\" lon=\"9\">",
    "</trkpt>",
    "<time>2026-03-01T12:00:00Z</time>",
    "<trkpt lat=\"0\" lon=\"0\"/>",
    "<kml>",
];

const CSV: [&str; 39] = [
    ",",
    ",,",
    "\n",
    "\"",
    "\"\"",
    "\r",
    "\r\n",
    "# c\n",
    "t_s",
    "time",
    "vehicle",
    "id",
    "x",
    "y",
    "x_m",
    "y_m",
    "lat",
    "lon",
    "latitude",
    "longitude",
    "speed",
    "0,v,1,2\n",
    "5,w,1,2\n",
    ";",
    "timestamp",
    "time_ms",
    "2026-03-01T12:00:01Z",
    "2026-03-01 12:00:01.5",
    "9999-12-31T23:59:60+14:00",
    "+01:00",
    "1,5",
    "sep=;\n",
    "\t",
    "|",
    "null",
    "frame",
    "vehicle_type",
    "DEFAULT_PEDTYPE",
    "xCenter",
];

fn options(choices: &mut Choices<'_>) -> Options {
    let coordinates =
        *choices.one_of(&[Coordinates::Auto, Coordinates::Auto, Coordinates::Metres, Coordinates::Degrees]);
    Options {
        coordinates,
        gap_s: *choices.one_of(&[None, None, Some(1.0), Some(1e300)]),
        persons: *choices.one_of(&[Persons::Ignored, Persons::Included]),
        frame_rate_hz: *choices.one_of(&[None, Some(10.0)]),
        origin: None,
    }
}

/// Reads a traffic file; returns whether it was accepted.
fn try_one(bytes: &[u8], options: &Options) -> bool {
    let traffic = match read_from(bytes, "file\u{1b}", options) {
        Ok(traffic) => traffic,
        Err(error) => return refused(&error),
    };
    assert!(!traffic.vehicles.is_empty() && traffic.begin_us <= traffic.end_us);
    for vehicle in &traffic.vehicles {
        assert!((1..=200).contains(&vehicle.name().chars().count()));
        let (first, last) = (vehicle.first_us(), vehicle.last_us());
        assert!(
            traffic.begin_us <= first && first <= last && last <= traffic.end_us && last.abs() <= 9_000_000_000_000_000
        );
        for state in [first, first + 1, first + (last - first) / 2, last].iter().filter_map(|&time| vehicle.at(time)) {
            assert!(state.x_m.abs() <= 1e8 && state.y_m.abs() <= 1e8, "{state:?}");
            // The limit applies to each axis; the factor allows for rounding of a float.
            assert!(state.vx_m_s.abs() <= 1.0001e4 && state.vy_m_s.abs() <= 1.0001e4, "{state:?}");
        }
    }
    true
}

#[test]
fn any_fcd_xml_is_read_or_refused() {
    let files = corpus("fcd");
    for file in &files {
        try_one(file, &Options::default());
    }
    run("FCD XML", 0.1, |choices| {
        let options = options(choices);
        try_one(&choices.mutated(&files, &XML), &options)
    });
}

#[test]
fn any_csv_is_read_or_refused() {
    let files = corpus("csv");
    for file in &files {
        try_one(file, &Options::default());
    }
    run("CSV", 0.1, |choices| {
        let options = options(choices);
        try_one(&choices.mutated(&files, &CSV), &options)
    });
}

#[test]
fn any_gzip_is_read_or_refused() {
    let files = [corpus("fcd"), corpus("csv")].concat();
    let packed = |text: &Vec<u8>| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    };
    let packed: Vec<Vec<u8>> = files.iter().map(packed).collect();
    run("gzip", 0.05, |choices| {
        let mut bytes = choices.one_of(&packed).clone();
        if choices.below(4) == 0 {
            bytes.extend(choices.one_of(&packed));
        }
        try_one(&choices.damaged(bytes), &Options::default())
    });
}
