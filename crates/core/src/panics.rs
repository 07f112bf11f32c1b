//! Panics: caught at calls into a component, so that they end the component and not the session.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::pin::pin;
use std::sync::{Mutex, PoisonError};

/// The most characters of a panic message that are kept.
const MESSAGE_CHARS: usize = 300;
/// The most panics outside of any component that are kept.
const MOST_STRAYS: usize = 16;

/// A caught panic, displayed as its message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panic {
    /// The first line of the panic's message, without control characters.
    pub message: String,
    /// Where in the code the panic started; `None` without the [hook](install_hook).
    pub place: Option<String>,
}

impl fmt::Display for Panic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

thread_local! {
    /// Whether a caller on this thread catches panics.
    static WATCHED: Cell<bool> = const { Cell::new(false) };
    /// Where the newest panic of this thread started.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Panics on threads without such a caller.
static STRAYS: Mutex<Vec<Panic>> = Mutex::new(Vec::new());

/// Calls a component. Costs nothing unless it panics.
///
/// The state of the component may be inconsistent afterwards: the caller drops it.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, Panic> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| Panic {
        message: message(&*payload),
        place: PLACE.with_borrow_mut(Option::take),
    })
}

/// Like [`caught`], for the work of a whole thread: the [hook](install_hook) leaves reporting to the caller, also for
/// panics that are caught further down.
pub fn watched<T>(work: impl FnOnce() -> T) -> Result<T, Panic> {
    let before = WATCHED.replace(true);
    let done = caught(work);
    WATCHED.set(before);
    done
}

/// Like [`watched`], for a future.
pub async fn watched_async<T>(work: impl Future<Output = T>) -> Result<T, Panic> {
    let mut work = pin!(work);
    std::future::poll_fn(|context| match watched(|| work.as_mut().poll(context)) {
        Ok(polled) => polled.map(Ok),
        Err(panic) => std::task::Poll::Ready(Err(panic)),
    })
    .await
}

/// Installs a panic hook: panics that a caller catches print nothing; any other panic prints one line on standard
/// error, and is kept for [`strays_after`].
pub fn install_hook() {
    std::panic::set_hook(Box::new(|panic: &PanicHookInfo<'_>| {
        let place = panic.location().map(ToString::to_string);
        if WATCHED.get() {
            PLACE.set(place);
            return;
        }
        let panic = Panic { message: message(panic.payload()), place };
        tracing::error!("a part of teampulse panicked: {panic}{}", at(&panic));
        let mut strays = STRAYS.lock().unwrap_or_else(PoisonError::into_inner);
        if strays.len() < MOST_STRAYS {
            strays.push(panic);
        }
    }));
}

/// The panics on threads without a caller that catches them, after the first `count`.
pub fn strays_after(count: usize) -> Vec<Panic> {
    STRAYS.lock().unwrap_or_else(PoisonError::into_inner).iter().skip(count).cloned().collect()
}

/// The place of a panic, as appended to its message.
pub fn at(panic: &Panic) -> String {
    panic.place.as_ref().map_or_else(String::new, |place| format!(" (at {place})"))
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
        (Some(text), _) => text,
        (_, Some(text)) => text.as_str(),
        _ => "without a message",
    };
    let line = text.lines().next().unwrap_or_default();
    line.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MESSAGE_CHARS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(work: impl FnOnce()) -> String {
        caught(work).unwrap_err().message
    }

    #[test]
    fn a_panic_is_one_line_of_bounded_length_without_control_characters() {
        assert_eq!(says(|| panic!("broken")), "broken");
        assert_eq!(says(|| panic!("{} of 3\nand more", 4)), "4 of 3");
        assert_eq!(says(|| panic!("\u{1b}[2J")), " [2J");
        assert_eq!(says(|| panic!("{}", "x".repeat(100_000))).len(), MESSAGE_CHARS);
        assert_eq!(says(|| std::panic::panic_any(7)), "without a message");
    }

    #[tokio::test]
    async fn a_future_that_panics_ends_with_that() {
        let ended = watched_async(async {
            tokio::task::yield_now().await;
            panic!("midway")
        });
        let ended: Result<(), Panic> = ended.await;
        assert_eq!(ended.unwrap_err().message, "midway");
        assert_eq!(watched_async(async { 3 }).await, Ok(3));
    }
}
