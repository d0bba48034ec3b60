//! Values of parameters, and access to structs of parameters.

use crate::validation::{Allowed, ParamError};

/// Kind of a parameter.
#[derive(Debug, Clone, Copy)]
pub enum ParamKind {
    /// A number.
    Number {
        /// Unit in the library; `1` if the parameter is dimensionless.
        unit: &'static str,
        /// Range. Bounds that other parameters set are only in its [`Allowed::because`].
        allowed: Allowed,
    },
    /// One of these words.
    Word(&'static [Word]),
    /// True or false.
    Flag,
}

/// A word that selects an option.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    /// The word.
    pub word: &'static str,
    /// Doc comment, as lines that begin with a space.
    pub(super) doc: &'static str,
}

/// Value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamValue {
    /// A number, in the unit of the library.
    Number(f64),
    /// A word.
    Word(&'static str),
    /// True or false.
    Flag(bool),
}

impl ParamKind {
    /// True for a number.
    pub fn is_number(&self) -> bool {
        matches!(self, Self::Number { .. })
    }
}

impl Word {
    /// Returns the meaning, as one line.
    pub fn doc(&self) -> String {
        one_line(self.doc)
    }
}

/// Joins the lines of a doc comment.
pub(super) fn one_line(doc: &str) -> String {
    doc.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

/// A struct of parameters, or an optional one.
pub(super) trait Part {
    fn paper() -> Self;
    fn recommended() -> Self;
    fn errors(&self) -> Vec<ParamError>;
}

impl<T: Part> Part for Option<T> {
    fn paper() -> Self {
        None
    }

    fn recommended() -> Self {
        None
    }

    fn errors(&self) -> Vec<ParamError> {
        self.as_ref().map(Part::errors).unwrap_or_default()
    }
}

/// Access to a struct of parameters that may be optional.
pub(super) trait Reach<T> {
    fn reach(&self) -> Option<&T>;
    fn reach_mut(&mut self) -> Option<&mut T>;
}

impl<T: Part> Reach<T> for T {
    fn reach(&self) -> Option<&T> {
        Some(self)
    }

    fn reach_mut(&mut self) -> Option<&mut T> {
        Some(self)
    }
}

impl<T: Part> Reach<T> for Option<T> {
    fn reach(&self) -> Option<&T> {
        self.as_ref()
    }

    fn reach_mut(&mut self) -> Option<&mut T> {
        self.as_mut()
    }
}

/// A field that holds one parameter.
pub(super) trait Scalar {
    fn value(&self) -> ParamValue;
    /// Returns false if the value is of another kind or an unknown word.
    fn set(&mut self, value: ParamValue) -> bool;
}

impl Scalar for f64 {
    fn value(&self) -> ParamValue {
        ParamValue::Number(*self)
    }

    fn set(&mut self, value: ParamValue) -> bool {
        let ParamValue::Number(number) = value else { return false };
        *self = number;
        true
    }
}

impl Scalar for bool {
    fn value(&self) -> ParamValue {
        ParamValue::Flag(*self)
    }

    fn set(&mut self, value: ParamValue) -> bool {
        let ParamValue::Flag(flag) = value else { return false };
        *self = flag;
        true
    }
}
