//! Symbols: small shapes of a fixed size that mark a place or an instant.

use super::ink::{PX, font, ink};
use plotters::element::ComposedElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use standoff::math::{TAU, cos, sin};

/// What happened to a target, as far as the figures mark it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Mark {
    Requested,
    Withdrawn,
    Completed,
    Discarded,
    Lost,
}

impl Mark {
    /// Each with the kind of event that it marks, and what the legend says.
    const ALL: [(Self, &str, &str); 5] = [
        (Self::Requested, "handoff-requested", "handoff requested"),
        (Self::Withdrawn, "handoff-withdrawn", "handoff withdrawn"),
        (Self::Completed, "handoff-completed", "handoff completed"),
        (Self::Discarded, "discarded", "target discarded"),
        (Self::Lost, "lost", "target lost"),
    ];

    /// The mark of a kind of event.
    pub(super) fn of(kind: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, marked, _)| *marked == kind).map(|(mark, ..)| *mark)
    }

    /// What the legend says.
    pub(super) fn label(self) -> String {
        Self::ALL.iter().find(|(mark, ..)| *mark == self).map_or("", |(.., label)| *label).to_owned()
    }

    /// The shape, in black and white: colours are for UAVs and groups.
    pub(super) fn symbol(self) -> Symbol {
        match self {
            Self::Requested => Symbol::new(4, &[5.5], 0.0, WHITE, BLACK),
            Self::Withdrawn => Symbol::new(3, &[6.0], 0.25, WHITE, BLACK),
            Self::Completed => Symbol::new(4, &[6.5], 0.0, BLACK, WHITE),
            Self::Discarded => Symbol::new(8, &[9.0, 2.5], 0.125, BLACK, WHITE),
            Self::Lost => Symbol::new(4, &[6.0], 0.125, WHITE, BLACK),
        }
    }
}

/// A polygon and its edge, in units about their place.
type Shape<'a, C> = ComposedElement<C, SVGBackend<'a>, Polygon<(i32, i32)>, PathElement<(i32, i32)>>;

/// A polygon with an edge, and a word on it.
#[derive(Debug, Clone)]
pub(super) struct Symbol {
    corners: Vec<(i32, i32)>,
    fill: RGBColor,
    edge: RGBColor,
    word: String,
}

impl Symbol {
    /// So many corners at the distances given in turn, px; the first lies `turn` of a circle clockwise from the right.
    fn new(corners: u32, reach: &[f64], turn: f64, fill: RGBColor, edge: RGBColor) -> Self {
        let at = |(corner, reach): (u32, &f64)| {
            let (angle, reach) = (TAU * (f64::from(corner) / f64::from(corners) + turn), reach * f64::from(PX));
            ((reach * cos(angle)).round() as i32, (reach * sin(angle)).round() as i32)
        };
        // Closed by its first corner.
        let corners = (0..=corners).zip(reach.iter().cycle()).map(at).collect();
        Self { corners, fill, edge, word: String::new() }
    }

    /// Where a UAV begins.
    pub(super) fn start(colour: RGBColor) -> Self {
        Self::new(24, &[4.0], 0.0, WHITE, colour)
    }

    /// Where a UAV ends, with its number.
    pub(super) fn end(colour: RGBColor, word: String) -> Self {
        Self { word, ..Self::new(24, &[8.0], 0.0, colour, WHITE) }
    }

    /// The shape at a place of a plot or of the page.
    pub(super) fn at<'a, C>(&self, place: C) -> Shape<'a, C> {
        EmptyElement::at(place)
            + Polygon::new(self.corners.clone(), self.fill.filled())
            + PathElement::new(self.corners.clone(), ink(self.edge, 1.0))
    }

    /// The word, to be drawn on the shape.
    pub(super) fn word_at<C>(&self, place: C) -> Option<Text<'static, C, String>> {
        let style = font(10.0).color(&WHITE).pos(Pos::new(HPos::Center, VPos::Center));
        (!self.word.is_empty()).then(|| Text::new(self.word.clone(), place, style))
    }
}
