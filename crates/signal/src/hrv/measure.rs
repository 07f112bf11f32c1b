/// A feature by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// The name, as NeuroKit2 spells it.
    pub name: &'static str,
    /// The unit; `1` for none.
    pub unit: &'static str,
    /// The value; NaN if it is undefined.
    pub value: f64,
}

impl Measure {
    pub(super) fn all<const N: usize>(of: [(&'static str, &'static str, f64); N]) -> Vec<Measure> {
        of.into_iter().map(|(name, unit, value)| Measure { name, unit, value }).collect()
    }
}
