//! Keyboard, mouse and gamepad activity: values of windows, computed from one-second summaries.
//!
//! A summary has the values of one second at a keyboard, a mouse or a gamepad, without the content typed.
//! Its channels identify the device: [`KEYBOARD`], [`MOUSE`] or [`GAMEPAD`].
//!
//! ```
//! use teampulse_signal::activity::{KEYBOARD, analysis};
//! use teampulse_signal::analysis::Span;
//!
//! let mut typing = analysis::causal(&KEYBOARD, 1.0)?;
//! // Ten seconds with four presses each, one of them Backspace; none of them was timed.
//! for second in 0i64..10 {
//!     let (none, idle_secs) = (f64::NAN, 0.0);
//!     typing.push(second * 1_000_000_000, &[4.0, 1.0, 0.0, none, none, 0.0, none, none, idle_secs]);
//! }
//! let measured = typing.measure(Span { begin_ns: 0, end_ns: 10_000_000_000 });
//! let names = typing.values().iter().map(|value| value.name.as_ref());
//! let found: Vec<_> = names.zip(measured.values).collect();
//! assert_eq!(found[0], ("KEY_Rate", Ok(240.0)));
//! assert_eq!(found[5], ("KEY_Corrections", Ok(0.25)));
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

pub mod analysis;
mod values;

pub use values::{GAMEPAD, KEYBOARD, MOUSE};
