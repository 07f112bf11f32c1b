//! Laws of alignment, on the public interface.
#![expect(clippy::float_cmp, reason = "what is compared is the same arithmetic")]
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

mod story;
mod policies;
mod chunking;
mod silence;
mod lateness;
mod coming_and_going;
mod modes;
mod bad_input;
mod memory;
