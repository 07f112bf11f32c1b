//! Malformed tables: they are either read, or refused with a reason.

use proptest::prelude::*;
use teampulse_core::text::is_unwanted;

use super::super::super::rows::{Rows, Said};
use super::*;

/// Possible contents of a cell.
fn cell() -> impl Strategy<Value = String> {
    let odd = [
        "",
        " ",
        "nan",
        "NaN",
        "inf",
        "-",
        "1e999",
        "-1e-999",
        "0x10",
        "1_000",
        "١٢٣",
        "1.2.3",
        "1,5",
        "=1+1",
        "\"",
        "\"a",
        "\"1\"\"2\"",
        "'",
        "\u{0}",
        "\u{1b}[2J",
        "\u{202e}1",
        "ms",
        "uS",
        "time",
        "ecg",
        "IBI",
        "2021-04-05T15:48:04.834",
        "05.04.2021 15:48",
        "99999999999999999999",
        "1617630484",
        "\u{feff}1",
        "#",
        "%",
    ];
    let number = prop_oneof![
        any::<i32>().prop_map(|number| number.to_string()),
        any::<f64>().prop_map(|number| number.to_string()),
        (0..100_u32).prop_map(|number| format!("{}.{number}", number % 7)),
    ];
    prop_oneof![
        6 => number,
        2 => prop::sample::select(odd.to_vec()).prop_map(str::to_owned),
        1 => any::<char>().prop_map(String::from),
    ]
}

/// The bytes of a table: ragged rows, any separators, any header, any encoding.
fn table() -> impl Strategy<Value = Vec<u8>> {
    let row = || prop::collection::vec(cell(), 0..6);
    let heads = [
        "",
        "ecg\n",
        "time,ecg\n",
        "ecg,ecg,ecg\n",
        "time;time\nms;uS\n",
        "# Sampling Rate: 0 Hz\n",
        "sep=;\n",
        "\"time\",\"ecg\n",
        "1617630484.0\n4.0\n",
        "1617630484.0, IBI\n",
        "\n\n\n",
    ];
    let separator = prop::sample::select(vec![",", ";", "\t", " ", ", ", "|"]);
    let end = prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n", "\u{2028}"]);
    let parts =
        (prop::sample::select(heads.to_vec()), prop::collection::vec(row(), 0..30), separator, end);
    (parts, 0..8_u8, prop_oneof![30 => Just(1_usize), 1 => Just(1 << 17)]).prop_map(
        |((head, rows, separator, end), encoding, times)| {
            let mut text = head.to_owned();
            for row in rows {
                text.push_str(&row.join(separator));
                text.push_str(end);
            }
            text.push_str(&"9".repeat(times - 1));
            let wide =
                |to: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to).collect::<Vec<u8>>();
            match encoding {
                0 => [&b"\xff\xfe"[..], &wide(u16::to_le_bytes)].concat(),
                1 => [&b"\xfe\xff"[..], &wide(u16::to_be_bytes)].concat(),
                2 => [&b"\xef\xbb\xbf"[..], text.as_bytes()].concat(),
                // In Latin 1.
                3 => text.chars().map(|each| each as u32 as u8).collect(),
                _ => text.into_bytes(),
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn any_table_is_read_or_refused_with_a_reason(
        bytes in table(),
        signal in prop::sample::select(vec![Signal::Ecg, Signal::Eda, Signal::Emg, Signal::Interval, Signal::Other]),
        rate_hz in prop_oneof![Just(None), Just(Some(130.0))],
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("odd.csv");
        std::fs::write(&path, &bytes).unwrap();
        let is_harmless = |said: &str| said.chars().all(|each| !is_unwanted(each) || matches!(each, '\n' | '\t'));
        match Table::open(&path, &of(signal), rate_hz) {
            Err(error) => {
                let said = crate::output::harmless(&error.to_string()).into_owned();
                prop_assert!(!said.is_empty() && is_harmless(&said), "{said:?}");
            }
            Ok(table) => {
                let Ok(mut rows) = Rows::new(Analysis::of(signal).unwrap(), table, &Said { scale: 1.0, unit: None }) else { return Ok(()) };
                let mut count = 0;
                while let Ok(Some(_)) = rows.next() {
                    count += 1;
                    prop_assert!(count <= bytes.len(), "no end");
                }
            }
        }
    }
}
