//! The events of a task.

/// An event of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Happening {
    /// The time after the start [s].
    pub at_secs: f64,
    /// The kind of event.
    pub what: What,
}

/// The kinds of events of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// A phase begins.
    Begins {
        /// The name of the phase.
        phase: &'static str,
        /// How long the phase will last [s].
        lasts_secs: f64,
    },
    /// A phase ends.
    Ends {
        /// The name of the phase.
        phase: &'static str,
    },
    /// The demand on the person from now on: hidden truth.
    Demands {
        /// Workload [0..1].
        workload: f64,
        /// Arousal [0..1].
        arousal: f64,
        /// Valence [0..1].
        valence: f64,
        /// Whether the person has given up for a while.
        disengaged: bool,
    },
    /// A letter is shown.
    Stimulus {
        /// The letter.
        letter: char,
        /// Whether the letter equals the one n stimuli before.
        is_match: bool,
    },
    /// The finger starts to move towards a key: hidden truth.
    Reaches {
        /// When the key will be down, after the start [s].
        press_secs: f64,
    },
    /// The person presses one of two keys.
    Press {
        /// Whether it is the key for a match; otherwise it is the other one.
        says_match: bool,
        /// Whether the answer is correct.
        is_right: bool,
        /// The time after the stimulus [s].
        reaction_secs: f64,
    },
    /// The person commands a robot.
    Command {
        /// The index of the robot, from 0.
        robot: u32,
    },
    /// The person reports the workload of a level at its end (Instantaneous Self-Assessment, 1 to 5).
    Report {
        /// The rating, from 1 (idle) to 5 (too much).
        isa: u8,
    },
}
