//! What becomes known of decoded streams after they were declared.

use teampulse_core::stream::Stream;
use teampulse_ros::graph::{Endpoint, Graph};

use super::followed::Receivers;
use super::publishing::offered;
use super::{Following, Kept, lock};

impl Following<'_> {
    /// Declares streams that are decoded again where their description, messages or publishers say more.
    pub(super) fn describe_anew(
        &mut self,
        graph: &Graph,
        choose: &impl Fn(&Endpoint) -> Option<Stream>,
    ) {
        if self.kept == Kept::AsTheyCame {
            return;
        }
        for (key, followed) in &mut self.followed {
            let Receivers::Split(split) = &followed.receivers else { continue };
            let mut publishers = graph.publishers(&key.0);
            let publisher = publishers.find(|each| each.type_name == key.1 && !each.own);
            let Some(mut stream) = publisher.and_then(choose) else { continue };
            let mut split = lock(split);
            lock(&split.primary().observed).describe(&mut stream);
            stream.qos = offered(key, graph);
            stream.publisher.clone_from(&followed.stream.publisher);
            if stream != followed.stream {
                self.outlet.declare(stream.clone());
                split.describe(&stream);
                followed.stream = stream;
            }
        }
    }
}
