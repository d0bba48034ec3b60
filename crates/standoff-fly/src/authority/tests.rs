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
        heartbeat_at: at(Condition::Heartbeat, 2_500_000),
        telemetry_at: at(Condition::Telemetry, 1_000_000),
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
        is_leaving: fails(Condition::Running),
        is_accepted,
    }
}

/// Every state that differs for the next step: answers pending, due, and exhausted.
fn states() -> Vec<State> {
    let mut states = vec![State::Waiting, State::Engaged];
    for age_us in [999_999, 1_000_000] {
        let sent_at = ago(age_us).unwrap();
        states.extend([1, 2, 3].map(|attempts| State::Confirming { sent_at, attempts }));
        for repeats in [0, 1, 2] {
            states.push(State::Stopped { reason: StopReason::Refused, sent_at, repeats });
        }
    }
    states
}

/// The 13 conditions, three answers and 14 states: 344,064 cases. The rules are stated again, each on its own.
#[test]
fn commands_follow_the_rules_in_every_state_with_every_set_of_failing_conditions() {
    const TAKEOVER: u32 = 0b1_1110;
    const HEARTBEAT: u32 = 1;
    let mut cases = 0;
    for state in states() {
        for failing in 0..1 << Condition::ALL.len() {
            for answer in [None, Some(false), Some(true)] {
                let inputs = inputs(failing, answer);
                let mut authority = Authority { state };
                let permission = authority.step(NOW, &inputs);
                let context = format!("{state:?} {failing:013b} {answer:?} -> {:?} {permission:?}", authority.state);
                let is_taken_over = failing & TAKEOVER != 0;
                cases += 1;
                // Nothing is commanded unless armed, airborne, in GUIDED and without failsafe.
                assert!(!is_taken_over || permission == Permission::None, "{context}");
                // Roll, speed and altitude need every condition.
                assert!(failing == 0 || !matches!(permission, Permission::Command | Permission::Confirm), "{context}");
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
                    State::Engaged if is_taken_over => (Permission::None, |next| next == State::Waiting),
                    State::Engaged => (Permission::SafeOrbit, |next| {
                        matches!(next, State::Stopped { reason: StopReason::Failed(_), sent_at: NOW, repeats: 2 })
                    }),
                    State::Stopped { .. } if is_taken_over && failing & HEARTBEAT == 0 => {
                        (Permission::None, |next| next == State::Waiting)
                    }
                    State::Stopped { sent_at, repeats, .. }
                        if !is_taken_over && repeats > 0 && answer.is_none() && NOW - sent_at >= ANSWER_TIMEOUT =>
                    {
                        (Permission::SafeOrbit, |next| matches!(next, State::Stopped { sent_at: NOW, .. }))
                    }
                    State::Stopped { .. } => (Permission::None, |next| matches!(next, State::Stopped { .. })),
                };
                assert_eq!(permission, expected, "{context}");
                assert!(next_is(authority.state), "{context}");
                // The only way into the stream is the accepted first command.
                let is_engaged = authority.state == State::Engaged;
                let confirmed = matches!(state, State::Confirming { .. }) && answer == Some(true) && failing == 0;
                assert!(!is_engaged || was_engaged || confirmed, "{context}");
            }
        }
    }
    assert_eq!(cases, 14 * 8192 * 3);
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
    let mut authority = Authority { state: State::Engaged };
    assert_eq!(authority.step(NOW, &inputs(1 << 8, Some(true))), Permission::SafeOrbit);
    // The feed is back, but the mode has not changed.
    for _ in 0..5 {
        assert_eq!(authority.step(NOW, &inputs(0, Some(true))), Permission::None);
    }
    assert_eq!(authority.step(NOW, &inputs(1 << 2, None)), Permission::None);
    assert_eq!(authority.step(NOW, &inputs(0, None)), Permission::Confirm);
}
