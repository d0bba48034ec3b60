//! Outbox: the messages that an agent sends at a time step.

use crate::message::{Message, SnapshotPart};

/// Messages to send; the buffers are reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outbox {
    /// The first `ready_count` entries are ready; the others are reusable buffers.
    slots: Vec<Message>,
    ready_count: usize,
}

impl Outbox {
    pub(crate) fn clear(&mut self) {
        self.ready_count = 0;
    }

    /// Messages that are ready to be sent.
    pub(crate) fn messages(&self) -> &[Message] {
        &self.slots[..self.ready_count]
    }

    /// Makes the next slot ready and returns it; the caller overwrites its old content.
    pub(crate) fn push(&mut self) -> &mut Message {
        if self.slots.len() == self.ready_count {
            self.slots.push(Message::Snapshot(SnapshotPart::default()));
        }
        self.ready_count += 1;
        &mut self.slots[self.ready_count - 1]
    }
}
