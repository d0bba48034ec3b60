//! A claim of the paper as data: its statement, the paper's number and ours, and a verdict derived from them.

use serde::Serialize;

use super::statistics::Estimate;

/// Default relative tolerance within which two numbers agree.
pub(crate) const TOLERANCE: f64 = 0.1;
/// Range within which the size of a difference agrees, as multiples of the paper's size.
const SAME_SIZE: [f64; 2] = [0.5, 1.5];
/// Rank correlation above which two curves show the same tendency.
const SAME_TENDENCY: f64 = 0.5;
/// Number of runs below which verdicts are weak: intervals are wide, and a statement that holds in all runs may fail in
/// the next one.
pub(crate) const FEW_RUNS: usize = 30;
/// Percentage of runs above which a statement holds in most runs.
const MOST: f64 = 50.0;

/// The rules of the verdicts, as text: kind of claim, rule.
pub(crate) const RULES: [(&str, &str); 5] = [
    (
        "number",
        "reproduced if our 95 % interval (or our number, if it involves no random numbers) overlaps the paper's value \
         within 10 %, or within the tolerance that the claim states",
    ),
    (
        "difference",
        "the direction is confirmed if the 95 % interval of the paired difference (same seeds) excludes zero and has \
         the paper's sign; reproduced if also the interval of the relative size overlaps 0.5 to 1.5 times the paper's, \
         provided the paper states a size; otherwise direction only; undecided if the interval contains both zero and \
         what the paper states",
    ),
    (
        "always",
        "the paper shows one run in which the statement holds: reproduced if it holds in every run, direction only if \
         Wilson's 95 % interval of the fraction of runs is above one half",
    ),
    ("one run", "the paper gives a number of one run: reproduced if it is within the 5 to 95 % range of our runs"),
    (
        "tendency",
        "two histories rise and fall together: reproduced if the 95 % interval of the mean rank correlation is above \
         0.5, direction only if it is above 0",
    ),
];

/// A claim of the paper.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Claim {
    /// Statement.
    pub(crate) what: String,
    /// Unit of its numbers; for a fraction, the plural noun of the cases it counts.
    pub(crate) unit: &'static str,
    /// The paper's number and ours.
    pub(crate) finding: Finding,
    /// Number of runs behind our number; 0 if it involves no random numbers.
    pub(crate) runs: usize,
    /// Known reason why the claim is not reproduced; empty if unknown.
    #[serde(skip)]
    pub(crate) reason: &'static str,
}

/// The compared numbers, by kind of comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Finding {
    /// A number, with a tolerance in the same unit.
    Number { paper: f64, tolerance: f64, ours: Estimate },
    /// A difference: its direction and, if the paper states one, its size in percent.
    Difference { paper: Paper, ours: Estimate, percent: Estimate },
    /// A statement that always holds: percentage of positive cases; the claim's unit names the cases.
    Always { ours: Estimate },
    /// A number of one run, and the median and the 5 to 95 % range of our runs.
    OneRun { paper: f64, ours: Estimate },
    /// Mean rank correlation of two histories.
    Tendency { ours: Estimate },
}

/// The paper's statement about a difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Paper {
    /// Change in percent.
    Percent(f64),
    /// A decrease without a number.
    Less,
}

/// Result of checking a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    Reproduced,
    DirectionOnly,
    /// The interval contains both the paper's value and zero.
    Undecided,
    NotReproduced,
}

impl Verdict {
    pub(crate) const ALL: [Self; 4] = [Self::Reproduced, Self::DirectionOnly, Self::Undecided, Self::NotReproduced];

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::DirectionOnly => "direction only",
            Self::Undecided => "undecided",
            Self::NotReproduced => "not reproduced",
        }
    }
}

impl Finding {
    /// Compares a number with the default tolerance.
    pub(crate) fn number(paper: f64, ours: Estimate) -> Self {
        Self::Number { paper, tolerance: TOLERANCE * paper.abs(), ours }
    }

    /// Returns the verdict according to [`RULES`]. A claim that could not be measured is not reproduced.
    pub(crate) fn verdict(&self) -> Verdict {
        let overlaps = |ours: &Estimate, [low, high]: [f64; 2]| ours.low <= high && ours.high >= low;
        match self {
            Self::Number { paper, tolerance, ours } if overlaps(ours, [paper - tolerance, paper + tolerance]) => {
                Verdict::Reproduced
            }
            Self::Difference { paper, ours, percent } => {
                let is_same_size = paper.sizes().is_none_or(|sizes| overlaps(percent, sizes));
                let (is_same_sign, may_be_same_sign) = if paper.is_negative() {
                    (ours.high < 0.0, ours.low < 0.0)
                } else {
                    (ours.low > 0.0, ours.high > 0.0)
                };
                match (is_same_sign, may_be_same_sign && is_same_size) {
                    (true, true) => Verdict::Reproduced,
                    (true, false) => Verdict::DirectionOnly,
                    (false, true) => Verdict::Undecided,
                    (false, false) => Verdict::NotReproduced,
                }
            }
            Self::Always { ours } if ours.value >= 100.0 => Verdict::Reproduced,
            Self::Always { ours } if ours.low > MOST => Verdict::DirectionOnly,
            Self::OneRun { paper, ours } if (ours.low..=ours.high).contains(paper) => Verdict::Reproduced,
            Self::Tendency { ours } if ours.low > SAME_TENDENCY => Verdict::Reproduced,
            Self::Tendency { ours } if ours.low > 0.0 => Verdict::DirectionOnly,
            Self::Number { .. } | Self::Always { .. } | Self::OneRun { .. } | Self::Tendency { .. } => {
                Verdict::NotReproduced
            }
        }
    }
}

impl Paper {
    /// True if the paper states a decrease.
    fn is_negative(self) -> bool {
        match self {
            Self::Percent(size) => size < 0.0,
            Self::Less => true,
        }
    }

    /// Returns the changes in percent that count as the same size; `None` if the paper states no size.
    fn sizes(self) -> Option<[f64; 2]> {
        let Self::Percent(size) = self else { return None };
        let mut bounds = SAME_SIZE.map(|share| share * size);
        bounds.sort_by(f64::total_cmp);
        Some(bounds)
    }
}

impl Claim {
    /// Creates a claim about a number that is computed without random numbers: the paper's number, its tolerance, and
    /// ours.
    pub(crate) fn computed(
        what: impl Into<String>,
        unit: &'static str,
        [paper, tolerance]: [f64; 2],
        ours: f64,
        reason: &'static str,
    ) -> Self {
        let finding = Finding::Number { paper, tolerance, ours: Estimate::exact(ours) };
        Self { what: what.into(), unit, finding, runs: 0, reason }
    }

    /// Creates a claim that a statement holds in every case; `unit` names the cases, such as runs.
    pub(crate) fn always(
        what: impl Into<String>,
        unit: &'static str,
        held: impl IntoIterator<Item = bool>,
        reason: &'static str,
    ) -> Self {
        let held: Vec<bool> = held.into_iter().collect();
        let finding = Finding::Always { ours: Estimate::share(held.iter().copied()) };
        Self { what: what.into(), unit, finding, runs: held.len(), reason }
    }

    /// Creates a claim about a difference, from pairs (from, to).
    pub(crate) fn difference(
        what: impl Into<String>,
        unit: &'static str,
        paper: Paper,
        pairs: impl IntoIterator<Item = (f64, f64)>,
        reason: &'static str,
    ) -> Self {
        let (from, to): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let change: Vec<f64> = from.iter().zip(&to).map(|(from, to)| to - from).collect();
        let (ours, percent) = (Estimate::mean(&change), Estimate::percent(&from, &to));
        let finding = Finding::Difference { paper, ours, percent };
        Self { what: what.into(), unit, finding, runs: change.len(), reason }
    }

    /// Formats the paper's number or statement.
    pub(crate) fn paper(&self) -> String {
        match self.finding {
            Finding::Number { paper, tolerance, .. } if tolerance == TOLERANCE * paper.abs() => self.with_unit(paper),
            Finding::Number { paper, tolerance, .. } => {
                format!("{} (± {})", self.with_unit(paper), self.with_unit(tolerance))
            }
            Finding::Difference { paper: Paper::Percent(percent), .. } => format!("{} %", signed(percent)),
            Finding::Difference { paper: Paper::Less, .. } => "less".to_owned(),
            Finding::Always { .. } if self.unit == "runs" => "in the run shown".to_owned(),
            Finding::Always { .. } => "always".to_owned(),
            Finding::OneRun { paper, .. } => format!("{} in the run shown", self.with_unit(paper)),
            Finding::Tendency { .. } => "the same tendency".to_owned(),
        }
    }

    /// Formats our number.
    pub(crate) fn ours(&self) -> String {
        match self.finding {
            Finding::Number { ours, .. } | Finding::Tendency { ours } => self.estimate(ours),
            Finding::Difference { paper: Paper::Less, ours, .. } => ours.formatted(signed) + &self.after(),
            Finding::Difference { ours, percent, .. } => {
                let [percent, low, high] = [percent.value, percent.low, percent.high].map(signed);
                format!("{percent} % [{low}, {high}]; {}{}", ours.formatted(signed), self.after())
            }
            Finding::Always { ours } => {
                let [value, low, high] = [ours.value, ours.low, ours.high].map(shown);
                format!("in {value} % [{low}, {high}] of the {}", self.unit)
            }
            Finding::OneRun { ours, .. } => {
                format!("median {}, 5 to 95 %: {} to {}", self.with_unit(ours.value), shown(ours.low), shown(ours.high))
            }
        }
    }

    /// Returns the known cause why the claim is not reproduced; `None` if it is, or if no cause is known.
    pub(crate) fn cause(&self) -> Option<&'static str> {
        (self.finding.verdict() != Verdict::Reproduced && !self.reason.is_empty()).then_some(self.reason)
    }

    /// Describes how the numbers differ from the paper's; `None` if the claim is reproduced.
    pub(crate) fn gap(&self) -> Option<String> {
        let verdict = self.finding.verdict();
        let (Finding::Number { ours, .. }
        | Finding::Difference { ours, .. }
        | Finding::Always { ours }
        | Finding::OneRun { ours, .. }
        | Finding::Tendency { ours }) = self.finding;
        if verdict == Verdict::Reproduced {
            return None;
        }
        if ours.value.is_nan() {
            return Some("could not be measured".to_owned());
        }
        Some(match self.finding {
            Finding::Number { paper, tolerance, ours } if ours.low > paper + tolerance => {
                format!("above {}, the upper end of the tolerance", self.with_unit(paper + tolerance))
            }
            Finding::Number { paper, tolerance, .. } => {
                format!("below {}, the lower end of the tolerance", self.with_unit(paper - tolerance))
            }
            Finding::Difference { .. } if verdict == Verdict::Undecided => {
                "the interval contains the paper's value, and zero".to_owned()
            }
            Finding::Difference { paper, .. } if verdict == Verdict::DirectionOnly => {
                let sizes = paper.sizes().unwrap_or_default().map(signed);
                format!("outside {} to {} %, 0.5 to 1.5 times the paper's change", sizes[0], sizes[1])
            }
            Finding::Difference { ours, .. } if ours.low <= 0.0 && ours.high >= 0.0 => {
                "the interval contains zero, and no change of the paper's size".to_owned()
            }
            Finding::Difference { .. } => "a change in the opposite direction".to_owned(),
            Finding::Always { ours } => {
                format!("does not hold in {} % of the {}", shown(100.0 - ours.value), self.unit)
            }
            Finding::OneRun { .. } => "the paper's value is outside this range".to_owned(),
            Finding::Tendency { .. } if verdict == Verdict::DirectionOnly => {
                "the interval of the correlation does not exceed 0.5".to_owned()
            }
            Finding::Tendency { .. } => "the interval of the correlation does not exceed 0".to_owned(),
        })
    }

    fn estimate(&self, ours: Estimate) -> String {
        if ours.low == ours.high {
            return self.with_unit(ours.value);
        }
        ours.formatted(shown) + &self.after()
    }

    fn with_unit(&self, value: f64) -> String {
        shown(value) + &self.after()
    }

    /// Returns the unit with a leading space, to follow a number.
    fn after(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) }
    }
}

/// Formats a number with four digits or three decimals, whichever is shorter; `-` for NaN.
pub(crate) fn shown(value: f64) -> String {
    let decimals = match value.abs() {
        size if size.is_nan() => return "-".to_owned(),
        size if size < 9.9995 => 3,
        size if size < 99.995 => 2,
        size if size < 999.95 => 1,
        _ => 0,
    };
    let text = format!("{value:.decimals$}");
    // Negative zero is printed without its sign.
    if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// Formats a number like [`shown`], always with a sign.
pub(crate) fn signed(value: f64) -> String {
    let text = shown(value);
    if text.starts_with('-') { text } else { format!("+{text}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(low: f64, high: f64) -> Estimate {
        Estimate { value: 0.5 * (low + high), low, high }
    }

    const NONE: Estimate = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };

    #[test]
    fn a_number_is_reproduced_within_its_tolerance() {
        let verdict = |low, high| Finding::number(10.0, estimate(low, high)).verdict();
        assert_eq!(verdict(10.9, 11.2), Verdict::Reproduced);
        assert_eq!(verdict(8.0, 9.1), Verdict::Reproduced);
        assert_eq!(verdict(11.1, 12.0), Verdict::NotReproduced);
        assert_eq!(verdict(7.0, 8.9), Verdict::NotReproduced);
        let zero = Finding::Number { paper: 0.0, tolerance: 0.5, ours: Estimate::exact(0.6) };
        assert_eq!(zero.verdict(), Verdict::NotReproduced);
        assert_eq!(Finding::number(10.0, NONE).verdict(), Verdict::NotReproduced);
    }

    #[test]
    fn a_difference_is_judged_by_direction_and_size() {
        let verdict = |ours: (f64, f64), percent: (f64, f64)| {
            let (ours, percent) = (estimate(ours.0, ours.1), estimate(percent.0, percent.1));
            Finding::Difference { paper: Paper::Percent(-60.0), ours, percent }.verdict()
        };
        assert_eq!(verdict((-9.0, -7.0), (-50.0, -40.0)), Verdict::Reproduced);
        assert_eq!(verdict((-9.0, -7.0), (-29.0, -20.0)), Verdict::DirectionOnly);
        assert_eq!(verdict((-9.0, -7.0), (-99.0, -91.0)), Verdict::DirectionOnly);
        assert_eq!(verdict((-9.0, 1.0), (-60.0, 5.0)), Verdict::Undecided);
        assert_eq!(verdict((-9.0, 1.0), (-20.0, 5.0)), Verdict::NotReproduced);
        assert_eq!(verdict((7.0, 9.0), (40.0, 50.0)), Verdict::NotReproduced);
        let more = |low, high| {
            let paper = Paper::Percent(20.0);
            Finding::Difference { paper, ours: estimate(low, high), percent: estimate(10.0, 12.0) }.verdict()
        };
        assert_eq!((more(1.0, 2.0), more(-1.0, 2.0)), (Verdict::Reproduced, Verdict::Undecided));
        let less = |ours| Finding::Difference { paper: Paper::Less, ours, percent: NONE }.verdict();
        assert_eq!(less(estimate(-2.0, -1.0)), Verdict::Reproduced);
        assert_eq!(less(estimate(-2.0, 0.1)), Verdict::Undecided);
        assert_eq!(less(estimate(0.1, 0.2)), Verdict::NotReproduced);
        assert_eq!(less(NONE), Verdict::NotReproduced);
    }

    #[test]
    fn a_statement_shown_once_in_the_paper_must_hold_in_every_run() {
        let verdict = |held: usize| {
            let ours = Estimate::share((0..200).map(|run| run < held));
            Finding::Always { ours }.verdict()
        };
        assert_eq!(verdict(200), Verdict::Reproduced);
        assert_eq!(verdict(199), Verdict::DirectionOnly);
        assert_eq!(verdict(120), Verdict::DirectionOnly);
        assert_eq!(verdict(105), Verdict::NotReproduced);
        assert_eq!(Finding::Always { ours: Estimate::share([]) }.verdict(), Verdict::NotReproduced);
    }

    #[test]
    fn a_number_of_one_run_must_be_in_the_range_of_our_runs() {
        let verdict = |paper| Finding::OneRun { paper, ours: estimate(30.0, 36.0) }.verdict();
        assert_eq!((verdict(35.0), verdict(36.1)), (Verdict::Reproduced, Verdict::NotReproduced));
        assert_eq!(Finding::OneRun { paper: 35.0, ours: NONE }.verdict(), Verdict::NotReproduced);
    }

    #[test]
    fn a_tendency_is_judged_by_its_rank_correlation() {
        let verdict = |low, high| Finding::Tendency { ours: estimate(low, high) }.verdict();
        assert_eq!(verdict(0.51, 0.6), Verdict::Reproduced);
        assert_eq!(verdict(0.1, 0.7), Verdict::DirectionOnly);
        assert_eq!(verdict(-0.1, 0.2), Verdict::NotReproduced);
    }

    #[test]
    fn a_claim_that_is_not_reproduced_has_a_reason() {
        let claim = |ours, reason| Claim {
            what: String::new(),
            unit: "m",
            finding: Finding::number(10.0, Estimate::exact(ours)),
            runs: 0,
            reason,
        };
        let reason = |ours, cause| (claim(ours, cause).gap(), claim(ours, cause).cause());
        assert_eq!(reason(10.0, "because"), (None, None));
        let above = Some("above 11.00 m, the upper end of the tolerance".to_owned());
        assert_eq!(reason(20.0, "because"), (above, Some("because")));
        assert_eq!(reason(5.0, ""), (Some("below 9.000 m, the lower end of the tolerance".to_owned()), None));
        assert_eq!(reason(f64::NAN, ""), (Some("could not be measured".to_owned()), None));
        assert_eq!(claim(20.0, "").ours(), "20.00 m");
    }

    #[test]
    fn numbers_are_rounded_and_zero_has_no_sign() {
        let all = [0.0, -0.0001, 9.9996, 12.345, 123.456, 12345.6, f64::NAN].map(shown);
        assert_eq!(all, ["0.000", "0.000", "10.00", "12.35", "123.5", "12346", "-"]);
        assert_eq!([signed(1.0), signed(-1.0)], ["+1.000", "-1.000"]);
    }
}
