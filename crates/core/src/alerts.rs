//! Alerts: that a robot needs someone, published as events in words, and parsed again.

/// The topic of alerts.
pub const ALERTS: &str = "/team/alerts";

/// A robot needs someone, or does not any more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alert {
    /// The robot.
    pub robot: String,
    /// Why, in words: `offline`.
    pub why: String,
    /// What became of it.
    pub stage: Stage,
}

/// What became of an alert.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The robot needs someone.
    Raised,
    /// Somebody commanded the robot.
    Answered,
    /// The robot no longer needs someone.
    Over,
}

impl Stage {
    const ALL: [Stage; 3] = [Stage::Raised, Stage::Answered, Stage::Over];

    fn words(self) -> &'static str {
        match self {
            Stage::Raised => " needs someone: ",
            Stage::Answered => " was answered: ",
            Stage::Over => " no longer needs someone: ",
        }
    }
}

impl Alert {
    /// As it stands in the label of its event: `robot2 needs someone: offline`.
    pub fn label(&self) -> String {
        format!("{}{}{}", self.robot, self.stage.words(), self.why)
    }

    /// The alert of a label; `None` for any other text.
    pub fn read(label: &str) -> Option<Alert> {
        // The words of one are the last ones of another, so the robot is a single word.
        Stage::ALL.into_iter().find_map(|stage| {
            let (robot, why) = label.split_once(stage.words())?;
            let is_robot = !robot.is_empty() && !robot.contains(' ');
            is_robot.then(|| Alert { robot: robot.to_owned(), why: why.to_owned(), stage })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alert_reads_as_it_was_reported() {
        for stage in Stage::ALL {
            let (robot, why) = ("robot2".to_owned(), "battery below 20 %".to_owned());
            let alert = Alert { robot, why, stage };
            assert_eq!(Alert::read(&alert.label()), Some(alert));
        }
        assert_eq!(Alert::read("robot2 offline"), None);
    }
}
