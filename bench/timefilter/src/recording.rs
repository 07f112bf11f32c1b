//! The arrivals that `generate.py` writes.

/// One sample as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Arrived {
    /// Its stream.
    pub topic: usize,
    /// When it arrived [ns].
    pub arrival: i64,
    /// The device's own clock [ns].
    pub device: i64,
    /// When it was measured in truth [ns].
    pub measured: i64,
    /// How many samples of its stream arrived with it, itself included; it is the `place`-th.
    pub count: u32,
    /// Its place among those, from 0.
    pub place: u32,
}

/// Reads a file of lines `topic arrival device measured count place`, in order of arrival.
pub fn read(path: &str) -> std::io::Result<Vec<Arrived>> {
    let text = std::fs::read_to_string(path)?;
    let bad = |line: &str| std::io::Error::other(format!("{path}: not a sample: {line}"));
    text.lines().map(|line| parse(line).ok_or_else(|| bad(line))).collect()
}

fn parse(line: &str) -> Option<Arrived> {
    let mut numbers = line.split(' ').map(str::parse::<i64>);
    let mut next = || numbers.next()?.ok();
    Some(Arrived {
        topic: usize::try_from(next()?).ok()?,
        arrival: next()?,
        device: next()?,
        measured: next()?,
        count: u32::try_from(next()?).ok()?,
        place: u32::try_from(next()?).ok()?,
    })
}
