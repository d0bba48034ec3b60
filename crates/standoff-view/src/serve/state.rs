//! State that all connections share, and what routes of a site do with it.

use std::net::SocketAddr;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::thread;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header;
use axum::http::status::StatusCode;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use futures_util::FutureExt;
use hyper_util::rt::TokioIo;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot, watch};
use tokio_tungstenite::tungstenite::handshake::server::create_response;

use super::limits::Limits;
use super::live_feed::{self, Feed};
use super::request_filter;
use super::response::{self, INTERNAL_ERROR, NOT_ALLOWED, NOT_FOUND, Refusal};

/// Panic message for a closed semaphore, which cannot occur.
const NEVER_CLOSED: &str = "the semaphores of the server are never closed";

/// Contents of a server: routes. Other paths have status 404. Handlers run on the server's thread and must be fast; slow
/// work needs [`ServerState::call`]. A panic results in a response with status 500.
pub type Site = Router<Arc<ServerState>>;

/// State of a running server.
#[derive(Debug)]
pub struct ServerState {
    address: SocketAddr,
    pub(super) limits: Limits,
    pub(super) connections: Arc<Semaphore>,
    web_sockets: Arc<Semaphore>,
    calls: Arc<Semaphore>,
    /// Resolves when the server ends.
    pub(super) stopped: watch::Receiver<()>,
}

impl ServerState {
    pub(super) fn new(address: SocketAddr, limits: Limits, stopped: watch::Receiver<()>) -> Arc<Self> {
        let slots = |count| Arc::new(Semaphore::new(count));
        Arc::new(Self {
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

    /// Completes a site for connections: with the filter for requests and the headers of responses.
    pub(super) fn guard(self: &Arc<Self>, site: Site) -> Router {
        let site = site.fallback(async || NOT_FOUND).method_not_allowed_fallback(async || NOT_ALLOWED);
        site.layer(from_fn_with_state(self.clone(), answer)).with_state(self.clone())
    }

    /// Runs work that may take seconds on a separate thread, at most [`Limits::calls`] at a time. Returns status 500
    /// after a panic, and status 503 if no thread can be started.
    pub async fn call<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Refusal> {
        let turn = self.calls.clone().acquire_owned().await.expect(NEVER_CLOSED);
        let (give, result) = oneshot::channel();
        let call = move || {
            let result = work();
            drop(turn);
            // The receiver is gone if the client is.
            let _ = give.send(result);
        };
        // Not with `spawn_blocking`, which panics if no thread can be started.
        thread::Builder::new().spawn(call).map_err(|_| {
            let what = "The server cannot start a thread for this request. Try again.\n";
            (StatusCode::SERVICE_UNAVAILABLE, what)
        })?;
        result.await.map_err(|_| INTERNAL_ERROR)
    }

    /// Answers a request for a WebSocket that receives a feed: its text is sent immediately and after every change.
    /// Returns status 400 if the request is not a valid handshake, and status 503 if there are too many WebSockets.
    // axum's own WebSocket does not give access to its connection, which `serve_feed` needs for an orderly end.
    pub fn follow(self: &Arc<Self>, feed: &Feed, mut request: Request) -> Response {
        let slot = request.extensions_mut().remove::<Arc<OwnedSemaphorePermit>>();
        let upgraded = hyper::upgrade::on(&mut request);
        let Ok(response) = create_response(&request.map(|_| ())) else {
            let what = "Invalid WebSocket handshake: version 13 is required.\n";
            return (StatusCode::BAD_REQUEST, what).into_response();
        };
        let Ok(web_socket_slot) = self.web_sockets.clone().try_acquire_owned() else {
            let what = "Too many pages are connected. Close one of them.\n";
            return (StatusCode::SERVICE_UNAVAILABLE, what).into_response();
        };
        let (texts, state) = (feed.subscribe(), self.clone());
        tokio::spawn(async move {
            // Both slots stay occupied while the WebSocket is open.
            let _held = (slot, web_socket_slot);
            if let Ok(stream) = upgraded.await {
                live_feed::serve_feed(TokioIo::new(stream), texts, &state.limits, state.stopped.clone()).await;
            }
        });
        response.map(|()| Body::empty())
    }
}

/// Answers a request, or refuses it and closes the connection.
async fn answer(State(state): State<Arc<ServerState>>, request: Request, next: Next) -> Response {
    let takes_gzip = response::takes_gzip(request.headers());
    let response = match request_filter::refuse(&request, state.address) {
        Some(refusal) => ([(header::CONNECTION, "close")], refusal).into_response(),
        None => {
            let response = AssertUnwindSafe(next.run(request)).catch_unwind();
            response.await.unwrap_or_else(|_| INTERNAL_ERROR.into_response())
        }
    };
    response::complete(response, takes_gzip).await
}
