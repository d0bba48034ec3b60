//! `standoff completions`: prints completion scripts for shells.

use clap::builder::PossibleValuesParser;
use clap::{Arg, Command};
use clap_complete::{Shell, generate};
use standoff_app::Failure;
use standoff_sim::scenario::BUILT_IN;

use crate::terminal::print;

pub(crate) const EXAMPLES: &str = "\
Examples:
  source <(standoff completions bash)              now, or in ~/.bashrc
  standoff completions fish > ~/.config/fish/completions/standoff.fish
  standoff completions zsh > ~/.zfunc/_standoff    a folder in $fpath";

/// Arguments that name a built-in scenario or a file. Bash completes all arguments of a command alike, so that one of
/// `a` and `b` is enough.
const NAMES: [&str; 4] = ["scenario", "a", "what", "file"];

/// Prints the completion script of a shell.
pub(crate) fn show(shell: Shell, command: &Command) -> Result<(), Failure> {
    let names = PossibleValuesParser::new(BUILT_IN.iter().map(|scenario| scenario.name));
    let with_names = |argument: Arg| {
        let id = argument.get_id().as_str();
        // For an argument with possible values, only bash completes file names, too.
        let is_named = id == "name" || NAMES.contains(&id) && shell == Shell::Bash;
        if is_named && argument.is_positional() { argument.value_parser(names.clone()) } else { argument }
    };
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set()).cloned();
    let mut visible = Command::new("standoff").version(env!("CARGO_PKG_VERSION"));
    visible = visible.subcommands(shown.map(|command| command.mut_args(with_names)));
    let mut script = Vec::new();
    generate(shell, &mut visible, "standoff", &mut script);
    print(&String::from_utf8_lossy(&script))
}
