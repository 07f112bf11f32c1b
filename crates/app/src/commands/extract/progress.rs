//! How far a long file is read.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Rows between two looks at how far the reading is.
const ROWS: usize = 1 << 14;
/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar on standard error, for work that takes more than a moment; none where nobody looks.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub fn new() -> Progress {
        let target = ProgressDrawTarget::stderr_with_hz(5);
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{msg:<10} {bar:40} {percent:>3} %  {elapsed}");
        if let Ok(style) = style {
            bar.set_style(style);
        }
        bar.set_message("reading");
        Progress { bar }
    }

    /// So many rows were read, which is such a share of the file.
    pub fn reading(&self, rows: usize, share: impl FnOnce() -> Option<f64>) {
        if rows.is_multiple_of(ROWS)
            && let Some(share) = share()
        {
            self.bar.set_position((share * STEPS as f64) as u64);
        }
    }

    /// All was read, and is looked at as a whole.
    pub fn analysing(&self) {
        self.bar.set_message("analysing");
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    /// Such a share of the windows was measured.
    pub fn measuring(&self, share: f64) {
        self.bar.set_message("measuring");
        self.bar.set_position((share * STEPS as f64) as u64);
    }

    /// Does something that prints, with the bar out of the way.
    pub fn aside(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    pub fn end(&self) {
        self.bar.finish_and_clear();
    }
}
