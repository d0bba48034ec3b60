//! A radio for tests: words go missing, come late, twice and in any order, all drawn from a seed; and what a fleet that
//! hears all at once knows of the same words.

use standoff::*;

use super::{Draw, Team, scan_of};

/// Carries what a team says.
#[derive(Clone)]
pub struct Radio {
    draw: Draw,
    /// The part of the words that goes missing, for each hearer by itself; 0 to 1.
    pub loss: f64,
    /// By so many periods words are late at most.
    pub late_max: i64,
    /// The part of the words that is heard twice.
    pub twice: f64,
    /// Who hears nothing of whom: speaker, hearer.
    pub deaf: Vec<(usize, usize)>,
    /// Who hears no cues.
    pub uncued: Vec<usize>,
    /// When it is heard, and by whom.
    under_way: Vec<(i64, usize, Message)>,
}

impl Radio {
    /// A perfect one.
    pub fn new(seed: u64) -> Self {
        let draw = Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        Self { draw, loss: 0.0, late_max: 0, twice: 0.0, deaf: Vec::new(), uncued: Vec::new(), under_way: Vec::new() }
    }

    /// From now on it is perfect; what is under way comes yet.
    pub fn heal(&mut self) {
        (self.loss, self.late_max, self.twice) = (0.0, 0, 0.0);
        self.deaf.clear();
        self.uncued.clear();
    }

    /// Nobody of one side hears anybody of the other.
    pub fn part(&mut self, one: &[usize], other: &[usize]) {
        let both = one.iter().flat_map(|a| other.iter().flat_map(|b| [(*a, *b), (*b, *a)]));
        self.deaf.extend(both);
    }

    /// Somebody hears what nobody of the team has said.
    pub fn tell(&mut self, tick: i64, to: usize, message: Message) {
        self.under_way.push((tick, to, message));
    }

    fn send(&mut self, tick: i64, (from, to): (Option<usize>, usize), message: &Message, is_sure: bool) {
        let is_deaf = from.is_some_and(|from| self.deaf.contains(&(from, to)));
        if !is_sure && (is_deaf || self.chance(self.loss)) {
            return;
        }
        for _ in 0..1 + u32::from(self.chance(self.twice)) {
            let late = if is_sure { 0 } else { self.pick(self.late_max + 1) };
            self.under_way.push((tick + late, to, message.clone()));
        }
    }

    /// What somebody hears at an instant, in any order.
    fn heard(&mut self, tick: i64, by: usize) -> Vec<Message> {
        let mine = self.under_way.extract_if(.., |(at, to, _)| *at <= tick && *to == by);
        let mut heard: Vec<Message> = mine.map(|(.., message)| message).collect();
        for place in (1..heard.len()).rev() {
            let other = self.pick(place as i64 + 1) as usize;
            heard.swap(place, other);
        }
        heard
    }

    fn chance(&mut self, of: f64) -> bool {
        self.draw.next() < 2.0 * of - 1.0
    }

    /// A number from 0 to one below this.
    fn pick(&mut self, below: i64) -> i64 {
        (0.5 * (self.draw.next() + 1.0) * below as f64) as i64
    }
}

impl Team {
    /// One whole tick over a radio; what all have said, and what each has heard. Of each cue one that is on hears at once: what nobody hears was never
    /// said. Whose computer is off flies on, unseeing and unheard.
    pub fn tick_over(&mut self, tick: i64, radio: &mut Radio) -> Words {
        let (now, cues, scans) = self.look(tick);
        let on: Vec<usize> = (0..self.agents.len()).filter(|index| !self.off.contains(index)).collect();
        let mut observed = Vec::new();
        let (mut said, mut heard, mut steps) = (Vec::new(), Vec::new(), Vec::new());
        for &index in &on {
            let agent = &mut self.agents[index];
            let scan = Some(scan_of(&scans[index])).filter(|_| !self.silent.contains(&agent.id()));
            let observation = agent.observe(now + self.clock_ahead[index], &self.states[index], scan);
            observed.push((index, observation));
            for message in agent.outbox(&observation) {
                said.push((Some(index), message.clone()));
                for &to in on.iter().filter(|to| **to != index) {
                    radio.send(tick, (Some(index), to), message, false);
                }
            }
        }
        let cued: Vec<usize> = on.into_iter().filter(|index| !radio.uncued.contains(index)).collect();
        for (place, cue) in cues.iter().enumerate() {
            said.push((None, cue.clone()));
            cued.iter().for_each(|to| radio.send(tick, (None, *to), cue, *to == cued[place % cued.len()]));
        }
        for (index, observation) in observed {
            for message in radio.heard(tick, index) {
                self.agents[index].hear(&observation, &message);
                heard.push((index, message));
            }
            let step = self.agents[index].decide(&observation);
            (self.commands[index], self.look_at[index]) = (step.command, step.look_at);
            steps.push((index, step));
        }
        self.fly(now);
        Words { said, heard, steps }
    }
}

/// What was said at an instant, by whomever, who has heard what, and what each has decided.
pub struct Words {
    pub said: Vec<(Option<usize>, Message)>,
    pub heard: Vec<(usize, Message)>,
    pub steps: Vec<(usize, Step)>,
}

/// What a fleet knows that hears every word at once, instant by instant.
pub struct Truth {
    fleet: Fleet,
    /// What it knew at each instant.
    digests: Vec<u64>,
}

impl Truth {
    /// A team of such parameters.
    pub fn new(params: TeamParams) -> Self {
        Self { fleet: Fleet::new(params).unwrap(), digests: Vec::new() }
    }

    /// Takes in what was said at the next instant, of that instant.
    pub fn hear(&mut self, now: Time, said: &[(Option<usize>, Message)]) {
        let nowhere = Team::new(1, 0).states[0];
        let observed = self.fleet.observe(now, UavId(0), &nowhere, None);
        for (_, message) in said {
            match message {
                Message::Report(report) if report.time == now => self.fleet.hear(&observed, message),
                Message::Cue(cue) if cue.said == now => self.fleet.hear(&observed, message),
                _ => {}
            }
        }
        let _ = self.fleet.decide(&observed);
        self.digests.push(self.fleet.picture().digest());
    }

    /// Whether this is what was known at its instant, to the bit.
    pub fn is(&self, picture: &Picture) -> bool {
        self.digests[(picture.time.us() / PERIOD.us()) as usize] == picture.digest()
    }
}

/// That of Table I.
pub const PERIOD: Duration = Duration::from_us(500_000);
