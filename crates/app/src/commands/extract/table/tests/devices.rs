//! Tables in the formats of devices and their programs.

use super::*;

const MS: i64 = 1_000_000;

fn lines(head: &str, rows: impl Iterator<Item = String>) -> String {
    rows.fold(format!("{head}\n"), |text, row| text + &row + "\n")
}

fn steps(times: &[i64]) -> Vec<i64> {
    times.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

#[test]
fn polar_sensor_logger_s_ecg_has_the_sensor_s_rate_and_the_phone_s_time() {
    // The phone gives samples of one packet nearly the same time.
    let row = |k: i64| {
        let (phone_ms, sensor_ns) = (270 + k / 4, 599_616_050_941_733_632 + k * 7_692_308);
        format!("2026-04-24T14:10:15.{phone_ms};{sensor_ns};{:.1};{}", k as f64 * 7.692, 85 - k)
    };
    let head = "Phone timestamp;sensor timestamp [ns];timestamp [ms];ecg [uV]";
    let text = lines(head, (0..40).map(row));
    let (table, times, numbers) = reported("psl_ecg.txt", &of(Signal::Ecg), &text);
    assert_eq!((table.rate_hz(), table.names()), (130.0, &["ecg [uV]".to_owned()][..]));
    assert_eq!(table.units(), [Some("uV".to_owned())]);
    assert_eq!(times[0], 1_777_039_815_270 * MS);
    assert!(steps(&times).iter().all(|step| *step == 7_692_308));
    assert_eq!(numbers[..2], [[85.0], [84.0]]);
    assert!(table.notes().iter().any(|note| note.contains("sensor timestamp [ns]")));
}

#[test]
fn polar_sensor_logger_s_acceleration_and_pulse_are_recognised() {
    let row = |k: i64| {
        let sensor_ns = 599_616_065_136_175_104 + k * 20_000_000;
        format!("2026-04-24T14:10:20.{:03};{sensor_ns};-953;63;{}", 58 + k, 425 + k)
    };
    let text =
        lines("Phone timestamp;sensor timestamp [ns];X [mg];Y [mg];Z [mg]", (0..20).map(row));
    let (table, _, numbers) = reported("psl_acc.txt", &of(Signal::Acceleration), &text);
    assert_eq!((table.rate_hz(), table.names().len()), (50.0, 3));
    assert_eq!(table.units()[2].as_deref(), Some("mg"));
    assert_eq!(numbers[1], [-953.0, 63.0, 426.0]);

    let head = "Phone timestamp;sensor timestamp [ns];channel 0;channel 1;channel 2;ambient";
    let (table, ..) = reported(
        "psl_ppg.txt",
        &of(Signal::Ppg),
        &text.replacen(text.lines().next().unwrap(), head, 1),
    );
    assert_eq!(table.names(), ["channel 0"]);
}

#[test]
fn polar_sensor_logger_s_intervals_have_their_times() {
    let text = "Phone timestamp;RR-interval [ms]\n\
                2026-04-24T14:10:15.270;812\n2026-04-24T14:10:16.100;830\n";
    let (table, times, numbers) = reported("psl_rr.txt", &of(Signal::Interval), text);
    assert_eq!(
        (table.names(), table.units()),
        (&["RR-interval [ms]".to_owned()][..], &[Some("ms".to_owned())][..])
    );
    assert_eq!(times, [1_777_039_815_270 * MS, 1_777_039_816_100 * MS]);
    assert_eq!(numbers, [[812.0], [830.0]]);

    // The error estimate of an interval is not an interval.
    let text = "Phone timestamp;PP-interval [ms];error estimate [ms];blocker;contact;contact supported\n\
                2026-04-24T14:10:15.270;812;10;0;1;1\n";
    let (table, ..) = reported("psl_ppi.txt", &of(Signal::Interval), text);
    assert_eq!(table.names(), ["PP-interval [ms]"]);
}

#[test]
fn an_e4_s_acceleration_is_in_sixty_fourths_of_g() {
    let text = "1551453301.000000, 1551453301.000000, 1551453301.000000\n\
                32.000000, 32.000000, 32.000000\n-1,65,5\n-1,64,5\n";
    let (table, _, numbers) = reported("e4_acc.csv", &of(Signal::Acceleration), text);
    assert_eq!((table.rate_hz(), table.begin_ns()), (32.0, Some(1_551_453_301_000 * MS)));
    assert!(table.units().iter().all(|unit| unit.as_deref() == Some("g/64")));
    assert_eq!(numbers, [[-1.0, 65.0, 5.0], [-1.0, 64.0, 5.0]]);
}

#[test]
fn an_e4_s_intervals_have_their_times_since_1970() {
    let text = "1551453301.000000, IBI\n145.631666,0.62509\n146.522332,0.890666\n";
    let (table, times, numbers) = reported("e4_ibi.csv", &of(Signal::Interval), text);
    assert_eq!(table.units(), [Some("s".to_owned())]);
    assert_eq!(times, [1_551_453_446_631_666_000, 1_551_453_447_522_332_000]);
    assert_eq!(numbers, [[0.62509], [0.890_666]]);
}

#[test]
fn an_embrace_plus_counts_microseconds() {
    let row =
        |k: i64| format!("{},{:.3}", 1_700_000_000_250_000 + k * 250_000, 0.5 + k as f64 / 100.0);
    let (table, times, _) =
        reported("ep_eda.csv", &of(Signal::Eda), &lines("unix_timestamp,eda", (0..20).map(row)));
    assert_eq!((table.rate_hz(), times[0]), (4.0, 1_700_000_000_250 * MS));

    let row =
        |k: i64| format!("{},{},{},{}", 1_700_000_000_250_000 + k * 15_625, 12 + k, -2040, 31);
    let (table, ..) = reported(
        "ep_acc.csv",
        &of(Signal::Acceleration),
        &lines("unix_timestamp,x,y,z", (0..20).map(row)),
    );
    assert_eq!((table.rate_hz(), table.names().join(" ")), (64.0, "x y z".to_owned()));
}

#[test]
fn the_minutes_of_an_embrace_plus_state_their_units() {
    let head =
        "timestamp_unix,timestamp_iso,participant_full_id,temperature_celsius,missing_value_reason";
    let row = |k: i64| {
        format!("{},2023-11-14T22:{:02}:00Z,1-1-P1,33.{k:02},", 1_699_999_200_000 + k * 60_000, k)
    };
    let (table, times, numbers) =
        reported("ep_temp.csv", &of(Signal::Temperature), &lines(head, (13..30).map(row)));
    assert_eq!(
        (table.names(), table.units()),
        (&["temperature_celsius".to_owned()][..], &[Some("celsius".to_owned())][..])
    );
    assert!((table.rate_hz() * 60.0 - 1.0).abs() < 1e-9);
    assert_eq!((times[0], numbers[0][0]), (1_699_999_980_000 * MS, 33.13));
}

#[test]
fn shimmer_s_consensys_gives_units_below_the_names() {
    let names = [
        "Timestamp_Unix_CAL",
        "Accel_LN_X_CAL",
        "Accel_LN_Y_CAL",
        "Accel_LN_Z_CAL",
        "Accel_WR_X_CAL",
        "Accel_WR_Y_CAL",
        "Accel_WR_Z_CAL",
        "GSR_Range_CAL",
        "GSR_Skin_Conductance_CAL",
        "GSR_Skin_Resistance_CAL",
    ];
    let names = names.map(|name| format!("Shimmer_40AC_{name}")).join(";");
    let head = format!(
        "\"sep=;\"\n{names};\nms;m/(s^2);m/(s^2);m/(s^2);m/(s^2);m/(s^2);m/(s^2);no_units;uS;kOhms;"
    );
    let row = |k: i64| {
        format!(
            "{}E12;-1.4;{k};9.7;1.5;8.4;-1.6;2.0;2.{k};401.1;",
            1.595_933_810_034 + k as f64 * 8e-12
        )
    };
    let text = lines(&head, (1..20).map(row));
    let (table, times, numbers) = reported("shimmer_eda.csv", &of(Signal::Eda), &text);
    assert_eq!(table.names(), ["Shimmer_40AC_GSR_Skin_Conductance_CAL"]);
    assert_eq!((table.rate_hz().round(), table.units()[0].as_deref()), (125.0, Some("uS")));
    assert!((times[0] - 1_595_933_810_042 * MS).abs() < MS);
    assert_eq!(numbers[0], [2.1]);

    let (table, _, numbers) = reported("shimmer_acc.csv", &of(Signal::Acceleration), &text);
    assert!(table.names().iter().all(|name| name.contains("Accel_LN")));
    assert_eq!(
        (&numbers[1][..], table.units()[0].as_deref()),
        (&[-1.4, 2.0, 9.7][..], Some("m/(s^2)"))
    );
}

#[test]
fn dates_are_times_in_any_form_of_them() {
    let row = |date: &str, mark: &str, k: i64| {
        format!("{date}15:48:{:02}{mark}{:03};{k}", k / 4, k % 4 * 250)
    };
    for (name, date, mark) in [
        ("iso", "2021-04-05T", "."),
        ("muse", "2021-04-05 ", "."),
        ("german", "05.04.2021 ", ","),
        ("english", "05/04/2021 ", "."),
    ] {
        let text = lines("TimeStamp;eda", (0..30).map(|k| row(date, mark, k)));
        let (table, times, _) = reported(&format!("{name}.csv"), &of(Signal::Eda), &text);
        assert_eq!((table.rate_hz(), times[0]), (4.0, 1_617_637_680_000 * MS), "{name}");
    }
    let text = lines("recorded_at;eda", (0..30).map(|k| row("2021-04-05T", ".", k)));
    let (table, times, numbers) = reported("any_name.csv", &of(Signal::Eda), &text);
    assert_eq!((table.rate_hz(), times[0]), (4.0, 1_617_637_680_000 * MS));
    assert_eq!(numbers[1], [1.0]);
    let text = lines("time,eda", (0..30).map(|k| row("", ".", k).replace(';', ",")));
    let (table, times, _) = reported("clock.csv", &of(Signal::Eda), &text);
    assert_eq!((table.rate_hz(), times[1] - times[0]), (4.0, 250 * MS));
}

#[test]
fn decimal_commas_are_read_in_any_column() {
    let row = |k: i64| format!("{},{:03};{},5;-1,25", k / 4, k % 4 * 250, 33 + k % 2);
    for (name, mark) in [("semicolons", ";"), ("tabs", "\t"), ("spaces", "  ")] {
        let text = lines("time;temp;x", (0..20).map(row)).replace(';', mark);
        let chosen = Wanted { time: Some("time".into()), ..of(Signal::Temperature) };
        let (table, times, numbers) = reported(&format!("{name}.csv"), &chosen, &text);
        assert_eq!((table.rate_hz(), times[1]), (4.0, 250 * MS), "{name}");
        assert_eq!(numbers[..2], [[33.5], [34.5]], "{name}");
    }
    let text =
        lines("time,temp", (0..20).map(|k| format!("{},{:03},33,{k:02}", k / 4, k % 4 * 250)));
    let (table, _, numbers) = reported("both.csv", &of(Signal::Temperature), &text);
    assert_eq!((table.rate_hz(), numbers[7][0]), (4.0, 33.07));
    let text = lines(
        "time,temp",
        (0..20).map(|k| format!("\"{},{:03}\",\"33,{k:02}\"", k / 4, k % 4 * 250)),
    );
    let (table, _, numbers) = reported("quoted.csv", &of(Signal::Temperature), &text);
    assert_eq!((table.rate_hz(), numbers[7][0]), (4.0, 33.07));
}

#[test]
fn one_column_with_commas_is_one() {
    for (name, text) in [
        ("named", "Temp\n33,4\n33,5\n"),
        ("words", "Skin temp\n33,40\n33,05\n"),
        ("bare", "33,40\n33,05\n"),
        ("mixed", "33\n33,5\n"),
    ] {
        let file = File::new(&format!("{name}.csv"), text);
        let mut table = Table::open(&file.0, &of(Signal::Temperature), Some(4.0)).unwrap();
        assert!(rows(&mut table).iter().all(|row| (33.0..34.0).contains(&row[0])), "{name}");
    }
    let file = File::new("open.csv", "12,65\n13,64\n12,7\n");
    let open = |wanted: &Wanted| Table::open(&file.0, wanted, Some(4.0));
    assert!(matches!(open(&of(Signal::Eda)), Err(TableError::WhichComma { line: 1, .. })));
    let comma = Wanted { decimal: Some(Decimal::Comma), ..of(Signal::Eda) };
    assert_eq!(rows(&mut open(&comma).unwrap())[0], [12.65]);
    let second = Wanted { columns: vec!["2".into()], ..of(Signal::Eda) };
    assert_eq!(rows(&mut open(&second).unwrap())[0], [65.0]);
}

#[test]
fn milliseconds_microseconds_and_nanoseconds_are_recognised() {
    for (name, ns) in [("ms", MS), ("us", 1000), ("ns", 1)] {
        let text = lines("timestamp,ecg", (0..30).map(|k| format!("{},{k}", k * 4 * MS / ns)));
        let (table, times, _) = reported(&format!("{name}.csv"), &of(Signal::Ecg), &text);
        assert_eq!((table.rate_hz(), times[1]), (250.0, 4 * MS), "{name}");
        assert!(
            table.notes().iter().any(|note| note.contains(&format!("read as {name}"))),
            "{name}"
        );
    }
    // Numbers of rows are no times.
    let file = File::new("rows.csv", lines("time,ecg", (0..30).map(|k| format!("{k},{k}"))));
    let opened = Table::open(&file.0, &of(Signal::Ecg), None);
    assert!(matches!(opened, Err(TableError::NoRate { time: Some(_) })));
}
