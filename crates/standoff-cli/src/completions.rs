//! `standoff completions`: what shells need to complete a command.

use clap::builder::PossibleValuesParser;
use clap::{Arg, Command};
use clap_complete::{Shell, generate};
use standoff_results::Failure;
use standoff_sim::scenario::BUILT_IN;

use crate::speech::print;

pub(crate) const EXAMPLES: &str = "\
Examples:
  source <(standoff completions bash)              here, or in ~/.bashrc
  standoff completions fish > ~/.config/fish/completions/standoff.fish
  standoff completions zsh > ~/.zfunc/_standoff    a folder of $fpath";

/// Arguments that name a built-in scenario or a file. (What bash completes is the same for all arguments of a command:
/// one of two is enough.)
const NAMES: [&str; 4] = ["scenario", "a", "what", "file"];

/// Prints a shell's script.
pub(crate) fn show(shell: Shell, command: Command) -> Result<(), Failure> {
    let names = PossibleValuesParser::new(BUILT_IN.iter().map(|scenario| scenario.name));
    let named = |argument: Arg| {
        let id = argument.get_id().as_str();
        // Of what has values to choose from only bash completes files, too.
        let is_named = id == "name" || NAMES.contains(&id) && shell == Shell::Bash;
        if is_named && argument.is_positional() { argument.value_parser(names.clone()) } else { argument }
    };
    let mut script = Vec::new();
    generate(shell, &mut command.mut_subcommands(|command| command.mut_args(named)), "standoff", &mut script);
    print(&String::from_utf8_lossy(&script))
}
