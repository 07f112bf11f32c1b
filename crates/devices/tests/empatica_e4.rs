//! Sessions with the Empatica E4's streaming server.

mod support;

use std::time::Duration;

use proptest::prelude::*;
use support::{drain, events, readings, requests, secs, values};
use teampulse_devices::empatica_e4::{E4Session, E4Settings};
use teampulse_devices::{ByteSession, Error, Event, Output, Session};

const LIST: &str = "R device_list 2 | 7a3166 Empatica_E4 | 9ff167 Empatica_E4\r\n";

fn settings() -> E4Settings {
    E4Settings { device: Some("9ff167".to_owned()), subscriptions: vec!["bvp", "gsr"] }
}

fn asked(outputs: Vec<Output<Vec<u8>>>) -> String {
    requests(outputs)
        .into_iter()
        .map(|b| String::from_utf8(b).expect("requests are text"))
        .collect()
}

fn say(e4: &mut E4Session, line: &str, now: Duration) -> Vec<Output<Vec<u8>>> {
    e4.receive(line.as_bytes(), now);
    drain(e4)
}

/// A session that has subscribed.
fn streaming() -> E4Session {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    e4.receive(LIST.as_bytes(), secs(0));
    for line in [
        "R device_connect OK\r\n",
        "R pause ON\r\n",
        "R device_subscribe bvp OK\r\n",
        "R device_subscribe gsr OK\r\n",
        "R pause OFF\r\n",
    ] {
        e4.receive(line.as_bytes(), secs(0));
    }
    drain(&mut e4);
    e4
}

#[test]
fn an_e4_is_found_connected_and_subscribed_to_in_order() {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    assert_eq!(asked(drain(&mut e4)), "device_list\r\n");
    assert_eq!(asked(say(&mut e4, LIST, secs(0))), "device_connect 9ff167\r\n");
    assert_eq!(asked(say(&mut e4, "R device_connect OK\r\n", secs(0))), "pause ON\r\n");
    assert_eq!(asked(say(&mut e4, "R pause ON\r\n", secs(0))), "device_subscribe bvp ON\r\n");
    let answer = "R device_subscribe bvp OK\r\n";
    assert_eq!(asked(say(&mut e4, answer, secs(0))), "device_subscribe gsr ON\r\n");
    let answer = "R device_subscribe gsr ON\r\n";
    assert_eq!(asked(say(&mut e4, answer, secs(0))), "pause OFF\r\n");
}

#[test]
fn samples_come_before_the_answer_and_several_in_one_piece() {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    e4.receive(LIST.as_bytes(), secs(0));
    drain(&mut e4);
    let piece =
        "E4_Bvp 10.0 1.5\r\nE4_Bvp 10.015625 -2\r\nR device_connect OK\r\nE4_Gsr 10.0 0.3\r\n";
    let outputs = say(&mut e4, piece, secs(0));
    let bvp = readings(&outputs, "ppg");
    assert_eq!(values(&bvp), [1.5, -2.0]);
    assert_eq!((bvp[1].index, bvp[1].device_time_ns), (1, Some(10_015_625_000)));
    assert_eq!(values(&readings(&outputs, "eda")), [0.3]);
    assert_eq!(asked(outputs), "pause ON\r\n");
}

#[test]
fn lines_may_end_without_a_carriage_return() {
    let outputs = say(&mut streaming(), "E4_Bvp 10 1\nE4_Bvp 10.015625 2\n", secs(0));
    assert_eq!(values(&readings(&outputs, "ppg")), [1.0, 2.0]);
}

#[test]
fn an_e4_that_is_off_is_looked_for_for_a_minute() {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    let mut outputs = drain(&mut e4);
    let mut now = secs(0);
    e4.receive(b"R device_list 0\r\n", now);
    while let Some(next) = e4.next_tick() {
        now = next;
        e4.tick(now);
        e4.receive(b"R device_list 1 | 7a3166 Empatica_E4\r\n", now);
        outputs.extend(drain(&mut e4));
    }
    assert_eq!(now, secs(55));
    assert!(matches!(outputs.last(), Some(Output::Done(Err(Error::Refused(_))))));
}

#[test]
fn a_refused_stream_is_reported_and_the_others_go_on() {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    e4.receive(LIST.as_bytes(), secs(0));
    e4.receive(b"R device_connect OK\r\nR pause ON\r\n", secs(0));
    drain(&mut e4);
    let outputs = say(&mut e4, "R device_subscribe bvp ERR not available\r\n", secs(0));
    let reason = "not available".to_owned();
    assert_eq!(events(&outputs), [Event::Refused { stream: "ppg", reason }]);
    assert_eq!(asked(outputs), "device_subscribe gsr ON\r\n");
}

#[test]
fn a_lost_radio_link_is_a_gap_of_its_length() {
    let mut e4 = streaming();
    e4.receive(b"E4_Gsr 100.00 1\r\nR connection lost to device 9ff167\r\n", secs(1));
    assert_eq!(e4.next_tick(), None); // the server finds it by itself
    let outputs = say(
        &mut e4,
        "R connection re-established to device 9ff167\r\nE4_Gsr 102.25 2\r\n",
        secs(3),
    );
    let gap = Event::Gap { stream: "eda", samples: Some(8) };
    let links = [false, true].map(|connected| Event::Wearable { connected });
    assert_eq!(events(&outputs), [links[0].clone(), links[1].clone(), gap]);
    assert_eq!(readings(&outputs, "eda")[1].index, 9);
}

#[test]
fn times_that_begin_anew_earlier_lose_no_sample() {
    let outputs =
        say(&mut streaming(), "E4_Bvp 100 1\r\nE4_Bvp 99.5 2\r\nE4_Bvp 99.515625 3\r\n", secs(1));
    let gap = Event::Gap { stream: "ppg", samples: None };
    assert_eq!(events(&outputs), [Event::ClockSet { stream: "ppg" }, gap]);
    assert_eq!(values(&readings(&outputs, "ppg")), [1.0, 2.0, 3.0]);
}

#[test]
fn a_press_of_the_button_is_a_marker_with_its_time() {
    let outputs = say(&mut streaming(), "E4_Tag 1460377850.5\r\n", secs(1));
    let device_time_ns = Some(1_460_377_850_500_000_000);
    assert_eq!(events(&outputs), [Event::Marker { name: "tag", device_time_ns }]);
}

#[test]
fn an_e4_that_is_not_worn_conducts_nothing() {
    let outputs = say(&mut streaming(), "E4_Gsr 1 0.0\r\nE4_Gsr 1.25 0.0\r\n", secs(1));
    assert_eq!(values(&readings(&outputs, "eda")), [0.0, 0.0]);
}

#[test]
fn a_server_that_sends_nothing_is_subscribed_to_again_and_given_up() {
    let mut e4 = streaming();
    let mut outputs = Vec::new();
    while let Some(next) = e4.next_tick() {
        e4.tick(next);
        for output in drain(&mut e4) {
            if let Output::Request(request) = &output {
                let line = String::from_utf8(request.clone()).unwrap();
                let answer = line.replace("bvp ON", "bvp OK").replace("gsr ON", "gsr OK");
                e4.receive(format!("R {answer}").as_bytes(), next);
            }
            outputs.push(output);
        }
    }
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::Silent("samples")))));
    assert!(matches!(events(&outputs)[..], [Event::Stalled { stream: "ppg", .. }, ..]));
}

#[test]
fn a_mute_server_is_asked_three_times() {
    let mut e4 = E4Session::new(settings());
    e4.start(secs(0));
    while let Some(next) = e4.next_tick() {
        e4.tick(next);
    }
    let outputs = drain(&mut e4);
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::NoAnswer("requests")))));
    assert_eq!(asked(outputs), "device_list\r\n".repeat(3));
}

#[test]
fn the_e4_is_released_before_the_connection_is_closed() {
    let mut e4 = streaming();
    e4.stop(secs(5));
    assert_eq!(asked(drain(&mut e4)), "device_disconnect\r\n");
    assert_eq!(say(&mut e4, "R device_disconnect OK\r\n", secs(5)), [Output::Done(Ok(()))]);
}

#[test]
fn another_connection_begins_anew_and_the_count_goes_on() {
    let mut e4 = streaming();
    e4.receive(b"E4_Bvp 100 1\r\nE4_Bvp 100.0156", secs(1));
    e4.start(secs(4));
    assert_eq!(asked(drain(&mut e4)), "device_list\r\n");
    let outputs = say(&mut e4, "E4_Bvp 101 2\r\n", secs(5));
    assert_eq!(readings(&outputs, "ppg")[0].index, 64);
}

#[test]
fn a_line_without_an_end_is_not_kept() {
    let mut e4 = streaming();
    let mut outputs = Vec::new();
    for _ in 0..100 {
        outputs.extend(say(&mut e4, &"x".repeat(1000), secs(1)));
    }
    outputs.extend(say(&mut e4, "\r\nE4_Bvp 1 1\r\n", secs(1)));
    let discarded = Event::Discarded { source: "streaming server", bytes: 100_001 };
    assert_eq!(events(&outputs), [discarded]);
    assert_eq!(values(&readings(&outputs, "ppg")), [1.0]);
}

/// Lines that a server may send, and noise.
fn line() -> impl Strategy<Value = Vec<u8>> {
    let known = prop::sample::select(vec![
        LIST,
        "R device_connect OK\r\n",
        "R device_connect ERR busy\r\n",
        "R pause ON\r\n",
        "R device_subscribe bvp OK\r\n",
        "R connection lost to device 9ff167\r\n",
        "R device_disconnect OK\r\n",
        "E4_Bvp 100.5 1,25\n",
        "E4_Bvp 100 -7\r\n",
        "E4_Gsr 107.25 0.25\r\n",
        "E4_Tag 3\r\n",
        "E4_Acc 4 1 2\r\n",
    ]);
    prop_oneof![
        3 => known.prop_map(|line| line.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 0..80),
    ]
}

proptest! {
    #[test]
    fn any_bytes_in_any_pieces_are_the_same_readings(
        lines in prop::collection::vec(line(), 0..60),
        cuts in prop::collection::vec(1_usize..40, 1..40),
    ) {
        let bytes = lines.concat();
        let run = |pieces: &mut dyn Iterator<Item = &[u8]>| {
            let mut e4 = E4Session::new(settings());
            e4.start(secs(0));
            pieces.for_each(|piece| e4.receive(piece, secs(1)));
            drain(&mut e4)
        };
        let whole = run(&mut std::iter::once(&bytes[..]));
        let mut rest = &bytes[..];
        let mut cuts = cuts.iter().cycle();
        let mut pieces = std::iter::from_fn(|| {
            let (piece, after) = rest.split_at(*cuts.next()?.min(&rest.len()));
            rest = after;
            (!piece.is_empty()).then_some(piece)
        });
        prop_assert_eq!(run(&mut pieces), whole.clone());
        prop_assert!(whole.len() <= 16 + bytes.len());
    }
}
