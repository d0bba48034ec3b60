//! Replicated message log of a team with a lossy radio: every agent ends up with the same messages, and so with the same
//! team states.
//!
//! ```text
//! committed      |  may still change        |  now
//! ...  k-4  k-3  |  k-2      k-1            |  k        time steps, each with its reports and cues
//!                   ^ a late report arrives: the team states from here on are recomputed
//! ```
//!
//! A time step is *committed* as soon as every expected UAV has reported it and a later time step, and this agent has
//! all messages that these later reports list as received. It is also committed when the retention time has passed. A
//! committed time step accepts no further messages. While messages are missing, the groups and assignments in use are
//! those from one decision lag earlier, because teammates have the same messages of that time.
//!
//! If the team states of two agents differ and the message log cannot reconcile them, the state of the *reference
//! agent* wins: among the live UAVs, the agent whose state started first; ties go to the lowest id. The other agents
//! see the difference in the digest of its reports and request a snapshot of its state. A reference agent that does not
//! send its state on request is skipped for a while.

mod link_monitor;
mod log;
mod outbox;
mod ranges;
mod reference;
mod replica;
mod retransmission;
mod rollback;
mod snapshot;
mod state_transfer;
mod teammates;

pub(crate) use replica::Replica;
pub use teammates::TeammateStatus;
