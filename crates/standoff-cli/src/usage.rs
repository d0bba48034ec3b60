//! Advice for arguments that the parser refuses.

use std::error::Error as _;
use std::num::{ParseFloatError, ParseIntError};

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use standoff_io::display_text::quoted;
use standoff_sim::scenario::{built_in, built_in_like};

/// Subcommands and options that exist under another name, or as another option: what was typed, and what to use.
const REPLACEMENTS: [(&str, &str); 6] = [
    ("--rate", "--speed FACTOR"),
    ("--schema", "standoff scenarios schema"),
    ("--duration", "--set duration_s=SECONDS"),
    ("--period", "--set period_s=SECONDS"),
    ("--targets", "--set targets.random.count=N"),
    ("--scenario", "the scenario's name without an option: standoff run SCENARIO"),
];

/// Returns a message with the right command or option, if the parser's own message does not.
pub(crate) fn advice(misused: &Error) -> Option<String> {
    let text = |kind| match misused.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    match misused.kind() {
        ErrorKind::InvalidSubcommand => {
            let typed = text(ContextKind::InvalidSubcommand)?;
            if std::env::args().nth(1).is_some_and(|command| command == "scenarios") {
                return Some(show_scenario(typed));
            }
            replacement(typed).map(|use_this| format!("{}: no such command; use `{use_this}`", quoted(typed)))
        }
        ErrorKind::UnknownArgument => {
            let typed = text(ContextKind::InvalidArg)?;
            match (typed.strip_prefix('-'), replacement(typed)) {
                (_, Some(use_this)) => Some(format!("{}: no such option; use {use_this}", quoted(typed))),
                // A negative number is taken for an option.
                (Some(number), None) if number.parse::<f64>().is_ok() => {
                    let arguments: Vec<String> = std::env::args().collect();
                    let option = arguments.windows(2).find(|pair| pair[1] == typed).map(|pair| pair[0].as_str());
                    Some(format!("{} {typed}: must not be negative", option.unwrap_or_default()))
                }
                _ => None,
            }
        }
        ErrorKind::ValueValidation => {
            let source = misused.source()?;
            let expected = match (source.is::<ParseIntError>(), source.is::<ParseFloatError>()) {
                (true, _) => "a whole number",
                (_, true) => "a number",
                _ => return None,
            };
            let (option, value) = (text(ContextKind::InvalidArg)?, text(ContextKind::InvalidValue)?);
            let option = option.split_whitespace().next()?;
            Some(format!("{option} {}: must be {expected}", quoted(value)))
        }
        _ => None,
    }
}

/// Advice if a scenario's name follows `standoff scenarios` directly.
fn show_scenario(typed: &str) -> String {
    let known = built_in(typed).map(|_| format!("use `standoff scenarios show {typed}`"));
    let advice = known.or_else(|| built_in_like(typed)).unwrap_or_else(|| "see standoff scenarios --help".to_owned());
    format!("{}: no such command; {advice}", quoted(typed))
}

fn replacement(typed: &str) -> Option<&'static str> {
    REPLACEMENTS.iter().find(|(retired, _)| *retired == typed).map(|(_, use_this)| *use_this)
}
