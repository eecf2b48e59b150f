use super::*;

use proptest::prelude::*;

use Action::{Hold, Step, Stop};

fn running() -> Guard {
    let mut guard = Guard::new();
    guard.restart(100);
    guard
}

#[test]
fn the_table_of_a_single_event() {
    let lost = |lost| Counters {
        lost,
        ..Counters::default()
    };
    let (truncated, corrupted) = (
        Counters {
            truncated: 1,
            ..lost(0)
        },
        Counters {
            corrupted: 1,
            ..lost(0)
        },
    );
    type Event = fn(&mut Guard) -> Action;
    let table: [(Event, Counters, Action, Counters); 9] = [
        // event, then of a running guard: counted and what to do; of a stopped one: counted
        (|g| g.received(101), lost(0), Step, lost(0)),
        (|g| g.received(111), lost(10), Step, lost(0)),
        (|g| g.received(112), lost(11), Stop, lost(0)),
        (|g| g.received(100), lost(1), Hold, lost(0)),
        (|g| g.received(99), lost(1), Hold, lost(0)),
        (Guard::missed, lost(1), Hold, lost(0)),
        (|g| g.damaged(FrameError::Truncated), truncated, Hold, truncated),
        (|g| g.damaged(FrameError::Corrupted), corrupted, Hold, corrupted),
        (Guard::held, lost(0), Hold, lost(0)),
    ];
    for (k, (event, counted, action, counted_stopped)) in table.into_iter().enumerate() {
        let mut guard = running();
        assert_eq!(
            (event(&mut guard), guard.counters()),
            (action, counted),
            "row {k}"
        );
        assert_eq!(guard.is_stopped(), action == Stop, "row {k}");
        let mut guard = running();
        guard.stop();
        assert_eq!(
            (event(&mut guard), guard.counters()),
            (Stop, counted_stopped),
            "row {k}, stopped"
        );
    }
}

#[test]
fn any_mix_of_missed_periods_holds_ten_times_and_then_stops_for_good() {
    let mut guard = running();
    for k in 0..HOLD_PERIODS {
        let action = match k % 4 {
            0 => guard.missed(),
            1 => guard.damaged(FrameError::Truncated),
            2 => guard.damaged(FrameError::Corrupted),
            _ => guard.held(),
        };
        assert_eq!(action, Hold, "period {k}");
    }
    assert_eq!(guard.missed(), Stop);
    assert_eq!(guard.received(112), Stop);
    guard.restart(500);
    assert_eq!(guard.received(501), Step);
    let expected = Counters {
        lost: 4,
        truncated: 3,
        corrupted: 2,
    };
    assert_eq!(guard.counters(), expected); // kept through the restart
}

#[test]
fn a_message_after_ten_missed_periods_goes_on_and_the_count_starts_again() {
    let mut guard = running();
    for _ in 0..3 {
        for _ in 0..HOLD_PERIODS {
            assert_eq!(guard.missed(), Hold);
        }
        assert_eq!(guard.received(guard.sequence().wrapping_add(1)), Step);
    }
    assert_eq!(guard.counters().lost, 3 * HOLD_PERIODS);
}

#[test]
fn a_gap_counts_only_what_was_not_noticed_before() {
    let mut guard = running();
    guard.missed();
    guard.damaged(FrameError::Corrupted);
    assert_eq!(guard.received(105), Step); // 101 to 104: two of them are known
    let expected = Counters {
        lost: 1 + 2,
        truncated: 0,
        corrupted: 1,
    };
    assert_eq!(guard.counters(), expected);
}

#[test]
fn numbers_wrap_round() {
    let mut guard = Guard::new();
    guard.restart(u32::MAX);
    assert_eq!(guard.received(0), Step);
    assert_eq!(guard.received(u32::MAX), Hold); // older, not 2^32 - 2 ahead
    assert_eq!(guard.counters().lost, 1);
}

#[test]
fn a_sender_that_repeats_itself_for_ever_is_stopped() {
    let mut guard = running();
    assert_eq!(guard.received(101), Step);
    for _ in 0..HOLD_PERIODS {
        assert_eq!(guard.received(101), Hold);
    }
    assert_eq!(guard.received(101), Stop);
}

#[test]
fn counters_stay_at_their_greatest_value() {
    let mut guard = running();
    guard.counters.lost = u32::MAX - 1;
    guard.received(105);
    assert_eq!(guard.counters().lost, u32::MAX);
}

proptest! {
    /// The rule itself, said over a whole history: which of the numbers 1, 2, ... arrive.
    #[test]
    fn it_runs_exactly_until_eleven_in_a_row_are_missing(arrives in proptest::collection::vec(any::<bool>(), 1..200)) {
        let mut by_gaps = Guard::new();
        let mut by_timer = Guard::new();
        by_gaps.restart(0);
        by_timer.restart(0);
        let (mut missing, mut stopped, mut lost) = (0, false, 0);
        for (sequence, arrived) in (1..).zip(arrives) {
            missing = if arrived { 0 } else { missing + 1 };
            lost += u32::from(!arrived && !stopped);
            stopped |= missing > HOLD_PERIODS;
            let expected = if stopped { Stop } else if arrived { Step } else { Hold };
            let action = if arrived { by_timer.received(sequence) } else { by_timer.missed() };
            prop_assert_eq!(action, expected);
            prop_assert_eq!(by_timer.counters().lost, lost);
            if arrived {
                prop_assert_eq!(by_gaps.received(sequence), expected); // without a timer it sees the same, later
            }
        }
    }
}
