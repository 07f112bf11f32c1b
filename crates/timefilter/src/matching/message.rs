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

/// One message of each topic, in the order of topics; what is not taken out of it is dropped.
#[derive(Debug)]
pub struct Set<'a, T> {
    places: std::slice::IterMut<'a, Option<Message<T>>>,
}

impl<'a, T> Set<'a, T> {
    /// The messages of places that are all taken.
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
