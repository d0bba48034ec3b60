//! Request filter against requests of foreign pages.
//!
//! A page of another origin can make the user's browser send requests to this server. The browser then sends that
//! origin in the Origin header. If the page uses its own domain name for the address of this machine (DNS rebinding),
//! the browser sends that name in the Host header.

use std::net::{IpAddr, SocketAddr};

use axum::body::HttpBody;
use axum::extract::Request;
use axum::http::header::{self, HeaderMap, HeaderName};
use axum::http::status::StatusCode;

use super::response::Refusal;

/// Returns the response if a request must be refused. It contains nothing of the request.
pub(super) fn refuse(request: &Request, bound: SocketAddr) -> Option<Refusal> {
    let headers = request.headers();
    // A request target with an authority is meant for a proxy.
    let host = sole(headers, &header::HOST).filter(|_| request.uri().authority().is_none());
    let Some(host) = host.filter(|host| names_us(host, bound)) else {
        return Some((
            StatusCode::FORBIDDEN,
            "This server answers only requests to the address and port that it was started with.\n",
        ));
    };
    if headers.contains_key(header::ORIGIN) && !sole(headers, &header::ORIGIN).is_some_and(|at| is_page_of(at, host)) {
        return Some((StatusCode::FORBIDDEN, "Requests from pages of another origin are refused.\n"));
    }
    let site = HeaderName::from_static("sec-fetch-site");
    if headers.contains_key(&site) && !matches!(sole(headers, &site), Some("same-origin" | "none")) {
        return Some((
            StatusCode::FORBIDDEN,
            "Requests from links on other sites are refused. Enter this address in the address bar of the browser.\n",
        ));
    }
    if !request.body().is_end_stream() {
        return Some((StatusCode::BAD_REQUEST, "Requests with a body are refused.\n"));
    }
    None
}

/// Value of a header that occurs exactly once and is ASCII.
fn sole<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    values.next().filter(|_| values.next().is_none())?.to_str().ok()
}

/// Returns true if a Host header names this server by an address or by `localhost`, with the bound port. Other names
/// are rejected because foreign domains could resolve to this machine.
fn names_us(host: &str, bound: SocketAddr) -> bool {
    // Browsers omit the default port.
    let usual = (bound.port() == 80).then_some(host);
    let Some(name) = host.strip_suffix(&format!(":{}", bound.port())).or(usual) else { return false };
    let ip: Option<IpAddr> = match name.strip_prefix('[') {
        Some(inner) => inner.strip_suffix(']').and_then(|v6| v6.parse().ok()).map(IpAddr::V6),
        None => name.parse().ok().map(IpAddr::V4),
    };
    match ip {
        Some(ip) => {
            let loopback = ["127.0.0.1", "[::1]"].contains(&name);
            loopback || bound.ip().is_unspecified() || ip == bound.ip()
        }
        None => name.eq_ignore_ascii_case("localhost"),
    }
}

/// Returns true if an Origin header is the origin of a page served under `host`.
fn is_page_of(origin: &str, host: &str) -> bool {
    origin.strip_prefix("http://").is_some_and(|origin| origin.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_hosts(bound: &str, ours: &[&str], foreign: &[&str]) {
        let bound = bound.parse().unwrap();
        for host in ours {
            assert!(names_us(host, bound), "{host} is a name of {bound}");
        }
        for host in foreign {
            assert!(!names_us(host, bound), "{host} is not a name of {bound}");
        }
    }

    #[test]
    fn a_loopback_server_accepts_only_loopback_names_with_its_port() {
        assert_hosts(
            "127.0.0.1:8080",
            &["127.0.0.1:8080", "localhost:8080", "LocalHost:8080", "[::1]:8080"],
            &[
                "",
                ":8080",
                "127.0.0.1",
                "localhost",
                "127.0.0.1:8081",
                "127.0.0.1:08080",
                "127.0.0.1:80 80",
                "192.168.1.5:8080",
                "evil.example:8080",
                "localhost.evil.example:8080",
                "127.0.0.1.evil.example:8080",
                "localhost.:8080",
                "evil.example:8080@127.0.0.1:8080",
                "user@127.0.0.1:8080",
                "127.1:8080",
                "0x7f000001:8080",
                "2130706433:8080",
                "0177.0.0.1:8080",
                "[::1:8080",
                "::1:8080",
                "[127.0.0.1]:8080",
            ],
        );
    }

    #[test]
    fn a_server_bound_to_one_address_accepts_only_that_address() {
        assert_hosts(
            "192.168.1.5:9000",
            &["192.168.1.5:9000", "localhost:9000"],
            &["192.168.1.6:9000", "evil.example:9000"],
        );
        assert_hosts("[fd00::5]:9000", &["[fd00::5]:9000", "[fd00:0::5]:9000"], &["[fd00::6]:9000", "fd00::5:9000"]);
    }

    #[test]
    fn a_server_bound_to_all_addresses_accepts_any_address_but_no_name() {
        assert_hosts(
            "0.0.0.0:9000",
            &["192.168.1.5:9000", "10.0.0.1:9000", "[fd00::5]:9000", "localhost:9000"],
            &["evil.example:9000", "192.168.1.5.evil.example:9000", "192.168.1.5:9001", "my-machine:9000"],
        );
    }

    #[test]
    fn the_default_port_may_be_omitted() {
        assert_hosts("127.0.0.1:80", &["127.0.0.1", "localhost", "[::1]", "127.0.0.1:80"], &["evil.example", "::1"]);
    }
}
