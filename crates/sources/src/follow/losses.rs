//! Reports the losses of followed topics, and where they occurred.

use std::collections::BTreeMap;

use super::Following;

impl Following<'_> {
    /// Reports the losses since the last call.
    pub(super) fn report_losses(&mut self) {
        let mut of_reliable = BTreeMap::new();
        for ((topic, _), followed) in &self.followed {
            let lost = followed.report_losses(self.outlet);
            if lost > 0 && followed.is_reliable() {
                *of_reliable.entry(topic.clone()).or_default() += lost;
            }
        }
        // Other kernels do not report what their receive buffers dropped.
        if cfg!(target_os = "linux")
            && let Some(trouble) = self.places.look(of_reliable)
        {
            self.fault(trouble);
        }
    }

    /// Reports the losses since the last call, and those not located yet.
    pub(super) fn report_last_losses(&mut self) {
        self.report_losses();
        if let Some(trouble) = self.places.report() {
            self.fault(trouble);
        }
    }
}
