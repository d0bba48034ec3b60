//! Default names of result folders: derived from the scenario, seeds and changes, so that each has its own folder.

use std::path::{Path, PathBuf};

/// Parent folder of all default result folders.
const RESULTS: &str = "standoff-out";

/// Maximum length of a folder name, bytes. File systems allow 255, some that encrypt names 143; the names of unfinished
/// runs need room for a suffix.
const NAME_MAX: usize = 120;

/// Returns the result folder for a scenario, its seeds and its changes: `standoff-out/paper/figure-9-1+uavs=5`.
pub(crate) fn folder(scenario: &str, seeds: &str, changes: &[(String, String)]) -> PathBuf {
    // Names of built-in scenarios contain a slash.
    let (parent, name) = scenario.rsplit_once('/').unwrap_or(("", scenario));
    let exact = [(name.to_owned(), seeds.to_owned())].into_iter().chain(changes.iter().cloned());
    let exact: Vec<(String, String)> = exact.collect();
    Path::new(RESULTS).join(parent).join(folder_name(&exact))
}

/// Returns a name that needs no quotes in a shell. If characters were replaced or the name was shortened, a checksum of
/// the exact text keeps it unique.
fn folder_name(exact: &[(String, String)]) -> String {
    let (mut name, mut crc) = (String::new(), crc32fast::Hasher::new());
    let mut is_exact = true;
    for (index, (key, value)) in exact.iter().enumerate() {
        let (safe_key, safe_value) = (shell_safe(key, |_| true), shell_safe(value, |next| next.is_ascii_digit()));
        is_exact &= safe_key == *key && safe_value == *value;
        name += &if index == 0 { format!("{safe_key}-{safe_value}") } else { format!("+{safe_key}={safe_value}") };
        // Arguments contain no NUL, so it separates them.
        [key, value].iter().for_each(|part| crc.update(format!("{part}\0").as_bytes()));
    }
    if is_exact && name.len() <= NAME_MAX {
        return name;
    }
    let suffix = format!("+{:08x}", crc.finalize());
    let length = (0..=NAME_MAX - suffix.len()).rev().find(|&at| name.is_char_boundary(at));
    name.truncate(length.unwrap_or_default());
    name + &suffix
}

/// Replaces all characters except letters, digits, hyphens and underscores by hyphens. A dot is kept if `keeps_dot`
/// accepts the character after it: a value must not end like a file extension with a meaning, such as that of
/// unfinished runs.
fn shell_safe(text: &str, keeps_dot: impl Fn(char) -> bool) -> String {
    let mut next = text.chars().skip(1);
    let mut safe = |c: char| match (c, next.next()) {
        ('.', Some(next)) if keeps_dot(next) => '.',
        ('-' | '_', _) => c,
        (c, _) if c.is_alphanumeric() => c,
        _ => '-',
    };
    text.chars().map(&mut safe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(scenario: &str, changes: &[(&str, &str)]) -> String {
        let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        folder(scenario, "1", &changes).strip_prefix(RESULTS).unwrap_or(Path::new("")).display().to_string()
    }

    #[test]
    fn the_folder_name_contains_the_scenario_the_seed_and_the_changes() {
        assert_eq!(name("paper/figure-9", &[]), "paper/figure-9-1");
        assert_eq!(name("mine.v2", &[("uavs", "3")]), "mine.v2-1+uavs=3");
        let both = [("guidance.lead_s", "0.5"), ("sensor.bearing_sd_deg", "1e-3")];
        assert_eq!(name("paper/figure-9", &both), "paper/figure-9-1+guidance.lead_s=0.5+sensor.bearing_sd_deg=1e-3");
    }

    /// Names that look alike after the replacement differ by their checksums.
    #[test]
    fn characters_special_to_a_shell_are_replaced_and_names_stay_unique() {
        let drawn = name("mine", &[("targets.random.x_m", "{ normal = { sd = 3 } }")]);
        assert_eq!(drawn, "mine-1+targets.random.x_m=--normal-----sd---3----+ef351d7a");
        let all = [
            name("a b", &[]),
            name("a-b", &[]),
            name("a+b", &[]),
            name("a\nb", &[]),
            name("a\u{202e}b", &[]),
            name("a", &[("about", "b")]),
            name("a", &[("about", "x y")]),
            name("a", &[("about", "x/y")]),
            name("a", &[("about", "../..")]),
            name("a", &[("about", "x+y=1")]),
            name("a", &[("about", "x"), ("y", "1")]),
            name("a", &[("about", "x.partial")]),
            name("a", &[("about", "x.standoff-older")]),
        ];
        for (index, one) in all.iter().enumerate() {
            assert!(one.chars().all(|c| c.is_ascii_alphanumeric() || "-_.+=".contains(c)), "{one}");
            assert!(!one.ends_with(".partial") && !one.ends_with(".standoff-older"), "{one}");
            assert!(!all[..index].contains(one), "{one} occurs twice");
        }
    }

    #[test]
    fn long_names_are_shortened_and_stay_unique() {
        let [one, other] = ["é".repeat(90) + "1", "é".repeat(90) + "2"].map(|value| name("mine", &[("about", &value)]));
        assert!(one.len() <= NAME_MAX && one.starts_with("mine-1+about=éé"), "{one}");
        assert_ne!(one, other);
        assert!(name(&"x".repeat(250), &[]).len() <= NAME_MAX);
    }
}
