//! What a folder of results is called if nobody says: as that which was flown, so that nothing else shares it.

use std::path::{Path, PathBuf};

/// Where results go if no folder is named.
const RESULTS: &str = "standoff-out";

/// Longest name, bytes. File systems take 255, some that encrypt names 143, and an unfinished run's has an ending.
const NAME_MAX: usize = 120;

/// The folder of a scenario, of its seeds and of the changes made to it: `standoff-out/paper/figure-9-1+uavs=5`.
pub(crate) fn folder(scenario: &str, seeds: &str, changes: &[(String, String)]) -> PathBuf {
    // Built-in names have a slash.
    let (above, name) = scenario.rsplit_once('/').unwrap_or(("", scenario));
    let exact = [(name.to_owned(), seeds.to_owned())].into_iter().chain(changes.iter().cloned());
    let exact: Vec<(String, String)> = exact.collect();
    Path::new(RESULTS).join(above).join(called(&exact))
}

/// Words that need no quotes in a shell; where they do not say all, or are too long, a checksum does.
fn called(exact: &[(String, String)]) -> String {
    let (mut shown, mut crc) = (String::new(), crc32fast::Hasher::new());
    let mut says_all = true;
    for (index, (key, value)) in exact.iter().enumerate() {
        let (key_shown, value_shown) = (plain(key, |_| true), plain(value, |next| next.is_ascii_digit()));
        says_all &= key_shown == *key && value_shown == *value;
        shown += &if index == 0 { format!("{key_shown}-{value_shown}") } else { format!("+{key_shown}={value_shown}") };
        // No argument has a zero in it.
        [key, value].iter().for_each(|part| crc.update(format!("{part}\0").as_bytes()));
    }
    if says_all && shown.len() <= NAME_MAX {
        return shown;
    }
    let ending = format!("+{:08x}", crc.finalize());
    let whole = (0..=NAME_MAX - ending.len()).rev().find(|&at| shown.is_char_boundary(at));
    shown.truncate(whole.unwrap_or_default());
    shown + &ending
}

/// With a hyphen for whatever is no letter, digit, hyphen or underscore, nor a dot before a character that is `dotted`: a
/// value's last dot shall not begin an ending that means something, like that of unfinished runs.
fn plain(text: &str, dotted: impl Fn(char) -> bool) -> String {
    let mut next = text.chars().skip(1);
    let mut shown = |c: char| match (c, next.next()) {
        ('.', Some(next)) if dotted(next) => '.',
        ('-' | '_', _) => c,
        (c, _) if c.is_alphanumeric() => c,
        _ => '-',
    };
    text.chars().map(&mut shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(scenario: &str, changes: &[(&str, &str)]) -> String {
        let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        folder(scenario, "1", &changes).strip_prefix(RESULTS).unwrap_or(Path::new("")).display().to_string()
    }

    #[test]
    fn a_folder_is_called_as_what_is_flown() {
        assert_eq!(name("paper/figure-9", &[]), "paper/figure-9-1");
        assert_eq!(name("mine.v2", &[("uavs", "3")]), "mine.v2-1+uavs=3");
        let both = [("guidance.lead_s", "0.5"), ("sensor.bearing_sd_deg", "1e-3")];
        assert_eq!(name("paper/figure-9", &both), "paper/figure-9-1+guidance.lead_s=0.5+sensor.bearing_sd_deg=1e-3");
    }

    /// What looks the same is told apart by its checksum.
    #[test]
    fn what_a_shell_would_not_take_is_left_out_and_told_apart() {
        let drawn = name("mine", &[("targets.scatter.x_m", "{ normal = { sd = 3 } }")]);
        assert_eq!(drawn, "mine-1+targets.scatter.x_m=--normal-----sd---3----+12dde255");
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
            assert!(!all[..index].contains(one), "{one} twice");
        }
    }

    #[test]
    fn long_names_are_cut_and_told_apart() {
        let [one, other] = ["é".repeat(90) + "1", "é".repeat(90) + "2"].map(|value| name("mine", &[("about", &value)]));
        assert!(one.len() <= NAME_MAX && one.starts_with("mine-1+about=éé"), "{one}");
        assert_ne!(one, other);
        assert!(name(&"x".repeat(250), &[]).len() <= NAME_MAX);
    }
}
