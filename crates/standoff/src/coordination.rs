//! Who watches what: the group, its members, and the orbit about it.

pub mod event;
pub mod group;
pub mod membership;
