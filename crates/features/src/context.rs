//! The settings of a study for all of its features.

use teampulse_core::registry::SettingsError;

use crate::thresholds::Threshold;

/// The longest window that a study may have [s]: a day.
const LONGEST_SECS: f64 = 86_400.0;

/// The hint for invalid windows.
const WINDOWS: &str = "give lengths in seconds, like [30, 60]";

/// The settings of a study for all of its features: `[features]`.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureContext {
    /// The lengths of the windows of every feature without a setting of its own [s].
    pub windows_secs: Vec<f64>,
    /// The mains frequency [Hz]: 50 or 60; by default it is detected in the signal.
    pub mains_hz: Option<f64>,
    /// The alerts of the study.
    pub alerts: Vec<Threshold>,
}

/// Windows of 30 s and 60 s, and a detected mains frequency.
impl Default for FeatureContext {
    fn default() -> FeatureContext {
        FeatureContext { windows_secs: vec![30.0, 60.0], mains_hz: None, alerts: Vec::new() }
    }
}

impl FeatureContext {
    /// The lengths in a feature's own settings, or else those of the study [s], ascending.
    pub(crate) fn windows_or(&self, own_secs: Option<Vec<f64>>) -> Result<Vec<f64>, SettingsError> {
        let mut lengths_secs = own_secs.unwrap_or_else(|| self.windows_secs.clone());
        if let Some(wrong) = lengths_secs.iter().find(|secs| !(1.0..=LONGEST_SECS).contains(*secs))
        {
            let message = format!("a window of {wrong} s: expected 1 s to {LONGEST_SECS} s");
            return Err(SettingsError::new(message).with_hint(WINDOWS).at("windows_secs"));
        }
        if lengths_secs.is_empty() {
            let message = "no windows: expected at least one length";
            return Err(SettingsError::new(message).with_hint(WINDOWS).at("windows_secs"));
        }
        lengths_secs.sort_by(f64::total_cmp);
        let twice = lengths_secs.windows(2).find(|pair| pair[0] >= pair[1]);
        if let Some([secs, ..]) = twice {
            let message = format!("the window of {secs} s is listed twice");
            let hint = "list each length once";
            return Err(SettingsError::new(message).with_hint(hint).at("windows_secs"));
        }
        Ok(lengths_secs)
    }
}

/// Checks that a length of time is more than zero and at most a day [s].
pub(crate) fn duration_setting(name: &str, secs: f64) -> Result<f64, SettingsError> {
    if secs > 0.0 && secs <= LONGEST_SECS {
        return Ok(secs);
    }
    let wrong =
        format!("`{name}` of {secs} s: expected more than 0 s and at most {LONGEST_SECS} s");
    Err(SettingsError::new(wrong).with_hint("give a length of time in seconds").at(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_ascending_and_one_that_is_listed_twice_is_refused() {
        let context =
            FeatureContext { windows_secs: vec![60.0, 30.0], ..FeatureContext::default() };
        assert_eq!(context.windows_or(None).unwrap(), [30.0, 60.0]);
        assert_eq!(context.windows_or(Some(vec![5.0])).unwrap(), [5.0]);
        let twice = context.windows_or(Some(vec![60.0, 30.0, 60.0])).unwrap_err();
        assert_eq!(twice.message, "the window of 60 s is listed twice");
        assert_eq!(twice.path, "windows_secs");
    }

    #[test]
    fn absurd_windows_are_refused() {
        for secs in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
            assert!(FeatureContext::default().windows_or(Some(vec![secs])).is_err());
            assert!(duration_setting("x", secs).is_err());
        }
        assert!(FeatureContext::default().windows_or(Some(Vec::new())).is_err());
    }
}
