/// A line of the streaming server.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// One sample.
    Sample(Sample),
    /// The wearer pressed the button, at this Unix time \[ns\].
    Tag(i64),
    /// The devices that are linked to the server, by their IDs.
    Devices(Vec<String>),
    /// The answer to a request: its words, such as `device_subscribe bvp`, and the reason if it was refused.
    Answer(String, Result<(), String>),
    /// Whether the radio link of the E4 is up: lost or switched off (`false`), or up again.
    Linked(bool),
}

/// The measurement in one line.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The signal that was measured.
    pub channels: &'static Channels,
    /// The Unix time of the sample, as counted by the server \[ns\].
    pub time_ns: i64,
    /// One value for each channel.
    pub values: Vec<f64>,
}

/// A signal of the E4.
#[derive(Debug, PartialEq)]
pub struct Channels {
    /// The word at the start of the signal's lines, after `E4_`.
    pub word: &'static str,
    /// The signal's name in a subscription request.
    pub subscription: &'static str,
    /// The name of the signal's stream.
    pub stream: &'static str,
    /// The names of the values.
    pub names: &'static [&'static str],
    /// The unit of `raw * scale`.
    pub unit: &'static str,
    /// One step of a raw value in `unit`.
    pub scale: f64,
    /// Samples per second \[Hz\]; `None` for irregular signals.
    pub rate_hz: Option<f64>,
}

impl Channels {
    const fn of(word: &'static str, subscription: &'static str, stream: &'static str) -> Self {
        Self { word, subscription, stream, names: &["value"], unit: "", scale: 1.0, rate_hz: None }
    }

    /// All signals.
    pub const ALL: [Self; 8] = [
        Self {
            names: &["x", "y", "z"],
            unit: "g",
            scale: 1.0 / 64.0,
            rate_hz: Some(32.0),
            ..Self::of("Acc", "acc", "acceleration")
        },
        Self { rate_hz: Some(64.0), ..Self::of("Bvp", "bvp", "ppg") },
        Self { unit: "uS", rate_hz: Some(4.0), ..Self::of("Gsr", "gsr", "eda") },
        Self { unit: "degC", rate_hz: Some(4.0), ..Self::of("Temperature", "tmp", "temperature") },
        Self { unit: "s", ..Self::of("Ibi", "ibi", "ibi") },
        Self { unit: "1/min", ..Self::of("Hr", "ibi", "heart_rate") },
        Self { unit: "%", scale: 100.0, ..Self::of("Battery", "bat", "battery") },
        Self { unit: "degC", rate_hz: Some(4.0), ..Self::of("Temp", "tmp", "temperature") },
    ];

    fn find(word: &str) -> Option<&'static Self> {
        static ALL: [Channels; 8] = Channels::ALL;
        ALL.iter().find(|channels| channels.word == word)
    }
}

impl Message {
    /// Parses a line without its line end; `None` if it is not a line of the protocol.
    ///
    /// ```
    /// use teampulse_devices::empatica_e4::Message;
    ///
    /// let Some(Message::Sample(sample)) = Message::parse("E4_Gsr 1460377850.53423 0.3129") else {
    ///     panic!("it is a sample");
    /// };
    /// assert_eq!((sample.time_ns, sample.values), (1_460_377_850_534_230_000, vec![0.3129]));
    /// ```
    pub fn parse(line: &str) -> Option<Self> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["R", "device_list", _, ..] => Some(Self::Devices(listed(line))),
            ["R", "connection", "lost", ..] | ["R", "device", _, "turned", "off", ..] => {
                Some(Self::Linked(false))
            }
            ["R", "connection", "re-established", ..] => Some(Self::Linked(true)),
            ["R", answer @ ..] => Self::answer(answer),
            ["E4_Tag", time, ..] => unix_ns(time).map(Self::Tag),
            [word, time, values @ ..] => {
                let channels = Channels::find(word.strip_prefix("E4_")?)?;
                let values: Vec<f64> = values.iter().map_while(|text| number(text)).collect();
                let sample = Sample { channels, time_ns: unix_ns(time)?, values };
                (sample.values.len() == channels.names.len()).then_some(Self::Sample(sample))
            }
            _ => None,
        }
    }

    fn answer(words: &[&str]) -> Option<Self> {
        let end = |word: &&str| matches!(*word, "OK" | "ERR" | "ON" | "OFF");
        let at = words.iter().position(end)?;
        let (request, verdict) = words.split_at(at);
        let result = match verdict {
            ["ERR", reason @ ..] => Err(reason.join(" ")),
            _ => Ok(()),
        };
        Some(Self::Answer(request.join(" "), result))
    }
}

/// Returns the IDs in a line such as `R device_list 2 | 9ff167 Empatica_E4 | 7a3166 Empatica_E4`.
fn listed(line: &str) -> Vec<String> {
    let devices = line.split('|').skip(1);
    devices.filter_map(|device| device.split_whitespace().next()).map(str::to_owned).collect()
}

/// Parses a number with a decimal point or comma.
fn number(text: &str) -> Option<f64> {
    text.replace(',', ".").parse().ok().filter(|number: &f64| number.is_finite())
}

/// Converts seconds since the Unix epoch, with up to nine decimals, to nanoseconds exactly.
fn unix_ns(text: &str) -> Option<i64> {
    let (secs, decimals) = text.split_once(['.', ',']).unwrap_or((text, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if secs.is_empty() || !digits(secs) || !digits(decimals) {
        return None;
    }
    let nanos = decimals.bytes().chain(std::iter::repeat(b'0')).take(9);
    let nanos = nanos.fold(0, |nanos, digit| nanos * 10 + i64::from(digit - b'0'));
    secs.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(line: &str) -> (&'static str, i64, Vec<f64>) {
        match Message::parse(line) {
            Some(Message::Sample(sample)) => {
                (sample.channels.stream, sample.time_ns, sample.values)
            }
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn every_signal_has_its_line() {
        let ns = 1_460_377_850_500_000_000;
        let lines = [
            ("E4_Acc 1460377850.5 51 -2 -10", "acceleration", vec![51.0, -2.0, -10.0]),
            ("E4_Bvp 1460377850.5 31.128", "ppg", vec![31.128]),
            ("E4_Gsr 1460377850.5 3.129", "eda", vec![3.129]),
            ("E4_Temperature 1460377850.5 35.82", "temperature", vec![35.82]),
            ("E4_Temp 1460377850.5 35.82", "temperature", vec![35.82]),
            ("E4_Ibi 1460377850.5 0.822", "ibi", vec![0.822]),
            ("E4_Hr 1460377850.5 142.2156", "heart_rate", vec![142.2156]),
            ("E4_Battery 1460377850.5 0.2", "battery", vec![0.2]),
        ];
        for (line, stream, values) in lines {
            assert_eq!(sample(line), (stream, ns, values));
        }
        assert_eq!(Message::parse("E4_Tag 1460377850.5"), Some(Message::Tag(ns)));
    }

    #[test]
    fn a_decimal_comma_is_a_decimal_point() {
        let point = sample("E4_Temperature 1460377850.25 35.82");
        assert_eq!(sample("E4_Temperature 1460377850,25 35,82"), point);
    }

    #[test]
    fn an_answer_is_ok_an_echo_or_a_refusal() {
        let answer = |line: &str| Message::parse(line);
        let subscribed = Some(Message::Answer("device_subscribe bvp".into(), Ok(())));
        assert_eq!(answer("R device_subscribe bvp OK"), subscribed);
        assert_eq!(answer("R device_subscribe bvp ON"), subscribed);
        let reason = Err("not connected".to_owned());
        let refused = Some(Message::Answer("device_subscribe bvp".into(), reason));
        assert_eq!(answer("R device_subscribe bvp ERR not connected"), refused);
    }

    #[test]
    fn devices_are_listed_by_their_ids() {
        let devices = |line: &str| match Message::parse(line) {
            Some(Message::Devices(devices)) => devices,
            other => panic!("{other:?}"),
        };
        let two = devices("R device_list 2 | 9ff167 Empatica_E4 | 7a3166 Empatica_E4");
        assert_eq!(two, ["9ff167", "7a3166"]);
        assert!(devices("R device_list 0").is_empty());
    }

    #[test]
    fn what_lacks_a_value_is_no_sample() {
        for line in [
            "E4_Acc 1.5 1 2",
            "E4_Bvp 1.5",
            "E4_Bvp x 1",
            "E4_Bvp 1.5 nan",
            "E4_Bvp 99999999999 1",
            "",
        ] {
            assert_eq!(Message::parse(line), None, "{line}");
        }
    }
}
