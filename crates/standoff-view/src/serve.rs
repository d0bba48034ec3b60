//! A small server of pages and feeds to the browsers of this machine.
//!
//! What is served is a [`Site`]'s matter. Here is what keeps serving safe: who may ask (`guard`), what every answer says
//! (`reply`), and that no reader, however slow, silent or many, costs more than [`Limits`] say or holds up anybody else.

mod connection;
mod feed;
#[cfg(test)]
mod fuzz;
mod guard;
mod reply;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

pub use feed::Feed;
pub use hyper::body::Bytes;
use tokio::net::TcpSocket;
use tokio::sync::watch;

/// Connections that the system keeps waiting for their turn; further ones it lets try again later.
const BACKLOG: u32 = 128;

/// What is served. Paths are absolute, percent-decoded and without query, such as `/page.js`; none climbs (`..`).
pub trait Site: Send + Sync + 'static {
    /// What lies at a path. It may take seconds and block: it is called on a thread of its own, and a panic in it is an
    /// answer of status 500.
    fn get(&self, path: &str) -> Option<Answer>;

    /// The feed at a path. Its newest text goes to every WebSocket that asks for it, at once and whenever it changes.
    /// Called on the server's own thread: it has to be quick.
    fn feed(&self, _path: &str) -> Option<Feed> {
        None
    }
}

/// What lies at a path.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The content type, such as `text/html; charset=utf-8`.
    pub kind: &'static str,
    /// The bytes, shared by all who are being sent them.
    pub body: Bytes,
    /// Whether `body` is the gzip of the content. Who cannot take gzip gets the content.
    pub gzip: bool,
    /// Whether this path will never have another content: a browser then asks once.
    pub immutable: bool,
}

/// What the readers may cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Connections at one time; further ones wait to be accepted.
    pub connections: usize,
    /// WebSockets among them; further ones are answered 503.
    pub web_sockets: usize,
    /// Calls of [`Site::get`] at one time; further ones wait.
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

/// A site being served, until this is dropped.
///
/// ```
/// use std::io::{Read, Write};
/// use std::net::TcpStream;
/// use std::sync::Arc;
///
/// use standoff_view::serve::{Answer, Limits, Server, Site};
///
/// struct Hello;
///
/// impl Site for Hello {
///     fn get(&self, path: &str) -> Option<Answer> {
///         let body = "hello".into();
///         (path == "/").then_some(Answer { kind: "text/plain", body, gzip: false, immutable: false })
///     }
/// }
///
/// let server = Server::bind("127.0.0.1:0".parse()?, Arc::new(Hello), Limits::default())?;
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
    /// The server ends when this goes.
    stop: Option<watch::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Server {
    /// Listens at `address` (port 0: one that is free) and serves from then on, on a thread of its own.
    ///
    /// Whoever can reach the address can read the site: other machines too, unless it is a loopback address. A browser is
    /// answered where it asks for `localhost`, a loopback address or the address bound, with its port; where `address` is
    /// `0.0.0.0` or `[::]`, for any IP address, but for no other name.
    pub fn bind(address: SocketAddr, site: Arc<dyn Site>, limits: Limits) -> io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let listener = {
            let _within = runtime.enter();
            let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
            // As the standard library does: a server started anew gets its port back at once. On Windows this would let
            // two servers share a port.
            #[cfg(unix)]
            socket.set_reuseaddr(true)?;
            socket.set_send_buffer_size(limits.send_buffer_bytes)?;
            socket.bind(address)?;
            socket.listen(BACKLOG)?
        };
        let address = listener.local_addr()?;
        let (stop, stopped) = watch::channel(());
        let serve = move || {
            // A call of the site that is still under way then is not waited for.
            runtime.block_on(connection::serve(listener, address, site, limits, stopped));
        };
        let thread = thread::Builder::new().name("server".into()).spawn(serve);
        let thread = thread.map_err(|reason| {
            let what = format!("cannot start a thread: {reason}; end other programs, or allow more (ulimit -u)");
            io::Error::new(reason.kind(), what)
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Server {
    /// Ends it, within [`Limits::farewell_time`].
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // A panic there has been told by its thread.
            let _ = thread.join();
        }
    }
}
