//! Beats that come in allocate nothing once a window's worth of them is held.

mod counting;

use counting::allocations;
use teampulse_signal::hrv::HeartWindows;

const SEC: i64 = 1_000_000_000;

/// Beats of an hour from here, a hole each minute; the newest five minutes are kept.
fn feed(heart: &mut HeartWindows, begin_secs: i64) {
    for beat in 0..4_000 {
        let at_ns = begin_secs * SEC + beat * 900_000_000;
        heart.push(at_ns);
        if beat % 67 == 0 {
            heart.mark_gap(at_ns - SEC / 2, at_ns - SEC / 4);
        }
        heart.forget(at_ns - 300 * SEC);
    }
}

#[test]
fn beats_and_holes_allocate_nothing_in_steady_state() {
    let mut heart = HeartWindows::causal();
    feed(&mut heart, 0);
    let before = allocations();
    feed(&mut heart, 3_600);
    assert_eq!(allocations() - before, 0);
}
