//! Analyses of a person's behaviour, as recorded by cameras, microphones and input devices.

use teampulse_core::data::EventKind;
use teampulse_core::stream::Signal;
use teampulse_signal::{activity, body, expression, face, view, voice};

use super::{Analysis, Chosen, Documented, Happening, Tabled};

pub(super) const ACTIVITY: Analysis = Analysis {
    signal: Signal::Activity,
    feature: Some(Documented {
        name: "dynamics",
        doc: "Keyboard, mouse and gamepad activity, and idle time.",
        summary: "Typing, mouse and gamepad dynamics, from one-second summaries that contain no keys.",
        measures: "for each window: for a keyboard the rate of presses, mean and spread of holds and of \
            intervals between presses, the share of corrections; for a mouse its speed and path, \
            clicks and wheel; for a gamepad presses and deflection; for each the share of idle time.",
        windows: "",
        reference: "Epp, Lippold & Mandryk (2011), doi:10.1145/1978942.1979046.",
        limits: "holds and intervals are reported in groups of five, up to 10 s later; the content \
            typed is unknown, so games and texts look alike.",
    }),
    events: &[],
    table: Tabled {
        help: "Summaries of the activity at a keyboard, mouse or gamepad, with its channels as columns",
        columns: &["presses", "path"],
        files: &["activity"],
        channels: None,
        least_hz: 0.0,
    },
    causal: |chosen, rate_hz| activity::analysis::causal(&names(chosen), rate_hz),
    whole: |chosen, recording| activity::analysis::whole(&names(chosen), recording),
};

pub(super) const VIDEO: Analysis = Analysis {
    signal: Signal::Video,
    feature: Some(Documented {
        name: "view",
        doc: "Pulse from the colour of the skin in camera images, presence and movement.",
        summary: "A person in view of a camera, from measures of its frames (the worker `frames`): the pulse in the \
            colour of the skin, presence and movement.",
        measures: "for each window the pulse rate from the colour of the skin with its uncertainty and signal-to-noise \
            ratio, the share of time with a person in view, the share of the view that moves, and the quality of \
            the pulse.",
        windows: "",
        reference: "Wang et al. (2017), doi:10.1109/TBME.2016.2609282.",
        limits: "a pulse needs 15 s of a face that stays in place, at 12 or more frames per second, and steady light; \
            measured on synthetic faces only. Presence means a person with bare skin who moves at least once in 20 s.",
    }),
    events: &[],
    table: Tabled {
        help: "Measures of camera frames, such as those of the worker `frames`",
        columns: &view::CHANNELS,
        files: &["frames"],
        channels: None,
        least_hz: 1.0,
    },
    causal: |chosen, _| Ok(view::analysis::causal(&chosen.channels)),
    whole: |chosen, recording| Ok(view::analysis::whole(&chosen.channels, recording)),
};

pub(super) const FACE: Analysis = Analysis {
    signal: Signal::Face,
    feature: Some(Documented {
        name: "face",
        doc: "Blinks, eye closures, and movement and tilt of the head.",
        summary: "Blinks, closed eyes and movement of the head, from face landmarks that a model (the worker \
            `model`) or another program detects.",
        measures: "each blink (as an event with its depth), and for each window their rate, duration and depth, the share of \
            time with closed eyes (PERCLOS, P80), the longest closure, movement and tilt of the head, presence, and the \
            quality of blinks.",
        windows: "",
        reference: "Soukupová & Čech (2016), Proc. 21st CVWW; Dinges & Grace (1998), FHWA-MCRT-98-006.",
        limits: "blinks need the six landmarks of an eye in `hri_msgs/FacialLandmarks`, in 10 pictures a second or more, \
            and are reported once the eyes are open again; eye centres are enough for the head. Eyes are compared with \
            themselves in the last minute.",
    }),
    events: &[Happening {
        kind: "blink",
        leaf: "blinks",
        word: EventKind::Blink,
        value: "amplitude",
        duration: "duration_secs",
    }],
    table: Tabled {
        help: "Face landmarks [px], such as those of the worker `model`",
        columns: &["right_eye", "left_eye"],
        files: &["landmarks"],
        channels: None,
        least_hz: 1.0,
    },
    causal: |chosen, _| face::analysis::causal(&names(chosen)),
    whole: |chosen, recording| face::analysis::whole(&names(chosen), recording),
};

pub(super) const BODY: Analysis = Analysis {
    signal: Signal::Body,
    feature: Some(Documented {
        name: "posture",
        doc: "Movement of the body and the hands, and posture.",
        summary: "Movement and posture, from body keypoints detected by a model (the worker `model`).",
        measures: "for each window movement of the body and of the hands, lean, tilt of the shoulders, height of the head \
            above them, and presence.",
        windows: "",
        reference: "none; the formula of each value is in the `method`.",
        limits: "angles and paths are those in the picture, relative to the distance between the \
            shoulders; a person who turns away has narrower shoulders. Jitter of points counts \
            as movement: about 0.04/s for 1 px noise at 30 Hz and shoulders 100 px apart.",
    }),
    events: &[],
    table: Tabled {
        help: "Body keypoints [px], such as those of the worker `model`",
        columns: &["right_shoulder", "left_shoulder"],
        files: &["pose"],
        channels: None,
        least_hz: 1.0,
    },
    causal: |chosen, _| body::analysis::causal(&names(chosen)),
    whole: |chosen, recording| body::analysis::whole(&names(chosen), recording),
};

pub(super) const EXPRESSION: Analysis = Analysis {
    signal: Signal::Expression,
    feature: Some(Documented {
        name: "expression",
        doc: "A model's estimates of facial expressions, and its confidence.",
        summary: "Estimates of facial expressions by a model (the worker `model`): \
            not what the person feels.",
        measures: "for each window mean and SD of the probability of each class, or of valence and arousal, the confidence of the \
            model, and how often a face was in view.",
        windows: "",
        reference: "Barrett et al. (2019), doi:10.1177/1529100619832930.",
        limits: "models are overconfident, differ between groups of people, and know a few posed \
            expressions; compare a person with their own baseline only.",
    }),
    events: &[],
    table: Tabled {
        help: "Expression estimates, one column each, such as those of the worker `model`",
        columns: &["happy", "happiness", "valence"],
        files: &["expression"],
        channels: None,
        least_hz: 0.5,
    },
    causal: |chosen, _| expression::analysis::causal(&names(chosen)),
    whole: |chosen, recording| expression::analysis::whole(&names(chosen), recording),
};

pub(super) const AUDIO: Analysis = Analysis {
    signal: Signal::Audio,
    feature: Some(Documented {
        name: "voice",
        doc: "Level, activity, pitch, rate, pauses, jitter, shimmer and tilt of a voice, and its quality.",
        summary: "The voice of a person, from a microphone: how they speak, not what they say.",
        measures: "for each window the level of speech and of the background noise, the share of time in speech, pitch \
            and its spread, speaking and articulation rates, pauses, jitter, shimmer, the tilt of the spectrum, \
            and the quality.",
        windows: "",
        reference: "Boersma (1993), Proc. IFA 17:97; de Jong & Wempe (2009), doi:10.3758/BRM.41.2.385.",
        limits: "samples at 8 to 96 kHz, with 1 as full scale; one person per microphone: with \
            two voices, the pitch is that of the louder one; a loud steady hum looks like a voice.",
    }),
    events: &[],
    table: Tabled {
        help: "Sound of a microphone (1 is full scale)",
        columns: &["audio", "mic", "sound", "voice"],
        files: &["audio", "microphone"],
        channels: Some(1),
        least_hz: 8_000.0,
    },
    causal: |chosen, rate_hz| {
        if are_frames(chosen) {
            return Ok(voice::analysis::of_frames());
        }
        voice::analysis::causal(&voice::Settings::default(), rate_hz)
    },
    whole: |chosen, recording| {
        if are_frames(chosen) {
            return Ok(voice::analysis::whole_of_frames(recording));
        }
        voice::analysis::whole(&voice::Settings::default(), recording)
    },
};

/// The names of the channels.
fn names(chosen: &Chosen) -> Vec<&str> {
    chosen.channels.iter().map(String::as_str).collect()
}

/// Whether a stream contains the [frames](voice::Frame) of a sound, computed where it was recorded, instead of its
/// samples.
fn are_frames(chosen: &Chosen) -> bool {
    chosen.channels.iter().map(String::as_str).eq(voice::CHANNELS.map(|(name, _)| name))
}
