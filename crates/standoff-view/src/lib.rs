//! Views of a finished run: static figures for a report.

pub mod figures;
