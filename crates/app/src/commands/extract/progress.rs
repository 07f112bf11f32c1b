//! Progress while a long file is read.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Rows between two updates of the progress bar.
const ROWS: usize = 1 << 14;
/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// A progress bar on standard error, for work that takes more than a moment; hidden where standard error is
/// not a terminal.
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

    /// Shows from time to time the share of the file that was read.
    pub fn reading(&self, rows: usize, share: impl FnOnce() -> Option<f64>) {
        if rows.is_multiple_of(ROWS)
            && let Some(share) = share()
        {
            self.bar.set_position((share * STEPS as f64) as u64);
        }
    }

    /// Shows that all rows were read and the recording is being analysed as a whole.
    pub fn analysing(&self) {
        self.bar.set_message("analysing");
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    /// Shows the share of the windows that are finished.
    pub fn measuring(&self, share: f64) {
        self.bar.set_message("measuring");
        self.bar.set_position((share * STEPS as f64) as u64);
    }

    /// Prints something with the bar hidden.
    pub fn aside(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    pub fn end(&self) {
        self.bar.finish_and_clear();
    }
}
