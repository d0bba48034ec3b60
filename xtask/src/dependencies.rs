//! Checks the dependencies: licences and sources against `deny.toml`, the lock file, and known vulnerabilities if
//! `cargo deny` and its database are available.

use std::fs;
use std::path::Path;
use std::process::Command;

use cargo_metadata::{CargoOpt, MetadataCommand, Package};
use serde::Deserialize;
use spdx::{Expression, Licensee, ParseMode};

/// The part of `deny.toml` that this check uses.
#[derive(Deserialize)]
struct Allowed {
    licenses: Licences,
    sources: Sources,
}

#[derive(Deserialize)]
struct Licences {
    allow: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

/// Checks all packages that any feature can include; returns a summary of the checks.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let text = fs::read_to_string(root.join("deny.toml")).map_err(|reason| format!("deny.toml: {reason}"))?;
    let allowed: Allowed = toml::from_str(&text).map_err(|error| format!("deny.toml: {error}"))?;
    let licensees = allowed
        .licenses
        .allow
        .iter()
        .map(|licence| Licensee::parse(licence).map_err(|error| format!("deny.toml: {licence}: {}", error.reason)));
    let licensees = licensees.collect::<Result<Vec<_>, _>>()?;
    let mut command = MetadataCommand::new();
    command.current_dir(root).features(CargoOpt::AllFeatures).other_options(["--locked".to_owned()]);
    let metadata = command.exec().map_err(|error| format!("the lock file does not list all dependencies: {error}"))?;
    let external: Vec<&Package> = metadata.packages.iter().filter(|package| package.source.is_some()).collect();
    let problems: Vec<String> =
        external.iter().flat_map(|package| problems(package, &licensees, &allowed.sources)).collect();
    if !problems.is_empty() {
        return Err(problems.join("\n"));
    }
    let advisories = advisories(root)?;
    Ok(format!("{} dependencies: deny.toml allows all licences and sources; {advisories}", external.len()))
}

fn problems(package: &Package, licensees: &[Licensee], sources: &Sources) -> Vec<String> {
    let licence = licence_problem(package.license.as_deref().unwrap_or_default(), licensees);
    let source = package.source.as_ref().map_or("", |source| source.repr.as_str());
    let is_allowed = sources.allow_registry.iter().any(|allowed| source.strip_prefix("registry+") == Some(allowed));
    let source = (!is_allowed).then(|| format!("from {source}, which deny.toml does not allow"));
    let found = licence.into_iter().chain(source);
    found.map(|problem| format!("{} {}: {problem}", package.name, package.version)).collect()
}

/// Returns the problem of a licence expression, if it has one.
fn licence_problem(licence: &str, licensees: &[Licensee]) -> Option<String> {
    match Expression::parse_mode(licence, ParseMode::LAX) {
        Ok(expression)
            if expression.evaluate(|required| licensees.iter().any(|licensee| licensee.satisfies(required))) =>
        {
            None
        }
        Ok(_) => Some(format!("licence {licence}: deny.toml does not allow it")),
        Err(error) => Some(format!("licence \"{licence}\" cannot be parsed: {}", error.reason)),
    }
}

/// Runs `cargo deny`. A missing tool or an unreachable database is reported, but is not an error.
fn advisories(root: &Path) -> Result<&'static str, String> {
    let deny = |arguments: &[&str]| Command::new("cargo").arg("deny").args(arguments).current_dir(root).output();
    if !deny(&["--version"]).is_ok_and(|output| output.status.success()) {
        return Ok("advisories NOT checked: cargo-deny is not installed");
    }
    if !deny(&["fetch", "db"]).is_ok_and(|output| output.status.success()) {
        return Ok("advisories NOT checked: the database cannot be reached");
    }
    let output = deny(&["check", "advisories"]).map_err(|reason| format!("cargo deny: {reason}"))?;
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() { Ok("no known vulnerability") } else { Err(messages) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_that_are_not_allowed_are_reported() {
        let licensees: Vec<Licensee> = ["MIT", "Zlib"].iter().filter_map(|name| Licensee::parse(name).ok()).collect();
        let problem = |licence: &str| licence_problem(licence, &licensees);
        assert_eq!(problem("MIT"), None);
        assert_eq!(problem("MIT/Apache-2.0"), None);
        assert_eq!(problem("GPL-3.0-only OR (MIT AND Zlib)"), None);
        for refused in ["GPL-3.0-only", "MIT AND GPL-3.0-only", "Apache-2.0", "", "mine"] {
            assert!(problem(refused).is_some_and(|message| message.contains(refused)), "{refused}");
        }
    }
}
