//! Channels of the file: one per topic, in the order of their first messages.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};

use foxglove::Encode;
use mcap::records::MessageHeader;
use mcap::{McapResult, Writer};

pub(super) struct Channels {
    writer: Writer<BufWriter<File>>,
    /// Channel id and sequence number of the last message, by topic.
    channels: BTreeMap<String, (u16, u32)>,
    time_ns: u64,
    /// The message being written.
    data: Vec<u8>,
}

impl Channels {
    pub(super) fn new(writer: Writer<BufWriter<File>>) -> Self {
        Self { writer, channels: BTreeMap::new(), time_ns: 0, data: Vec::new() }
    }

    /// Sets the time of the following messages, microseconds since the start of the mission.
    pub(super) fn now(&mut self, time_us: i64) {
        self.time_ns = u64::try_from(time_us).unwrap_or(0).saturating_mul(1000);
    }

    /// Writes a message; the first message on a topic declares its channel.
    pub(super) fn put<M: Encode>(&mut self, topic: &str, message: &M) -> McapResult<()> {
        let (channel_id, sequence) = match self.channels.get(topic) {
            Some(&(channel_id, last)) => (channel_id, last + 1),
            None => (self.declare::<M>(topic)?, 1),
        };
        self.channels.insert(topic.to_owned(), (channel_id, sequence));
        self.data.clear();
        message.encode(&mut self.data).map_err(|error| io::Error::other(error.to_string()))?;
        let header = MessageHeader { channel_id, sequence, log_time: self.time_ns, publish_time: self.time_ns };
        self.writer.write_to_known_channel(&header, &self.data)
    }

    fn declare<M: Encode>(&mut self, topic: &str) -> McapResult<u16> {
        // Schema id 0 means a channel without a schema.
        let schema = M::get_schema()
            .map_or(Ok(0), |schema| self.writer.add_schema(&schema.name, &schema.encoding, &schema.data))?;
        self.writer.add_channel(schema, topic, &M::get_message_encoding(), &BTreeMap::new())
    }

    /// Writes the index and returns the file, which is not flushed yet.
    pub(super) fn finish(mut self) -> McapResult<BufWriter<File>> {
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}
