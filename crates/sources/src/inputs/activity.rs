use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::Reading;
use teampulse_core::stream::{Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_devices::inputs::{Act, Kind, Seconds};

use super::SECOND_NS;

/// The namespace of people.
const PEOPLE: &str = "/humans/persons";

/// A person's activity at all devices, second by second. Clones share it; each reader has one.
#[derive(Clone)]
pub(super) struct Activity {
    person: Arc<str>,
    outlet: Outlet,
    kinds: Arc<Mutex<BTreeMap<Kind, Present>>>,
}

/// A kind of device that is present.
struct Present {
    devices: usize,
    seconds: Seconds,
    stream: StreamId,
}

impl Activity {
    pub(super) fn new(person: &str, outlet: &Outlet) -> Activity {
        Activity { person: person.into(), outlet: outlet.clone(), kinds: Arc::default() }
    }

    /// Registers a device, until the returned value is dropped.
    pub(super) fn join(&self, kinds: &[Kind]) -> Attendance {
        let mut present = self.present();
        for &kind in kinds {
            let known = present.entry(kind).or_insert_with(|| self.begin(kind));
            known.devices += 1;
        }
        drop(present);
        Attendance { activity: self.clone(), kinds: kinds.to_vec() }
    }

    fn begin(&self, kind: Kind) -> Present {
        let stream = self.outlet.declare(stream(&self.person, kind));
        Present { devices: 0, seconds: Seconds::new(kind, self.now_ns()), stream }
    }

    /// Whether there is a device of a kind.
    pub(super) fn has(&self, kind: Kind) -> bool {
        self.present().contains_key(&kind)
    }

    /// The session's time \[ns\].
    pub(super) fn now_ns(&self) -> i64 {
        self.outlet.clock().now().nanos()
    }

    /// Adds an action at a time of the session's clock \[ns\].
    pub(super) fn take(&self, at_ns: i64, act: &Act) {
        if let Some(known) = self.present().get_mut(&act.kind()) {
            known.seconds.take(at_ns, act);
        }
    }

    /// Offers the summaries of finished seconds.
    pub(super) fn hand_over(&self) {
        let now_ns = self.now_ns();
        for known in self.present().values_mut() {
            for summary in known.seconds.until(now_ns) {
                // Seconds are numbered, so that those without a summary show as a gap.
                let index = u64::try_from(summary.begin_ns / SECOND_NS).ok();
                let middle = Time::from_nanos(summary.begin_ns.saturating_add(SECOND_NS / 2));
                self.outlet.offer(Reading {
                    stream: known.stream,
                    index,
                    device_time: None,
                    source_time: Some(middle),
                    data: Data::Sample(summary.values.as_slice().into()),
                });
            }
        }
    }

    /// Reports a problem to the user.
    pub(super) fn warn(&self, what: &str) {
        self.outlet.happen(passing(format!("inputs of {}: {what}", self.person)));
    }

    fn present(&self) -> MutexGuard<'_, BTreeMap<Kind, Present>> {
        self.kinds.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The presence of a device, which ends when this is dropped.
pub(super) struct Attendance {
    activity: Activity,
    kinds: Vec<Kind>,
}

impl Drop for Attendance {
    fn drop(&mut self) {
        let mut present = self.activity.present();
        for kind in &self.kinds {
            let is_last = present.get_mut(kind).is_some_and(|known| {
                known.devices -= 1;
                known.devices == 0
            });
            if is_last {
                present.remove(kind);
            }
        }
    }
}

fn stream(person: &str, kind: Kind) -> Stream {
    let name = format!("{PEOPLE}/{person}/{}/activity", kind.name());
    let stream = Stream::raw(name, Subject::person(person), Shape::Sample);
    Stream {
        signal: Signal::Activity,
        rate_hz: 1.0,
        doc: format!("how much {person} uses the {} each second, but not which keys", kind.name()),
        ..stream.with_channels(kind.channels())
    }
}
