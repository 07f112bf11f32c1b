//! The publishers of followed topics.

use teampulse_ros::graph::{Gid, Graph};

use super::followed::{Followed, Receivers};
use super::publishing::{Key, gids, names_of, publishing, several};
use super::{Following, lock};

impl Following<'_> {
    /// Updates each person's topic with its present publishers.
    pub(super) fn look_at_publishers(&self, graph: &Graph) {
        for (key, followed) in &self.followed {
            if let Receivers::Split(split) = &followed.receivers {
                lock(split).look(&gids(key, graph).collect());
            }
        }
    }

    /// Updates one topic with its present publishers.
    pub(super) fn look_at_publishers_of(&self, topic: &str, graph: &Graph) {
        let from = self.followed.range((topic.to_owned(), String::new())..);
        for (key, followed) in from.take_while(|((each, _), _)| each == topic) {
            if let Receivers::Split(split) = &followed.receivers {
                lock(split).look(&gids(key, graph).collect());
            }
        }
    }

    /// Reports the publishers of each topic without a stream per publisher, if there are several. This is done at the
    /// second check: a restarted publisher is briefly present twice, and names arrive with a delay.
    pub(super) fn report_publishers(&mut self, graph: &Graph) {
        let mut faults = Vec::new();
        for (key, followed) in &mut self.followed {
            if followed.is_split() {
                continue;
            }
            let present: Vec<Gid> = gids(key, graph).collect();
            let is_settled =
                std::mem::replace(&mut followed.publishers, present.clone()) == present;
            let names = names_of(graph, &present);
            let is_several = names.len() > 1 || followed.published_by.len() > 1;
            if !is_settled || !is_several || names == followed.published_by {
                continue;
            }
            self.outlet.published_by(followed.id, &names);
            // Publishers on several computers are reported separately.
            let is_of_one = several(&publishing(key, graph)).is_none();
            let has_numbers = !followed.stream.channels.is_empty();
            if is_of_one && has_numbers && names.len() > followed.published_by.len() {
                faults.push(format!(
                    "{}: {} publishers: {}",
                    key.0,
                    names.len(),
                    names.join(" and ")
                ));
            }
            followed.published_by = names;
        }
        for label in faults {
            self.fault(label);
        }
    }

    /// Reports the topics that are published from several places, each once. This is done at the second check, as names
    /// arrive with a delay.
    pub(super) fn report_several(&mut self, graph: &Graph) {
        let is_shared = |(key, followed): &(&Key, &Followed)| {
            !followed.is_split() && gids(key, graph).nth(1).is_some()
        };
        let shared = self.followed.iter().filter(is_shared);
        let keys: Vec<Key> = shared.map(|(key, _)| key.clone()).collect();
        for key in keys {
            let Some(several) = several(&publishing(&key, graph)) else { continue };
            let known = self.several.get(&key).copied();
            if known == Some(false) {
                self.fault(format!("{}: published by {several}", key.0));
            }
            self.several.insert(key, known.is_some());
        }
    }
}
