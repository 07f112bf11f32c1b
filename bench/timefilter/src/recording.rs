//! The arrivals written by `generate.py`.

/// A sample and its arrival.
#[derive(Clone, Copy, Debug)]
pub struct Arrived {
    /// The index of the stream.
    pub topic: usize,
    /// When the sample arrived [ns].
    pub arrival: i64,
    /// The device's clock at the measurement [ns].
    pub device: i64,
    /// The true time of the measurement [ns].
    pub measured: i64,
    /// The number of samples of the stream that arrived together, including this one.
    pub count: u32,
    /// The place of this sample among them, from 0.
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
