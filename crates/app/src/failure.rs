//! Failures as shown to the user: the cause and a hint.

use std::fmt;

use teampulse_ros::bus::BusError;

use crate::exit::Exit;
use crate::output::{draw, say};
use crate::study::StudyError;

/// Why a command ended early.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    message: String,
    hint: String,
    study: Option<Box<StudyError>>,
}

impl Failure {
    /// Creates a failure from a sentence that says what failed.
    pub fn new(message: impl Into<String>) -> Failure {
        Failure { exit: Exit::Failed, message: message.into(), hint: String::new(), study: None }
    }

    /// Creates the failure "failed to …" from an error that completes this sentence.
    pub fn to(error: impl fmt::Display) -> Failure {
        Failure::new(format!("failed to {error}"))
    }

    /// Adds a hint; an empty hint is not shown.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Failure {
        self.hint = hint.into();
        self
    }

    /// Sets another exit code.
    #[must_use]
    pub fn exit(mut self, exit: Exit) -> Failure {
        self.exit = exit;
        self
    }

    /// The message and the hint.
    pub fn words(&self) -> (String, String) {
        (self.message.clone(), self.hint.clone())
    }

    /// The error in the study, if that is the cause.
    #[cfg(test)]
    pub fn study(self) -> Option<StudyError> {
        self.study.map(|study| *study)
    }

    /// Shows the failure on standard error.
    pub fn show(self) {
        match self.study {
            Some(study) => draw(format!("{:?}", miette::Report::new(*study))),
            None if self.hint.is_empty() => say(format!("error: {}", self.message)),
            None => say(format!("error: {}\n hint: {}", self.message, self.hint)),
        }
    }
}

impl From<BusError> for Failure {
    fn from(error: BusError) -> Failure {
        let hint = error.hint();
        Failure::to(error).hint(hint)
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Failure {
        let study = Some(Box::new(error));
        Failure { exit: Exit::BadStudy, message: String::new(), hint: String::new(), study }
    }
}
