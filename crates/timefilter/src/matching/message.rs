//! The messages to match, and the listener.

use super::DropReason;

/// A message with its stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<T> {
    /// When it was measured [ns since the Unix epoch]; any number.
    pub stamp: i64,
    /// What it holds, or a handle to that.
    pub payload: T,
}

/// One message of each topic, in the order of topics; what is not taken out of it is let go.
pub type Set<'a, T> = std::vec::Drain<'a, Message<T>>;

/// Receives sets, and messages that do not get into one.
///
/// A closure that takes a [`Set`] is a listener who does not care about the others.
pub trait Listener<T> {
    /// A set is complete.
    fn set(&mut self, set: Set<'_, T>);

    /// A message of `topic` will be in no set, because of `reason`.
    fn dropped(&mut self, _topic: usize, _message: Message<T>, _reason: DropReason) {}
}

impl<T, F: FnMut(Set<'_, T>)> Listener<T> for F {
    fn set(&mut self, set: Set<'_, T>) {
        self(set);
    }
}
