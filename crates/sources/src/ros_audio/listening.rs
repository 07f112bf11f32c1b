//! Processes the messages of a microphone's publisher, in order.

use std::sync::{Arc, Mutex, PoisonError};

use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_messages::audio::{AUDIO_INFO, AudioBlock, AudioInfo};
use teampulse_messages::convert::Decoded;
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Subscription};
use teampulse_ros::graph::Gid;

use crate::hearing::{Hearing, Kept};

/// The queue size of the subscription to the format.
const DEPTH: u32 = 10;

/// A microphone shared by two callbacks: one for its sound and one for its format.
#[derive(Clone)]
pub(super) struct Listening(Arc<Mutex<State>>);

struct State {
    kept: Kept,
    info: Option<AudioInfo>,
    hearing: Hearing,
    publisher: Option<Gid>,
    sequence: Option<u64>,
}

impl Listening {
    pub fn new(kept: Kept, info: Option<AudioInfo>) -> Listening {
        let hearing = Hearing::new(kept, info);
        Listening(Arc::new(Mutex::new(State {
            kept,
            info,
            hearing,
            publisher: None,
            sequence: None,
        })))
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Learns the format of the sound from a topic, until the returned value is dropped.
    pub fn learn_from(
        &self,
        bus: &dyn Bus,
        topic: &str,
        outlet: &Outlet,
    ) -> Result<Subscription, BusError> {
        let (listening, outlet, name) = (self.clone(), outlet.clone(), topic.to_owned());
        let reported = Mutex::new(None);
        let deliver = Arc::new(move |arrival: Arrival| match AudioInfo::read(&arrival.bytes) {
            Ok(info) => {
                let mut state = listening.lock();
                state.info = Some(info);
                state.hearing.learn(info);
            }
            Err(error) => {
                let mut reported = reported.lock().unwrap_or_else(PoisonError::into_inner);
                if reported.replace(error.clone()).as_ref() != Some(&error) {
                    outlet.happen(passing(format!("{name}: failed to {error}")));
                }
            }
        });
        bus.subscribe(topic, AUDIO_INFO, Asked::Adaptive { depth: DEPTH }, deliver)
    }

    /// Handles a message with sound; returns the resulting data. An error fits after "failed to".
    pub fn hear(&self, type_name: &str, arrival: &Arrival) -> Result<Option<Decoded>, String> {
        let mut state = self.lock();
        let state = &mut *state;
        if state.publisher.replace(arrival.publisher) != Some(arrival.publisher) {
            // Another program, or the same one restarted, counts its samples anew.
            state.hearing = Hearing::new(state.kept, state.info);
            state.sequence = None;
        }
        let expected = state.sequence.map(|before| before + 1);
        let lost = arrival.sequence.zip(expected).map_or(0, |(is, was)| is.saturating_sub(was));
        state.sequence = arrival.sequence.or(state.sequence);
        let block = AudioBlock::read(type_name, &arrival.bytes);
        let block = block.ok_or_else(|| format!("read sound in a {type_name}"))?;
        state.hearing.hear(block.map_err(|error| format!("read sound: {error}"))?, lost)
    }
}
