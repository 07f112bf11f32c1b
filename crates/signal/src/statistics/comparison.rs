/// How a value is compared with the baseline of the same participant.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Comparison {
    /// The value minus the baseline mean, in the value's own unit.
    Difference,
    /// The value minus the baseline mean, in baseline standard deviations.
    Z,
    /// The value minus the baseline median, in 1.4826 baseline median absolute deviations.
    RobustZ,
}

impl Comparison {
    /// Every comparison.
    pub const ALL: [Comparison; 3] = [Comparison::Difference, Comparison::Z, Comparison::RobustZ];

    fn suffix(self) -> &'static str {
        match self {
            Comparison::Difference => "_difference",
            Comparison::Z => "_z",
            Comparison::RobustZ => "_robust_z",
        }
    }

    /// The name of a compared measure: `heart_rate_z`.
    pub fn of(self, measure: &str) -> String {
        format!("{measure}{}", self.suffix())
    }

    /// The possible readings of a name as a measure and its comparison.
    pub fn read(name: &str) -> impl Iterator<Item = (&str, Comparison)> {
        let of = move |each: Comparison| Some((name.strip_suffix(each.suffix())?, each));
        Comparison::ALL.into_iter().filter_map(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_read_as_it_was_written() {
        for each in Comparison::ALL {
            let name = each.of("heart_rate");
            assert!(Comparison::read(&name).any(|read| read == ("heart_rate", each)), "{name}");
        }
        assert_eq!(Comparison::read("heart_rate").count(), 0);
    }
}
