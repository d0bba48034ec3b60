//! Tests of the server over real sockets: refused requests, limits and delivered contents.

#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use axum::extract::{Path, Request, State};
use axum::routing;
use standoff_view::serve::{Bytes, Feed, Limits, Resource, Server, ServerState, Site};
use tokio_tungstenite::tungstenite::client::{IntoClientRequest, client};
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::{Error, Message, WebSocket};

/// Time limit for everything in these tests, long enough for a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// Larger than the socket buffers of any machine.
const BIG_BYTES: usize = 64 << 20;

const PAGE: &str = "<!doctype html><title>A page</title>";

/// Contents of a site with one path of every kind.
struct Pages {
    live: Feed,
    gate: Mutex<bool>,
    opened: Condvar,
    /// Number of calls that wait at the gate, and its maximum so far.
    waiting: AtomicUsize,
    waited: AtomicUsize,
    /// A large body, shared between all responses.
    big: Arc<Vec<u8>>,
}

/// A reference to the large body.
struct Big(Arc<Vec<u8>>);

impl AsRef<[u8]> for Big {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Pages {
    fn new() -> Arc<Self> {
        Arc::new(Self {
            live: Feed::new("first".into()),
            gate: Mutex::new(false),
            opened: Condvar::new(),
            waiting: AtomicUsize::new(0),
            waited: AtomicUsize::new(0),
            big: Arc::new(vec![0; BIG_BYTES]),
        })
    }

    fn wait_at_the_gate(&self) {
        let waiting = self.waiting.fetch_add(1, Ordering::SeqCst) + 1;
        self.waited.fetch_max(waiting, Ordering::SeqCst);
        let open = self.opened.wait_timeout_while(self.gate.lock().unwrap(), PATIENCE, |open| !*open).unwrap();
        drop(open);
        self.waiting.fetch_sub(1, Ordering::SeqCst);
    }

    fn open_the_gate(&self) {
        *self.gate.lock().unwrap() = true;
        self.opened.notify_all();
    }
}

/// Makes the site of these contents.
fn site(pages: Arc<Pages>) -> Site {
    let page = |body: Bytes| Resource { kind: "text/html; charset=utf-8", body, gzip: false };
    let packed = Resource { gzip: true, ..page(packed()) };
    let [through, followed] = [pages.clone(), pages.clone()];
    let wait = async move |State(server): State<Arc<ServerState>>| {
        server.call(move || through.wait_at_the_gate()).await.map(|()| page("through".into()))
    };
    let follow =
        async move |State(server): State<Arc<ServerState>>, request: Request| server.follow(&followed.live, request);
    let fault = async |State(server): State<Arc<ServerState>>| {
        server.call(|| -> Resource { panic!("intended panic of a test") }).await
    };
    Site::new()
        .route("/", routing::get(async move || page(PAGE.into())))
        .route("/file/{name}", routing::get(async move |Path(name): Path<String>| page(name.into())))
        .route("/packed", routing::get(async || packed))
        .route("/big", routing::get(async move || page(Bytes::from_owner(Big(pages.big.clone())))))
        .route("/gate", routing::get(wait))
        .route("/live", routing::get(follow))
        .route("/fault", routing::get(async || -> Resource { panic!("intended panic of a test") }))
        .route("/fault-of-a-call", routing::get(fault))
}

/// A text of about 300,000 bytes, as gzip.
fn packed() -> Bytes {
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(unpacked().as_bytes()).unwrap();
    gzip.finish().unwrap().into()
}

fn unpacked() -> String {
    "plain text ".repeat(30_000)
}

fn serve(limits: Limits) -> (Server, Arc<Pages>) {
    let pages = Pages::new();
    let server = Server::bind((Ipv4Addr::LOCALHOST, 0).into(), site(pages.clone()), limits).unwrap();
    (server, pages)
}

/// A received response.
struct Reply {
    status: u16,
    headers: BTreeMap<String, String>,
    body: Vec<u8>,
}

fn connect(at: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.set_write_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Reads until the server closes.
fn reply(mut stream: TcpStream) -> Reply {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("a response and the end of the connection");
    let split = bytes.windows(4).position(|end| end == b"\r\n\r\n").expect("a complete head");
    let head = String::from_utf8(bytes[..split].to_vec()).unwrap();
    let (status, headers) = head.split_once("\r\n").unwrap();
    let headers = headers.split("\r\n").map(|header| header.split_once(": ").unwrap());
    Reply {
        status: status.split(' ').nth(1).unwrap().parse().unwrap(),
        headers: headers.map(|(name, value)| (name.to_lowercase(), value.to_string())).collect(),
        body: bytes[split + 4..].to_vec(),
    }
}

/// Sends an HTTP/1.0 request, whose response ends with the connection. `HOST` in a header stands for the server's
/// address.
fn ask(at: SocketAddr, request: &str, headers: &[&str]) -> Reply {
    let mut stream = connect(at);
    let head = format!("{request} HTTP/1.0\r\n{}\r\n\r\n", headers.join("\r\n"));
    stream.write_all(head.replace("HOST", &at.to_string()).as_bytes()).unwrap();
    reply(stream)
}

fn get(at: SocketAddr, path: &str) -> Reply {
    ask(at, &format!("GET {path}"), &["Host: HOST"])
}

fn follow(at: SocketAddr, path: &str, headers: &[(&'static str, &str)]) -> Result<WebSocket<TcpStream>, u16> {
    let mut request = format!("ws://{at}{path}").into_client_request().unwrap();
    for (name, value) in headers {
        request.headers_mut().append(*name, value.parse().unwrap());
    }
    match client(request, connect(at)) {
        Ok((socket, _)) => Ok(socket),
        Err(tokio_tungstenite::tungstenite::HandshakeError::Failure(Error::Http(reply))) => {
            Err(reply.status().as_u16())
        }
        Err(error) => panic!("neither a WebSocket nor a response: {error}"),
    }
}

/// Reads messages of the server until `select` returns a value; skips pings.
fn next<T>(socket: &mut WebSocket<TcpStream>, select: impl Fn(Message) -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = select(socket.read().expect("a message")) {
            return found;
        }
        assert!(start.elapsed() < PATIENCE, "only pings were received");
    }
}

fn next_text(socket: &mut WebSocket<TcpStream>) -> String {
    next(socket, |message| if let Message::Text(text) = message { Some(text.to_string()) } else { None })
}

/// The code with which the server closes. Checks that no connection reset follows, which could overtake the close
/// frame.
fn close_code(mut socket: WebSocket<TcpStream>) -> CloseCode {
    let code = next(&mut socket, |message| if let Message::Close(frame) = message { frame } else { None }).code;
    socket.get_mut().read_to_end(&mut Vec::new()).expect("an orderly end, not a reset");
    code
}

#[track_caller]
fn until(what: &str, mut is_true: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_true() {
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn known_paths_are_served_and_unknown_paths_are_404() {
    let (server, _) = serve(Limits::default());
    for (path, body) in [("/?query=1", PAGE), ("/file/a%20b%2F%2E%2E.js?query=1", "a b/...js"), ("/file/%2525", "%25")]
    {
        let page = get(server.address(), path);
        assert_eq!((page.status, page.body.as_slice()), (200, body.as_bytes()), "{path}");
        assert_eq!(page.headers["content-type"], "text/html; charset=utf-8");
    }
    for path in ["/nothing", "/file", "/file/", "/file/a/b", "/file/../live", "/%2e%2e/", "/%ff", "//"] {
        assert_eq!(get(server.address(), path).status, 404, "{path}");
    }
    for path in ["/live", "/file/%ff"] {
        assert_eq!(get(server.address(), path).status, 400, "{path}");
    }
}

#[test]
fn every_response_restricts_the_browser_to_this_site() {
    let (server, _) = serve(Limits::default());
    let at = server.address();
    let foreign = ask(at, "GET /", &["Host: foreign.example"]);
    let post = ask(at, "POST /", &["Host: HOST"]);
    for (reply, status) in [
        (get(at, "/"), 200),
        (get(at, "/no"), 404),
        (get(at, "/fault"), 500),
        (get(at, "/fault-of-a-call"), 500),
        (foreign, 403),
        (post, 405),
    ] {
        assert_eq!(reply.status, status);
        assert_eq!(
            reply.headers["content-security-policy"],
            "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; \
             connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        );
        assert_eq!(reply.headers["x-content-type-options"], "nosniff");
        assert_eq!(reply.headers["referrer-policy"], "no-referrer");
        assert_eq!(reply.headers["cross-origin-resource-policy"], "same-origin");
        assert_eq!(reply.headers["cross-origin-opener-policy"], "same-origin");
        assert_eq!(reply.headers["cache-control"], "no-store");
    }
}

#[test]
fn requests_for_another_host_are_refused_without_echoing_it() {
    let (server, _) = serve(Limits::default());
    let at = server.address();
    let port = at.port();
    for host in ["localhost", "[::1]", "127.0.0.1"] {
        assert_eq!(ask(at, "GET /", &[&format!("Host: {host}:{port}")]).status, 200, "{host}");
    }
    let foreign = [
        vec![],
        vec!["Host: 127.0.0.1".to_string()],
        vec![format!("Host: foreign.example:{port}")],
        vec![format!("Host: 192.0.2.1:{port}")],
        vec![format!("Host: 127.0.0.1:{}", port.wrapping_add(1))],
        vec![format!("Host: 127.0.0.1:{port}"), format!("Host: foreign.example:{port}")],
    ];
    for headers in foreign {
        let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
        let reply = ask(at, "GET /", &headers);
        assert_eq!(reply.status, 403, "{headers:?}");
        assert!(!String::from_utf8_lossy(&reply.body).contains("foreign.example"));
    }
    assert_eq!(ask(at, "GET http://foreign.example/", &["Host: HOST"]).status, 403);
    assert_eq!(ask(at, "GET http://HOST/", &["Host: HOST"]).status, 403, "a request to a proxy");
}

#[test]
fn requests_from_another_origin_get_neither_pages_nor_feeds() {
    let (server, _) = serve(Limits::default());
    let at = server.address();
    let own = format!("http://{at}");
    assert_eq!(ask(at, "GET /", &["Host: HOST", &format!("Origin: {own}")]).status, 200);
    assert_eq!(next_text(&mut follow(at, "/live", &[("origin", &own)]).expect("a feed")), "first");
    let foreign = [
        "null",
        "http://foreign.example",
        "http://127.0.0.1",
        &format!("https://{at}"),
        &format!("http://localhost:{}", at.port()),
        &format!("http://127.0.0.1:{}", at.port().wrapping_add(1)),
        &format!("{own}.foreign.example"),
        &format!("{own}/"),
    ];
    for origin in foreign {
        assert_eq!(ask(at, "GET /", &["Host: HOST", &format!("Origin: {origin}")]).status, 403, "{origin}");
        assert_eq!(follow(at, "/live", &[("origin", origin)]).err(), Some(403), "{origin}");
    }
    assert_eq!(follow(at, "/live", &[("origin", &own), ("origin", "http://foreign.example")]).err(), Some(403));
    for (site, status) in [("same-origin", 200), ("none", 200), ("same-site", 403), ("cross-site", 403), ("", 403)] {
        assert_eq!(ask(at, "GET /", &["Host: HOST", &format!("Sec-Fetch-Site: {site}")]).status, status, "{site}");
    }
}

#[test]
fn only_get_and_head_without_a_body_are_allowed() {
    let (server, _) = serve(Limits::default());
    let at = server.address();
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "PROPFIND"] {
        let reply = ask(at, &format!("{method} /"), &["Host: HOST"]);
        assert_eq!((reply.status, reply.headers["allow"].as_str()), (405, "GET,HEAD"), "{method}");
        assert_eq!(reply.body, b"Only GET and HEAD requests are allowed.\n", "{method}");
    }
    assert_eq!(ask(at, "GET /", &["Host: HOST", "Content-Length: 1000000000"]).status, 400);
    let head = ask(at, "HEAD /", &["Host: HOST"]);
    assert_eq!((head.status, head.body.len()), (200, 0));
    assert_eq!(head.headers["content-length"], PAGE.len().to_string());
}

#[test]
fn gzip_is_sent_unchanged_if_accepted_and_decompressed_otherwise() {
    let (server, _) = serve(Limits::default());
    let at = server.address();
    let gzip = ask(at, "GET /packed", &["Host: HOST", "Accept-Encoding: br, gzip"]);
    assert_eq!((gzip.headers["content-encoding"].as_str(), gzip.headers["vary"].as_str()), ("gzip", "accept-encoding"));
    assert_eq!(gzip.body, packed());
    let head = ask(at, "HEAD /packed", &["Host: HOST"]);
    assert_eq!((head.status, head.body.len(), head.headers.get("content-encoding")), (200, 0, None));
    assert!(head.headers.get("content-length").is_none_or(|length| *length == unpacked().len().to_string()));
    let plain = get(at, "/packed");
    assert_eq!(plain.headers.get("content-encoding"), None);
    assert_eq!(plain.headers["vary"], "accept-encoding");
    assert!(plain.body == unpacked().as_bytes(), "{} bytes with other contents", plain.body.len());
}

#[test]
fn a_panic_in_the_site_is_status_500_and_the_server_continues() {
    let (server, _) = serve(Limits { calls: 2, ..Limits::default() });
    for path in ["/fault", "/fault-of-a-call"].repeat(4) {
        assert_eq!(get(server.address(), path).status, 500, "{path}");
    }
    assert_eq!(get(server.address(), "/").status, 200);
}

#[test]
fn a_head_that_is_too_large_is_not_read_to_its_end() {
    let (server, _) = serve(Limits { head_bytes: 1000, ..Limits::default() });
    let at = server.address();
    assert_eq!(ask(at, "GET /", &["Host: HOST", &format!("Long: {}", "x".repeat(900))]).status, 200);
    assert_eq!(ask(at, "GET /", &["Host: HOST", &format!("Long: {}", "x".repeat(1000))]).status, 431);
    let mut stream = connect(at);
    stream.write_all(b"GET / HTTP/1.1\r\nLong: ").unwrap();
    // Socket buffers also accept some of the data.
    let sent = (0..4096).take_while(|_| stream.write_all(&[b'x'; 16 * 1024]).is_ok()).count();
    assert!(sent < 2048, "{sent} times 16 KiB were accepted");
    assert_eq!(get(at, "/").status, 200);
}

#[test]
fn silent_and_slow_connections_are_closed() {
    let (server, _) = serve(Limits { head_time: Duration::from_millis(300), ..Limits::default() });
    let at = server.address();
    let mut silent = connect(at);
    let mut kept = connect(at);
    write!(kept, "GET / HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
    let mut slow = connect(at);
    until("a slowly sent head is rejected", || {
        std::thread::sleep(Duration::from_millis(10));
        slow.write_all(b"G").is_err()
    });
    for stream in [&mut silent, &mut kept] {
        let ended = stream.read_to_end(&mut Vec::new());
        assert!(ended.as_ref().map_or_else(|error| error.kind() == ErrorKind::ConnectionReset, |_| true), "{ended:?}");
    }
}

#[test]
fn simultaneous_connections_are_limited_and_the_others_wait() {
    let (server, pages) = serve(Limits { connections: 3, ..Limits::default() });
    let at = server.address();
    let request = |path: &str| {
        let mut stream = connect(at);
        write!(stream, "GET {path} HTTP/1.0\r\nHost: {at}\r\n\r\n").unwrap();
        stream
    };
    let held: Vec<TcpStream> = (0..3).map(|_| request("/gate")).collect();
    until("three calls wait at the gate", || pages.waiting.load(Ordering::SeqCst) == 3);
    let rest: Vec<TcpStream> = (0..10).map(|_| request("/")).collect();
    rest[0].set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let early = (&rest[0]).read(&mut [0; 1]).expect_err("no response while all slots are occupied");
    assert!([ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&early.kind()), "{early}");
    rest[0].set_read_timeout(Some(PATIENCE)).unwrap();
    pages.open_the_gate();
    assert!(held.into_iter().chain(rest).all(|stream| reply(stream).status == 200));
}

#[test]
fn the_server_recovers_from_a_flood_of_silent_connections() {
    let (server, _) = serve(Limits { connections: 4, head_time: Duration::from_millis(200), ..Limits::default() });
    let _flood: Vec<TcpStream> = (0..8).map(|_| connect(server.address())).collect();
    assert_eq!(get(server.address(), "/").status, 200);
}

#[test]
fn simultaneous_calls_of_the_site_are_limited() {
    let (server, pages) = serve(Limits { calls: 2, ..Limits::default() });
    let at = server.address();
    let requests: Vec<_> = (0..6).map(|_| std::thread::spawn(move || get(at, "/gate").status)).collect();
    until("two calls wait at the gate", || pages.waiting.load(Ordering::SeqCst) == 2);
    pages.open_the_gate();
    assert!(requests.into_iter().all(|request| request.join().unwrap() == 200));
    assert_eq!(pages.waited.load(Ordering::SeqCst), 2);
}

#[test]
fn a_stalled_client_blocks_no_other_uses_no_copy_and_is_disconnected() {
    let (server, pages) = serve(Limits { stall_time: Duration::from_secs(2), ..Limits::default() });
    let at = server.address();
    let stalled: Vec<TcpStream> = (0..8)
        .map(|_| {
            let mut stream = connect(at);
            write!(stream, "GET /big HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
            stream.read_exact(&mut [0; 1]).unwrap();
            assert!(Arc::strong_count(&pages.big) > 1, "the remaining data is a copy");
            stream
        })
        .collect();
    assert_eq!(get(at, "/").status, 200);
    assert_eq!(get(at, "/big").body.len(), BIG_BYTES);
    until("the body is released", || Arc::strong_count(&pages.big) == 1);
    for mut stream in stalled {
        let mut received = Vec::new();
        let _ = stream.read_to_end(&mut received);
        assert!(received.len() < BIG_BYTES, "the whole body had been sent");
    }
}

#[test]
fn a_feed_sends_its_newest_text_immediately_and_after_every_change() {
    let (server, pages) = serve(Limits::default());
    pages.live.send("before any client".into());
    let mut one = follow(server.address(), "/live", &[]).unwrap();
    assert_eq!(next_text(&mut one), "before any client");
    pages.live.send("second".into());
    assert_eq!(next_text(&mut one), "second");
    let mut other = follow(server.address(), "/live", &[]).unwrap();
    assert_eq!(next_text(&mut other), "second");
    assert_eq!(pages.live.readers(), 2);
    for change in 0..=1000 {
        pages.live.send(change.to_string());
    }
    for socket in [&mut one, &mut other] {
        let mut last = -1;
        while last < 1000 {
            let next = next_text(socket).parse().unwrap();
            assert!(next > last, "{next} after {last}");
            last = next;
        }
    }
    assert_eq!(follow(server.address(), "/", &[]).err(), Some(200), "this path has a page but no feed");
}

#[test]
fn a_slow_follower_blocks_no_other_and_skips_to_the_newest_text() {
    const CHANGES: usize = 400;
    let (server, pages) = serve(Limits::default());
    let mut slow = follow(server.address(), "/live", &[]).unwrap();
    let mut quick = follow(server.address(), "/live", &[]).unwrap();
    assert_eq!(next_text(&mut quick), "first");
    let text = |change: usize| format!("{change:06}{}", "x".repeat(64 * 1024));
    for change in 1..=CHANGES {
        pages.live.send(text(change));
        assert!(next_text(&mut quick) == text(change), "the quick follower receives every text");
    }
    let mut received = 1;
    while next_text(&mut slow) != text(CHANGES) {
        received += 1;
    }
    assert!(received < CHANGES / 2, "the slow follower received {received} of {CHANGES} texts");
}

#[test]
fn simultaneous_web_sockets_are_limited() {
    let (server, _) = serve(Limits { web_sockets: 2, ..Limits::default() });
    let at = server.address();
    let mut following: Vec<_> = (0..2).map(|_| follow(at, "/live", &[]).unwrap()).collect();
    assert_eq!(follow(at, "/live", &[]).err(), Some(503));
    assert_eq!(get(at, "/").status, 200);
    drop(following.pop());
    until("a slot is free again", || follow(at, "/live", &[]).is_ok());
}

#[test]
fn messages_of_followers_are_ignored_and_large_ones_close_the_web_socket() {
    let (server, pages) = serve(Limits::default());
    for bytes in [1025, 64 * 1024] {
        pages.live.send("first".into());
        let mut socket = follow(server.address(), "/live", &[]).unwrap();
        assert_eq!(next_text(&mut socket), "first");
        socket.send(Message::text("x".repeat(1024))).unwrap();
        socket.send(Message::binary(vec![0; 1024])).unwrap();
        pages.live.send("still here".into());
        assert_eq!(next_text(&mut socket), "still here");
        socket.send(Message::text("x".repeat(bytes))).unwrap();
        assert_eq!(close_code(socket), CloseCode::Size, "{bytes} bytes");
        until("the follower is gone", || pages.live.readers() == 0);
    }
}

#[test]
fn followers_that_do_not_answer_pings_are_disconnected() {
    let (server, pages) = serve(Limits { stall_time: Duration::from_millis(600), ..Limits::default() });
    let mut dead = follow(server.address(), "/live", &[]).unwrap();
    let mut alive = follow(server.address(), "/live", &[]).unwrap();
    alive.get_mut().set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    assert_eq!(pages.live.readers(), 2);
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1500) {
        // Reading answers the pings.
        let _ = alive.read();
    }
    assert_eq!(pages.live.readers(), 1);
    pages.live.send("still here".into());
    alive.get_mut().set_read_timeout(Some(PATIENCE)).unwrap();
    until("the follower that answers receives the text", || next_text(&mut alive) == "still here");
    while dead.read().is_ok() {}
}

#[test]
fn shutdown_is_quick_with_open_connections_and_closes_web_sockets() {
    let (server, pages) = serve(Limits::default());
    let at = server.address();
    let follower = follow(at, "/live", &[]).unwrap();
    let _silent = connect(at);
    let mut stalled = connect(at);
    write!(stalled, "GET /big HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
    let mut waiting = connect(at);
    write!(waiting, "GET /gate HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
    until("a call is in progress", || pages.waiting.load(Ordering::SeqCst) == 1);
    let code = std::thread::spawn(move || close_code(follower));
    let start = Instant::now();
    drop(server);
    assert!(start.elapsed() < PATIENCE / 2, "{:?}", start.elapsed());
    assert_eq!(pages.waiting.load(Ordering::SeqCst), 1, "the call is still running");
    assert_eq!(code.join().unwrap(), CloseCode::Away);
    assert!(TcpStream::connect(at).is_err(), "the port is closed");
    pages.open_the_gate();
}

#[test]
fn shutdown_waits_for_responses_in_progress_but_not_for_idle_connections() {
    let (server, pages) = serve(Limits { shutdown_timeout: PATIENCE, ..Limits::default() });
    let at = server.address();
    let mut silent = connect(at);
    let mut kept = connect(at);
    write!(kept, "GET / HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
    kept.read_exact(&mut [0; 1]).unwrap();
    let mut waiting = connect(at);
    write!(waiting, "GET /gate HTTP/1.1\r\nHost: {at}\r\n\r\n").unwrap();
    until("a call is in progress", || pages.waiting.load(Ordering::SeqCst) == 1);
    let start = Instant::now();
    let end = std::thread::spawn(move || drop(server));
    for stream in [&mut silent, &mut kept] {
        stream.read_to_end(&mut Vec::new()).unwrap();
    }
    pages.open_the_gate();
    assert_eq!(reply(waiting).status, 200);
    end.join().unwrap();
    assert!(start.elapsed() < PATIENCE / 2, "{:?}", start.elapsed());
}
