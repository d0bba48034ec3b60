//! Files of unknown origin: safe reading of their text, safe display of their contents, and atomic writes.

pub mod atomic_file;
pub mod bounded_input;
pub mod display_text;
pub mod geodesy;
pub mod net_projection;
pub mod parquet_file;
pub mod text_source;
