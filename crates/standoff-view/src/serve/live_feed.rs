//! Feeds: texts that change, sent to WebSockets.

use futures_util::{SinkExt, StreamExt};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Bytes, Error, Message, Utf8Bytes};

use super::limits::Limits;

/// A text that changes over time. Every change is sent to all WebSockets; a slow one skips intermediate texts.
#[derive(Debug, Clone)]
pub struct Feed(watch::Sender<Utf8Bytes>);

impl Feed {
    /// Makes a feed with an initial text.
    pub fn new(text: String) -> Self {
        Self(watch::Sender::new(text.into()))
    }

    /// Changes the text without waiting for clients.
    pub fn send(&self, text: String) {
        self.0.send_replace(text.into());
    }

    /// Number of connected WebSockets. If it is 0, the text need not be updated; a new client receives the last text.
    pub fn readers(&self) -> usize {
        self.0.receiver_count()
    }

    pub(super) fn subscribe(&self) -> watch::Receiver<Utf8Bytes> {
        self.0.subscribe()
    }
}

/// Sends the newest of `texts` to a WebSocket until it disconnects, violates a limit or the server is `stopped`.
pub(super) async fn serve_feed<S: AsyncRead + AsyncWrite + Unpin>(
    stream: S,
    texts: watch::Receiver<Utf8Bytes>,
    limits: &Limits,
    mut stopped: watch::Receiver<()>,
) {
    let bounds = WebSocketConfig::default()
        .read_buffer_size(limits.message_bytes)
        .max_message_size(Some(limits.message_bytes))
        .max_frame_size(Some(limits.message_bytes));
    let mut socket = WebSocketStream::from_raw_socket(stream, Role::Server, Some(bounds)).await;
    let code = tokio::select! {
        code = follow(&mut socket, texts, limits) => code,
        _ = stopped.changed() => Some(CloseCode::Away),
    };
    let Some(code) = code else { return };
    let farewell = async {
        let _ = socket.close(Some(CloseFrame { code, reason: Utf8Bytes::default() })).await;
        // Closing a connection with unread input would drop the close frame, so read until the client closes it.
        let stream = socket.get_mut();
        let _ = stream.shutdown().await;
        while stream.read(&mut [0; 1024]).await.is_ok_and(|length| length > 0) {}
    };
    let _ = timeout(limits.shutdown_timeout, farewell).await;
}

/// Sends texts until there is a reason to close, which is returned, or until the client is gone (`None`).
async fn follow<S: AsyncRead + AsyncWrite + Unpin>(
    socket: &mut WebSocketStream<S>,
    mut texts: watch::Receiver<Utf8Bytes>,
    limits: &Limits,
) -> Option<CloseCode> {
    let mut pulse = interval(limits.stall_time / 2);
    pulse.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut alive = true;
    texts.mark_changed();
    loop {
        tokio::select! {
            // A received pong is processed before the next pulse.
            biased;
            message = socket.next() => match message {
                Some(Ok(_)) => alive = true,
                Some(Err(Error::Capacity(_))) => return Some(CloseCode::Size),
                Some(Err(_)) | None => return None,
            },
            changed = texts.changed() => {
                if changed.is_err() {
                    return Some(CloseCode::Normal);
                }
                let newest = texts.borrow_and_update().clone();
                socket.send(Message::Text(newest)).await.ok()?;
            }
            _ = pulse.tick() => {
                if !std::mem::take(&mut alive) {
                    return None;
                }
                socket.send(Message::Ping(Bytes::new())).await.ok()?;
            }
        }
    }
}
