//! What can happen in a task.

/// Something that happens in a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Happening {
    /// When, after the start [s].
    pub at_secs: f64,
    /// What.
    pub what: What,
}

/// What can happen in a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// A phase begins.
    Begins {
        /// Its name.
        phase: &'static str,
        /// How long it will last [s].
        lasts_secs: f64,
    },
    /// A phase ends.
    Ends {
        /// Its name.
        phase: &'static str,
    },
    /// The demand on the person from now on: hidden truth.
    Demands {
        /// How hard the mind works [0..1].
        workload: f64,
        /// How excited the person is [0..1].
        arousal: f64,
        /// How it feels [0..1].
        valence: f64,
        /// Whether the person has given up for a while.
        disengaged: bool,
    },
    /// A letter is shown.
    Stimulus {
        /// Which.
        letter: char,
        /// Whether it is that of n stimuli before.
        is_match: bool,
    },
    /// The finger begins to press a key: hidden truth.
    Reaches {
        /// When the key will be down, after the start [s].
        press_secs: f64,
    },
    /// The person presses one of two keys.
    Press {
        /// The one for a match; else the one for none.
        says_match: bool,
        /// Whether that is right.
        is_right: bool,
        /// After the stimulus [s].
        reaction_secs: f64,
    },
    /// The person commands a robot.
    Command {
        /// Which, from 0.
        robot: u32,
    },
    /// The person reports the workload of a level at its end (Instantaneous
    /// Self-Assessment, 1 to 5).
    Report {
        /// From 1 (idle) to 5 (too much).
        isa: u8,
    },
}
