//! Event-related responses.

use super::response::Response;
use crate::error::{SignalError, checked};

/// The response to an event, if any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventResponse {
    /// Whether there was a response.
    pub responded: bool,
    /// The amplitude of the response [µS]; 0 without one, so that means over events are magnitudes.
    pub amplitude_us: f64,
    /// The time from the event to the onset of the response [s].
    pub latency_secs: Option<f64>,
    /// The response.
    pub response: Option<Response>,
}

/// The latencies of an event-related response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventWindow {
    /// The shortest latency [s].
    pub from_secs: f64,
    /// The longest latency [s].
    pub to_secs: f64,
}

impl Default for EventWindow {
    /// 1 to 4 s: Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.
    fn default() -> EventWindow {
        EventWindow { from_secs: 1.0, to_secs: 4.0 }
    }
}

impl EventWindow {
    /// Finds for each event (a possibly fractional sample) the first response whose onset lies in its window.
    ///
    /// `responses` must be in order of time. One response may belong to two events whose windows overlap. An
    /// event that is not a finite number has none. Returns an error unless 0 ≤ from ≤ to ≤ 60 s, and for a
    /// rate outside 1 to 2000 Hz.
    pub fn of(
        &self,
        responses: &[Response],
        events: &[f64],
        rate_hz: f64,
    ) -> Result<Vec<EventResponse>, SignalError> {
        super::checked_rate(rate_hz)?;
        checked("the end of the window", self.to_secs, (0.0, 60.0))?;
        checked("the beginning of the window", self.from_secs, (0.0, self.to_secs))?;
        Ok(events.iter().map(|&event| self.response(responses, event, rate_hz)).collect())
    }

    fn response(&self, responses: &[Response], event: f64, rate_hz: f64) -> EventResponse {
        let from = event + self.from_secs * rate_hz;
        let first = responses.partition_point(|response| response.onset < from);
        let latency_secs = |response: &Response| (response.onset - event) / rate_hz;
        let is_in_time = |response: &&Response| latency_secs(response) <= self.to_secs;
        let response = responses.get(first).filter(|_| event.is_finite()).filter(is_in_time);
        EventResponse {
            responded: response.is_some(),
            amplitude_us: response.map_or(0.0, |response| response.amplitude_us),
            latency_secs: response.map(latency_secs),
            response: response.copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(onset: f64, amplitude_us: f64) -> Response {
        Response {
            onset,
            peak: onset + 8.0,
            amplitude_us,
            rise_secs: 2.0,
            half_recovery_secs: None,
        }
    }

    #[test]
    fn an_event_has_the_first_response_that_begins_one_to_four_seconds_later() {
        let responses = [response(2.0, 0.3), response(10.0, 0.5), response(14.0, 0.9)];
        let related = EventWindow::default().of(&responses, &[0.0, 30.0, f64::NAN], 4.0).unwrap();
        assert!(related[0].responded);
        assert_eq!((related[0].latency_secs, related[0].amplitude_us), (Some(2.5), 0.5));
        assert!(related[1..].iter().all(|none| !none.responded && none.amplitude_us == 0.0));
    }

    #[test]
    fn a_window_that_ends_before_it_begins_is_refused() {
        let window = EventWindow { from_secs: 4.0, to_secs: 1.0 };
        assert!(window.of(&[], &[], 4.0).is_err());
        assert!(EventWindow { to_secs: f64::NAN, ..window }.of(&[], &[], 4.0).is_err());
    }
}
