//! Detects pulses that are upside down: in some sensors, the signal falls when blood arrives.

use teampulse_core::stream::Signal;
use teampulse_features::analyses::{Analysis, Chosen};
use teampulse_signal::analysis::{Reason, Recording, Span, Whole};

/// The minimum quality of the inverted signal at which a signal of poor quality counts as upside down: pulses reach it,
/// noise does not.
const LEAST_QUALITY: f64 = 0.7;

/// Returns a note on a signal whose quality is poor as recorded and good when inverted; `None` for any other.
pub fn note(
    signal: &Analysis,
    chosen: &Chosen,
    recording: &Recording<'_>,
    (whole, span): (&Whole, Span),
) -> Option<String> {
    if signal.signal != Signal::Ppg || rate(whole, span) != Some(Err(Reason::Quality)) {
        return None;
    }
    let mut channels = recording.channels.to_vec();
    channels.first_mut()?.iter_mut().for_each(|value| *value = -*value);
    let inverted = Recording { channels: &channels, ..*recording };
    let inverted = (signal.whole)(chosen, &inverted).ok()?;
    let is_fine = inverted.windows.measure(span).quality >= LEAST_QUALITY
        && matches!(rate(&inverted, span), Some(Ok(_)));
    is_fine.then(|| {
        "the pulses look upside down, as their quality is good when inverted: give --scale -1"
            .to_owned()
    })
}

/// The pulse rate of a span.
fn rate(whole: &Whole, span: Span) -> Option<Result<f64, Reason>> {
    let place = whole.windows.values().iter().position(|value| value.name == "PPG_Rate_Mean")?;
    whole.windows.measure(span).values.get(place).copied()
}
