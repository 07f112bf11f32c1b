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
        /// What it is called.
        phase: &'static str,
        /// How long it will last [s].
        lasts_secs: f64,
    },
    /// A phase ends.
    Ends {
        /// What it is called.
        phase: &'static str,
    },
    /// From now on so much is demanded of the person; truth that nobody sees.
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
    /// The finger sets out to press a key; truth that nobody sees.
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
    /// The person is asked, when a level has ended, and says how much it was (Instantaneous
    /// Self-Assessment, 1 to 5).
    Report {
        /// From 1 (idle) to 5 (too much).
        isa: u8,
    },
}
