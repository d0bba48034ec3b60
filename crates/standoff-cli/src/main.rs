//! The `standoff` command: flies scenarios, lists them, checks them.

mod changes;
mod compare;
mod completions;
mod folder;
mod interruption;
mod maps;
#[cfg_attr(not(feature = "mcap"), path = "mcap_left_out.rs")]
mod mcap;
mod merge;
mod monte_carlo;
mod papers_law;
mod reproduce;
mod run;
mod scenarios;
mod show;
mod speech;
mod view;
mod wanted;
mod watch;
mod yardstick;

use std::panic;
use std::path::PathBuf;
use std::process::ExitCode;

use changes::key_and_value;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use standoff_results::Failure;
use standoff_sim::record::panic_is_expected;
use standoff_sim::text;

/// UAVs keep groups of moving ground vehicles in view: coordinated standoff tracking, simulated.
///
/// Without a command: flies best/figure-9, prints the outcome beside that of the paper's law, writes the results, says
/// where.
#[derive(Parser)]
#[command(name = "standoff", version, after_help = EXAMPLES, disable_help_subcommand = true, max_term_width = WIDTH)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Fly a scenario: print the outcome, write the results.
    #[command(after_help = run::EXAMPLES)]
    Run(run::Args),
    /// Fly a scenario many times, each with a seed of its own: statistics of every metric.
    #[command(after_help = monte_carlo::EXAMPLES)]
    MonteCarlo(monte_carlo::Args),
    /// Put the shards of a Monte Carlo batch together.
    #[command(after_help = merge::EXAMPLES)]
    Merge(merge::Args),
    /// Compare two scenarios, or two values of one, on the same draws: does a change help?
    #[command(after_help = compare::EXAMPLES)]
    Compare(compare::Args),
    /// How much of a scenario greedy discs that know where every target is would watch: a yardstick for its runs.
    #[command(after_help = yardstick::EXAMPLES)]
    Yardstick(yardstick::Args),
    /// Tell a finished run again, from its record alone: scores, events, figures.
    Show {
        /// The folder of the run.
        dir: PathBuf,
        #[command(flatten)]
        metrics: wanted::Wanted,
        #[command(flatten)]
        maps: maps::Maps,
        /// Print one JSON object instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Look at a run in a browser: a map that replays it, charts, events.
    #[command(after_help = view::EXAMPLES)]
    View(view::Args),
    /// Measure the paper's tables, figures and claims again: paper beside ours.
    #[command(after_help = reproduce::EXAMPLES)]
    Reproduce(reproduce::Args),
    /// List the built-in scenarios, or print one.
    Scenarios {
        /// The scenario to print.
        name: Option<String>,
        /// Print the JSON schema of scenario files, with which editors complete and check them.
        #[arg(long, conflicts_with = "name")]
        schema: bool,
    },
    /// Check a scenario file, and the traffic and maps it names; nothing else.
    Check {
        /// A scenario file, or the name of a built-in scenario.
        file: String,
    },
    /// Print a script with which a shell completes commands, options and names.
    #[command(after_help = completions::EXAMPLES)]
    Completions {
        /// The shell.
        shell: Shell,
    },
}

/// Help is no wider, and as wide in a pipe, columns.
const WIDTH: usize = 100;

const EXAMPLES: &str = "\
Examples:
  standoff                                            four UAVs over two groups
  standoff run paper/table-2-pair --seed 7            the paper's pair
  standoff run --traffic city.fcd.xml.gz --uavs 2     over your own traffic
  standoff monte-carlo paper/table-2-pair --runs 200  how it goes on average
  standoff compare paper/table-2-pair --set-b guidance.lead_s=0
                                                      what a change does
  standoff yardstick traffic/city --uavs 4            what could be watched
  standoff scenarios tour/01-one-uav > mine.toml      begin one of your own
  standoff check mine.toml
  standoff show standoff-out/best/figure-9-1          tell a run again
  standoff view standoff-out/best/figure-9-1          look at it in a browser
  standoff reproduce table-2                          the paper's beside ours

Exit status: 0 done, 1 failed while running, 2 wrong input or usage.";

/// Longest argument, bytes: as long as a path may be. Messages repeat arguments.
const ARGUMENT_MAX: usize = 4096;

fn main() -> ExitCode {
    silence_expected_panics();
    done().map_or_else(|failure| speech::told(&failure).into(), |()| ExitCode::SUCCESS)
}

/// The library of Parquet panics on some damaged files. Such a panic is caught, and told as damage: nobody need hear of it.
fn silence_expected_panics() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |what| {
        if !panic_is_expected() {
            print(what);
        }
    }));
}

/// What to write where a value was set with a space: who parses arguments may complain of what comes behind that first.
fn without_value() -> Option<String> {
    let arguments: Vec<_> = std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect();
    let set = arguments.windows(2).filter(|pair| ["--set", "--set-b"].contains(&pair[0].as_str()));
    set.filter_map(|pair| key_and_value(&pair[1]).err().map(|what| format!("{}: {what}", pair[0]))).next()
}

/// Which arguments are not UTF-8: who parses them says only that one is.
fn not_text() -> Failure {
    let arguments: Vec<_> = std::env::args_os().filter(|argument| argument.to_str().is_none()).collect();
    let shown: Vec<_> = arguments.iter().map(|argument| text::quoted(&argument.to_string_lossy())).collect();
    let advice =
        "only files and folders after an option may be called so: rename it, or go into the folder and call it .";
    Failure::Input(format!("{}: not UTF-8 text; {advice}", shown.join(", ")))
}

fn done() -> Result<(), Failure> {
    if let Some(long) = std::env::args_os().find(|argument| argument.len() > ARGUMENT_MAX) {
        let (shown, bytes) = (text::quoted(&long.to_string_lossy()), long.len());
        let limit = format!("at most {ARGUMENT_MAX}: long values belong in a scenario file");
        return Err(Failure::Input(format!("{shown}: an argument of {bytes} bytes; {limit}")));
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(misused) if misused.kind() == ErrorKind::InvalidUtf8 => return Err(not_text()),
        // It repeats arguments as they are.
        Err(misused) if misused.use_stderr() => {
            let told = misused.render().to_string();
            let told = told.trim_start_matches("error: ").trim_end().to_owned();
            return Err(Failure::Input(without_value().unwrap_or(told)));
        }
        Err(help) => help.exit(),
    };
    match cli.command {
        None => run::run(&run::Args::default()),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::MonteCarlo(args)) => monte_carlo::run(&args),
        Some(Command::Merge(args)) => merge::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Yardstick(args)) => yardstick::run(&args),
        Some(Command::Show { dir, metrics, maps, json }) => show::show(&dir, metrics.choice, &maps.named(), json),
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Reproduce(args)) => reproduce::reproduce(&args),
        Some(Command::Scenarios { schema: true, .. }) => scenarios::show_schema(),
        Some(Command::Scenarios { name, .. }) => scenarios::show(name.as_deref()),
        Some(Command::Check { file }) => scenarios::check(&file),
        Some(Command::Completions { shell }) => completions::show(shell, Cli::command()),
    }
}
