//! A small web server of pages and feeds for browsers on this machine.
//!
//! A [`Site`] provides the contents. This module makes serving safe: it filters requests (`request_filter`), adds
//! security headers to every response (`response`), and enforces [`Limits`], so that slow, silent or many clients
//! cannot block others or use unbounded resources. `axum::serve` has no limits; its routes are served by hyper instead.

mod connection;
#[cfg(test)]
mod fuzz;
mod limits;
mod live_feed;
mod request_filter;
mod response;
mod state;

use std::io;
use std::net::SocketAddr;
use std::thread;

pub use axum::body::Bytes;
pub use limits::Limits;
pub use live_feed::Feed;
pub(crate) use response::policy_with_images;
pub use response::{NOT_FOUND, Refusal, Resource};
pub use state::{ServerState, Site};
use tokio::net::TcpSocket;
use tokio::sync::watch;

/// Maximum number of connections that the operating system queues; further clients must retry.
const BACKLOG: u32 = 128;

/// A running web server of a site; dropping it stops the server.
///
/// ```
/// use std::io::{Read, Write};
/// use std::net::TcpStream;
///
/// use axum::routing::get;
/// use standoff_view::serve::{Limits, Server, Site};
///
/// let site = Site::new().route("/", get(async || "hello"));
/// let server = Server::bind("127.0.0.1:0".parse()?, site, Limits::default())?;
/// let mut stream = TcpStream::connect(server.address())?;
/// write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", server.address())?;
/// let mut answer = String::new();
/// stream.read_to_string(&mut answer)?;
/// assert!(answer.starts_with("HTTP/1.1 200 OK") && answer.ends_with("hello"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    /// Dropping the sender stops the server.
    stop: Option<watch::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Server {
    /// Listens at `address` and serves the site on a separate thread. Port 0 selects a free port.
    ///
    /// Every client that can reach the address can read the site, including other machines unless it is a loopback
    /// address. The host of a request must be `localhost`, a loopback address or the bound address, with the bound
    /// port. If `address` is `0.0.0.0` or `[::]`, the host may be any IP address, but no other name.
    pub fn bind(address: SocketAddr, site: Site, limits: Limits) -> io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let listener = {
            let _within = runtime.enter();
            let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
            // Like the standard library: a restarted server can reuse its port immediately. On Windows, the option
            // would let two servers share a port.
            #[cfg(unix)]
            socket.set_reuseaddr(true)?;
            socket.set_send_buffer_size(limits.send_buffer_bytes)?;
            socket.bind(address)?;
            socket.listen(BACKLOG)?
        };
        let address = listener.local_addr()?;
        let (stop, stopped) = watch::channel(());
        let state = ServerState::new(address, limits, stopped);
        // When the server stops, calls in progress are not awaited.
        let serve = move || runtime.block_on(connection::serve(listener, state.guard(site), state));
        let thread = thread::Builder::new().name("server".into()).spawn(serve);
        let thread = thread.map_err(|reason| {
            let what = format!("cannot start a thread: {reason}; close other programs, or raise the limit (ulimit -u)");
            io::Error::new(reason.kind(), what)
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Address at which the server listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    /// Stops the server within [`Limits::shutdown_timeout`].
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // The thread has already printed the message of a panic.
            let _ = thread.join();
        }
    }
}
