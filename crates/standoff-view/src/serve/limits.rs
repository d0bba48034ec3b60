//! Resource limits of the server.

use std::time::Duration;

/// Resource limits of the server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Maximum number of simultaneous connections; further ones wait to be accepted.
    pub connections: usize,
    /// Maximum number of WebSockets among them; further ones get status 503.
    pub web_sockets: usize,
    /// Maximum number of simultaneous calls of [`ServerState::call`](super::ServerState::call); further ones wait.
    pub calls: usize,
    /// Maximum size of a request head, bytes.
    pub head_bytes: usize,
    /// Maximum time for receiving the head of the next request of a connection.
    pub head_time: Duration,
    /// Maximum size of a message from a WebSocket, bytes. The contents of messages are ignored.
    pub message_bytes: usize,
    /// Maximum time during which a client accepts no data, or a WebSocket does not answer pings.
    pub stall_time: Duration,
    /// Size of the send buffer of a socket, bytes. It bounds the age of the texts that a slow client receives.
    pub send_buffer_bytes: u32,
    /// Maximum duration of the shutdown, in which responses in progress are completed and WebSockets are closed.
    pub shutdown_timeout: Duration,
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
            shutdown_timeout: Duration::from_secs(1),
        }
    }
}
