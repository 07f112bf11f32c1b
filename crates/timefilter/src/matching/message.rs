//! The messages to match, and the listener.

use super::DropReason;

/// A message with its stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<T> {
    /// When the message was measured [ns since the Unix epoch]; any value.
    pub stamp: i64,
    /// The content of the message, or a handle to it.
    pub payload: T,
}

/// One message of each topic, in the order of topics; messages that are not taken out are dropped.
#[derive(Debug)]
pub struct Set<'a, T> {
    places: std::slice::IterMut<'a, Option<Message<T>>>,
}

impl<'a, T> Set<'a, T> {
    /// Creates a set from places that are all occupied.
    #[inline]
    pub(super) fn of(places: &'a mut [Option<Message<T>>]) -> Set<'a, T> {
        Set { places: places.iter_mut() }
    }
}

impl<T> Iterator for Set<'_, T> {
    type Item = Message<T>;

    #[inline]
    fn next(&mut self) -> Option<Message<T>> {
        self.places.next()?.take()
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.places.size_hint()
    }
}

impl<T> ExactSizeIterator for Set<'_, T> {}

impl<T> Drop for Set<'_, T> {
    #[inline]
    fn drop(&mut self) {
        for place in &mut self.places {
            *place = None;
        }
    }
}

/// Receives sets, and messages that are in no set.
///
/// A closure that takes a [`Set`] is a listener that ignores dropped messages.
pub trait Listener<T> {
    /// Called with a complete set.
    fn set(&mut self, set: Set<'_, T>);

    /// Called with a message of `topic` that will be in no set, and the `reason`.
    fn dropped(&mut self, _topic: usize, _message: Message<T>, _reason: DropReason) {}
}

impl<T, F: FnMut(Set<'_, T>)> Listener<T> for F {
    fn set(&mut self, set: Set<'_, T>) {
        self(set);
    }
}
