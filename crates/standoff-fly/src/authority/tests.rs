use super::*;

const NOW: Time = Time::from_us(100_000_000);

fn ago(us: i64) -> Option<Time> {
    Some(Time::from_us(NOW.us() - us))
}

/// Inputs in which exactly the conditions of a bit mask fail, at [`NOW`].
fn inputs(failing: u32, is_accepted: Option<bool>) -> Inputs {
    let fails =
        |condition: Condition| failing & (1 << Condition::ALL.iter().position(|c| *c == condition).unwrap()) != 0;
    let at = |condition, limit_us: i64| if fails(condition) { ago(limit_us + 1) } else { ago(limit_us) };
    Inputs {
        heartbeat_at: at(Condition::Heartbeat, 4_000_000),
        telemetry_at: at(Condition::Telemetry, 3_000_000),
        telemetry_age_max: TELEMETRY_STALE,
        navigation_at: at(Condition::Navigation, 4_000_000),
        feed_at: at(Condition::Feed, 1_000_000),
        target_at: at(Condition::Target, 1_000_000),
        teammates_at: at(Condition::Teammates, 3_000_000),
        teammate_timeout: Duration::from_us(3_000_000),
        has_teammates: true,
        step_at: at(Condition::OnTime, 1_000_000),
        is_armed: !fails(Condition::Armed),
        is_guided: !fails(Condition::Guided),
        is_failsafe: fails(Condition::NoFailsafe),
        is_airborne: !fails(Condition::Airborne),
        has_parameters: !fails(Condition::Parameters),
        has_fence: !fails(Condition::Fence),
        has_uplink: !fails(Condition::Uplink),
        has_clock: !fails(Condition::Clock),
        is_leaving: fails(Condition::Running),
        is_accepted,
    }
}

/// Bit of a condition in a mask.
fn bit(condition: Condition) -> u32 {
    1 << Condition::ALL.iter().position(|c| *c == condition).unwrap()
}

/// Every state that differs for the next step: answers pending, due, and exhausted, soon and long after a stop.
fn states() -> Vec<State> {
    let mut states = vec![State::Waiting, State::Engaged];
    for age_us in [999_999, 1_000_000] {
        let sent_at = ago(age_us).unwrap();
        states.extend([1, 2, 3].map(|attempts| State::Confirming { sent_at, attempts }));
        for (repeats, since_us) in [(0, 4_999_999), (1, 4_999_999), (2, 4_999_999), (2, 5_000_000)] {
            let since = ago(since_us).unwrap();
            states.push(State::Stopped { reason: StopReason::Refused, since, sent_at, repeats });
        }
    }
    states
}

/// The 16 conditions, three answers and 16 states: 3,145,728 cases. The rules are stated again, each on its own.
#[test]
fn commands_follow_the_rules_in_every_state_with_every_set_of_failing_conditions() {
    let (armed, guided) = (bit(Condition::Armed), bit(Condition::Guided));
    let (heartbeat, failsafe) = (bit(Condition::Heartbeat), bit(Condition::NoFailsafe));
    let mut cases = 0;
    for state in states() {
        for failing in 0..1 << Condition::ALL.len() {
            for answer in [None, Some(false), Some(true)] {
                let inputs = inputs(failing, answer);
                let mut authority = Authority { state, trusts_guided: true };
                let permission = authority.step(NOW, &inputs);
                let next = authority.state;
                let context = || format!("{state:?} {failing:016b} {answer:?} -> {next:?} {permission:?}");
                let is_taken_over = failing & (armed | guided) != 0;
                // The pilot has left GUIDED: not by a failsafe, and not long ago.
                let has_left = failing & heartbeat == 0
                    && (failing & armed != 0 || failing & guided != 0 && failing & failsafe == 0);
                cases += 1;
                // Nothing is commanded unless armed and in GUIDED.
                assert!(!is_taken_over || permission == Permission::None, "{}", context());
                // Roll, speed and altitude need every condition.
                let commands = matches!(permission, Permission::Command | Permission::Confirm);
                assert!(failing == 0 || !commands, "{}", context());
                // Commands end with the request of a circle, unless the pilot or the autopilot has taken over.
                let ends = state == State::Engaged && next != State::Engaged;
                assert!(!ends || is_taken_over || permission == Permission::SafeOrbit, "{}", context());
                let was_engaged = state == State::Engaged;
                let (expected, next_is): (Permission, fn(State) -> bool) = match state {
                    State::Waiting if failing == 0 => {
                        (Permission::Confirm, |next| next == State::Confirming { sent_at: NOW, attempts: 1 })
                    }
                    State::Waiting => (Permission::None, |next| next == State::Waiting),
                    State::Confirming { .. } if failing != 0 => (Permission::None, |next| next == State::Waiting),
                    State::Confirming { sent_at, attempts } => match (answer, NOW - sent_at < ANSWER_TIMEOUT, attempts)
                    {
                        (Some(true), ..) => (Permission::Command, |next| next == State::Engaged),
                        (Some(false), ..) => (Permission::None, |next| {
                            matches!(next, State::Stopped { reason: StopReason::Refused, .. })
                        }),
                        (None, true, _) => (Permission::None, |next| matches!(next, State::Confirming { .. })),
                        (None, false, 3) => (Permission::None, |next| {
                            matches!(next, State::Stopped { reason: StopReason::NoAnswer, .. })
                        }),
                        (None, false, _) => (Permission::Confirm, |next| {
                            matches!(next, State::Confirming { sent_at: NOW, attempts: 2 | 3 })
                        }),
                    },
                    State::Engaged if failing == 0 => (Permission::Command, |next| next == State::Engaged),
                    State::Engaged if is_taken_over && failing & failsafe != 0 => {
                        (Permission::None, |next| matches!(next, State::Stopped { repeats: 0, .. }))
                    }
                    State::Engaged if is_taken_over => (Permission::None, |next| next == State::Waiting),
                    State::Engaged => (Permission::SafeOrbit, |next| {
                        let reason_is = |reason| matches!(reason, StopReason::Failed(_));
                        matches!(next, State::Stopped { reason, since: NOW, sent_at: NOW, repeats: 2 } if reason_is(reason))
                    }),
                    State::Stopped { .. } if has_left => (Permission::None, |next| next == State::Waiting),
                    State::Stopped { since, sent_at, repeats, .. }
                        if !is_taken_over
                            && repeats > 0
                            && answer.is_none()
                            && NOW - sent_at >= ANSWER_TIMEOUT
                            && NOW - since < Duration::from_us(5_000_000) =>
                    {
                        (Permission::SafeOrbit, |next| matches!(next, State::Stopped { sent_at: NOW, .. }))
                    }
                    State::Stopped { .. } => (Permission::None, |next| matches!(next, State::Stopped { .. })),
                };
                assert_eq!(permission, expected, "{}", context());
                assert!(next_is(next), "{}", context());
                // The only way into the stream is the accepted first command.
                let confirmed = matches!(state, State::Confirming { .. }) && answer == Some(true) && failing == 0;
                assert!(next != State::Engaged || was_engaged || confirmed, "{}", context());
            }
        }
    }
    assert_eq!(cases, 16 * 65_536 * 3);
}

#[test]
fn times_in_the_future_and_missing_times_count_as_stale() {
    let fresh = inputs(0, None);
    assert_eq!(fresh.missing(NOW).count(), 0);
    let missing = Inputs { telemetry_at: None, feed_at: ago(-1), teammates_at: None, ..fresh };
    let names: Vec<_> = missing.missing(NOW).collect();
    assert_eq!(names, [Condition::Telemetry, Condition::Feed, Condition::Teammates]);
    let alone = Inputs { has_teammates: false, ..missing };
    assert!(alone.holds(Condition::Teammates, NOW));
    let extremes = Inputs { feed_at: Some(Time::from_us(i64::MIN)), ..fresh };
    assert!(!extremes.holds(Condition::Feed, NOW) && !fresh.holds(Condition::Feed, Time::from_us(i64::MIN)));
}

#[test]
fn after_a_stop_the_pilot_has_to_leave_guided_and_return() {
    let mut authority = Authority { state: State::Engaged, trusts_guided: true };
    assert_eq!(authority.step(NOW, &inputs(bit(Condition::Feed), Some(true))), Permission::SafeOrbit);
    // The feed is back, but the mode has not changed.
    for _ in 0..5 {
        assert_eq!(authority.step(NOW, &inputs(0, Some(true))), Permission::None);
    }
    assert_eq!(authority.step(NOW, &inputs(bit(Condition::Guided), None)), Permission::None);
    assert_eq!(authority.step(NOW, &inputs(0, None)), Permission::Confirm);
}

/// Without an answer after a stop, whatever the time between two steps is: at most two more requests, and none after 5 s.
#[test]
fn a_circle_is_requested_at_most_three_times_within_5_s() {
    for step_us in [1, 100_000, 900_000, 1_000_000, 2_400_000, 4_999_999, 5_000_000, 60_000_000] {
        let mut authority = Authority { state: State::Engaged, trusts_guided: true };
        assert_eq!(authority.step(NOW, &inputs(bit(Condition::Feed), None)), Permission::SafeOrbit);
        let times_us = (1..2_000).map(|step| step * step_us);
        let requests: Vec<i64> = times_us
            .filter(|after_us| {
                let (now, seen) = (NOW + Duration::from_us(*after_us), inputs(bit(Condition::Feed), None));
                authority.step(now, &Inputs { heartbeat_at: Some(now), ..seen }) != Permission::None
            })
            .collect();
        assert!(requests.len() <= 2 && requests.iter().all(|us| *us < 5_000_000), "{step_us}: {requests:?}");
    }
}

#[test]
fn guided_in_the_first_heartbeat_counts_only_with_the_switch() {
    let silent = Inputs { heartbeat_at: None, ..inputs(0, None) };
    let mut authority = Authority::new(false);
    assert_eq!(authority.step(NOW, &silent), Permission::None);
    assert_eq!(authority.step(NOW, &inputs(0, None)), Permission::None);
    assert!(matches!(authority.state(), State::Stopped { reason: StopReason::AlreadyGuided, .. }));
    assert_eq!(authority.step(NOW, &inputs(bit(Condition::Guided), None)), Permission::None);
    assert_eq!(authority.step(NOW, &inputs(0, None)), Permission::Confirm);
    assert_eq!(Authority::new(true).step(NOW, &inputs(0, None)), Permission::Confirm);
    for other in [Condition::Guided, Condition::Armed] {
        let mut authority = Authority::new(false);
        assert_eq!(authority.step(NOW, &inputs(bit(other), None)), Permission::None);
        assert_eq!(authority.step(NOW, &inputs(0, None)), Permission::Confirm, "{other}");
    }
}
