//! Connections: accepts them within the limits, has their requests answered and ends them.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::Request;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::{sleep, timeout};
use tokio_io_timeout::TimeoutStream;

use super::state::ServerState;

/// Minimum buffer size that hyper allows, bytes.
const MIN_BUFFER_BYTES: usize = 8192;

/// Delay before the next attempt after a failed accept.
const RETRY: Duration = Duration::from_millis(100);

/// Serves until the server is stopped, then waits until all connections have ended or the time limit for that is over.
pub(super) async fn serve(listener: TcpListener, site: Router, state: Arc<ServerState>) {
    let mut stopped = state.stopped.clone();
    tokio::select! {
        () = accept(&listener, &site, &state) => {}
        _ = stopped.changed() => {}
    }
    drop(listener);
    let all = state.connections.acquire_many(state.limits.connections as u32);
    // The remaining connections end with the runtime.
    let _ = timeout(state.limits.shutdown_timeout, all).await;
}

/// Accepts connections while slots are free.
async fn accept(listener: &TcpListener, site: &Router, state: &Arc<ServerState>) {
    loop {
        let slot = state.slot().await;
        match listener.accept().await {
            Ok((stream, _)) => {
                // Without it, a small response may wait for the acknowledgement of the previous one.
                let _ = stream.set_nodelay(true);
                tokio::spawn(serve_connection(stream, site.clone(), state.clone(), slot));
            }
            // The connection broke before it was accepted, or no file handle is free until other connections end.
            Err(_) => sleep(RETRY).await,
        }
    }
}

/// Answers the requests of a connection sequentially.
pub(super) async fn serve_connection<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
    stream: S,
    site: Router,
    state: Arc<ServerState>,
    slot: OwnedSemaphorePermit,
) {
    // A write fails after waiting this long for the client.
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(state.limits.stall_time));
    let stream = TokioIo::new(stream);
    let mut stopped = state.stopped.clone();
    let mut protocol = http1::Builder::new();
    protocol
        .timer(TokioTimer::new())
        .header_read_timeout(state.limits.head_time)
        .max_header_size(state.limits.head_bytes)
        .max_buf_size(state.limits.head_bytes.max(MIN_BUFFER_BYTES));
    let (site, slot) = (TowerToHyperService::new(site), Arc::new(slot));
    let answer = service_fn(move |mut request: Request<_>| {
        // For a request that turns the connection into a WebSocket, which then occupies the slot.
        request.extensions_mut().insert(slot.clone());
        site.call(request)
    });
    let mut connection = pin!(protocol.serve_connection(stream, answer).with_upgrades());
    tokio::select! {
        // An error means that the client is gone, too slow or does not speak HTTP: only this connection ends.
        _ = connection.as_mut() => return,
        _ = stopped.changed() => connection.as_mut().graceful_shutdown(),
    }
    let _ = connection.await;
}
