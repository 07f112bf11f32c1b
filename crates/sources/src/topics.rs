//! Records any topics as received.

use std::sync::Arc;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_core::source::{Source, SourceError};
use teampulse_core::stream::{Shape, Stream, Subject};
use teampulse_ros::BusId;
use teampulse_ros::bus::Bus;

use crate::claims::{Claimed, Rank, is_of_sessions};
use crate::expected::Expected;
use crate::faces::Faces;
use crate::follow::follow;
use crate::{SourceContext, join};
use teampulse_core::pattern::Pattern;

/// Any ROS topics by name, recorded unchanged. Topics of the study's robots and people are left to their sources, and
/// topics on which teampulse sessions publish about themselves are matched only by their full names.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Topics {
    /// The names of the topics; a `*` stands for any part of a token, and `/**` for everything.
    pub names: Vec<Pattern>,
    /// `"blur"`: pictures are recorded only with hidden faces, by the worker of type `blur`.
    #[serde(default)]
    pub faces: Faces,
    /// The ROS domain, or another bus as `"KIND:ADDRESS"`; by default the domain of `ROS_DOMAIN_ID`, else 0.
    pub domain: Option<BusId>,
}

impl Topics {
    /// Returns the topics that are named in full.
    pub fn named(&self) -> impl Iterator<Item = &str> {
        let in_full = |name: &&str| !name.contains('*') && *name != SESSION_EVENTS;
        self.names.iter().map(Pattern::text).filter(in_full)
    }
}

/// Returns the message that nothing publishes a topic named in the study.
pub fn unpublished(topic: &str) -> String {
    format!("topics: nothing publishes `{topic}`")
}

impl Component<dyn Source, SourceContext> for Topics {
    const EXAMPLE: &'static str = r#"names = ["/tf", "/tf_static", "/map*"]"#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let bus = join(context, self.domain.as_ref())?;
        let named = self.named().map(|topic| (topic.to_owned(), unpublished(topic)));
        let expected = Expected::new(named);
        let names = Arc::new(self.names);
        let wanted = Arc::clone(&names);
        let claimed =
            context.claims.lay(&bus, Rank::Named, move |each| wants(&wanted, &each.topic));
        Ok(Box::new(TopicsSource { bus, names, faces: self.faces, claimed, expected }))
    }
}

/// A running source of topics.
struct TopicsSource {
    bus: Arc<dyn Bus>,
    names: Arc<Vec<Pattern>>,
    faces: Faces,
    claimed: Claimed,
    expected: Expected,
}

#[async_trait]
impl Source for TopicsSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let expected = &self.expected;
        let following = follow(Arc::clone(&self.bus), outlet, |endpoint| {
            expected.see(&endpoint.topic);
            let is_wanted = wants(&self.names, &endpoint.topic) && self.claimed.is_ours(endpoint);
            let stream = || Stream::raw(&endpoint.topic, Subject::session(), Shape::Sample);
            is_wanted.then(|| self.faces.hidden_in_any(stream(), &endpoint.type_name))
        });
        tokio::select! {
            ended = following => ended,
            never = expected.report(outlet) => match never {},
        }
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}

/// Whether a topic is wanted by name. Wildcards match neither the topics on which other sessions publish about
/// themselves nor the events that this session reads already.
fn wants(names: &[Pattern], topic: &str) -> bool {
    let of_sessions = is_of_sessions(topic);
    let by_name = |name: &Pattern| name.text() == topic && topic != SESSION_EVENTS;
    names.iter().any(|name| if of_sessions { by_name(name) } else { name.matches(topic) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_named_in_full_unless_they_have_a_wildcard_or_are_our_own_events() {
        let names = r#"names = ["/tf", "/truth", "/map*", "/nothing/**", "/session/events"]"#;
        let topics: Topics = toml::from_str(names).expect("settings");
        assert!(topics.named().eq(["/tf", "/truth"]));
    }

    #[test]
    fn stars_do_not_mean_what_sessions_say_of_themselves() {
        let names = |names: &[&str]| -> Vec<Pattern> {
            names.iter().map(|name| Pattern::parse(name).unwrap()).collect()
        };
        let all = names(&["/**"]);
        for (topic, wanted) in
            [("/tf", true), ("/teampulse/status", false), (SESSION_EVENTS, false)]
        {
            assert_eq!(wants(&all, topic), wanted, "{topic}");
        }
        assert!(wants(&names(&["/teampulse/status"]), "/teampulse/status"));
        assert!(!wants(&names(&[SESSION_EVENTS]), SESSION_EVENTS));
    }
}
