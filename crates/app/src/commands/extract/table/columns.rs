//! Selects the columns of a table.

use super::clock::{Clock, unit_ns, unit_of_name_ns};
use super::dates::{Order, date_ns, order};
use super::dialect::Decimal;
use super::error::TableError;
use super::head::{Head, is_count_like, is_time_like};
use super::line::number;
use super::units::{self, unit};

/// The names of the time columns in our own tables [s].
const OWN_TIMES: [&str; 3] = ["measured_secs", "unix_secs", "time_secs"];
/// Rates that differ by less than this fraction count as equal: a few stamps in whole milliseconds are no more exact.
const LIKE_RATES: f64 = 0.05;

/// A column rises evenly if it has at least this many steps, and the largest is less than this factor times the
/// smallest.
const LEAST_STEPS: usize = 4;
const MOST_UNEVEN: f64 = 1.5;

/// Earlier times are not dates [ns since 1970]: 2001-01-01.
const DATED_NS: i64 = 978_307_200_000_000_000;

/// What to look for in a table.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The signal to look for.
    pub signal: &'static str,
    /// Words that may occur in the name of the signal's column.
    pub words: &'static [&'static str],
    /// Whether all columns are wanted if none is named.
    pub takes_all: bool,
    /// The number of columns; `None` for any number.
    pub channels: Option<usize>,
    /// The unit to convert to; `None` if any will do.
    pub unit: Option<&'static str>,
    /// Whether rows are sampled evenly.
    pub is_even: bool,
    /// The lowest plausible sampling rate of the signal [Hz].
    pub least_hz: f64,
    /// Names or numbers of columns; empty when the user named none.
    pub columns: Vec<String>,
    /// The column with the times.
    pub time: Option<String>,
    /// The decimal separator, if the user set it.
    pub decimal: Option<Decimal>,
}

/// The selected columns of a table.
pub struct Columns {
    /// The index of each column.
    pub places: Vec<usize>,
    pub names: Vec<String>,
    /// The unit of each column, if the table states it.
    pub units: Vec<Option<String>>,
    pub time: Option<Time>,
    /// The start of rows whose times follow from a rate, if a column contains the date [ns since 1970].
    pub begin_ns: Option<i64>,
    /// Notes on choices that the user did not ask for.
    pub notes: Vec<String>,
}

/// A column of times.
#[derive(Clone, Debug)]
pub struct Time {
    pub place: usize,
    pub clock: Clock,
}

impl Columns {
    /// Selects the columns. A rate that the user gave [Hz], or that the table states, takes precedence over a column of
    /// times that the user did not name.
    pub fn choose(
        head: &Head,
        wanted: &Wanted,
        rate_hz: Option<f64>,
    ) -> Result<Columns, TableError> {
        let mut notes = Vec::new();
        let time = time(head, wanted, rate_hz, &mut notes)?;
        let begin_ns = if time.is_none() { begin_ns(head, wanted) } else { None };
        notes.extend(wanted.is_even.then(|| overruled(head, rate_hz)).flatten());
        let places = if wanted.columns.is_empty() {
            unnamed(head, wanted, time.as_ref(), &mut notes)?
        } else {
            let place = |name: &String| named(head, name);
            wanted.columns.iter().map(place).collect::<Result<Vec<_>, _>>()?
        };
        let is_repeated = |at: &usize| places[..*at].contains(&places[*at]);
        if let Some(at) = (0..places.len()).find(is_repeated) {
            return Err(TableError::Twice { column: head.name(places[at]) });
        }
        if let Some(&place) = places.iter().find(|place| head.is_text(**place)) {
            let text = head.cells(place)[0].chars().take(40).collect();
            return Err(TableError::TextColumn { column: head.name(place), text });
        }
        let names = places.iter().map(|&place| channel_name(head, place)).collect();
        let units = places.iter().map(|&place| unit(head, place, wanted)).collect();
        Ok(Columns { places, names, units, time, begin_ns, notes })
    }
}

/// Finds the index of a column by its name, its number from 1, or its name in another case.
fn named(head: &Head, name: &str) -> Result<usize, TableError> {
    let exact = head.names.iter().position(|each| each == name);
    let by_number =
        || name.parse::<usize>().ok().filter(|number| (1..=head.width).contains(number));
    let loose = || head.names.iter().position(|each| each.eq_ignore_ascii_case(name));
    exact
        .or_else(|| by_number().map(|number| number - 1))
        .or_else(loose)
        .ok_or_else(|| TableError::NoColumn { wanted: name.to_owned(), there: all_names(head) })
}

fn unnamed(
    head: &Head,
    wanted: &Wanted,
    time: Option<&Time>,
    notes: &mut Vec<String>,
) -> Result<Vec<usize>, TableError> {
    let is_signal = |&place: &usize| {
        time.is_none_or(|time| time.place != place)
            && !head.names.get(place).is_some_and(|name| is_time_like(name))
            && !head.is_empty(place)
    };
    let all: Vec<usize> = (0..head.width).filter(is_signal).collect();
    let numbers: Vec<usize> = all.iter().copied().filter(|place| !head.is_text(*place)).collect();
    let named = |&place: &usize| {
        let name = head.names.get(place).map(|name| name.to_ascii_lowercase());
        name.is_some_and(|name| wanted.words.iter().any(|word| holds(&name, word)))
    };
    let of_name: Vec<usize> = numbers.iter().copied().filter(named).collect();
    let several = if of_name.is_empty() { &numbers } else { &of_name };
    let chosen = match (wanted.takes_all, &several[..]) {
        (true, [_, ..]) => axes(head, several, wanted.channels),
        (false, [one]) => vec![*one],
        (false, [_, ..]) if !of_name.is_empty() => units::narrowed(head, of_name.clone(), wanted),
        (_, []) => return Ok(all.into_iter().take(1).collect()),
        _ => Vec::new(),
    };
    if chosen.is_empty() || (!wanted.takes_all && chosen.len() > 1) {
        return Err(TableError::WhichColumn { signal: wanted.signal, there: all_names(head) });
    }
    notes.extend(rising(head, &chosen));
    if chosen.len() < several.len() {
        let names: Vec<String> = chosen.iter().map(|&place| head.name(place)).collect();
        notes.push(format!("{} is read from column {}", wanted.signal, names.join(", ")));
    }
    Ok(chosen)
}

/// Returns a note if the first of several unnamed channels looks like times.
fn rising(head: &Head, chosen: &[usize]) -> Option<String> {
    let first = chosen.first().copied().filter(|_| head.names.is_empty() && chosen.len() > 1)?;
    let numbers: Vec<f64> = head.cells(first).into_iter().filter_map(number).collect();
    let steps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (least, most) = steps
        .iter()
        .fold((f64::INFINITY, 0.0), |(least, most), step| (step.min(least), step.max(most)));
    let is_even = steps.len() >= LEAST_STEPS && least > 0.0 && most < MOST_UNEVEN * least;
    let column = first + 1;
    is_even.then(|| {
        format!(
            "column {column} rises evenly, as times do, and is read as a channel: give --time {column} if it holds times, \
             or --column with the numbers of the others"
        )
    })
}

/// Whether a name contains a word; a short word must stand alone (`rr`, but not in `error`).
fn holds(name: &str, word: &str) -> bool {
    match word.len() {
        ..=2 => name.split(|c: char| !c.is_ascii_alphanumeric()).any(|part| part == word),
        _ => name.contains(word),
    }
}

/// Returns the first three columns whose names differ only by x, y and z, if three are needed and there are more.
fn axes(head: &Head, places: &[usize], wanted: Option<usize>) -> Vec<usize> {
    let all = places.to_vec();
    if wanted != Some(3) || places.len() <= 3 {
        return all;
    }
    let place = |name: &str| places.iter().copied().find(|&place| head.name(place) == name);
    let others = |first: usize| {
        let name = head.name(first);
        name.match_indices(['x', 'X']).find_map(|(at, x)| {
            let with = |axis: &str| format!("{}{axis}{}", &name[..at], &name[at + 1..]);
            let [y, z] = if x == "x" { ["y", "z"] } else { ["Y", "Z"] };
            Some(vec![first, place(&with(y))?, place(&with(z))?])
        })
    };
    places.iter().find_map(|&first| others(first)).unwrap_or(all)
}

fn time(
    head: &Head,
    wanted: &Wanted,
    rate_hz: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Option<Time>, TableError> {
    if let Some(name) = &wanted.time {
        let time = named_time(head, name, wanted, notes)?;
        notes.extend(contradicted(head, wanted, &time, rate_hz));
        return Ok(Some(time));
    }
    // The times of our own tables.
    let own = OWN_TIMES.iter().find_map(|&time| head.names.iter().position(|name| name == time));
    if let Some(place) = own {
        let time = Time { place, clock: Clock::of_unit(1_000_000_000) };
        notes.extend(contradicted(head, wanted, &time, rate_hz));
        return Ok(Some(time));
    }
    let Some(mut time) = recognised(head, wanted) else { return Ok(None) };
    if let Some(known_hz) = rate_hz.or(head.rate_hz).filter(|_| wanted.is_even) {
        let whose = if rate_hz.is_some() { "--rate" } else { "the rate in the table" };
        let (name, made) = (head.name(time.place), shown_hz(time.rate_hz(head)));
        notes.push(format!(
            "{whose} ({known_hz} Hz) is used, not the times in column {name}{made}, assuming no gaps between rows; give --time \"{name}\" to use the times"
        ));
        return Ok(None);
    }
    if !head.is_e4 {
        notes.push(format!("times are read from column {}", head.name(time.place)));
        notes.extend(Some(time.clock.note.clone()).filter(|note| !note.is_empty()));
    }
    time.clock = begun(head, time.place, time.clock);
    Ok(Some(time))
}

/// The date of the first row, if a column contains it [ns since 1970].
fn begin_ns(head: &Head, wanted: &Wanted) -> Option<i64> {
    let time = recognised(head, wanted).filter(|_| wanted.is_even)?;
    let first = head.cells(time.place).first().copied()?;
    let first_ns = begun(head, time.place, time.clock).read(first).ok().flatten();
    first_ns.filter(|first_ns| *first_ns >= DATED_NS)
}

/// Whether a column of this name holds the times of one of our own tables.
pub fn is_own_time(name: &str) -> bool {
    OWN_TIMES.contains(&name)
}

/// Finds the column that looks like times, by its name or by cells with dates.
fn recognised(head: &Head, wanted: &Wanted) -> Option<Time> {
    let is_one = |&place: &usize| match head.names.get(place) {
        Some(name) if is_time_like(name) => !is_count_like(name),
        Some(_) => is_date(head, place),
        None => head.names.is_empty() && is_date(head, place),
    };
    let mut places: Vec<usize> = (0..head.width).filter(is_one).collect();
    places.sort_by_key(|&place| rank(head, place));
    let clocks = places.into_iter().filter_map(|place| {
        let clock = clock(head, place, wanted)?;
        clock.fits(&head.cells(place), wanted.least_hz).then_some(Time { place, clock })
    });
    { clocks }.next()
}

/// Returns a note if the given rate differs from that of the times.
fn contradicted(head: &Head, wanted: &Wanted, time: &Time, rate_hz: Option<f64>) -> Option<String> {
    let (asked_hz, made_hz) = (rate_hz.filter(|_| wanted.is_even)?, time.rate_hz(head)?);
    let name = head.name(time.place);
    let is_other = (made_hz / asked_hz - 1.0).abs() > LIKE_RATES;
    is_other.then(|| {
        let made = shown_hz(Some(made_hz));
        format!("--rate ({asked_hz} Hz) is not the rate of the times in column {name}{made}")
    })
}

/// Returns a note if the given rate differs from the one that the table states.
fn overruled(head: &Head, rate_hz: Option<f64>) -> Option<String> {
    let (asked_hz, own_hz) = (rate_hz?, head.rate_hz?);
    let is_other = (own_hz / asked_hz - 1.0).abs() > f64::EPSILON;
    is_other.then(|| format!("--rate ({asked_hz} Hz) is used, not the {own_hz} Hz in the table"))
}

/// Formats a rate in brackets; empty if the rate is not known.
fn shown_hz(rate_hz: Option<f64>) -> String {
    let shown = |hz: f64| format!(" ({} Hz)", (hz * 10.0).round() / 10.0);
    rate_hz.map(shown).unwrap_or_default()
}

impl Time {
    /// The rate of the first rows, by their times [Hz].
    fn rate_hz(&self, head: &Head) -> Option<f64> {
        self.clock.rate_hz(&head.cells(self.place))
    }
}

/// Ranks a column of times by preference: a sensor's own times, those with a known unit, dates, anything else.
fn rank(head: &Head, place: usize) -> u8 {
    match head.name(place).to_ascii_lowercase() {
        name if name.contains("sensor timestamp") => 0,
        _ if stated_unit_ns(head, place).is_some() => 1,
        _ if is_date(head, place) => 2,
        _ => 3,
    }
}

/// Sets the start of a sensor's times: from the phone's times next to them (Polar Sensor Logger), or as stated in the
/// file of an E4.
fn begun(head: &Head, place: usize, clock: Clock) -> Clock {
    let first = |place: usize| head.cells(place).first().copied().unwrap_or_default();
    if let Some(begin_ns) = head.begin_ns.filter(|_| head.is_e4) {
        return clock.shifted("0", begin_ns);
    }
    let is_sensor = head.name(place).to_ascii_lowercase().contains("sensor timestamp");
    let phone = head.names.iter().position(|name| name.eq_ignore_ascii_case("phone timestamp"));
    let phone = phone.and_then(|phone| date_ns(first(phone), Order::Year));
    match phone.filter(|_| is_sensor) {
        Some(at_ns) => clock.shifted(first(place), at_ns),
        None => clock,
    }
}

/// Finds the column that `NAME`, `NAME:UNIT`, `NAME:mm:ss` or `NAME:excel` refers to.
fn named_time(
    head: &Head,
    name: &str,
    wanted: &Wanted,
    notes: &mut Vec<String>,
) -> Result<Time, TableError> {
    let with_unit = name.match_indices(':').find_map(|(at, _)| {
        let clock = Clock::named(&name[at + 1..])?;
        Some((&name[..at], clock))
    });
    if let Some((name, clock)) = with_unit {
        return Ok(Time { place: named(head, name)?, clock });
    }
    let place = named(head, name)?;
    // A cell that is not a time is reported with its line number when it is read.
    let clock = clock(head, place, wanted).unwrap_or_else(|| Clock::of_unit(1_000_000_000));
    notes.extend(Some(clock.note.clone()).filter(|note| !note.is_empty()));
    Ok(Time { place, clock: begun(head, place, clock) })
}

fn clock(head: &Head, place: usize, wanted: &Wanted) -> Option<Clock> {
    match stated_unit_ns(head, place) {
        Some(ns) => Some(Clock::of_unit(ns)),
        None => Clock::recognised(&head.name(place), &head.cells(place), wanted.least_hz),
    }
}

/// Returns the unit of a numeric column of times [ns], if the table states it.
fn stated_unit_ns(head: &Head, place: usize) -> Option<i64> {
    let below = head.units.get(place).and_then(|unit| unit_ns(unit));
    let unit_ns = below.or_else(|| unit_of_name_ns(&head.name(place)));
    unit_ns.filter(|_| !head.is_text(place))
}

fn is_date(head: &Head, place: usize) -> bool {
    let mut cells = head.cells(place);
    cells.retain(|cell| !cell.is_empty());
    order(&cells).is_some()
}

fn channel_name(head: &Head, place: usize) -> String {
    let name = head.names.get(place).filter(|name| !name.is_empty());
    name.cloned().unwrap_or_else(|| format!("ch{}", place + 1))
}

fn all_names(head: &Head) -> Vec<String> {
    (0..head.width).map(|place| head.name(place)).collect()
}
