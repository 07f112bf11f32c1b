use proptest::collection::vec;
use proptest::prelude::*;

use super::evdev::{Abilities, Translator};
use super::*;

const MS: i64 = 1_000_000;
const SECOND: i64 = 1000 * MS;

fn key(code: u32, is_down: bool) -> Act {
    Act::Key { which: Which::of(code), is_down, corrects: code == 14 }
}

/// The values of the named channels in each second, in thousandths.
fn values<const N: usize>(kind: Kind, summaries: &[Summary], names: [&str; N]) -> Vec<[i64; N]> {
    let place = |name: &str| kind.channels().iter().position(|(each, _)| *each == name);
    let of = |summary: &Summary| {
        names.map(|name| (summary.values[place(name).expect(name)] * 1e3).round() as i64)
    };
    summaries.iter().map(of).collect()
}

/// Keys that are pressed every 100 ms from 1.05 s on, each held for 80 ms.
fn typed(codes: &[u32]) -> Seconds {
    let mut seconds = Seconds::new(Kind::Keyboard, 0);
    for (place, code) in codes.iter().enumerate() {
        let at_ns = 1050 * MS + 100 * MS * place as i64;
        seconds.take(at_ns, &key(*code, true));
        seconds.take(at_ns + 80 * MS, &key(*code, false));
    }
    seconds
}

#[test]
fn typing_is_counted_and_timed() {
    let summaries = typed(&[30, 31, 14, 32, 33, 34]).until(3 * SECOND);
    let names = ["presses", "corrections", "holds", "hold_mean", "intervals", "interval_mean"];
    let found = values(Kind::Keyboard, &summaries, names);
    assert_eq!(found[1], [6000, 1000, 6000, 80_000, 5000, 100_000]);
    assert_eq!(summaries[1].begin_ns, SECOND);
}

#[test]
fn fewer_than_five_times_wait_for_more() {
    let mut seconds = typed(&[30, 31, 32]);
    let first = seconds.until(2 * SECOND);
    for (place, code) in [33, 34, 35].into_iter().enumerate() {
        let at_ns = 2 * SECOND + 100 * MS * place as i64;
        seconds.take(at_ns, &key(code, true));
        seconds.take(at_ns + 20 * MS, &key(code, false));
    }
    let found = values(Kind::Keyboard, &first, ["presses", "holds"]);
    assert_eq!(found, [[0, 0], [3000, 0]]);
    let found =
        values(Kind::Keyboard, &seconds.until(3 * SECOND), ["presses", "holds", "hold_mean"]);
    assert_eq!(found, [[3000, 6000, 50000]]);
}

#[test]
fn no_summary_has_the_time_of_a_single_press() {
    let mut seconds = Seconds::new(Kind::Keyboard, 0);
    for place in 0..30 {
        seconds.take(place * 1300 * MS + 123_456_789, &key(30, true));
        seconds.take(place * 1300 * MS + 223_456_789, &key(30, false));
    }
    for summary in seconds.until(40 * SECOND) {
        assert_eq!(summary.begin_ns % SECOND, 0);
        let idle = *summary.values.last().expect("a value");
        assert!(idle.fract() == 0.0, "{idle}");
        let [holds, intervals] = [summary.values[2], summary.values[5]];
        assert!([holds, intervals].iter().all(|count| *count == 0.0 || *count >= 5.0));
    }
}

#[test]
fn a_held_key_is_one_press_and_one_whose_release_was_lost_is_pressed_again() {
    let mut seconds = Seconds::new(Kind::Keyboard, 0);
    (0..20).for_each(|place| seconds.take(place * 40 * MS, &key(30, true)));
    seconds.take(5 * SECOND, &key(30, true));
    let found = values(Kind::Keyboard, &seconds.until(6 * SECOND), ["presses"]);
    assert_eq!((found[0], found[5]), ([1000], [1000]));
}

#[test]
fn what_a_key_is_can_not_be_printed() {
    assert_eq!(format!("{:?}", key(30, true)), format!("{:?}", key(31, true)));
}

#[test]
fn a_mouse_has_a_path_clicks_and_double_clicks() {
    let mut seconds = Seconds::new(Kind::Mouse, 0);
    for place in 0..11 {
        seconds.take(place * 50 * MS, &Act::Move(3.0));
    }
    for at_ms in [600, 700, 800, 900] {
        seconds.take(at_ms * MS, &Act::Click(Which::of(1)));
    }
    seconds.take(950 * MS, &Act::Wheel(-2.0));
    let names = ["path", "clicks", "double_clicks", "wheel", "moving", "idle"];
    let found = values(Kind::Mouse, &seconds.until(3 * SECOND), names);
    assert_eq!(found[0], [33000, 4000, 2000, 2000, 500, 0]);
    assert_eq!(found[1], [0, 0, 0, 0, 0, 1000]);
}

#[test]
fn a_stick_that_is_held_moves_on() {
    let mut seconds = Seconds::new(Kind::Gamepad, 0);
    seconds.take(500 * MS, &Act::Stick(0, -0.8));
    seconds.take(600 * MS, &Act::Control);
    let found =
        values(Kind::Gamepad, &seconds.until(2 * SECOND), ["presses", "deflection", "moving"]);
    assert_eq!(found, [[1000, 400, 500], [0, 800, 1000]]);
}

#[test]
fn the_first_second_is_a_whole_one_and_a_time_in_which_nothing_was_read_is_a_gap() {
    let mut seconds = Seconds::new(Kind::Mouse, 300 * MS);
    assert_eq!(seconds.until(2 * SECOND)[0].begin_ns, SECOND);
    assert_eq!(seconds.until(5000 * SECOND + MS), []);
    assert_eq!(seconds.until(5002 * SECOND)[0].begin_ns, 5001 * SECOND);
}

#[test]
fn a_device_is_what_it_can_do() {
    let keyboard = Abilities { keys: (1..120).collect(), ..Abilities::default() };
    let mouse = Abilities { keys: vec![0x110], relative: vec![0, 1, 8], ..Abilities::default() };
    let axes = vec![(0, -32768, 32767), (1, -32768, 32767), (2, 0, 255)];
    let gamepad = Abilities { keys: vec![0x130], absolute: axes.clone(), ..Abilities::default() };
    let touchpad = Abilities { keys: vec![0x110, 0x14a], absolute: axes, ..Abilities::default() };
    let power = Abilities { keys: vec![116], ..Abilities::default() };
    let found = [keyboard, mouse, gamepad, touchpad, power].map(|each| each.kinds());
    let expected =
        [vec![Kind::Keyboard], vec![Kind::Mouse], vec![Kind::Gamepad], vec![Kind::Mouse], vec![]];
    assert_eq!(found, expected);
}

#[test]
fn a_mouse_moves_by_report_and_a_trigger_rests_at_zero() {
    let mouse = Abilities { keys: vec![0x110], relative: vec![0, 1, 8], ..Abilities::default() };
    let mut mouse = Translator::new(&mouse, &Kind::ALL);
    let acts: Vec<Act> = [(2, 0, 3), (2, 1, -4), (0, 0, 0)]
        .map(|(kind, code, value)| mouse.take(kind, code, value))
        .concat();
    assert_eq!(acts, [Act::Move(5.0)]);
    let axes = vec![(0, -100, 100), (2, 0, 255)];
    let gamepad = Abilities { keys: vec![0x130], absolute: axes, ..Abilities::default() };
    let mut gamepad = Translator::new(&gamepad, &Kind::ALL);
    assert_eq!(gamepad.take(3, 0, 50), [Act::Stick(0, 0.5)]);
    assert_eq!(gamepad.take(3, 2, 0), [Act::Stick(2, 0.0)]);
    assert_eq!(gamepad.take(0, 3, 0), [Act::Lost(Kind::Gamepad)]);
}

#[test]
fn a_jump_of_a_finger_that_was_lifted_is_no_movement() {
    let pad = Abilities {
        keys: vec![0x14a],
        absolute: vec![(0, 0, 9), (1, 0, 9)],
        ..Abilities::default()
    };
    let mut pad = Translator::new(&pad, &Kind::ALL);
    let events = [
        (3, 0, 10),
        (0, 0, 0),
        (3, 0, 13),
        (0, 0, 0),
        (1, 0x14a, 0),
        (1, 0x14a, 1),
        (3, 0, 900),
        (0, 0, 0),
    ];
    let acts: Vec<Act> = events.map(|(kind, code, value)| pad.take(kind, code, value)).concat();
    assert_eq!(acts, [Act::Move(3.0)]);
}

fn acts() -> impl Strategy<Value = Vec<(i64, Act)>> {
    let act = prop_oneof![
        (0..40u32, any::<bool>()).prop_map(|(code, is_down)| key(code, is_down)),
        (0..3u32).prop_map(|code| Act::Click(Which::of(code))),
        (0.0..50.0).prop_map(Act::Move),
        (-3.0..3.0).prop_map(Act::Wheel),
        Just(Act::Control),
        (any::<u8>(), -2.0..2.0).prop_map(|(axis, deflection)| Act::Stick(axis, deflection)),
        Just(Act::Lost(Kind::Keyboard)),
    ];
    vec((0..900 * MS, act), 0..200).prop_map(|steps| {
        let mut at_ns = 0;
        let place = |(after_ns, act)| {
            at_ns += after_ns;
            (at_ns, act)
        };
        steps.into_iter().map(place).collect()
    })
}

proptest! {
    #[test]
    fn summaries_are_the_same_whenever_they_are_asked_for(acts in acts(), asked in vec(any::<bool>(), 200)) {
        for kind in Kind::ALL {
            let (mut once, mut often) = (Seconds::new(kind, 0), Seconds::new(kind, 0));
            let mut found = Vec::new();
            for ((at_ns, act), is_asked) in acts.iter().zip(asked.iter().cycle()) {
                once.take(*at_ns, act);
                if *is_asked {
                    found.extend(often.until(*at_ns));
                }
                often.take(*at_ns, act);
            }
            let end_ns = acts.last().map_or(0, |(at_ns, _)| *at_ns) + 5 * SECOND;
            found.extend(often.until(end_ns));
            // NaN is not itself.
            prop_assert_eq!(format!("{:?}", once.until(end_ns)), format!("{found:?}"));
        }
    }

    #[test]
    fn any_events_at_any_times_give_whole_summaries(
        events in vec((any::<i64>(), any::<u16>(), any::<u16>(), any::<i32>()), 0..100),
        least in any::<i32>(), most in any::<i32>(),
    ) {
        let absolute = (0..24).map(|code| (code, least, most)).collect();
        let keys = vec![16, 57, 0x110, 0x130];
        let abilities = Abilities { keys, relative: vec![0], absolute };
        let mut translator = Translator::new(&abilities, &Kind::ALL);
        let mut all = Kind::ALL.map(|kind| (kind, Seconds::new(kind, 0)));
        for (at_ns, kind, code, value) in events {
            let acts = translator.take(kind % 4, code % 0x300, value);
            for (kind, seconds) in &mut all {
                for act in &acts {
                    seconds.take(at_ns, act);
                }
                for summary in seconds.until(at_ns) {
                    prop_assert_eq!(summary.values.len(), kind.channels().len());
                }
            }
        }
    }
}
