use std::borrow::Cow;
use std::fmt;

/// The smallest coverage of a span for which values are reported.
pub const LEAST_COVERAGE: f64 = 0.5;

/// The description of a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// The name of the value, spelt as in NeuroKit2 if it has the value; for one of several channels, followed by a
    /// slash and the channel.
    pub name: Cow<'static, str>,
    /// The unit of the value; `1` for none. Derived from the signal's unit where only the host knows that unit.
    pub unit: Cow<'static, str>,
    /// The recipe: what a reader needs to compute the same value.
    pub method: Cow<'static, str>,
}

impl Value {
    /// A value whose description is constant.
    pub const fn new(name: &'static str, unit: &'static str, method: &'static str) -> Value {
        let [name, unit, method] =
            [Cow::Borrowed(name), Cow::Borrowed(unit), Cow::Borrowed(method)];
        Value { name, unit, method }
    }

    /// A value of one channel of several: `name/channel`; `name` alone where the channel has none.
    pub fn of_channel(
        name: &str,
        channel: &str,
        unit: impl Into<Cow<'static, str>>,
        method: impl Into<Cow<'static, str>>,
    ) -> Value {
        let of = if channel.is_empty() { "" } else { "/" };
        let name = Cow::Owned(format!("{name}{of}{channel}"));
        Value { name, unit: unit.into(), method: method.into() }
    }

    /// The quantity and the channel, if any, of a value's name.
    pub fn parts(name: &str) -> (&str, Option<&str>) {
        name.split_once('/').map_or((name, None), |(measure, channel)| (measure, Some(channel)))
    }
}

/// The values of a span of a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The share of the span that has data [0..1].
    pub coverage: f64,
    /// How reliable the data are [0..1].
    pub quality: f64,
    /// The values in order, or the reason why one is missing.
    pub values: Vec<Result<f64, Reason>>,
}

impl Measured {
    /// A span whose values are all missing for one reason.
    pub fn nothing(coverage: f64, quality: f64, count: usize, reason: Reason) -> Measured {
        Measured { coverage, quality, values: vec![Err(reason); count] }
    }
}

/// Why a value is missing.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Reason {
    /// The span is too short, or holds too few events.
    Short,
    /// Too much of the data is missing.
    Gap,
    /// The data are too poor.
    Quality,
    /// The input does not have this quantity.
    Missing,
    /// The formula has no answer for these data.
    Undefined,
    /// What is measured did not happen in the span: nobody spoke.
    Nothing,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reason::Short => "window too short",
            Reason::Gap => "data missing in the window",
            Reason::Quality => "data too poor",
            Reason::Missing => "not measured by this device",
            Reason::Undefined => "undefined for these data",
            Reason::Nothing => "there is none",
        })
    }
}

impl Reason {
    /// The number, or [`Reason::Undefined`] when it is not finite.
    pub fn unless_finite(value: f64) -> Result<f64, Reason> {
        if value.is_finite() { Ok(value) } else { Err(Reason::Undefined) }
    }
}
