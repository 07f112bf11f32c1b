//! This computer's microphones, over `PulseAudio` or `PipeWire`.
//!
//! ```text
//! server ──► blocks of 20 ms ──► samples ──► voice frames (100 a second) ──► Outlet::offer
//!                                   the sound itself goes no further, unless the study asks for it
//! ```

mod found;
mod server;

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::StreamId;
use teampulse_messages::audio::{AudioBlock, AudioInfo, SampleFormat};
use teampulse_messages::convert::Decoded;
use tokio::time::{sleep, timeout};

use crate::SourceContext;
use crate::core_files::leave_no_core_file;
use crate::hearing::{Hearing, Kept};
use crate::wearables::check_person;

pub use found::FoundMicrophone;
use server::{Block, Recording, SAMPLE_BYTES, Server};

/// A microphone that delivers no sound for this long was unplugged, or its server hangs.
const SILENCE: Duration = Duration::from_secs(2);
/// How often to look for a microphone that was unplugged.
const LOOK: Duration = Duration::from_millis(500);

/// A microphone connected to this computer, over `PulseAudio` or `PipeWire`, which desktops run.
///
/// How somebody speaks is recorded, not what they say: level, pitch, voicing and the basis for rates and pauses (15
/// numbers, 100 times a second). No word can be reconstructed from these. The sound itself leaves this source only with
/// `raw_audio = true`. The process leaves no core file behind.
///
/// Samples are timed by counting them, by the clock of the sound card. The server mixes several channels into one.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Microphone {
    /// The person who speaks into the microphone, by pseudonym.
    pub person: String,
    /// Which microphone to record: a part of its name or description. `teampulse scan` lists them. By default the
    /// desktop's default microphone.
    #[serde(default)]
    pub device: String,
    /// Whether the sound itself is recorded instead of the frames, so that everything that is said can be understood.
    #[serde(default)]
    pub raw_audio: bool,
}

impl Component<dyn Source, SourceContext> for Microphone {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        check_person(&self.person)?;
        Ok(Box::new(MicrophoneReader { settings: self, was_heard: false }))
    }
}

impl Microphone {
    fn kept(&self) -> Kept {
        if self.raw_audio { Kept::Sound } else { Kept::Frames }
    }
}

/// Reads a microphone.
struct MicrophoneReader {
    settings: Microphone,
    was_heard: bool,
}

/// How the reading of a microphone ended.
enum Ended {
    Closed,
    /// The microphone was unplugged, or the server ended.
    Gone(String),
}

#[async_trait]
impl Source for MicrophoneReader {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        if !self.settings.raw_audio {
            leave_no_core_file();
        }
        loop {
            let Some(recording) = self.record(outlet).await? else { return Ok(()) };
            self.was_heard = true;
            match self.hear(recording, outlet).await? {
                Ended::Closed => return Ok(()),
                Ended::Gone(why) => {
                    let person = &self.settings.person;
                    outlet.happen(passing(format!("microphone of {person} is gone: {why}")));
                }
            }
        }
    }
}

impl MicrophoneReader {
    /// Starts to record; waits for a microphone that was present before. Returns `None` if the session is over.
    async fn record(&self, outlet: &Outlet) -> Result<Option<Recording>, SourceError> {
        loop {
            let begun = tokio::select! {
                () = outlet.closed() => return Ok(None),
                begun = Server::record(&self.settings.device) => begun,
            };
            match begun {
                Ok(recording) => return Ok(Some(recording)),
                Err(error) if !self.was_heard => return Err(error),
                Err(_) => sleep(LOOK).await,
            }
        }
    }

    async fn hear(&self, mut recording: Recording, outlet: &Outlet) -> Result<Ended, SourceError> {
        let kept = self.settings.kept();
        let info = AudioInfo {
            rate_hz: f64::from(recording.rate_hz),
            channels: 1,
            format: SampleFormat::F32LE,
        };
        let mut stream = kept.stream(&self.settings.person, info.rate_hz);
        let share = stream.rate_hz / info.rate_hz;
        stream.doc = format!("{}: {}", recording.name, stream.doc);
        let stream = outlet.declare(stream);
        // From now on losses can be counted.
        outlet.lost(stream, 0);
        let mut hearing = Hearing::new(kept, Some(info));
        loop {
            let next = tokio::select! {
                () = outlet.closed() => return Ok(Ended::Closed),
                next = timeout(SILENCE, recording.blocks.recv()) => next,
            };
            let block = match next {
                Ok(Some(block)) => block,
                Ok(None) => {
                    return Ok(Ended::Gone("the sound server ended the recording".to_owned()));
                }
                Err(_) => return Ok(Ended::Gone(format!("silent for {} s", SILENCE.as_secs()))),
            };
            let Block { data, lost } = block;
            if lost > 0 {
                // All blocks have the same length.
                let sounds = lost as f64 * data.len() as f64 / f64::from(SAMPLE_BYTES);
                outlet.lost(stream, (sounds * share).round() as u64);
            }
            let heard = hearing.hear(AudioBlock { stamp: None, data }, lost);
            let heard = heard.map_err(|reason| SourceError::Fatal {
                message: reason,
                hint: "choose another microphone with `device`".to_owned(),
            })?;
            if let Some(heard) = heard {
                offer(outlet, stream, heard);
            }
        }
    }
}

fn offer(outlet: &Outlet, stream: StreamId, heard: Decoded) {
    let Decoded { device_time, index, data, .. } = heard;
    outlet.offer(Reading { index, stream, device_time, source_time: None, data });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sound_is_kept_only_if_the_study_says_so() {
        let stream = |text: &str| {
            let settings: Microphone = toml::from_str(text).unwrap();
            settings.kept().stream(&settings.person, 48_000.0)
        };
        let frames = stream("person = \"p001\"");
        assert_eq!(
            (frames.name.as_str(), frames.rate_hz),
            ("/humans/persons/p001/microphone/voice", 100.0)
        );
        let sound = stream("person = \"p001\"\nraw_audio = true");
        assert_eq!(
            (sound.name.as_str(), sound.rate_hz),
            ("/humans/persons/p001/microphone/audio", 48_000.0)
        );
    }
}
