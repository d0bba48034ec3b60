//! What is served, as the server sees it.

use hyper::body::Bytes;

use super::feed::Feed;

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
