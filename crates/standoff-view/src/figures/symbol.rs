//! Symbols: small shapes of fixed size that mark a position or a time.

use super::style::{PX, font, ink};
use plotters::element::ComposedElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use standoff::math::{TAU, cos, sin};

/// Events of targets that the figures mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Mark {
    HandoffStarted,
    HandoffCancelled,
    HandoffCompleted,
    Removed,
    Lost,
}

impl Mark {
    /// Marks with the kind of their event and their legend entry.
    const ALL: [(Self, &str, &str); 5] = [
        (Self::HandoffStarted, "handoff-started", "handoff started"),
        (Self::HandoffCancelled, "handoff-cancelled", "handoff cancelled"),
        (Self::HandoffCompleted, "handoff-completed", "handoff completed"),
        (Self::Removed, "removed", "target removed"),
        (Self::Lost, "lost", "target lost"),
    ];

    /// Mark of an event kind; `None` if it is not marked.
    pub(super) fn of(kind: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, marked, _)| *marked == kind).map(|(mark, ..)| *mark)
    }

    /// Legend entry.
    pub(super) fn label(self) -> String {
        Self::ALL.iter().find(|(mark, ..)| *mark == self).map_or("", |(.., label)| *label).to_owned()
    }

    /// Symbol of the mark, in black and white because colours identify UAVs and groups.
    pub(super) fn symbol(self) -> Symbol {
        match self {
            Self::HandoffStarted => Symbol::new(4, &[5.5], 0.0, WHITE, BLACK),
            Self::HandoffCancelled => Symbol::new(3, &[6.0], 0.25, WHITE, BLACK),
            Self::HandoffCompleted => Symbol::new(4, &[6.5], 0.0, BLACK, WHITE),
            Self::Removed => Symbol::new(8, &[9.0, 2.5], 0.125, BLACK, WHITE),
            Self::Lost => Symbol::new(4, &[6.0], 0.125, WHITE, BLACK),
        }
    }
}

/// A filled polygon and its outline, in drawing units relative to their position.
type Shape<'a, C> = ComposedElement<C, SVGBackend<'a>, Polygon<(i32, i32)>, PathElement<(i32, i32)>>;

/// A polygon with an outline and an optional text on it.
#[derive(Debug, Clone)]
pub(super) struct Symbol {
    corners: Vec<(i32, i32)>,
    fill: RGBColor,
    edge: RGBColor,
    word: String,
}

impl Symbol {
    /// Makes a polygon with `corners` corners; their distances from the centre cycle through `reach`, px. The first
    /// corner is `turn` turns clockwise from the right.
    fn new(corners: u32, reach: &[f64], turn: f64, fill: RGBColor, edge: RGBColor) -> Self {
        let at = |(corner, reach): (u32, &f64)| {
            let (angle, reach) = (TAU * (f64::from(corner) / f64::from(corners) + turn), reach * f64::from(PX));
            ((reach * cos(angle)).round() as i32, (reach * sin(angle)).round() as i32)
        };
        // The last point repeats the first corner to close the outline.
        let corners = (0..=corners).zip(reach.iter().cycle()).map(at).collect();
        Self { corners, fill, edge, word: String::new() }
    }

    /// Symbol of the start position of a UAV.
    pub(super) fn start(colour: RGBColor) -> Self {
        Self::new(24, &[4.0], 0.0, WHITE, colour)
    }

    /// Symbol of the final position of a UAV, with its number.
    pub(super) fn end(colour: RGBColor, word: String) -> Self {
        Self { word, ..Self::new(24, &[8.0], 0.0, colour, WHITE) }
    }

    /// The shape at a position in a plot or on the page.
    pub(super) fn at<'a, C>(&self, place: C) -> Shape<'a, C> {
        EmptyElement::at(place)
            + Polygon::new(self.corners.clone(), self.fill.filled())
            + PathElement::new(self.corners.clone(), ink(self.edge, 1.0))
    }

    /// The text, to be drawn over the shape.
    pub(super) fn word_at<C>(&self, place: C) -> Option<Text<'static, C, String>> {
        let style = font(10.0).color(&WHITE).pos(Pos::new(HPos::Center, VPos::Center));
        (!self.word.is_empty()).then(|| Text::new(self.word.clone(), place, style))
    }
}
