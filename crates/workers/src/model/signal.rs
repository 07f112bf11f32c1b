//! The kind of signal that a model's outputs are, inferred from their names.

use teampulse_core::stream::Signal;
use teampulse_vision::model::decode::Output;

/// Words that occur only in the names of body keypoints, and words that occur only in the names of expressions.
const OF_BODY: [&str; 2] = ["hip", "shoulder"];
const OF_EXPRESSION: [&str; 6] = ["valence", "arousal", "happy", "happiness", "anger", "angry"];

/// The signal of a model's outputs. Body keypoints include eyes, so they are checked first.
pub(super) fn signal_of(output: &Output) -> Signal {
    let channels = output.channels();
    let has = |words: &[&str]| {
        channels.iter().any(|(name, _)| words.iter().any(|word| name.to_lowercase().contains(word)))
    };
    match output {
        Output::Classes(_) | Output::Regression(_) if has(&OF_EXPRESSION) => Signal::Expression,
        Output::Classes(_) | Output::Regression(_) | Output::Gaze(_) => Signal::Other,
        _ if has(&OF_BODY) => Signal::Body,
        _ if has(&["eye"]) => Signal::Face,
        _ => Signal::Other,
    }
}

#[cfg(test)]
mod tests {
    use teampulse_vision::model::descriptor::Descriptor;
    use teampulse_vision::model::ready;

    use super::*;

    #[test]
    fn ready_models_have_the_signals_of_what_they_find() {
        let of = |name: &str| {
            let ready = ready::named(name).expect("a ready descriptor");
            signal_of(&Descriptor::parse(ready.text).unwrap().output)
        };
        assert_eq!(of("yunet"), Signal::Face);
        assert_eq!(of("mediapipe_pose"), Signal::Body);
        assert_eq!(of("rtmpose"), Signal::Body);
        assert_eq!(of("mediapipe_hand"), Signal::Other);
        assert_eq!(of("mediapipe_palm"), Signal::Other);
        assert_eq!(of("fer"), Signal::Expression);
        assert_eq!(of("emotieff"), Signal::Expression);
    }
}
