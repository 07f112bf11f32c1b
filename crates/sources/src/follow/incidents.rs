//! Reports incidents of the bus on followed topics.

use teampulse_ros::bus::Incident;

use super::Following;

impl Following<'_> {
    /// Reports an incident on a followed topic, once.
    pub(super) fn report_incident(&mut self, incident: &Incident) {
        let (topic, trouble) = match incident {
            Incident::IncompatibleQos { topic, policy, ours: true } => {
                (topic, format!("{topic}: a publisher offers less {policy} than requested"))
            }
            Incident::IncompatibleQos { .. } | Incident::TwoTypes { .. } => return,
            Incident::Overflow { .. } => return self.places.overflow(),
            Incident::DeadlineMissed { topic, .. } => {
                (topic, format!("{topic}: its publisher misses the deadline that it promised"))
            }
        };
        let mut of_topic = self.followed.range((topic.clone(), String::new())..);
        let followed = of_topic.next().is_some_and(|((known, _), _)| known == topic);
        if followed && self.reported.insert(trouble.clone()) {
            self.fault(trouble);
        }
    }
}
