//! The dashboard as browsers and programs see it.

mod stage;

use std::sync::Arc;

use serde_json::json;
use stage::{Received, Stage};
use teampulse_core::clock::Clock;
use teampulse_core::data::{Data, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::stream::{Schema, Shape, Stream, Subject};
use teampulse_dashboard::{Context, Settings, Tokens};
use teampulse_messages::cdr::Writer;
use teampulse_messages::standard::std_msgs::Header;

fn ecg() -> Stream {
    let stream =
        Stream::raw("/humans/persons/p001/strap/ecg", Subject::person("p001"), Shape::Wave);
    stream.with_channels(&[("ecg", "mV")])
}

fn wave(samples: usize) -> Data {
    Data::Wave(Wave { period_ns: 1e7, channels: 1, samples: vec![0.5; samples].into() })
}

fn values(value: f64) -> Data {
    Data::Feature(Arc::new(FeatureValues {
        window_secs: 30.0,
        coverage: 1.0,
        quality: 1.0,
        values: vec![value, f64::NAN],
        sigmas: Vec::new(),
        reasons: vec![Reason::Ok, Reason::Short],
    }))
}

fn state() -> Stream {
    let stream = Stream::derived(&ecg(), "state", Shape::Feature);
    stream.with_channels(&[("heart_rate_z", "1"), ("<script>alert(1)</script>", "1")])
}

#[tokio::test(flavor = "multi_thread")]
async fn who_joins_gets_what_is_known_and_then_what_is_new() {
    let stage = Stage::new("nback");
    stage.give(ecg(), 1e7, wave(10));
    stage.give(state(), 0.0, values(1.5));
    stage.happen(EventKind::Marker, "before");
    let mut first = stage.browser().await;
    first.event("before").await;
    // From now on it is known.
    let mut browser = stage.connect().await;
    let hello = browser.until("hello").await;
    assert_eq!(
        (&hello["session"], &hello["viewer"]["right"]),
        (&json!("nback"), &json!("control"))
    );
    browser.event("before").await;
    let features = browser.until("features").await;
    assert_eq!(features["features"][0]["values"], json!([1.5, null]));
    assert_eq!(features["features"][0]["reasons"], json!(["ok", "short"]));
    let streams = browser.seen["streams"]["streams"].as_array().unwrap();
    let ecg_id = streams.iter().find(|each| each["signal"] == "other").unwrap()["id"].clone();
    let want = json!({"type": "want", "streams": [{"stream": ecg_id, "points_per_sec": 0.0}]});
    browser.say(want.to_string()).await;
    // Answered in their order: what was wanted before is wanted by now.
    browser.say(json!({"type": "ping", "sent": 12.5}).to_string()).await;
    assert_eq!(browser.until("pong").await["sent"], 12.5);
    stage.give(ecg(), 1e7, wave(20));
    let bytes = loop {
        match browser.next().await {
            Received::Wave(bytes) => break bytes,
            Received::Text(_) => {}
            Received::Closed(reason) => panic!("{reason}"),
        }
    };
    assert_eq!(bytes.len(), 24 + 4 * 20);
    let ask = json!({"type": "history", "reference": "h", "stream": ecg_id, "from": 0.0, "to": 1e9, "points": 100});
    browser.say(ask.to_string()).await;
    assert_eq!(browser.until("history").await["channels"][0]["max"][0], 0.5);
    assert!(stage.end().is_ok());
    assert_eq!(browser.until("ended").await["reason"], "the session is over");
}

#[tokio::test(flavor = "multi_thread")]
async fn script_in_a_name_stays_text() {
    let stage = Stage::new("</script><script>alert(1)</script>");
    stage.give(state(), 0.0, values(2.0));
    stage.happen(EventKind::Marker, "<img src=x onerror=alert(1)>");
    let mut browser = stage.browser().await;
    browser.event("<img src=x onerror=alert(1)>").await;
    let answer = stage.request(&["GET /api/streams HTTP/1.1", "Host: HOST"], "").await;
    assert!(answer.contains("content-type: application/json"), "{answer}");
    assert!(answer.contains("x-content-type-options: nosniff"));
    let page = stage.request(&["GET / HTTP/1.1", "Host: HOST"], "").await;
    assert!(page.starts_with("HTTP/1.1 200") && !page.contains("alert(1)"));
    let policy = page.lines().find(|line| line.starts_with("content-security-policy")).unwrap();
    assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe"), "{policy}");
}

#[tokio::test(flavor = "multi_thread")]
async fn other_sites_other_names_and_other_kinds_of_posts_are_refused() {
    let stage = Stage::new("s");
    let marker = r#"{"label": "x"}"#;
    let post = "POST /api/events HTTP/1.1";
    let json = "Content-Type: application/json";
    let upgrade = [
        "GET /ws HTTP/1.1",
        "Upgrade: websocket",
        "Connection: upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    ];
    for (lines, body, status) in [
        (&[post, "Host: evil.example", json][..], marker, "403"),
        (&[post, "Host: HOST", "Origin: http://evil.example", json], marker, "403"),
        (&[post, "Host: HOST", "Origin: null", json], marker, "403"),
        (&[post, "Host: HOST", "Sec-Fetch-Site: cross-site", json], marker, "403"),
        (&[post, "Host: HOST", "Content-Type: text/plain"], marker, "415"),
        (&[post, "Host: HOST", json], "{", "400"),
        (&[post, "Host: HOST", json], r#"{"label": 5}"#, "422"),
        (&[post, "Host: HOST", json], r#"{"label": " "}"#, "422"),
        (&[post, "Host: HOST", json], r#"{"note": ""}"#, "422"),
        (&[post, "Host: HOST", json], r#"{"scale": "two words", "value": 1}"#, "422"),
        (&[post, "Host: HOST", json], marker, "403"),
        (&["GET / HTTP/1.1", "Host: evil.example:80"], "", "403"),
        (&["GET /nowhere HTTP/1.1", "Host: HOST"], "", "404"),
        (&[&upgrade[..], &["Host: HOST", "Origin: http://evil.example"]].concat(), "", "403"),
        (&[&upgrade[..], &["Host: evil.example"]].concat(), "", "403"),
    ] {
        let answer = stage.request(lines, body).await;
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{lines:?}: {answer}");
    }
    let answer = stage.request(&[post, "Host: HOST", json], r#"{"label": ""}"#).await;
    let empty = r#"{"error":"the text is empty","hint":"write 1 to 1000 bytes"}"#;
    assert!(answer.contains(empty), "{answer}");
    let large = format!(r#"{{"label": "{}"}}"#, "x".repeat(100_000));
    let answer = stage.request(&[post, "Host: HOST", json], &large).await;
    assert!(answer.starts_with("HTTP/1.1 413"), "{answer}");
    stage.browser().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_program_asks_wrongly_is_refused_with_the_reason() {
    let stage = Stage::new("s");
    let [post, json] = ["POST /api/events HTTP/1.1", "Content-Type: application/json"];
    for (body, reason) in [
        ("{}", "the event is neither a marker, a note nor a self-report"),
        (
            r#"{"label": "x", "note": "y"}"#,
            "the event has `label` and `note`, which exclude each other",
        ),
        (
            r#"{"label": "x", "value": 1}"#,
            "the event has a `label` with `value`, which belongs to a `scale`",
        ),
        (
            r#"{"note": "x", "subject": "p001"}"#,
            "the event has a `note` with `subject`, which belongs to a `scale`",
        ),
        (r#"{"scale": "isa"}"#, "a `scale` needs a `value`"),
        (r#"{"label": "x", "foo": 1}"#, "unknown key `foo`, expected one of `label`, `note`"),
        (r#"{"label": 5}"#, "label: invalid type: integer `5`, expected a string"),
        (r#"{"label": "x", "at": 1, "unix": 1}"#, "the event has two times"),
        (r#"{"label": "x", "unix": 12}"#, "12 is not within the last minute of the session"),
    ] {
        let answer = stage.request(&[post, "Host: HOST", json], body).await;
        assert!(answer.starts_with("HTTP/1.1 422"), "{answer}");
        assert!(answer.contains(reason), "{answer}");
    }
    for (query, reason) in [
        ("history?stream=/x&from=x", "from: not a number"),
        ("history?stream=/x&to=nan", "to: not a number"),
        ("history?stream=/x&from=-inf", "from: not a number"),
        ("history?stream=/x&points=0", "points: expected 1 or more"),
        (
            "history?stream=/x&from=20&to=10",
            "the span from 20.0 s to 10.0 s of the session is empty",
        ),
        ("history?stream=/x&from=5&to=0", "the span from 5.0 s to 0.0 s of the session is empty"),
        ("history?stream=/x&form=3", "form: unknown parameter `form`, expected one of"),
        ("history", "missing parameter `stream`"),
        ("latest?strem=/x", "strem: unknown parameter `strem`, expected `stream`"),
    ] {
        let answer =
            stage.request(&[&format!("GET /api/{query} HTTP/1.1"), "Host: HOST"], "").await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
        assert!(answer.contains(&format!("the query is wrong: {reason}")), "{answer}");
    }
    stage.happen(EventKind::Marker, "x");
    stage.browser().await.event("x").await;
    let answer = stage
        .request(&["GET /api/history?stream=/session/events HTTP/1.1", "Host: HOST"], "")
        .await;
    assert!(answer.contains("\"/session/events\\\" has no stored values"), "{answer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_self_report_that_nothing_would_use_is_refused_with_the_reason() {
    let stage = Stage::new("s");
    let lines = ["POST /api/events HTTP/1.1", "Host: HOST", "Content-Type: application/json"];
    let ask = async |scale: &str, value: f64, subject: &str| {
        let body = json!({"scale": scale, "value": value, "subject": subject}).to_string();
        stage.request(&lines, &body).await
    };
    // A recording takes no events (403), but for those that are wrong (422).
    assert!(ask("isa", 3.0, "p999").await.starts_with("HTTP/1.1 403"), "nobody is known yet");
    stage.give(ecg(), 1e7, wave(20));
    stage.happen(EventKind::Marker, "x");
    stage.browser().await.event("x").await;
    let person = ecg().id;
    for (scale, value, subject, reason) in [
        ("isa", 99.0, &*person, "ISA 99 is off the scale"),
        ("ISA", 0.5, &*person, "ISA 0.5 is off the scale"),
        ("isa", 3.0, "p999", "the ISA of p999 can't be used: nobody with that name is known"),
    ] {
        let answer = ask(scale, value, subject).await;
        assert!(answer.starts_with("HTTP/1.1 422") && answer.contains(reason), "{answer}");
    }
    assert!(ask("isa", 3.0, &person).await.starts_with("HTTP/1.1 403"));
    assert!(ask("nasa_tlx", 99.0, "p999").await.starts_with("HTTP/1.1 403"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_opens_the_page_and_says_what_may_be_done() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tokens");
    std::fs::write(&file, "watch watch-0123456789\ncontrol control-0123456789\n").unwrap();
    let context = Context::new("s", Clock::host());
    let stage = Stage::of(
        context,
        Settings { tokens: Tokens::read(&file).unwrap(), ..Settings::default() },
    );
    for (path, status) in [
        ("/", "401"),
        ("/?token=wrong", "401"),
        ("/app.js", "401"),
        ("/metrics", "401"),
        ("/?token=watch-0123456789", "303"),
    ] {
        let answer = stage.request(&[&format!("GET {path} HTTP/1.1"), "Host: HOST"], "").await;
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{path}: {answer}");
        let has_cookie = answer.contains("HttpOnly; SameSite=Strict");
        assert_eq!(has_cookie, status == "303", "{answer}");
    }
    let cookie = "Cookie: teampulse_token=watch-0123456789";
    let page = stage.request(&["GET / HTTP/1.1", "Host: HOST", cookie], "").await;
    assert!(page.starts_with("HTTP/1.1 200"), "{page}");
    let lines =
        ["POST /api/events HTTP/1.1", "Host: HOST", cookie, "Content-Type: application/json"];
    let answer = stage.request(&lines, r#"{"label": "x"}"#).await;
    assert!(
        answer.starts_with("HTTP/1.1 403") && answer.contains("a token for `mark`"),
        "{answer}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_message_is_refused_and_hurts_nobody_else() {
    let stage = Stage::new("s");
    let mut good = stage.browser().await;
    let mut bad = stage.browser().await;
    let deep = "[".repeat(10_000);
    let long =
        json!({"type": "note", "reference": "r", "text": "x".repeat(5000), "at": null}).to_string();
    let odd =
        json!({"type": "history", "reference": "r", "stream": 99, "from": 0, "to": 1, "points": 1});
    for text in [
        "",
        "{}",
        "[]",
        r#"{"type": "mark"}"#,
        r#"{"type": "ping"}"#,
        &deep,
        &long,
        &odd.to_string(),
    ] {
        bad.say(text).await;
        let refused = bad.until("refused").await;
        assert!(!refused["reason"].as_str().unwrap().is_empty(), "{refused}");
    }
    // The connection may end while it is still being sent.
    drop(bad.socket_say(&"x".repeat(1 << 20)).await);
    bad.ended().await;
    let mut flooding = stage.browser().await;
    for _ in 0..600 {
        if flooding.socket_say(r#"{"type": "ping", "sent": 0}"#).await.is_err() {
            break;
        }
    }
    assert!(flooding.ended().await.contains("more than 100 messages per second"));
    stage.happen(EventKind::Marker, "after");
    good.event("after").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_a_hundred_browsers_sixty_four_are_served_and_the_others_hear_why() {
    let stage = Stage::new("s");
    let mut served = Vec::new();
    for _ in 0..64 {
        served.push(stage.browser().await);
    }
    for _ in 64..100 {
        let reason = stage.connect().await.ended().await;
        assert_eq!(reason, "64 viewers are already connected: close one of them");
    }
    stage.happen(EventKind::Marker, "all");
    for browser in &mut served {
        browser.event("all").await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_stops_reading_is_cut_off_while_others_get_every_marker() {
    let stage = Stage::new("s");
    let mut reading = stage.browser().await;
    let mut deaf = stage.browser().await;
    let label = |number: usize| format!("{number} {}", "x".repeat(1000));
    for number in 0..25_000 {
        stage.happen(EventKind::Marker, &label(number));
        if number % 1000 == 999 {
            reading.event(&label(number)).await;
        }
    }
    let metrics = ["GET /metrics HTTP/1.1", "Host: HOST"];
    while !stage.request(&metrics, "").await.contains("teampulse_viewers_cut_off_total 1\n") {}
    stage.happen(EventKind::Marker, "after");
    reading.event("after").await;
    let mut markers = 0;
    loop {
        match deaf.next().await {
            Received::Text(value) => markers += value["events"].as_array().map_or(0, Vec::len),
            Received::Wave(_) => {}
            Received::Closed(_) => break,
        }
    }
    assert!(markers < 25_000, "it got the first {markers}");
}

#[tokio::test(flavor = "multi_thread")]
async fn who_shall_stay_blind_gets_no_estimates() {
    let hides = Arc::new(|stream: &Stream| stream.family == "state");
    let context = Context { is_blinding: true, hides, ..Context::new("s", Clock::host()) };
    let stage = Stage::of(context, Settings::default());
    stage.give(state(), 0.0, values(1.5));
    stage.give(Stream::derived(&ecg(), "heart", Shape::Feature), 0.0, values(70.0));
    stage.happen(EventKind::Marker, "x");
    let mut browser = stage.browser().await;
    // Known before, or new: the order is not the same.
    let features = browser.until("features").await;
    browser.event("x").await;
    assert_eq!(features["features"].as_array().unwrap().len(), 1);
    assert_eq!(features["features"][0]["values"][0], 70.0);
    let text = stage.request(&["GET /metrics HTTP/1.1", "Host: HOST"], "").await;
    assert!(!text.contains("heart_rate_z"), "{text}");
    let name = "/humans/persons/p001/strap/ecg/state";
    let ask = format!("GET /api/history?stream={name} HTTP/1.1");
    assert!(stage.request(&[&ask, "Host: HOST"], "").await.starts_with("HTTP/1.1 404"));
}

fn camera() -> Stream {
    let [name, encoding] = ["sensor_msgs/msg/CompressedImage", "ros2msg"].map(str::to_owned);
    let schema = Schema { name, encoding, text: String::new(), hash: String::new() };
    Stream::raw("/robot1/front", Subject::robot("robot1"), Shape::Message(schema.into()))
}

/// A message with a file that ends with a byte.
fn picture(last: u8) -> Data {
    let mut writer = Writer::new();
    writer.write(&Header::default());
    writer.text("jpeg");
    writer.sequence(&[0xff, 0xd8, 0xff, last]);
    Data::Message(writer.finish())
}

fn pose() -> Stream {
    let name = "/humans/persons/p001/front/pose";
    let stream = Stream::raw(name, Subject::person("p001"), Shape::Sample);
    let inputs = vec!["/robot1/front".to_owned()];
    Stream { inputs, ..stream.with_channels(&[("nose_x", "px"), ("nose_y", "px")]) }
}

fn nose(x: f64) -> Data {
    Data::Sample(Arc::from([x, 5.0]))
}

/// The last bytes of the next pictures, and the noses that come with them.
async fn next(browser: &mut stage::Browser, count: usize) -> (Vec<u8>, Vec<f64>) {
    let (mut pictures, mut noses) = (Vec::new(), Vec::new());
    while pictures.len() < count {
        match browser.next().await {
            Received::Wave(bytes) => {
                pictures.push(*bytes.last().expect("a picture"));
                let stream = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes"));
                browser.say(json!({"type": "shown", "streams": [stream]}).to_string()).await;
            }
            Received::Text(text) if text["type"] == "samples" => {
                let samples = text["samples"].as_array().expect("samples");
                noses.extend(samples.iter().filter_map(|sample| sample["values"][0].as_f64()));
            }
            Received::Text(_) => {}
            Received::Closed(reason) => panic!("{reason}"),
        }
    }
    (pictures, noses)
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_wait_for_the_points_found_in_them_where_these_are_drawn() {
    let stage = Stage::new("s");
    let at = |secs: f64| stage.now() + secs;
    let taken = at(0.0);
    stage.give_at(taken, camera(), picture(0));
    stage.give_at(taken, pose(), nose(0.0));
    let streams = ["GET /api/streams HTTP/1.1", "Host: HOST"];
    while !stage.request(&streams, "").await.contains(&pose().name) {}
    let mut browsers = Vec::new();
    for with_points in [true, false] {
        let mut browser = stage.browser().await;
        let streams = browser.seen["streams"]["streams"].as_array().unwrap().clone();
        let number =
            |name: &str| streams.iter().find(|each| each["name"] == name).unwrap()["id"].clone();
        let want = |id: serde_json::Value| json!({"stream": id, "points_per_sec": 0.0, "with_points": with_points});
        let wanted =
            [want(number("/robot1/front")), want(number("/humans/persons/p001/front/pose"))];
        browser.say(json!({"type": "want", "streams": wanted}).to_string()).await;
        // The newest picture is sent at once.
        assert_eq!(next(&mut browser, 1).await.0, [0]);
        browsers.push(browser);
    }
    let times = [0.1, 0.2, 0.3, 0.4].map(at);
    for (time, last) in times.iter().zip(1..) {
        stage.give_at(*time, camera(), picture(last));
    }
    stage.give_at(times[0], pose(), nose(1.0));
    stage.give_at(times[2], pose(), nose(3.0));
    let [with_points, without] = browsers.as_mut_slice() else { panic!() };
    // Of what is looked at every second picture; without points the newest.
    let (pictures, noses) = next(with_points, 1).await;
    let (rest, more) = if pictures == [3] { (vec![], vec![]) } else { next(with_points, 1).await };
    assert_eq!([pictures, rest].concat().last(), Some(&3));
    assert!([noses, more].concat().contains(&3.0));
    while next(without, 1).await.0 != [4] {}
    assert!(stage.end().is_ok());
}

#[tokio::test(flavor = "multi_thread")]
async fn points_that_are_hidden_are_sent_to_nobody_who_is_blind() {
    let hides = Arc::new(|stream: &Stream| stream.name.ends_with("/pose"));
    let context = Context { is_blinding: true, hides, ..Context::new("s", Clock::host()) };
    let stage = Stage::of(context, Settings::default());
    stage.give(camera(), 0.0, picture(0));
    stage.give(pose(), 0.0, nose(7.0));
    stage.happen(EventKind::Marker, "after");
    let mut browser = stage.browser().await;
    browser.event("after").await;
    let streams = browser.seen["streams"]["streams"].as_array().unwrap();
    let hidden = streams.iter().find(|each| each["name"] == pose().name).unwrap();
    assert_eq!(hidden["hidden"], json!(true));
    let id = &hidden["id"];
    let want = json!({"stream": id, "points_per_sec": 0.0, "with_points": true});
    browser.say(json!({"type": "want", "streams": [want]}).to_string()).await;
    stage.give(pose(), 0.0, nose(8.0));
    stage.happen(EventKind::Marker, "later");
    browser.event("later").await;
    assert!(!browser.seen.contains_key("samples"), "{:?}", browser.seen["samples"]);
    assert!(stage.end().is_ok());
}
