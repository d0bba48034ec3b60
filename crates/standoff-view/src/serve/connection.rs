//! Connections: accepted, bounded, answered, ended.

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
use super::reply::{self, Reply};
use super::site::Site;
use super::{feed, guard};

/// Nobody closes these semaphores.
const NEVER_CLOSED: &str = "a semaphore of the server is never closed";

/// The least that the protocol's implementation allows.
const LEAST_BUFFER_BYTES: usize = 8192;

/// How long to wait where no connection could be taken up.
const RETRY: Duration = Duration::from_millis(100);

/// What all connections share.
pub(super) struct House {
    site: Arc<dyn Site>,
    address: SocketAddr,
    limits: Limits,
    connections: Arc<Semaphore>,
    web_sockets: Arc<Semaphore>,
    calls: Arc<Semaphore>,
    /// Resolves when the server ends.
    stopped: watch::Receiver<()>,
}

impl House {
    pub(super) fn new(
        site: Arc<dyn Site>,
        address: SocketAddr,
        limits: Limits,
        stopped: watch::Receiver<()>,
    ) -> Arc<Self> {
        let places = |count| Arc::new(Semaphore::new(count));
        Arc::new(Self {
            site,
            address,
            connections: places(limits.connections),
            web_sockets: places(limits.web_sockets),
            calls: places(limits.calls),
            limits,
            stopped,
        })
    }

    /// A place for a connection, as soon as there is one.
    pub(super) async fn place(&self) -> OwnedSemaphorePermit {
        self.connections.clone().acquire_owned().await.expect(NEVER_CLOSED)
    }
}

/// Serves until `stopped`, then until all connections have ended or the time for that is over.
pub(super) async fn serve(listener: TcpListener, house: Arc<House>) {
    let mut stopped = house.stopped.clone();
    tokio::select! {
        () = accept(&listener, &house) => {}
        _ = stopped.changed() => {}
    }
    drop(listener);
    let all = house.connections.acquire_many(house.limits.connections as u32);
    // What has not ended by then ends with the runtime.
    let _ = timeout(house.limits.farewell_time, all).await;
}

/// Takes up connections as there are places for them.
async fn accept(listener: &TcpListener, house: &Arc<House>) {
    loop {
        let place = house.place().await;
        match listener.accept().await {
            Ok((stream, _)) => {
                // Without it, a small answer may wait for the last one's acknowledgement.
                let _ = stream.set_nodelay(true);
                tokio::spawn(converse(stream, house.clone(), place));
            }
            // One that broke before it was taken up, or no file handle left: others end, and then there are some.
            Err(_) => sleep(RETRY).await,
        }
    }
}

/// Answers the requests of a connection, one after the other.
pub(super) async fn converse<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
    stream: S,
    house: Arc<House>,
    place: OwnedSemaphorePermit,
) {
    // A write that has waited for the reader for as long fails.
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(house.limits.stall_time));
    let stream = TokioIo::new(stream);
    let mut stopped = house.stopped.clone();
    let place = Arc::new(place);
    let mut protocol = http1::Builder::new();
    protocol
        .timer(TokioTimer::new())
        .header_read_timeout(house.limits.head_time)
        .max_header_size(house.limits.head_bytes)
        .max_buf_size(house.limits.head_bytes.max(LEAST_BUFFER_BYTES));
    let answer = service_fn(move |request| answer(request, house.clone(), place.clone()));
    let mut connection = pin!(protocol.serve_connection(stream, answer).with_upgrades());
    tokio::select! {
        // An error is a reader that is gone, too slow or speaks no HTTP: the connection ends, nobody else is concerned.
        _ = connection.as_mut() => return,
        _ = stopped.changed() => connection.as_mut().graceful_shutdown(),
    }
    let _ = connection.await;
}

/// Answers a request.
async fn answer(
    request: Request<Incoming>,
    house: Arc<House>,
    place: Arc<OwnedSemaphorePermit>,
) -> Result<Reply, Infallible> {
    let reply = if let Some((status, why)) = guard::refuse(&request, house.address) {
        reply::refusal(status, why)
    } else if let Some(path) = reply::decode(request.uri().path()) {
        let upgrade = request.headers().get(header::UPGRADE);
        if upgrade.is_some_and(|to| to.as_bytes().eq_ignore_ascii_case(b"websocket")) {
            open(request, &path, &house, place)
        } else {
            get(request, path, &house).await
        }
    } else {
        not_found()
    };
    Ok(reply::harden(reply))
}

fn not_found() -> Reply {
    reply::text(StatusCode::NOT_FOUND, "There is nothing at this address.\n")
}

/// What the site has at a path.
async fn get(request: Request<Incoming>, path: String, house: &House) -> Reply {
    let gzip = reply::takes_gzip(request.headers());
    let turn = house.calls.clone().acquire_owned().await.expect(NEVER_CLOSED);
    let site = house.site.clone();
    let call = move || {
        let answer = site.get(&path);
        drop(turn);
        answer.map(|answer| reply::content(answer, gzip))
    };
    let (give, answer) = oneshot::channel();
    // Not on the runtime's own threads: where it cannot start one, it panics. Nobody may wait for the answer any more.
    let answering = thread::Builder::new().spawn(move || drop(give.send(call())));
    if answering.is_err() {
        return reply::text(StatusCode::SERVICE_UNAVAILABLE, "No thread can be started to answer. Try again.\n");
    }
    match answer.await {
        Ok(found) => found.unwrap_or_else(not_found),
        Err(_) => reply::text(
            StatusCode::INTERNAL_SERVER_ERROR,
            "This could not be made: a fault in the program. Its terminal says more.\n",
        ),
    }
}

/// Turns a connection into a WebSocket that is told a feed.
fn open(request: Request<Incoming>, path: &str, house: &Arc<House>, place: Arc<OwnedSemaphorePermit>) -> Reply {
    let Some(feed) = house.site.feed(path) else { return not_found() };
    let mut request = request;
    let upgraded = hyper::upgrade::on(&mut request);
    let Ok(reply) = create_response(&request.map(|_| ())) else {
        return reply::refusal(StatusCode::BAD_REQUEST, "This is not how a WebSocket of version 13 is opened.\n");
    };
    let Ok(seat) = house.web_sockets.clone().try_acquire_owned() else {
        return reply::text(StatusCode::SERVICE_UNAVAILABLE, "Too many pages follow already. Close one of them.\n");
    };
    let (texts, house) = (feed.follow(), house.clone());
    tokio::spawn(async move {
        // Both are held for as long as the WebSocket is open.
        let _held = (place, seat);
        if let Ok(stream) = upgraded.await {
            feed::tell(TokioIo::new(stream), texts, &house.limits, house.stopped.clone()).await;
        }
    });
    reply.map(|()| reply::Content::Left(Bytes::new().into()))
}
