//! The `standoff` command: flies, lists and checks scenarios, and shows results.

mod advise;
mod baseline;
mod compare;
mod completions;
mod export;
mod fly;
mod fly_config;
mod live_view;
mod maps;
mod merge;
mod metric_args;
mod monte_carlo;
mod output_dir;
mod overrides;
mod paper_comparison;
mod report;
mod reproduce;
mod run;
mod scenarios;
mod signals;
mod sweep;
mod terminal;
mod usage;
mod view;

use std::panic;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use overrides::key_and_value;
use standoff_app::Failure;
use standoff_io::display_text;
use standoff_io::parquet_file::panic_is_expected;

/// Simulate coordinated standoff tracking: UAVs keep groups of moving ground vehicles in view.
///
/// Without a command: fly improved/figure-9, print a summary next to the values of the paper's law, write the results
/// and print their folder.
#[derive(Parser)]
#[command(name = "standoff", version, after_help = EXAMPLES, max_term_width = WIDTH)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Fly a scenario: print a summary and write the results.
    #[command(after_help = run::EXAMPLES)]
    Run(run::Args),
    /// Fly a scenario many times with different seeds and print statistics of every metric.
    #[command(after_help = monte_carlo::EXAMPLES)]
    MonteCarlo(monte_carlo::Args),
    /// Merge the shards of a Monte Carlo batch.
    #[command(after_help = merge::EXAMPLES)]
    Merge(merge::Args),
    /// Fly a scenario many times at each point of a grid, or of random points, of its keys.
    #[command(after_help = sweep::EXAMPLES)]
    Sweep(sweep::Args),
    /// Compare two scenarios, or two settings of one, on the same random draws.
    #[command(after_help = compare::EXAMPLES)]
    Compare(compare::Args),
    /// Compute the coverage baseline of a scenario: what greedy discs with perfect knowledge of all targets would
    /// cover.
    #[command(after_help = baseline::EXAMPLES)]
    Baseline(baseline::Args),
    /// Recompute and print the results of a recorded run: scores, events, figures.
    Report {
        /// The folder of the run.
        dir: PathBuf,
        #[command(flatten)]
        metrics: metric_args::MetricArgs,
        #[command(flatten)]
        maps: maps::Maps,
        /// Print one JSON object instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Show a run in a browser: a map that replays it, charts and events.
    #[command(after_help = view::EXAMPLES)]
    View(view::Args),
    /// Write a recorded run in latitude and longitude, for maps and globes: KML, GeoJSON, GPX or CZML.
    #[command(after_help = export::EXAMPLES)]
    Export(export::Args),
    /// Run the agent of one UAV on its companion computer, behind an ArduPlane autopilot.
    #[command(after_help = fly::EXAMPLES, args_override_self = true)]
    Fly(fly::Args),
    /// Reproduce the paper's tables, figures and claims: the paper's values next to ours.
    #[command(after_help = reproduce::EXAMPLES)]
    Reproduce(reproduce::Args),
    /// List the built-in scenarios, print one, or print the schema of scenario files.
    #[command(disable_help_subcommand = true)]
    Scenarios {
        #[command(subcommand)]
        action: Option<scenarios::Action>,
    },
    /// Check a scenario file and the traffic and map files it names, without flying it.
    Check {
        /// A scenario file, or the name of a built-in scenario.
        file: String,
    },
    /// Print a shell script that completes commands, options and names.
    #[command(after_help = completions::EXAMPLES)]
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Write the manual pages of all commands to a folder, for packages.
    #[command(hide = true)]
    ManPages {
        /// The folder, which must exist.
        dir: PathBuf,
    },
}

/// Maximum width of the help text, columns; the same in a terminal and in a pipe.
const WIDTH: usize = 100;

const EXAMPLES: &str = "\
Examples:
  standoff                                            four UAVs over two groups
  standoff run paper/table-2-pair --seed 7            the paper's pair
  standoff run --traffic city.fcd.xml.gz --uavs 2     over your own traffic
  standoff monte-carlo paper/table-2-pair --runs 200  statistics of many runs
  standoff compare paper/table-2-pair --set-b guidance.lead_s=0
                                                      effect of a change
  standoff sweep paper/table-2-pair --vary guidance.lead_s=0..4:5 --runs 50
                                                      effect of several values
  standoff baseline traffic/city --uavs 4             coverage baseline
  standoff scenarios show tour/01-one-uav > mine.toml
                                                      start your own scenario
  standoff check mine.toml
  standoff report standoff-out/improved/figure-9-1    print a run's results
  standoff view standoff-out/improved/figure-9-1      show it in a browser
  standoff reproduce table-2                          compare with the paper

Exit status: 0 success, 1 failure while running, 2 wrong input or usage.";

/// Maximum length of an argument, bytes: the maximum length of a path. Limited because messages repeat arguments.
const ARGUMENT_MAX: usize = 4096;

fn main() -> ExitCode {
    silence_expected_panics();
    run_command().map_or_else(|failure| terminal::report_failure(&failure).into(), |()| ExitCode::SUCCESS)
}

/// Hides the panics that the Parquet library raises on some damaged files: they are caught and reported as damage.
fn silence_expected_panics() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |what| {
        if !panic_is_expected() {
            print(what);
        }
    }));
}

/// Returns the message for a `--set` value after a space. The argument parser may report the stray value first, which
/// would not help the user.
fn without_value() -> Option<String> {
    let arguments: Vec<_> = std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect();
    let set = arguments.windows(2).filter(|pair| ["--set", "--set-b"].contains(&pair[0].as_str()));
    set.filter_map(|pair| key_and_value(&pair[1]).err().map(|what| format!("{}: {what}", pair[0]))).next()
}

/// Returns a failure that names all arguments that are not UTF-8: the argument parser does not name them.
fn not_text() -> Failure {
    let arguments: Vec<_> = std::env::args_os().filter(|argument| argument.to_str().is_none()).collect();
    let shown: Vec<_> = arguments.iter().map(|argument| display_text::quoted(&argument.to_string_lossy())).collect();
    let advice =
        "only files and folders after an option may have such a name: rename it, or change to the folder and pass .";
    Failure::Input(format!("{}: not UTF-8 text; {advice}", shown.join(", ")))
}

fn run_command() -> Result<(), Failure> {
    if let Some(long) = std::env::args_os().find(|argument| argument.len() > ARGUMENT_MAX) {
        let (shown, bytes) = (display_text::quoted(&long.to_string_lossy()), long.len());
        let limit = format!("at most {ARGUMENT_MAX}: put long values in a scenario file");
        return Err(Failure::Input(format!("{shown}: an argument of {bytes} bytes; {limit}")));
    }
    let (arguments, file) = fly_config::with_options_of_file(std::env::args_os().collect())?;
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(misused) if misused.kind() == ErrorKind::InvalidUtf8 => return Err(not_text()),
        // The rendered message repeats arguments unescaped; `Failure` escapes them.
        Err(misused) if misused.use_stderr() => {
            let message = misused.render().to_string();
            // No option is meant as a value.
            let lines: Vec<&str> = message.lines().filter(|line| !line.starts_with("  tip: to pass ")).collect();
            let message = lines.join("\n").replace("\n\n\n", "\n\n");
            let message = message.trim_start_matches("error: ").trim_end().to_owned();
            let message = without_value().or_else(|| usage::advice(&misused)).unwrap_or(message);
            let place =
                file.map_or_else(String::new, |file| format!("with the options of {}: ", display_text::path(&file)));
            return Err(Failure::Input(place + &message));
        }
        Err(help) => return terminal::written(help.print()),
    };
    match cli.command {
        None => run::run(&run::Args::default()),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::MonteCarlo(args)) => monte_carlo::run(&args),
        Some(Command::Merge(args)) => merge::run(&args),
        Some(Command::Sweep(args)) => sweep::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Baseline(args)) => baseline::run(&args),
        Some(Command::Report { dir, metrics, maps, json }) => {
            report::show(&dir, metrics.selection(), &maps.named(), json)
        }
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Export(args)) => export::run(&args),
        Some(Command::Fly(args)) => fly::run(&args),
        Some(Command::Reproduce(args)) => reproduce::reproduce(&args),
        Some(Command::Scenarios { action }) => scenarios::run(action),
        Some(Command::Check { file }) => scenarios::check(&file),
        Some(Command::Completions { shell }) => completions::show(shell, &Cli::command()),
        Some(Command::ManPages { dir }) => clap_mangen::generate_to(Cli::command(), dir).map_err(Failure::running),
    }
}
