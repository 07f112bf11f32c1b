//! Redeclaring decoded streams when more is known about them.

use teampulse_core::outlet::Outlet;
use teampulse_core::stream::Stream;
use teampulse_ros::graph::{Endpoint, Graph};

use super::followed::{Followed, Receivers};
use super::publishing::{Key, offered};
use super::{Following, lock};

impl Following<'_> {
    /// Redeclares a decoded topic if its description, messages or publishers provide more details.
    pub(super) fn describe_anew(
        &mut self,
        topic: &str,
        graph: &Graph,
        choose: &impl Fn(&Endpoint) -> Option<Stream>,
    ) {
        let from = self.followed.range_mut((topic.to_owned(), String::new())..);
        for (key, followed) in from.take_while(|((each, _), _)| each == topic) {
            followed.describe_anew(key, self.outlet, graph, choose);
        }
    }

    /// Redeclares all decoded topics likewise: messages may have shown the channels of a topic without a description.
    pub(super) fn describe_all_anew(
        &mut self,
        graph: &Graph,
        choose: &impl Fn(&Endpoint) -> Option<Stream>,
    ) {
        for (key, followed) in &mut self.followed {
            followed.describe_anew(key, self.outlet, graph, choose);
        }
    }
}

impl Followed {
    /// Redeclares the topic if more is known about it.
    fn describe_anew(
        &mut self,
        key: &Key,
        outlet: &Outlet,
        graph: &Graph,
        choose: &impl Fn(&Endpoint) -> Option<Stream>,
    ) {
        let Receivers::Split(split) = &self.receivers else { return };
        let mut publishers = graph.publishers(&key.0);
        let publisher = publishers.find(|each| each.type_name == key.1 && !each.own);
        let Some(mut stream) = publisher.and_then(choose) else { return };
        let mut split = lock(split);
        lock(&split.primary().observed).describe(&mut stream);
        stream.qos = offered(key, graph);
        stream.publisher.clone_from(&self.stream.publisher);
        if stream != self.stream {
            outlet.declare(stream.clone());
            split.describe(&stream);
            self.stream = stream;
        }
    }
}
