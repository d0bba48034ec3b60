//! A claim of the paper as data: what it says, what comes out here, and a verdict that follows from the two.

use serde::Serialize;

use super::statistics::Estimate;

/// Numbers agree within this share of the paper's, unless a claim says otherwise.
pub(crate) const TOLERANCE: f64 = 0.1;
/// The size of a difference agrees between these multiples of the paper's.
const SAME_SIZE: [f64; 2] = [0.5, 1.5];
/// Two curves show the same tendency if their rank correlation is above this.
const SAME_TENDENCY: f64 = 0.5;
/// Of fewer runs intervals are wide, and what holds in all of them may not hold in the next: their verdicts are weak.
pub(crate) const FEW_RUNS: usize = 30;
/// What holds in more than this share of the runs, in percent, holds in most.
const MOST: f64 = 50.0;

/// The rules of the verdicts, for people.
pub(crate) const RULES: [(&str, &str); 5] = [
    (
        "number",
        "comes out if our 95 % interval (of a number without draws, the number) meets the paper's value within 10 %, \
         or within the tolerance that the claim names",
    ),
    (
        "difference",
        "its direction is shown if the 95 % interval of the paired difference (same seeds) leaves out zero on the \
         paper's side; it comes out if, besides, the interval of its relative size meets 0.5 to 1.5 times the paper's, \
         where the paper prints one; else it is direction only",
    ),
    (
        "always",
        "the paper shows one run in which it holds: comes out if it holds in every run, direction only if Wilson's \
         95 % interval of the share of runs lies above one half",
    ),
    ("one run", "the paper prints a number of one run: comes out if it lies within the 5 to 95 % range of our runs"),
    (
        "tendency",
        "two histories rise and fall together: comes out if the 95 % interval of the mean rank correlation lies above \
         0.5, direction only if it lies above 0",
    ),
];

/// Something that the paper says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Claim {
    /// What it says.
    pub(crate) what: String,
    /// The unit of its numbers; of a share, what it is a share of.
    pub(crate) unit: &'static str,
    /// The paper's number and ours.
    pub(crate) finding: Finding,
    /// Runs that ours comes from; 0 where nothing is drawn.
    pub(crate) runs: usize,
    /// What is known about why it does not come out, if it does not.
    #[serde(skip)]
    pub(crate) reason: &'static str,
}

/// What is compared, and how.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Finding {
    /// A number, to within a tolerance in its own unit.
    Number { paper: f64, tolerance: f64, ours: Estimate },
    /// A difference, its direction and, where the paper prints one, its size in percent.
    Difference { paper: Paper, ours: Estimate, percent: Estimate },
    /// Something that always holds: the share of runs (or of what else the unit says) in which it does, percent.
    Always { ours: Estimate },
    /// A number of one run beside the median and the 5 to 95 % range of ours.
    OneRun { paper: f64, ours: Estimate },
    /// The mean rank correlation of two histories.
    Tendency { ours: Estimate },
}

/// What the paper says of a difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Paper {
    /// By so many percent.
    Percent(f64),
    /// Less, without a number.
    Less,
}

/// What becomes of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    ComesOut,
    DirectionOnly,
    DoesNotComeOut,
}

impl Verdict {
    pub(crate) const ALL: [Self; 3] = [Self::ComesOut, Self::DirectionOnly, Self::DoesNotComeOut];

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::ComesOut => "comes out",
            Self::DirectionOnly => "direction only",
            Self::DoesNotComeOut => "does not come out",
        }
    }
}

impl Finding {
    /// A number to within the usual tolerance.
    pub(crate) fn number(paper: f64, ours: Estimate) -> Self {
        Self::Number { paper, tolerance: TOLERANCE * paper.abs(), ours }
    }

    /// The verdict, by [`RULES`]. What could not be measured does not come out.
    pub(crate) fn verdict(&self) -> Verdict {
        let meets = |ours: &Estimate, low: f64, high: f64| ours.low <= high && ours.high >= low;
        let (comes_out, direction) = match self {
            Self::Number { paper, tolerance, ours } => (meets(ours, paper - tolerance, paper + tolerance), false),
            Self::Difference { paper, ours, percent } => {
                let (sign, same_size) = match *paper {
                    Paper::Less => (-1.0, true),
                    Paper::Percent(size) => {
                        let mut bounds = SAME_SIZE.map(|share| share * size);
                        bounds.sort_by(f64::total_cmp);
                        (size, meets(percent, bounds[0], bounds[1]))
                    }
                };
                let shown = if sign < 0.0 { ours.high < 0.0 } else { ours.low > 0.0 };
                (shown && same_size, shown)
            }
            Self::Always { ours } => (ours.value >= 100.0, ours.low > MOST),
            Self::OneRun { paper, ours } => ((ours.low..=ours.high).contains(paper), false),
            Self::Tendency { ours } => (ours.low > SAME_TENDENCY, ours.low > 0.0),
        };
        match (comes_out, direction) {
            (true, _) => Verdict::ComesOut,
            (false, true) => Verdict::DirectionOnly,
            (false, false) => Verdict::DoesNotComeOut,
        }
    }
}

impl Claim {
    /// A number that is computed, with nothing drawn: the paper's, to within a tolerance, and ours.
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

    /// Something that holds in every run, or in all of what else the unit says.
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

    /// A difference, pair by pair: from, to.
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

    /// The paper's side, as people read it.
    pub(crate) fn paper(&self) -> String {
        match self.finding {
            Finding::Number { paper, tolerance, .. } if tolerance == TOLERANCE * paper.abs() => self.with_unit(paper),
            Finding::Number { paper, tolerance, .. } => {
                format!("{} (to {})", self.with_unit(paper), self.with_unit(tolerance))
            }
            Finding::Difference { paper: Paper::Percent(percent), .. } => format!("{} %", signed(percent)),
            Finding::Difference { paper: Paper::Less, .. } => "less".to_owned(),
            Finding::Always { .. } if self.unit == "runs" => "in the run shown".to_owned(),
            Finding::Always { .. } => "always".to_owned(),
            Finding::OneRun { paper, .. } => format!("{} in the run shown", self.with_unit(paper)),
            Finding::Tendency { .. } => "the same tendency".to_owned(),
        }
    }

    /// Our side.
    pub(crate) fn ours(&self) -> String {
        match self.finding {
            Finding::Number { ours, .. } | Finding::Tendency { ours } => self.estimate(ours),
            Finding::Difference { paper: Paper::Less, ours, .. } => ours.told(signed) + &self.after(),
            Finding::Difference { ours, percent, .. } => {
                let [percent, low, high] = [percent.value, percent.low, percent.high].map(signed);
                format!("{percent} % [{low}, {high}]; {}{}", ours.told(signed), self.after())
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

    /// Why, where it does not come out.
    pub(crate) fn why(&self) -> &'static str {
        match self.finding.verdict() {
            Verdict::ComesOut => "",
            _ if self.reason.is_empty() => "not explained",
            _ => self.reason,
        }
    }

    fn estimate(&self, ours: Estimate) -> String {
        if ours.low == ours.high {
            return self.with_unit(ours.value);
        }
        ours.told(shown) + &self.after()
    }

    fn with_unit(&self, value: f64) -> String {
        shown(value) + &self.after()
    }

    /// The unit after a number.
    fn after(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) }
    }
}

/// A number as people read it: four digits or three decimals, whichever is shorter; `-` for none.
pub(crate) fn shown(value: f64) -> String {
    let decimals = match value.abs() {
        size if size.is_nan() => return "-".to_owned(),
        size if size < 9.9995 => 3,
        size if size < 99.995 => 2,
        size if size < 999.95 => 1,
        _ => 0,
    };
    let text = format!("{value:.decimals$}");
    // Zero has no sign.
    if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// The same with a sign.
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
    fn a_number_comes_out_within_its_tolerance() {
        let verdict = |low, high| Finding::number(10.0, estimate(low, high)).verdict();
        assert_eq!(verdict(10.9, 11.2), Verdict::ComesOut);
        assert_eq!(verdict(8.0, 9.1), Verdict::ComesOut);
        assert_eq!(verdict(11.1, 12.0), Verdict::DoesNotComeOut);
        assert_eq!(verdict(7.0, 8.9), Verdict::DoesNotComeOut);
        let zero = Finding::Number { paper: 0.0, tolerance: 0.5, ours: Estimate::exact(0.6) };
        assert_eq!(zero.verdict(), Verdict::DoesNotComeOut);
        assert_eq!(Finding::number(10.0, NONE).verdict(), Verdict::DoesNotComeOut);
    }

    #[test]
    fn a_difference_needs_its_direction_first_and_then_its_size() {
        let verdict = |ours: (f64, f64), percent: (f64, f64)| {
            let (ours, percent) = (estimate(ours.0, ours.1), estimate(percent.0, percent.1));
            Finding::Difference { paper: Paper::Percent(-60.0), ours, percent }.verdict()
        };
        assert_eq!(verdict((-9.0, -7.0), (-50.0, -40.0)), Verdict::ComesOut);
        assert_eq!(verdict((-9.0, -7.0), (-29.0, -20.0)), Verdict::DirectionOnly);
        assert_eq!(verdict((-9.0, -7.0), (-99.0, -91.0)), Verdict::DirectionOnly);
        assert_eq!(verdict((-9.0, 1.0), (-60.0, 5.0)), Verdict::DoesNotComeOut);
        assert_eq!(verdict((7.0, 9.0), (40.0, 50.0)), Verdict::DoesNotComeOut);
        let more = |low, high| {
            let finding = Paper::Percent(20.0);
            Finding::Difference { paper: finding, ours: estimate(low, high), percent: estimate(10.0, 12.0) }.verdict()
        };
        assert_eq!((more(1.0, 2.0), more(-1.0, 2.0)), (Verdict::ComesOut, Verdict::DoesNotComeOut));
        let less = |ours| Finding::Difference { paper: Paper::Less, ours, percent: NONE }.verdict();
        assert_eq!(less(estimate(-2.0, -1.0)), Verdict::ComesOut);
        assert_eq!(less(estimate(-2.0, 0.1)), Verdict::DoesNotComeOut);
        assert_eq!(less(NONE), Verdict::DoesNotComeOut);
    }

    #[test]
    fn what_the_paper_shows_once_must_hold_in_every_run() {
        let verdict = |held: usize| {
            let ours = Estimate::share((0..200).map(|run| run < held));
            Finding::Always { ours }.verdict()
        };
        assert_eq!(verdict(200), Verdict::ComesOut);
        assert_eq!(verdict(199), Verdict::DirectionOnly);
        assert_eq!(verdict(120), Verdict::DirectionOnly);
        assert_eq!(verdict(105), Verdict::DoesNotComeOut);
        assert_eq!(Finding::Always { ours: Estimate::share([]) }.verdict(), Verdict::DoesNotComeOut);
    }

    #[test]
    fn one_run_of_the_paper_must_lie_among_ours() {
        let verdict = |paper| Finding::OneRun { paper, ours: estimate(30.0, 36.0) }.verdict();
        assert_eq!((verdict(35.0), verdict(36.1)), (Verdict::ComesOut, Verdict::DoesNotComeOut));
        assert_eq!(Finding::OneRun { paper: 35.0, ours: NONE }.verdict(), Verdict::DoesNotComeOut);
    }

    #[test]
    fn a_tendency_is_strong_weak_or_none() {
        let verdict = |low, high| Finding::Tendency { ours: estimate(low, high) }.verdict();
        assert_eq!(verdict(0.51, 0.6), Verdict::ComesOut);
        assert_eq!(verdict(0.1, 0.7), Verdict::DirectionOnly);
        assert_eq!(verdict(-0.1, 0.2), Verdict::DoesNotComeOut);
    }

    #[test]
    fn a_claim_that_does_not_come_out_says_why_or_that_nobody_knows() {
        let claim = |ours, reason| Claim {
            what: String::new(),
            unit: "m",
            finding: Finding::number(10.0, Estimate::exact(ours)),
            runs: 0,
            reason,
        };
        assert_eq!((claim(10.0, "because").why(), claim(20.0, "because").why()), ("", "because"));
        assert_eq!((claim(20.0, "").why(), claim(20.0, "").ours()), ("not explained", "20.00 m".to_owned()));
    }

    #[test]
    fn numbers_are_short_and_zero_has_no_sign() {
        let all = [0.0, -0.0001, 9.9996, 12.345, 123.456, 12345.6, f64::NAN].map(shown);
        assert_eq!(all, ["0.000", "0.000", "10.00", "12.35", "123.5", "12346", "-"]);
        assert_eq!([signed(1.0), signed(-1.0)], ["+1.000", "-1.000"]);
    }
}
