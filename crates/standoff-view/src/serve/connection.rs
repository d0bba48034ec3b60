//! Connections: accepts them within the limits, answers their requests and ends them.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use hyper::body::{Bytes, Incoming};
use hyper::header;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Request, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot, watch};
use tokio::time::{sleep, timeout};
use tokio_io_timeout::TimeoutStream;
use tokio_tungstenite::tungstenite::handshake::server::create_response;

use super::limits::Limits;
use super::response::{self, HttpResponse};
use super::site::Site;
use super::{live_feed, request_filter};

/// Panic message for a closed semaphore, which cannot occur.
const NEVER_CLOSED: &str = "the semaphores of the server are never closed";

/// Minimum buffer size that hyper allows, bytes.
const MIN_BUFFER_BYTES: usize = 8192;

/// Delay before the next attempt after a failed accept.
const RETRY: Duration = Duration::from_millis(100);

/// State that all connections share.
pub(super) struct ServerState {
    site: Arc<dyn Site>,
    address: SocketAddr,
    limits: Limits,
    connections: Arc<Semaphore>,
    web_sockets: Arc<Semaphore>,
    calls: Arc<Semaphore>,
    /// Resolves when the server ends.
    stopped: watch::Receiver<()>,
}

impl ServerState {
    pub(super) fn new(
        site: Arc<dyn Site>,
        address: SocketAddr,
        limits: Limits,
        stopped: watch::Receiver<()>,
    ) -> Arc<Self> {
        let slots = |count| Arc::new(Semaphore::new(count));
        Arc::new(Self {
            site,
            address,
            connections: slots(limits.connections),
            web_sockets: slots(limits.web_sockets),
            calls: slots(limits.calls),
            limits,
            stopped,
        })
    }

    /// Waits for a free connection slot.
    pub(super) async fn slot(&self) -> OwnedSemaphorePermit {
        self.connections.clone().acquire_owned().await.expect(NEVER_CLOSED)
    }
}

/// Serves until `stopped`, then waits until all connections have ended or the time limit for that is over.
pub(super) async fn serve(listener: TcpListener, state: Arc<ServerState>) {
    let mut stopped = state.stopped.clone();
    tokio::select! {
        () = accept(&listener, &state) => {}
        _ = stopped.changed() => {}
    }
    drop(listener);
    let all = state.connections.acquire_many(state.limits.connections as u32);
    // The remaining connections end with the runtime.
    let _ = timeout(state.limits.shutdown_timeout, all).await;
}

/// Accepts connections while slots are free.
async fn accept(listener: &TcpListener, state: &Arc<ServerState>) {
    loop {
        let slot = state.slot().await;
        match listener.accept().await {
            Ok((stream, _)) => {
                // Without it, a small response may wait for the acknowledgement of the previous one.
                let _ = stream.set_nodelay(true);
                tokio::spawn(serve_connection(stream, state.clone(), slot));
            }
            // The connection broke before it was accepted, or no file handle is free until other connections end.
            Err(_) => sleep(RETRY).await,
        }
    }
}

/// Answers the requests of a connection sequentially.
pub(super) async fn serve_connection<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
    stream: S,
    state: Arc<ServerState>,
    slot: OwnedSemaphorePermit,
) {
    // A write fails after waiting this long for the client.
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(state.limits.stall_time));
    let stream = TokioIo::new(stream);
    let mut stopped = state.stopped.clone();
    let slot = Arc::new(slot);
    let mut protocol = http1::Builder::new();
    protocol
        .timer(TokioTimer::new())
        .header_read_timeout(state.limits.head_time)
        .max_header_size(state.limits.head_bytes)
        .max_buf_size(state.limits.head_bytes.max(MIN_BUFFER_BYTES));
    let answer = service_fn(move |request| answer(request, state.clone(), slot.clone()));
    let mut connection = pin!(protocol.serve_connection(stream, answer).with_upgrades());
    tokio::select! {
        // An error means that the client is gone, too slow or does not speak HTTP: only this connection ends.
        _ = connection.as_mut() => return,
        _ = stopped.changed() => connection.as_mut().graceful_shutdown(),
    }
    let _ = connection.await;
}

/// Answers one request.
async fn answer(
    request: Request<Incoming>,
    state: Arc<ServerState>,
    slot: Arc<OwnedSemaphorePermit>,
) -> Result<HttpResponse, Infallible> {
    let reply = if let Some((status, why)) = request_filter::refuse(&request, state.address) {
        response::refusal(status, why)
    } else if let Some(path) = response::decode(request.uri().path()) {
        let upgrade = request.headers().get(header::UPGRADE);
        if upgrade.is_some_and(|to| to.as_bytes().eq_ignore_ascii_case(b"websocket")) {
            open(request, &path, &state, slot)
        } else {
            get(request, path, &state).await
        }
    } else {
        not_found()
    };
    Ok(response::add_common_headers(reply))
}

fn not_found() -> HttpResponse {
    response::text(StatusCode::NOT_FOUND, "This address does not exist.\n")
}

/// Returns the content of the site at a path.
async fn get(request: Request<Incoming>, path: String, state: &ServerState) -> HttpResponse {
    let gzip = response::takes_gzip(request.headers());
    let turn = state.calls.clone().acquire_owned().await.expect(NEVER_CLOSED);
    let site = state.site.clone();
    let call = move || {
        let answer = site.get(&path);
        drop(turn);
        answer.map(|answer| response::content(answer, gzip))
    };
    let (give, answer) = oneshot::channel();
    // Not with `spawn_blocking`, which panics if no thread can be started. The receiver may be gone when the answer is
    // sent.
    let answering = thread::Builder::new().spawn(move || drop(give.send(call())));
    if answering.is_err() {
        return response::text(
            StatusCode::SERVICE_UNAVAILABLE,
            "The server cannot start a thread for this request. Try again.\n",
        );
    }
    match answer.await {
        Ok(found) => found.unwrap_or_else(not_found),
        Err(_) => response::text(
            StatusCode::INTERNAL_SERVER_ERROR,
            "Internal error: see the terminal of the program for details.\n",
        ),
    }
}

/// Upgrades a connection to a WebSocket that receives a feed.
fn open(
    request: Request<Incoming>,
    path: &str,
    state: &Arc<ServerState>,
    slot: Arc<OwnedSemaphorePermit>,
) -> HttpResponse {
    let Some(feed) = state.site.feed(path) else { return not_found() };
    let mut request = request;
    let upgraded = hyper::upgrade::on(&mut request);
    let Ok(reply) = create_response(&request.map(|_| ())) else {
        return response::refusal(StatusCode::BAD_REQUEST, "Invalid WebSocket handshake: version 13 is required.\n");
    };
    let Ok(web_socket_slot) = state.web_sockets.clone().try_acquire_owned() else {
        return response::text(StatusCode::SERVICE_UNAVAILABLE, "Too many pages are connected. Close one of them.\n");
    };
    let (texts, state) = (feed.follow(), state.clone());
    tokio::spawn(async move {
        // Both slots stay occupied while the WebSocket is open.
        let _held = (slot, web_socket_slot);
        if let Ok(stream) = upgraded.await {
            live_feed::serve_feed(TokioIo::new(stream), texts, &state.limits, state.stopped.clone()).await;
        }
    });
    reply.map(|()| response::Content::Left(Bytes::new().into()))
}
