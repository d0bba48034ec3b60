//! Responses and their headers.

use std::io::{self, Cursor, Read};

use flate2::bufread::MultiGzDecoder;
use futures_util::stream::{Iter, iter};
use http_body_util::{Either, Full, StreamBody};
use hyper::body::{Bytes, Frame};
use hyper::header::{self, HeaderName, HeaderValue};
use hyper::{HeaderMap, Response, StatusCode};

use super::site::Resource;

/// Content security policy of pages: only scripts, styles (including those set by scripts), images and feeds of this
/// site.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
    img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Headers of every response: the browser runs only contents of the site and passes nothing to other origins.
const COMMON_HEADERS: [(HeaderName, &str); 5] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Size of the pieces in which decompressed content is sent, bytes; the memory used for a client without gzip support.
const PIECE_BYTES: usize = 64 * 1024;

/// A response as it is sent.
pub(super) type HttpResponse = Response<Content>;

/// Body of a response: bytes sent unchanged, or gzip data that is decompressed while it is sent.
pub(super) type Content = Either<Full<Bytes>, StreamBody<Iter<Inflated>>>;

/// Decompressed content of gzip data, in pieces.
pub(super) struct Inflated(Box<MultiGzDecoder<Cursor<Bytes>>>);

impl Iterator for Inflated {
    type Item = io::Result<Frame<Bytes>>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut piece = vec![0; PIECE_BYTES];
        match self.0.read(&mut piece) {
            Ok(0) => None,
            Ok(length) => {
                piece.truncate(length);
                Some(Ok(Frame::data(piece.into())))
            }
            Err(reason) => Some(Err(reason)),
        }
    }
}

/// Makes the response for an answer of the site. `takes_gzip`: whether the client supports gzip.
pub(super) fn content(answer: Resource, takes_gzip: bool) -> HttpResponse {
    let body = if answer.gzip && !takes_gzip {
        let inflated = Inflated(Box::new(MultiGzDecoder::new(Cursor::new(answer.body))));
        Either::Right(StreamBody::new(iter(inflated)))
    } else {
        Either::Left(answer.body.into())
    };
    let mut reply = Response::new(body);
    let headers = reply.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(answer.kind));
    let keep = if answer.immutable { "private, max-age=31536000, immutable" } else { "no-store" };
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(keep));
    if answer.gzip {
        headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    }
    if answer.gzip && takes_gzip {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    reply
}

/// Makes a plain-text response.
pub(super) fn text(status: StatusCode, sentence: &'static str) -> HttpResponse {
    let body = Bytes::from_static(sentence.as_bytes());
    let mut reply = content(Resource { kind: "text/plain; charset=utf-8", body, gzip: false, immutable: false }, true);
    *reply.status_mut() = status;
    reply
}

/// Makes the response to a refused request and closes the connection after it.
pub(super) fn refusal(status: StatusCode, why: &'static str) -> HttpResponse {
    let mut reply = text(status, why);
    reply.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    if status == StatusCode::METHOD_NOT_ALLOWED {
        reply.headers_mut().insert(header::ALLOW, HeaderValue::from_static("GET, HEAD"));
    }
    reply
}

/// Adds the headers of every response.
pub(super) fn add_common_headers(mut reply: HttpResponse) -> HttpResponse {
    reply.headers_mut().extend(COMMON_HEADERS.map(|(name, value)| (name, HeaderValue::from_static(value))));
    reply
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

/// Percent-decodes a path. Returns `None` if it is not UTF-8, or contains control characters, backslashes, `.` or `..`
/// segments.
pub(super) fn decode(path: &str) -> Option<String> {
    let mut plain = Vec::with_capacity(path.len());
    let mut bytes = path.bytes();
    while let Some(byte) = bytes.next() {
        let mut digit = || char::from(bytes.next()?).to_digit(16);
        plain.push(if byte == b'%' { (16 * digit()? + digit()?) as u8 } else { byte });
    }
    let plain = String::from_utf8(plain).ok()?;
    let climbs = plain.split('/').any(|part| part == "." || part == "..");
    (plain.starts_with('/') && !climbs && !plain.contains(|c: char| c.is_control() || c == '\\')).then_some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_decoded_once_and_dot_segments_are_rejected() {
        for (sent, meant) in
            [("/", "/"), ("/a%20b/%C3%A9.js", "/a b/é.js"), ("/%2525", "/%25"), ("/a..b/...", "/a..b/...")]
        {
            assert_eq!(decode(sent).as_deref(), Some(meant), "{sent}");
        }
        for sent in [
            "",
            "*",
            "a",
            "/%",
            "/%4",
            "/%zz",
            "/%+1",
            "/%ff",
            "/../x",
            "/a/%2e%2e/x",
            "/a%2f..%2fx",
            "/.",
            "/a%5cb",
            "/%00",
            "/%0d%0a",
        ] {
            assert_eq!(decode(sent), None, "{sent}");
        }
    }

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
