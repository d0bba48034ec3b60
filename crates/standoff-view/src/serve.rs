//! A small server of pages and feeds to the browsers of this machine.
//!
//! What is served is a [`Site`]'s matter. Here is what keeps serving safe: who may ask (`guard`), what every answer says
//! (`reply`), and that no reader, however slow, silent or many, costs more than [`Limits`] say or holds up anybody else.

mod connection;
mod feed;
#[cfg(test)]
mod fuzz;
mod guard;
mod limits;
mod reply;
mod site;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread;

use connection::House;
pub use feed::Feed;
pub use hyper::body::Bytes;
pub use limits::Limits;
pub use site::{Answer, Site};
use tokio::net::TcpSocket;
use tokio::sync::watch;

/// Connections that the system keeps waiting for their turn; further ones it lets try again later.
const BACKLOG: u32 = 128;

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
        let house = House::new(site, address, limits, stopped);
        // A call of the site that is still under way then is not waited for.
        let serve = move || runtime.block_on(connection::serve(listener, house));
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
