//! Subscribing to wanted topics as their publishers appear.

use std::sync::{Arc, Mutex};

use teampulse_core::stream::{Shape, Stream};
use teampulse_ros::bus::{Asked, Deliver, Subscription};
use teampulse_ros::graph::{Endpoint, Graph};

use super::decoding::Reading;
use super::followed::{Followed, Receivers};
use super::loss_counter::LossCounter;
use super::publisher_split::PublisherSplit;
use super::publishing::{Key, offered, who};
use super::stamped::known_schema;
use super::{Following, Kept, lock, verbatim};

/// The queue size of a subscription. Messages are taken from it immediately, so this bounds a burst, not a delay.
const DEPTH: u32 = 2000;

impl Following<'_> {
    /// Subscribes to a topic if it is wanted and not yet followed.
    pub(super) fn subscribe_to_wanted(
        &mut self,
        topic: &str,
        graph: &Graph,
        choose: &impl Fn(&Endpoint) -> Option<Stream>,
    ) {
        for endpoint in graph.publishers(topic).filter(|each| !each.own) {
            let key = (endpoint.topic.clone(), endpoint.type_name.clone());
            if self.followed.contains_key(&key) {
                continue;
            }
            if let Some(mut stream) = choose(endpoint) {
                stream.qos = offered(&key, graph);
                self.begin(key, endpoint, stream, graph);
            }
        }
    }

    fn begin(&mut self, key: Key, endpoint: &Endpoint, stream: Stream, graph: &Graph) {
        self.report_second_type(endpoint);
        let followed = match self.kept {
            Kept::AsTheyCame => self.begin_verbatim(&key, endpoint, stream, graph),
            Kept::Decoded => {
                let reading = Reading::of_ours(&stream);
                self.begin_decoded(endpoint, stream, reading)
            }
            Kept::Read(reader) => match reader(endpoint) {
                Ok(decoder) => {
                    self.begin_decoded(endpoint, stream, Reading { decoder, is_stamped: false })
                }
                Err(reason) => return self.fault(format!("failed to {reason}")),
            },
        };
        self.followed.insert(key, followed);
    }

    /// Reports that a followed topic is also published with another type.
    fn report_second_type(&self, endpoint: &Endpoint) {
        let of_topic = self.followed.range((endpoint.topic.clone(), String::new())..);
        let other =
            of_topic.map(|(key, _)| key).next().filter(|(topic, _)| *topic == endpoint.topic);
        if let Some((topic, other)) = other {
            let mut types = [other.as_str(), endpoint.type_name.as_str()];
            types.sort_unstable();
            self.fault(format!("{topic}: published with two types: {}", types.join(", ")));
        }
    }

    /// Follows a topic whose messages are kept as received.
    fn begin_verbatim(
        &mut self,
        key: &Key,
        endpoint: &Endpoint,
        mut stream: Stream,
        graph: &Graph,
    ) -> Followed {
        let (mut schema, stamped) = known_schema(endpoint);
        let of = (endpoint.type_name.clone(), endpoint.type_hash.clone());
        if let Some(found) = self.defined.get(&of).filter(|_| schema.text.is_empty()) {
            stamped.learn(found);
            schema.clone_from(found);
        }
        let is_known = !schema.text.is_empty();
        stream.shape = Shape::Message(Arc::new(schema));
        self.leave_out_wrong_fields(&mut stream);
        stream.publisher = who(graph, endpoint.gid);
        let id = self.outlet.declare(stream.clone());
        let losses = Arc::new(Mutex::new(LossCounter::new(id, self.bus.graph())));
        let deliver = verbatim::deliver(self.outlet, id, &stamped, &losses);
        let subscription = self.subscribe(endpoint, deliver);
        if !is_known {
            self.ask_for_definition(key.clone(), of);
        }
        Followed::new(id, stream, Receivers::Verbatim { losses, stamped }, subscription)
    }

    /// Follows a topic whose messages are decoded; which of its publishers sends first is not known yet.
    fn begin_decoded(&self, endpoint: &Endpoint, stream: Stream, reading: Reading) -> Followed {
        let id = self.outlet.declare(stream.clone());
        let split = PublisherSplit::new(self.outlet, self.bus.graph(), (id, &stream), reading);
        let split = Arc::new(Mutex::new(split));
        let taking = Arc::clone(&split);
        let deliver: Deliver = Arc::new(move |arrival| lock(&taking).take(arrival));
        let subscription = self.subscribe(endpoint, deliver);
        Followed::new(id, stream, Receivers::Split(split), subscription)
    }

    fn subscribe(&self, endpoint: &Endpoint, deliver: Deliver) -> Option<Subscription> {
        let asked = Asked::Adaptive { depth: DEPTH };
        match self.bus.subscribe(&endpoint.topic, &endpoint.type_name, asked, deliver) {
            Ok(subscription) => Some(subscription),
            Err(error) => {
                self.fault(format!("failed to {error}"));
                None
            }
        }
    }
}
