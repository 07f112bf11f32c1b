//! Values computed by independent tools.

use std::error::Error;
use std::path::Path;

use serde_json::Value;

/// Reads a file in the folder `golden`.
pub fn golden(data: &Path, name: &str) -> Result<Value, Box<dyn Error>> {
    let text = std::fs::read_to_string(data.join("golden").join(name))?;
    Ok(serde_json::from_str(&text)?)
}

/// Returns a number of a golden file.
pub fn number(values: &Value, name: &str) -> Result<f64, Box<dyn Error>> {
    values[name].as_f64().ok_or_else(|| format!("find the number {name}").into())
}

/// Returns the numbers of a list in a golden file.
pub fn numbers(values: &Value) -> Vec<f64> {
    values.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

/// The largest relative difference in a set of values, and the name of its value.
#[derive(Default)]
pub struct Worst {
    share: f64,
    name: String,
    count: usize,
}

impl Worst {
    /// Compares one value.
    pub fn see(&mut self, name: &str, ours: f64, theirs: f64) {
        let share = (ours - theirs).abs() / theirs.abs().max(f64::MIN_POSITIVE);
        self.count += 1;
        if share > self.share || share.is_nan() {
            self.share = share;
            name.clone_into(&mut self.name);
        }
    }

    /// Prints the difference with its bar; returns whether the bar was met.
    pub fn print(&self, what: &str, bar: f64) -> bool {
        let (count, share, name) = (self.count, self.share, &self.name);
        let of = if name.is_empty() { String::new() } else { format!(" of {name}") };
        verdict(
            count > 0 && share <= bar,
            &format!("{what}: {count} values, at most {share:.1e} off{of} (bar {bar:.0e})"),
        )
    }
}

/// Prints a figure; returns whether its bar was met.
pub fn verdict(met: bool, figure: &str) -> bool {
    println!("{}  {figure}", if met { "pass" } else { "FAIL" });
    met
}
