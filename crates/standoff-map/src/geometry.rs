//! Lines and areas, and limits on their number.

use crate::feature_class::Kind;
use crate::limits::{MAX_NAME, MAX_POINTS, MAX_SHAPES};

/// East and north, m, or longitude and latitude, degrees.
pub(crate) type Point = [f64; 2];

/// Line or area of a map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    pub(crate) kind: Kind,
    pub(crate) form: Form,
    /// Name of a road.
    pub(crate) name: Option<Box<str>>,
}

/// Geometry of a shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Form {
    /// Line with its width, m.
    Line(f64, Vec<Point>),
    /// Area: the outer ring followed by the rings of its holes.
    Area(Vec<Vec<Point>>),
}

impl Form {
    pub(crate) fn lines(&self) -> &[Vec<Point>] {
        match self {
            Self::Line(_, line) => std::slice::from_ref(line),
            Self::Area(rings) => rings,
        }
    }

    pub(crate) fn points(&self) -> impl Iterator<Item = &Point> {
        self.lines().iter().flatten()
    }
}

/// Numbers of shapes and points of all maps of a run.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Count {
    pub(crate) shapes: usize,
    pub(crate) points: usize,
}

impl Count {
    /// Adds to the counts. Fails if a limit is exceeded.
    pub(crate) fn with(self, shapes: usize, points: usize) -> Result<Self, String> {
        let (shapes, points) = (self.shapes + shapes, self.points + points);
        let advice = "crop the map to the area of the vehicles";
        if points > MAX_POINTS {
            return Err(format!("has more than {MAX_POINTS} points; {advice}"));
        }
        if shapes > MAX_SHAPES {
            return Err(format!("has more than {MAX_SHAPES} lines and areas; {advice}"));
        }
        Ok(Self { shapes, points })
    }
}

/// Shapes of a file while it is read, with their count.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    pub(crate) all: Vec<Shape>,
    /// Shapes in degrees, in a file whose other shapes are not.
    pub(crate) in_degrees: Vec<Shape>,
    /// Count including the previous files.
    pub(crate) count: Count,
}

impl Shapes {
    pub(crate) fn after(count: Count) -> Self {
        Self { count, ..Self::default() }
    }

    /// Adds a shape. Fails if a limit is exceeded.
    pub(crate) fn add(&mut self, kind: Kind, form: Form, in_degrees: bool) -> Result<(), String> {
        self.add_named(kind, form, None, in_degrees)
    }

    /// Adds a shape with the name of its road; names that are too long are omitted. Fails if a limit is exceeded.
    pub(crate) fn add_named(
        &mut self,
        kind: Kind,
        form: Form,
        name: Option<&str>,
        in_degrees: bool,
    ) -> Result<(), String> {
        if form.lines().iter().all(|line| line.len() < 2) {
            return Ok(());
        }
        self.count = self.count.with(1, form.points().count())?;
        if in_degrees { &mut self.in_degrees } else { &mut self.all }.push(Shape {
            kind,
            form,
            name: name.map(str::trim).filter(|name| (1..=MAX_NAME).contains(&name.len())).map(Box::from),
        });
        Ok(())
    }
}

/// Rectangle: west, south, east, north, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds(pub [f64; 4]);

impl Bounds {
    /// Returns the bounds of all points; `None` without points.
    pub fn of(points: impl IntoIterator<Item = [f64; 2]>) -> Option<Self> {
        points.into_iter().fold(None, Self::around)
    }

    /// Extends the bounds to one more point; without bounds, returns those of the point alone.
    #[must_use]
    pub fn around(bounds: Option<Self>, [x, y]: [f64; 2]) -> Option<Self> {
        let [west, south, east, north] = bounds.map_or([x, y, x, y], |bounds| bounds.0);
        Some(Self([west.min(x), south.min(y), east.max(x), north.max(y)]))
    }

    pub(crate) fn grown(self, by_m: f64) -> Self {
        let [west, south, east, north] = self.0;
        Self([west - by_m, south - by_m, east + by_m, north + by_m])
    }

    pub(crate) fn is_smaller_than(self, size_m: f64) -> bool {
        let [west, south, east, north] = self.0;
        east - west < size_m && north - south < size_m
    }

    pub(crate) fn touches(self, other: Self) -> bool {
        let ([w, s, e, n], [west, south, east, north]) = (self.0, other.0);
        w <= east && west <= e && s <= north && south <= n
    }
}
