//! People's microphones whose sound is published on ROS.
//!
//! ```text
//! AudioData ──► AudioBlock ──► samples ──► voice frames (100 a second) ──► Outlet::offer
//!                     the sound itself goes no further, unless the study asks for it
//! ```

mod listening;

use std::sync::Arc;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::Stream;
use teampulse_messages::audio::{AUDIO_DATA, AUDIO_DATA_STAMPED, AudioInfo, SampleFormat};
use teampulse_ros::BusId;
use teampulse_ros::bus::{Arrival, Bus};
use teampulse_ros::graph::Endpoint;

use crate::claims::{Claimed, Rank};
use crate::follow::{Decoder, follow_decoded};
use crate::hearing::Kept;
use crate::{SourceContext, join};

use listening::Listening;

/// A person's microphone whose sound is published on ROS (`audio_common_msgs`, also as in REP-155:
/// `/humans/voices/v1/audio`).
///
/// Records how somebody speaks (level, pitch, voicing, and what speaking rate and pauses are computed from: 15 numbers,
/// 100 times a second), not what they say. No word can be reconstructed from these. The sound itself leaves this source
/// only with `raw_audio = true`.
///
/// Messages have no stamps, or stamps of another clock, so they are timed by counting samples. Of several channels, the
/// first is used. Lost messages are gaps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RosAudio {
    /// The topic with the sound: `/audio`, `/humans/voices/v1/audio`.
    pub topic: String,
    /// The person who speaks into the microphone, by pseudonym.
    pub person: String,
    /// The topic with the `AudioInfo`; by default the topic of the sound with `_info` appended.
    #[serde(default)]
    pub info: Option<String>,
    /// The sampling rate [Hz], if nothing publishes an `AudioInfo`.
    #[serde(default)]
    pub rate_hz: Option<f64>,
    /// The number of channels, if nothing publishes an `AudioInfo`; by default 1.
    #[serde(default)]
    pub channels: Option<u8>,
    /// The format of samples, if nothing publishes an `AudioInfo`, as named by `GStreamer`; by default `S16LE`.
    #[serde(default)]
    pub format: Option<String>,
    /// Whether the sound itself is recorded, too, so that everything that is said can be understood.
    #[serde(default)]
    pub raw_audio: bool,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
    #[serde(default)]
    pub domain: Option<BusId>,
}

impl Component<dyn Source, SourceContext> for RosAudio {
    const EXAMPLE: &'static str = r#"
topic  = "/humans/voices/v1/audio"
person = "p001"
"#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        crate::wearables::check_person(&self.person)?;
        let known = self.known()?;
        let bus = join(context, self.domain.as_ref())?;
        let topic = self.topic.clone();
        let claimed = context
            .claims
            .lay(&bus, Rank::People, move |each| each.topic == topic && is_sound(&each.type_name));
        Ok(Box::new(RosAudioSource { bus, claimed, known, settings: self }))
    }
}

impl RosAudio {
    /// Returns the format of the sound according to the settings.
    fn known(&self) -> Result<Option<AudioInfo>, SettingsError> {
        let name = self.format.as_deref();
        let named =
            name.map_or(Some(SampleFormat::S16LE), |name| SampleFormat::named(name.as_bytes()));
        let Some(format) = named else {
            let error = SettingsError::new(format!(
                "`{}` is not a sample format",
                name.unwrap_or_default()
            ));
            return Err(error.at("format").with_hint("give one such as \"S16LE\" or \"F32LE\""));
        };
        let Some(rate_hz) = self.rate_hz else {
            let set = [("channels", self.channels.is_some()), ("format", name.is_some())];
            return match set.iter().find(|(_, is_set)| *is_set) {
                Some((path, _)) => {
                    let error =
                        SettingsError::new("the format of the sound is set, but not its rate");
                    Err(error.at(*path).with_hint("give `rate_hz` as well"))
                }
                None => Ok(None),
            };
        };
        let channels = self.channels.unwrap_or(1);
        if !(8_000.0..=96_000.0).contains(&rate_hz) {
            let error = SettingsError::new(format!("a voice can't be analysed at {rate_hz} Hz"))
                .at("rate_hz");
            return Err(error.with_hint("give a rate of 8000 to 96000 Hz"));
        }
        if channels == 0 {
            return Err(SettingsError::new("sound has at least one channel").at("channels"));
        }
        Ok(Some(AudioInfo { rate_hz, channels, format }))
    }

    fn kept(&self) -> Kept {
        if self.raw_audio { Kept::Sound } else { Kept::Frames }
    }

    fn info_topic(&self) -> String {
        let derived = || format!("{}_info", self.topic.trim_end_matches("_stamped"));
        self.info.clone().unwrap_or_else(derived)
    }

    fn stream(&self) -> Stream {
        self.kept().stream(&self.person, self.rate_hz.unwrap_or(0.0))
    }

    /// Whether a stream comes from this microphone and has a publisher.
    pub fn is_published(&self, stream: &Stream) -> bool {
        // Streams that this computer reads from a device itself have no publisher, and so no QoS.
        stream.name == self.stream().name && !stream.qos.is_empty()
    }
}

fn is_sound(type_name: &str) -> bool {
    [AUDIO_DATA, AUDIO_DATA_STAMPED].contains(&type_name)
}

/// A running source of a microphone.
struct RosAudioSource {
    bus: Arc<dyn Bus>,
    claimed: Claimed,
    known: Option<AudioInfo>,
    settings: RosAudio,
}

#[async_trait]
impl Source for RosAudioSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let RosAudioSource { bus, claimed, known, settings } = &*self;
        let choose = |endpoint: &Endpoint| {
            let is_wanted = endpoint.topic == settings.topic
                && is_sound(&endpoint.type_name)
                && claimed.is_ours(endpoint);
            is_wanted.then(|| settings.stream())
        };
        let decoder = |endpoint: &Endpoint| {
            let listening = Listening::new(settings.kept(), *known);
            let info = settings.info_topic();
            let learning = known.is_none().then(|| listening.learn_from(&**bus, &info, outlet));
            let learning = learning.transpose().map_err(|error| error.to_string())?;
            let type_name = endpoint.type_name.clone();
            let decoder: Decoder = Arc::new(move |arrival: &Arrival| {
                let _held = &learning;
                listening
                    .hear(&type_name, arrival)
                    .map_err(|reason| format!("{reason} (see {info})"))
            });
            Ok(decoder)
        };
        follow_decoded(Arc::clone(bus), outlet, choose, &decoder).await
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}
