//! What the readers may cost.

use std::time::Duration;

/// What the readers may cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Connections at one time; further ones wait to be accepted.
    pub connections: usize,
    /// WebSockets among them; further ones are answered 503.
    pub web_sockets: usize,
    /// Calls of [`Site::get`](super::Site::get) at one time; further ones wait.
    pub calls: usize,
    /// Largest head of a request, bytes.
    pub head_bytes: usize,
    /// How long a connection may take to send the head of its next request.
    pub head_time: Duration,
    /// Largest message that a WebSocket may send, bytes. None is read.
    pub message_bytes: usize,
    /// How long a reader may take nothing of what it is sent, and a WebSocket leave pings unanswered.
    pub stall_time: Duration,
    /// What the system is asked to hold back for a reader, bytes: it bounds how old a text is that a slow one gets.
    pub send_buffer_bytes: u32,
    /// How long the end may take: answers under way are finished, WebSockets closed politely.
    pub farewell_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 64,
            web_sockets: 16,
            calls: 4,
            head_bytes: 16 * 1024,
            head_time: Duration::from_secs(10),
            message_bytes: 1024,
            stall_time: Duration::from_secs(30),
            send_buffer_bytes: 128 * 1024,
            farewell_time: Duration::from_secs(1),
        }
    }
}
