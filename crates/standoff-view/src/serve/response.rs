//! Responses and their headers.

use std::io::{self, Cursor, Read};

use axum::body::{Body, Bytes, to_bytes};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::status::StatusCode;
use axum::response::{IntoResponse, Response};
use flate2::bufread::MultiGzDecoder;
use futures_util::stream::iter;

/// Content security policy of pages: only scripts, styles (including those set by scripts), images and feeds of this
/// site.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
    img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Content security policy of a page that also shows images from another origin: scheme, host and port.
pub(crate) fn policy_with_images(origin: &str) -> HeaderValue {
    let policy = CONTENT_SECURITY_POLICY.replace("img-src 'self'", &format!("img-src 'self' {origin}"));
    HeaderValue::from_str(&policy).unwrap_or(HeaderValue::from_static(CONTENT_SECURITY_POLICY))
}

/// Headers of every response that does not have its own: the browser runs only contents of the site and passes nothing to other origins. It must
/// not cache, because another run or another version of standoff may use the same address later.
const COMMON_HEADERS: [(HeaderName, &str); 6] = [
    (header::CACHE_CONTROL, "no-store"),
    (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Size of the pieces in which decompressed content is sent, bytes; the memory used for a client without gzip support.
const PIECE_BYTES: usize = 64 * 1024;

/// A response without content: its status, and a sentence for the user.
pub type Refusal = (StatusCode, &'static str);

/// The response if a site has no content at a path.
pub const NOT_FOUND: Refusal = (StatusCode::NOT_FOUND, "This address does not exist.\n");

/// The response if a path has content, but not for the method of the request.
pub(super) const NOT_ALLOWED: Refusal = (StatusCode::METHOD_NOT_ALLOWED, "Only GET and HEAD requests are allowed.\n");

/// The response after a panic.
pub(super) const INTERNAL_ERROR: Refusal =
    (StatusCode::INTERNAL_SERVER_ERROR, "Internal error: see the terminal of the program for details.\n");

/// Content at a path.
#[derive(Debug, Clone)]
pub struct Resource {
    /// Content type, such as `text/html; charset=utf-8`.
    pub kind: &'static str,
    /// Bytes, shared between all responses that are sending them.
    pub body: Bytes,
    /// True if `body` is the gzip-compressed content. It is decompressed for clients without gzip support.
    pub gzip: bool,
}

impl IntoResponse for Resource {
    fn into_response(self) -> Response {
        let packed = [(header::CONTENT_ENCODING, "gzip"), (header::VARY, "accept-encoding")];
        ([(header::CONTENT_TYPE, self.kind)], self.gzip.then_some(packed), self.body).into_response()
    }
}

/// Decompressed content of gzip data, in pieces.
struct Inflated(MultiGzDecoder<Cursor<Bytes>>);

impl Iterator for Inflated {
    type Item = io::Result<Bytes>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut piece = vec![0; PIECE_BYTES];
        match self.0.read(&mut piece) {
            Ok(0) => None,
            Ok(length) => {
                piece.truncate(length);
                Some(Ok(piece.into()))
            }
            Err(reason) => Some(Err(reason)),
        }
    }
}

/// Completes a response: adds the common headers, and decompresses the content unless the client `takes_gzip`.
pub(super) async fn complete(mut response: Response, takes_gzip: bool) -> Response {
    let headers = response.headers_mut();
    for (name, value) in COMMON_HEADERS {
        headers.entry(name).or_insert(HeaderValue::from_static(value));
    }
    if takes_gzip || headers.remove(header::CONTENT_ENCODING).is_none() {
        return response;
    }
    let (parts, body) = response.into_parts();
    // The bytes of a `Resource`, not a copy; reading them from memory cannot fail.
    let gzip = to_bytes(body, usize::MAX).await.unwrap_or_default();
    Response::from_parts(parts, Body::from_stream(iter(Inflated(MultiGzDecoder::new(Cursor::new(gzip))))))
}

/// Returns true if the client supports gzip: Accept-Encoding contains `gzip` or, without it, `*`, with a weight above
/// 0.
pub(super) fn takes_gzip(headers: &HeaderMap) -> bool {
    let mut anything = false;
    let lists = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|list| list.to_str().ok());
    for coding in lists.flat_map(|list| list.split(',')) {
        let mut parts = coding.split(';').map(str::trim);
        let name = parts.next().unwrap_or_default();
        let weight = parts.find_map(|part| part.strip_prefix("q=")).map_or(Ok(1.0), str::parse::<f32>);
        let accepted = weight.is_ok_and(|weight| weight > 0.0);
        if name.eq_ignore_ascii_case("gzip") {
            return accepted;
        }
        anything |= name == "*" && accepted;
    }
    anything
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_is_sent_only_to_clients_that_accept_it() {
        for (sent, takes) in [
            ("gzip", true),
            ("GZIP", true),
            ("deflate, gzip;q=0.5, br", true),
            ("*", true),
            ("gzip;q=0", false),
            ("gzip; q=0.000, *", false),
            ("*;q=0", false),
            ("identity", false),
            ("gzipped", false),
            ("gzip;q=x", false),
            ("", false),
        ] {
            let headers = HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(sent))]);
            assert_eq!(takes_gzip(&headers), takes, "{sent}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));
    }
}
