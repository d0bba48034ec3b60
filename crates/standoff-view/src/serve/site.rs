//! Interface between the server and its contents.

use hyper::body::Bytes;

use super::live_feed::Feed;

/// Contents of a server. Paths are absolute, percent-decoded and without query, such as `/page.js`, and contain no
/// `..`.
pub trait Site: Send + Sync + 'static {
    /// Returns the content at a path. The call may block for seconds, because it runs on a separate thread. A panic
    /// results in a response with status 500.
    fn get(&self, path: &str) -> Option<Resource>;

    /// Returns the feed at a path. Its text is sent to every WebSocket that opens the path, immediately and after every
    /// change. The call runs on the server's thread and must be fast.
    fn feed(&self, _path: &str) -> Option<Feed> {
        None
    }
}

/// Content at a path.
#[derive(Debug, Clone)]
pub struct Resource {
    /// Content type, such as `text/html; charset=utf-8`.
    pub kind: &'static str,
    /// Bytes, shared between all responses that are sending them.
    pub body: Bytes,
    /// True if `body` is the gzip-compressed content. It is decompressed for clients without gzip support.
    pub gzip: bool,
    /// True if the content at this path never changes: browsers may then cache it.
    pub immutable: bool,
}
