//! Tile server of the user: background images for the map of a served page.

use std::str::FromStr;

use axum::http::Uri;

/// Placeholders of a tile: zoom level, column and row.
const PLACEHOLDERS: [&str; 3] = ["{z}", "{x}", "{y}"];

/// Address of a tile server, such as `http://127.0.0.1:8080/{z}/{x}/{y}.png`, whose tiles are in the Web Mercator
/// projection (EPSG:3857) with row 0 in the north. Pages request the tiles themselves.
///
/// ```
/// use standoff_view::tiles::TileServer;
///
/// let server: TileServer = "http://127.0.0.1:8080/{z}/{x}/{y}.png".parse()?;
/// assert_eq!(server.origin(), "http://127.0.0.1:8080");
/// assert!("http://127.0.0.1:8080/{z}/{x}.png".parse::<TileServer>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TileServer {
    template: String,
    origin: String,
}

impl TileServer {
    /// Address with `{z}`, `{x}` and `{y}`.
    #[must_use]
    pub fn template(&self) -> &str {
        &self.template
    }

    /// Scheme, host and port: the only other origin from which a page may request images.
    #[must_use]
    pub fn origin(&self) -> &str {
        &self.origin
    }
}

impl FromStr for TileServer {
    type Err = String;

    /// Parses an address. Fails unless it is an HTTP address without user name that contains each placeholder once.
    fn from_str(template: &str) -> Result<Self, String> {
        let help = "must be like http://127.0.0.1:8080/{z}/{x}/{y}.png";
        if let Some(name) = PLACEHOLDERS.into_iter().find(|name| template.matches(name).count() != 1) {
            return Err(format!("must contain {name} once; {help}"));
        }
        let address = PLACEHOLDERS.into_iter().fold(template.to_owned(), |address, name| address.replace(name, "0"));
        let uri: Uri = address.parse().map_err(|error| format!("not an address: {error}; {help}"))?;
        let (Some(scheme @ ("http" | "https")), Some(authority)) = (uri.scheme_str(), uri.authority()) else {
            return Err(format!("must start with http:// or https:// and a host; {help}"));
        };
        // The host becomes part of a content security policy. A user name would be visible to everyone with the page.
        if authority.as_str().contains(|letter: char| !letter.is_ascii_alphanumeric() && !".-:[]".contains(letter)) {
            return Err(format!("the host may contain letters, digits, dots, hyphens and a port; {help}"));
        }
        if !template.contains(authority.as_str()) {
            return Err(format!("the host must not contain {{z}}, {{x}} or {{y}}; {help}"));
        }
        Ok(Self { template: template.to_owned(), origin: format!("{scheme}://{authority}") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_templates_of_http_addresses_are_accepted() {
        for (template, origin) in [
            ("http://127.0.0.1:8080/{z}/{x}/{y}.png", "http://127.0.0.1:8080"),
            ("https://tiles.example.org/a/{z}/{x}/{y}?key=1&s=2", "https://tiles.example.org"),
            ("http://[::1]:81/?z={z}&x={x}&y={y}", "http://[::1]:81"),
        ] {
            assert_eq!(template.parse::<TileServer>().unwrap().origin(), origin);
        }
        for (template, expected) in [
            ("", "must contain {z} once"),
            ("http://a/{z}/{x}", "must contain {y} once"),
            ("http://a/{z}/{x}/{y}/{z}", "must contain {z} once"),
            ("/{z}/{x}/{y}", "must start with http"),
            ("ftp://a/{z}/{x}/{y}", "must start with http"),
            ("javascript:alert(1)//{z}{x}{y}", "not an address"),
            ("http://a b/{z}/{x}/{y}", "not an address"),
            ("http://user:word@a/{z}/{x}/{y}", "the host may contain"),
            ("http://a;script-src/{z}/{x}/{y}", "the host may contain"),
            ("http://{z}.a/{x}/{y}", "the host must not contain"),
            ("http://a/{z}/{x}/{y}\"><script>", "not an address"),
        ] {
            let error = template.parse::<TileServer>().unwrap_err();
            assert!(error.starts_with(expected), "{template}: {error}");
        }
    }
}
