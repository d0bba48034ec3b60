//! Reads SUMO nets and polygons.

use std::collections::BTreeMap;

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::net_projection::{FURTHEST_M, Location};
use standoff_io::text_source::xml::{Elements, Found, attributes, walk};
use standoff_io::text_source::{Fault, Position, Text};

use crate::feature_class::Kind;
use crate::geometry::{Count, Form, Point, Shapes};
use crate::limits::MAX_SHAPES;
use crate::projection::Read;

/// Default width of a lane, m, as in SUMO.
const LANE_M: f64 = 3.2;
/// Maximum plausible width of a lane, m.
const LANE_MAX_M: f64 = 100.0;
/// Speed limit above which an edge is a major road, m/s; the usual limit in towns is 50 km/h (13.9 m/s).
const MAJOR_M_S: f64 = 16.0;
/// Functions of edges that are connections in junctions, not roads.
const JUNCTION_FUNCTIONS: [&str; 3] = ["internal", "crossing", "walkingarea"];
/// Vehicle classes on rails.
const ON_RAILS: [&str; 7] = ["rail", "rail_urban", "rail_electric", "rail_fast", "tram", "subway", "cable_car"];
/// Vehicle classes on paths.
const ON_PATHS: [&str; 4] = ["pedestrian", "bicycle", "wheelchair", "scooter"];
/// Root elements of files with polygons.
const POLYGON_ROOTS: [&str; 3] = ["additional", "polygons", "shapes"];

pub(crate) fn read(text: Text<'_>, before: Count) -> Result<Read, Fault> {
    let mut file = File { shapes: Shapes::after(before), ..File::default() };
    walk(text, &mut file)?;
    file.end_edge()?;
    if file.shapes.all.is_empty() && file.shapes.in_degrees.is_empty() {
        return Err(Fault::whole(
            "contains neither edges nor polygons; must be a SUMO net or SUMO polygons".to_owned(),
        ));
    }
    if let (true, None) = (file.is_net, &file.location) {
        let message =
            "contains no <location>, which defines the frame of a SUMO net; make the net again with netconvert";
        return Err(Fault::whole(message.to_owned()));
    }
    Ok(Read {
        shapes: file.shapes,
        location: file.location,
        is_net: file.is_net,
        is_of_openstreetmap: file.is_of_openstreetmap,
    })
}

/// Shapes and counts read from the file so far.
#[derive(Default)]
struct File {
    in_root: bool,
    is_net: bool,
    location: Option<Location>,
    shapes: Shapes,
    is_of_openstreetmap: bool,
    edge: Option<Edge>,
    /// Lanes of roads, by id.
    lanes: BTreeMap<Box<str>, Kind>,
}

/// Edge whose lanes are being read.
struct Edge {
    start: Position,
    kind: Option<Kind>,
    name: Option<String>,
    lanes: Vec<Lane>,
    /// Total of all its lanes.
    points: usize,
}

struct Lane {
    kind: Kind,
    width_m: f64,
    line: Vec<Point>,
}

impl Elements for File {
    fn comment(&mut self, text: &str) {
        // Netconvert and polyconvert write their arguments into a comment.
        self.is_of_openstreetmap |= text.contains("osm-files") || text.contains("OpenStreetMap");
    }

    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        let name = element.name().into_inner();
        match (depth, name) {
            (0, _) if !self.in_root => self.root(name, start),
            (1, "location") => self.place(element, start),
            (1, "type") => {
                let [id] = attributes(element, start, ["id"])?;
                // Type names of SUMO's OpenStreetMap import.
                self.is_of_openstreetmap |= id.is_some_and(|id| id.text.starts_with("highway."));
                Ok(())
            }
            (1, "edge") => self.begin_edge(element, start),
            (2, "lane") => self.lane(element, start),
            (1, "junction") => self.junction(element, start),
            (1, "poly") => self.polygon(element, start),
            _ => Ok(()),
        }
    }
}

impl File {
    fn root(&mut self, name: &str, start: Position) -> Result<(), Fault> {
        self.in_root = true;
        self.is_net = name == "net";
        let help = match name {
            "net" => return Ok(()),
            _ if POLYGON_ROOTS.contains(&name) => return Ok(()),
            "fcd-export" => "this is traffic: use it with --traffic, and give --map the net that it was made on",
            "routes" | "trips" => "these are trips: give --map the net that they are for",
            "osm" => "this is OpenStreetMap XML: convert it to a net with netconvert --osm-files, or to GeoJSON",
            "kml" => "this is KML: convert it to GeoJSON, with ogr2ogr -f GeoJSON NEW.geojson FILE",
            "gpx" => "these are tracks: use them with --traffic",
            _ => "make a net with SUMO's netconvert",
        };
        let message = format!("element = {}; the root element must be net or additional; {help}", quoted(name));
        Err(Fault::at(start, message))
    }

    fn place(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        let location = Location::of(element, start)?;
        self.location.get_or_insert(location);
        Ok(())
    }

    fn begin_edge(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        self.end_edge()?;
        let [function, kind, name] = attributes(element, start, ["function", "type", "name"])?;
        let is_within = function.is_some_and(|function| JUNCTION_FUNCTIONS.contains(&function.text.as_ref()));
        let kind = kind.and_then(|kind| Kind::of_type(&kind.text));
        let name = name.map(|name| name.text.into_owned());
        self.edge = (!is_within).then(|| Edge { start, kind, name, lanes: Vec::new(), points: 0 });
        Ok(())
    }

    fn lane(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        let Some(edge) = &mut self.edge else { return Ok(()) };
        let keys = ["id", "shape", "width", "speed", "allow", "disallow"];
        let [id, shape, width, speed, allow, disallow] = attributes(element, start, keys)?;
        let number = |found: Option<Found<'_>>| found.and_then(|found| found.text.trim().parse::<f64>().ok());
        let speed_m_s = number(speed).filter(|speed| speed.is_finite()).unwrap_or_default();
        let words = |found: &Option<Found<'_>>| found.as_ref().map(|found| found.text.to_string()).unwrap_or_default();
        let (allow, disallow) = (words(&allow), words(&disallow));
        let all_in = |known: &[&str]| {
            !allow.is_empty() && allow.split_whitespace().all(|vehicle_class| known.contains(&vehicle_class))
        };
        let kind = if disallow == "all" || all_in(&["ship"]) {
            return Ok(());
        } else if all_in(&ON_RAILS) {
            Kind::Rail
        } else if all_in(&ON_PATHS) {
            Kind::Path
        } else {
            edge.kind.unwrap_or(if speed_m_s > MAJOR_M_S { Kind::Major } else { Kind::Minor })
        };
        let Some(shape) = shape else {
            let message = "lane: shape is missing; must be an attribute; make the net again with netconvert";
            return Err(Fault::at(start, message.to_owned()));
        };
        let line = shape.read(points)?;
        // Lanes are in memory until the edge ends.
        edge.points += line.len();
        let counted = self.shapes.count.with(edge.lanes.len() + 1, edge.points);
        counted.map_err(|message| Fault::at(start, message))?;
        let width_m = number(width).filter(|width| (0.1..=LANE_MAX_M).contains(width)).unwrap_or(LANE_M);
        if let (Some(id), Kind::Minor | Kind::Major) = (id, kind) {
            self.lanes.insert(id.text.into(), kind);
            if self.lanes.len() > MAX_SHAPES {
                let message = format!("has more than {MAX_SHAPES} lanes; crop the map to the area of the vehicles");
                return Err(Fault::at(start, message));
            }
        }
        edge.lanes.push(Lane { kind, width_m, line });
        Ok(())
    }

    /// Adds an edge as one line in the middle of its lanes, excluding the pavements.
    fn end_edge(&mut self) -> Result<(), Fault> {
        let Some(Edge { start, lanes, name, .. }) = self.edge.take() else { return Ok(()) };
        let Some(kind) = lanes.iter().map(|lane| lane.kind).max() else { return Ok(()) };
        let mut lanes: Vec<Lane> = lanes.into_iter().filter(|lane| lane.kind == kind).collect();
        let width_m: f64 = lanes.iter().map(|lane| lane.width_m).sum();
        let is_even = lanes.iter().all(|lane| lane.line.len() == lanes[0].line.len());
        if is_even && let [first, .., last] = &lanes[..] {
            let middle = |(a, b): (&Point, &Point)| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
            let line = first.line.iter().zip(&last.line).map(middle).collect();
            lanes = vec![Lane { kind, width_m, line }];
        }
        for lane in lanes {
            let form = Form::Line(lane.width_m, lane.line);
            let added = self.shapes.add_named(kind, form, name.as_deref(), false);
            added.map_err(|message| Fault::at(start, message))?;
        }
        Ok(())
    }

    /// Adds a junction of roads as an area.
    fn junction(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        self.end_edge()?;
        let [kind, shape, lanes] = attributes(element, start, ["type", "shape", "incLanes"])?;
        if kind.is_some_and(|kind| kind.text == "internal") {
            return Ok(());
        }
        let lanes = lanes.map(|lanes| lanes.text.into_owned()).unwrap_or_default();
        let roads = lanes.split_whitespace().filter_map(|lane| self.lanes.get(lane));
        let (Some(kind), Some(shape)) = (roads.max().copied(), shape) else { return Ok(()) };
        let ring = shape.read(points)?;
        if ring.len() < 3 {
            return Ok(());
        }
        self.shapes.add(kind, Form::Area(vec![closed(ring)]), false).map_err(|message| Fault::at(start, message))
    }

    fn polygon(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        let [kind, shape, fill, geo] = attributes(element, start, ["type", "shape", "fill", "geo"])?;
        let Some(shape) = shape else {
            return Err(Fault::at(start, "poly: shape is missing; must be an attribute".to_owned()));
        };
        let is_set = |found: Option<Found<'_>>| found.is_some_and(|found| ["1", "true"].contains(&found.text.as_ref()));
        let kind = kind.and_then(|kind| Kind::of_type(&kind.text)).unwrap_or(Kind::Other);
        let line = shape.read(points)?;
        let is_area = line.len() > 2 && (is_set(fill) || line.first() == line.last());
        let form = if is_area { Form::Area(vec![closed(line)]) } else { Form::Line(kind.width_m(), line) };
        self.shapes.add(kind, form, is_set(geo)).map_err(|message| Fault::at(start, message))
    }
}

/// Closes a ring, so that it ends where it starts.
fn closed(mut ring: Vec<Point>) -> Vec<Point> {
    if ring.first() != ring.last() {
        ring.extend(ring.first().copied());
    }
    ring
}

/// Parses `x,y x,y ...` or `x,y,z x,y,z ...`.
fn points(text: &str) -> Result<Vec<Point>, String> {
    let number = |text: Option<&str>, pair: &str| match text.map(|text| text.trim().parse::<f64>()) {
        Some(Ok(value)) if value.abs() <= FURTHEST_M => Ok(value),
        Some(Ok(_)) => Err(format!("{}: must be -{FURTHEST_M:e} to {FURTHEST_M:e} m", quoted(pair))),
        _ => Err(format!("{}: must be x,y in metres", quoted(pair))),
    };
    let point = |pair: &str| {
        let mut parts = pair.split(',');
        Ok([number(parts.next(), pair)?, number(parts.next(), pair)?])
    };
    text.split_whitespace().map(point).collect()
}
