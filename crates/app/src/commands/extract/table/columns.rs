//! Which columns of a table are wanted.

use super::error::TableError;
use super::head::{Head, is_time_like};

/// What is wanted of a table.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The signal that is looked for.
    pub signal: &'static str,
    /// Words that the name of its column may hold.
    pub words: &'static [&'static str],
    /// Whether all columns are wanted when none is named.
    pub takes_all: bool,
    /// Whether rows come at an even rate.
    pub is_even: bool,
    /// Names or numbers of columns; empty when the user named none.
    pub columns: Vec<String>,
    /// The column with the times.
    pub time: Option<String>,
}

/// Where the wanted columns stand.
pub struct Columns {
    pub places: Vec<usize>,
    pub names: Vec<String>,
    pub time: Option<Time>,
}

/// A column of times.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    pub place: usize,
    /// How long its unit is [ns].
    pub ns: i64,
}

impl Columns {
    pub fn choose(head: &Head, wanted: &Wanted) -> Result<Columns, TableError> {
        let time = time(head, wanted)?;
        let places = if wanted.columns.is_empty() {
            unnamed(head, wanted, time)?
        } else {
            let place = |name: &String| named(head, name);
            wanted.columns.iter().map(place).collect::<Result<Vec<_>, _>>()?
        };
        if let Some(&place) = places.iter().find(|place| head.texts.contains(place)) {
            let cell = head.first.as_deref().and_then(|line| head.separator.cells(line).nth(place));
            let text = cell.unwrap_or_default().chars().take(40).collect();
            return Err(TableError::TextColumn { column: head.name(place), text });
        }
        let names = places.iter().map(|&place| channel_name(head, place)).collect();
        Ok(Columns { places, names, time })
    }
}

/// The place of a column by its name, its number from 1, or its name in other letters.
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

fn unnamed(head: &Head, wanted: &Wanted, time: Option<Time>) -> Result<Vec<usize>, TableError> {
    let is_signal = |&place: &usize| {
        time.is_none_or(|time| time.place != place)
            && !head.names.get(place).is_some_and(|name| is_time_like(name))
    };
    let all: Vec<usize> = (0..head.width).filter(is_signal).collect();
    let numbers: Vec<usize> =
        all.iter().copied().filter(|place| !head.texts.contains(place)).collect();
    let named = |&place: &usize| {
        let name = head.names.get(place).map(|name| name.to_ascii_lowercase());
        name.is_some_and(|name| wanted.words.iter().any(|word| name.contains(word)))
    };
    let of_name: Vec<usize> = numbers.iter().copied().filter(named).collect();
    match (wanted.takes_all, &of_name[..], &numbers[..]) {
        (true, [], [_, ..]) => Ok(numbers),
        (true, [_, ..], _) => Ok(of_name),
        (false, &[one], _) | (false, [], &[one]) => Ok(vec![one]),
        (_, _, []) => Ok(all.into_iter().take(1).collect()),
        _ => Err(TableError::WhichColumn { signal: wanted.signal, there: all_names(head) }),
    }
}

fn time(head: &Head, wanted: &Wanted) -> Result<Option<Time>, TableError> {
    let place = match &wanted.time {
        Some(name) => return Ok(Some(named_time(head, name)?)),
        // The times of our own tables.
        None => ["measured_secs", "time_secs"]
            .iter()
            .find_map(|&time| head.names.iter().position(|name| name == time)),
    };
    let place = place.filter(|_| wanted.is_even);
    Ok(place.map(|place| Time { place, ns: unit_ns(&head.name(place)) }))
}

/// The column that `NAME` or `NAME:UNIT` means.
fn named_time(head: &Head, name: &str) -> Result<Time, TableError> {
    let told =
        name.rsplit_once(':').map(|(name, unit)| (name, UNITS.iter().find(|each| each.0 == unit)));
    if let Some((name, Some((_, ns)))) = told {
        return Ok(Time { place: named(head, name)?, ns: *ns });
    }
    let place = named(head, name)?;
    Ok(Time { place, ns: unit_ns(&head.name(place)) })
}

/// Units of times, and how long they are [ns].
const UNITS: [(&str, i64); 4] = [("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000), ("ns", 1)];

/// How long the unit of times is that a column of this name holds [ns]: seconds, if it tells none.
fn unit_ns(name: &str) -> i64 {
    let name = name.to_ascii_lowercase();
    let is = |end: &str, word: &str| {
        name.ends_with(&format!("_{end}"))
            || name.contains(&format!("({end})"))
            || name.contains(word)
    };
    match () {
        () if is("ms", "milli") => 1_000_000,
        () if is("us", "micro") => 1_000,
        () if is("ns", "nano") => 1,
        () => 1_000_000_000,
    }
}

fn channel_name(head: &Head, place: usize) -> String {
    let name = head.names.get(place).filter(|name| !name.is_empty());
    name.cloned().unwrap_or_else(|| format!("ch{}", place + 1))
}

fn all_names(head: &Head) -> Vec<String> {
    (0..head.width).map(|place| head.name(place)).collect()
}
