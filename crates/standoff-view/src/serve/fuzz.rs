//! `bolero` fuzz targets for client input, starting with the first byte. `scripts/fuzz` runs them for longer.

#[path = "../../../standoff-io/fuzz/harness.rs"]
mod harness;

use std::panic::{AssertUnwindSafe, RefUnwindSafe};
use std::sync::Arc;

use axum::extract::{Path, Request, State};
use axum::routing::get;
use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};
use tokio::runtime::Runtime;
use tokio::sync::watch;

use super::{Bytes, Feed, Limits, NOT_FOUND, Resource, ServerState, Site, connection, live_feed};

/// Valid and invalid pieces of request heads.
const HEAD: [&str; 40] = [
    "GET / HTTP/1.1\r\n",
    "GET ",
    "HEAD ",
    "POST ",
    "/",
    "/page.js",
    "/feed",
    "/%2e%2e/x",
    "/%00",
    "/run/0/1/",
    " HTTP/1.1\r\n",
    " HTTP/1.0\r\n",
    " HTTP/2.0\r\n",
    "\r\n",
    "\r\n\r\n",
    "\n",
    "Host: 127.0.0.1:8080\r\n",
    "Host: evil.example\r\n",
    "Host: 127.0.0.1:8080\r\n\r\n",
    "Origin: http://127.0.0.1:8080\r\n",
    "Origin: null\r\n",
    "Connection: upgrade\r\n",
    "Upgrade: websocket\r\n",
    "Sec-WebSocket-Version: 13\r\n",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
    "Content-Length: 5\r\n",
    "Content-Length: -1\r\n",
    "Content-Length: 99999999999999999999\r\n",
    "Transfer-Encoding: chunked\r\n",
    "5\r\nhello\r\n",
    "Accept-Encoding: gzip;q=0, *\r\n",
    "Expect: 100-continue\r\n",
    "Sec-Fetch-Site: cross-site\r\n",
    "X: \u{1b}[2J\r\n",
    "X: \0\r\n",
    ": \r\n",
    " folded\r\n",
    "http://evil.example/",
    "*",
    "Range: bytes=0-\r\n",
];

/// WebSocket frames and pieces of frames, masked with zeros.
const FRAMES: [&[u8]; 20] = [
    b"\x81\x85\0\0\0\0hello",
    b"\x82\x81\0\0\0\0x",
    b"\x89\x80\0\0\0\0",
    b"\x8a\x80\0\0\0\0",
    b"\x8a\x84\0\0\0\0pong",
    b"\x88\x80\0\0\0\0",
    b"\x88\x82\0\0\0\0\x03\xe8",
    b"\x88\x81\0\0\0\0\x03",
    b"\x01\x81\0\0\0\0a",
    b"\x00\x81\0\0\0\0b",
    b"\x80\x81\0\0\0\0c",
    b"\x81\xfe\xff\xff\0\0\0\0",
    b"\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0",
    b"\x81\xff\0\0\0\x02\0\0\0\0\0\0\0\0",
    b"\xf1\x80\0\0\0\0",
    b"\x83\x80\0\0\0\0",
    b"\x81\x02hi",
    b"\x81\x81\0\0\0\0\xff",
    b"\0",
    b"\xff",
];

/// A site with one path of every kind.
fn site(feed: Feed) -> Site {
    let page = || Resource { kind: "text/html", body: Bytes::from_static(b"page"), gzip: false };
    let follow = async move |State(server): State<Arc<ServerState>>, request: Request| server.follow(&feed, request);
    let file = async |Path(file): Path<String>| if file == "page.js" { Ok(file) } else { Err(NOT_FOUND) };
    Site::new().route("/", get(async move || page())).route("/feed", get(follow)).route("/{*file}", get(file))
}

/// Runs a target. Random choices select pieces and damage some of them.
fn run(target: &str, pieces: &[&[u8]], starts: &[&[u8]], try_one: impl Fn(&[u8]) -> bool + RefUnwindSafe) {
    harness::run(target, 0.06, |choices| {
        let mut input = choices.one_of(starts).to_vec();
        for _ in 0..choices.below(8) {
            let change = choices.below(8);
            let at = if change < 3 { choices.below(input.len()) } else { 0 };
            match change {
                0 if !input.is_empty() => input[at] ^= 1 << choices.below(8),
                1 => input.truncate(at),
                2 => drop(input.splice(at..at, choices.one_of(pieces).iter().copied())),
                _ => input.extend(*choices.one_of(pieces)),
            }
        }
        try_one(&input)
    });
}

/// A runtime with paused time, which advances only when all tasks are idle, so that timeouts take no real time.
fn runtime() -> Runtime {
    tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap()
}

#[test]
fn any_head_is_answered_or_refused() {
    let good = "GET / HTTP/1.1\r\nHost: 127.0.0.1:8080\r\n\r\n";
    let upgrade = "GET /feed HTTP/1.1\r\nHost: 127.0.0.1:8080\r\nConnection: upgrade\r\nUpgrade: websocket\r\n\
        Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    let starts = [good, upgrade, "GET / HTTP/1.1\r\nHost: 127.0.0.1:8080\r\n", ""].map(str::as_bytes);
    let runtime = AssertUnwindSafe(runtime());
    run("server head", &HEAD.map(str::as_bytes), &starts, |input| {
        runtime.block_on(async {
            let (_stop, stopped) = watch::channel(());
            let state = ServerState::new(([127, 0, 0, 1], 8080).into(), Limits::default(), stopped);
            let site = state.guard(site(Feed::new("state".into())));
            let slot = state.slot().await;
            let (mut client, server) = duplex(64 << 10);
            let served = tokio::spawn(connection::serve_connection(server, site, state, slot));
            client.write_all(input).await.unwrap();
            let mut answer = Vec::new();
            client.read_to_end(&mut answer).await.unwrap();
            served.await.unwrap();
            assert!(answer.is_empty() || answer.starts_with(b"HTTP/1."), "{}", answer.escape_ascii());
            assert!(answer.len() < 64 << 10 && !answer.contains(&0x1b));
            answer.starts_with(b"HTTP/1.1 200") || answer.starts_with(b"HTTP/1.1 101")
        })
    });
}

#[test]
fn any_message_is_ignored_or_ends_its_web_socket() {
    let runtime = AssertUnwindSafe(runtime());
    run("server message", &FRAMES, &[b"", FRAMES[0], FRAMES[3]], |input| {
        runtime.block_on(async {
            let (_stop, stopped) = watch::channel(());
            let (feed, limits) = (Feed::new("state".into()), Limits::default());
            let (mut client, server) = duplex(64 << 10);
            client.write_all(input).await.unwrap();
            let mut received = Vec::new();
            let send = live_feed::serve_feed(server, feed.subscribe(), &limits, stopped);
            let ((), read) = tokio::join!(send, client.read_to_end(&mut received));
            read.unwrap();
            assert!(received.len() < 4 << 10, "{} bytes", received.len());
            received.windows(5).any(|text| text == b"state")
        })
    });
}
