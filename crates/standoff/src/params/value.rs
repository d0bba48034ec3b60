//! Kinds and values of parameters.

use crate::validation::Allowed;

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
