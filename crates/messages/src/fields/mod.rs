//! Reading numbers from messages by field paths.
//!
//! ```
//! use teampulse_messages::catalogue::shipped;
//! use teampulse_messages::definition::Definition;
//! use teampulse_messages::fields::Fields;
//! use teampulse_messages::standard::{Message, sensor_msgs::BatteryState};
//!
//! let battery = BatteryState { voltage: 12.5, cell_voltage: vec![4.25], ..Default::default() };
//! let definition = Definition::of(&shipped(BatteryState::NAME).unwrap())?;
//! let fields = Fields::compile(&definition, &["voltage", "cell_voltage[0]", "cell_voltage[1]"])?;
//! let mut numbers = Vec::new();
//! fields.read(&battery.encode(), &mut numbers)?;
//! assert_eq!(numbers[..2], [12.5, 4.25]);
//! assert!(numbers[2].is_nan());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod path;
mod plan;
mod resolve;
mod listing;
mod nearest;
mod header;

use thiserror::Error;

use crate::cdr::{CdrError, Reader};
use crate::definition::Definition;

pub use header::{header_frame, header_stamp, starts_with_header};
pub use listing::numbers;
pub use path::{Path, Step};
pub use resolve::kind;

/// Selected fields of a type, compiled for reading from its messages.
#[derive(Clone, Debug)]
pub struct Fields {
    plan: plan::Plan,
    count: usize,
}

impl Fields {
    /// Compiles the fields at these paths of a type.
    pub fn compile<P: AsRef<str>>(
        definition: &Definition,
        paths: &[P],
    ) -> Result<Fields, FieldError> {
        let ways = paths.iter().map(|path| resolve::resolve(definition, path.as_ref()));
        let plan = plan::Plan::new(definition.root(), &ways.collect::<Result<Vec<_>, _>>()?);
        Ok(Fields { plan, count: paths.len() })
    }

    /// Reads the numbers of a message into `out`, in the order of the paths.
    ///
    /// Booleans are 0 or 1. A string is parsed as a number; a string that is not a number, and an index beyond the end
    /// of a sequence, give NaN. The message is traversed once, and nothing is allocated if `out` has the capacity.
    pub fn read(&self, cdr: &[u8], out: &mut Vec<f64>) -> Result<(), CdrError> {
        out.clear();
        out.resize(self.count, f64::NAN);
        self.plan.read(&mut Reader::new(cdr)?, out)
    }
}

/// Why a path does not lead to a number.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FieldError {
    /// This is not a valid path.
    #[error("read the path {0:?}: expected names separated by dots, as in `status[0].level`")]
    Path(String),
    /// There is no such field.
    #[error("find `{path}` in {type_name}{}", suggestion(nearest.as_deref()))]
    Unknown {
        /// The type.
        type_name: String,
        /// The path.
        path: String,
        /// A similar path that exists.
        nearest: Option<String>,
    },
    /// The path ends at a message instead of a number.
    #[error("read `{path}` as a number: it is a {type_name}")]
    Message {
        /// The path.
        path: String,
        /// The type of that message.
        type_name: String,
    },
    /// The path has no index, but the field has several values.
    #[error("read `{0}` as a number: it has several values, the first one is `{0}[0]`")]
    Many(String),
    /// The path has an index, but the field has a single value.
    #[error("read `{0}`: it has a single value, which has no index")]
    One(String),
    /// The index exceeds the bound of the field.
    #[error("read `{path}`: it has at most {most} values")]
    Beyond {
        /// The path.
        path: String,
        /// The most values that the field can have.
        most: u64,
    },
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map(|path| format!(": the nearest is `{path}`")).unwrap_or_default()
}
