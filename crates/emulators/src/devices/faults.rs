//! The faults of an emulated device.

/// Sorts faults by time.
pub(super) fn in_order<T>(mut faults: Vec<T>, at_secs: impl Fn(&T) -> f64) -> Vec<T> {
    faults.sort_by(|one, other| at_secs(one).total_cmp(&at_secs(other)));
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_happen_in_order_of_time_however_they_are_given() {
        let faults = vec![(30.0, "off"), (10.0, "lost"), (10.0, "repeated")];
        let sorted = in_order(faults, |(at_secs, _)| *at_secs);
        assert_eq!(sorted, [(10.0, "lost"), (10.0, "repeated"), (30.0, "off")]);
    }
}
