//! How long a connection may stay open without use, as the number of connections is limited.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep};

/// The time allowed for a handshake and the head of the first request, however slowly the bytes arrive.
const HEAD: Duration = Duration::from_secs(10);
/// The longest time without anything sent to the client after that: pages request the time every few seconds. Bytes
/// from the client do not extend it.
const IDLE: Duration = Duration::from_secs(90);

/// The deadline of one connection.
pub(crate) struct Patience {
    until: Pin<Box<Sleep>>,
    /// Whether the head of the first request has arrived.
    has_asked: bool,
    /// Whether the next byte is at the start of a line of the head.
    at_line_start: bool,
    idle: Duration,
}

impl Patience {
    /// The deadline of a connection that was just accepted.
    pub(crate) fn new() -> Patience {
        Patience::of(HEAD, IDLE)
    }

    fn of(head: Duration, idle: Duration) -> Patience {
        let until = Box::pin(sleep(head));
        Patience { until, has_asked: false, at_line_start: false, idle }
    }

    /// Takes received bytes into account.
    pub(crate) fn received(&mut self, bytes: &[u8]) {
        let had_asked = self.has_asked;
        for byte in bytes {
            if self.has_asked {
                break;
            }
            // The head ends with an empty line.
            self.has_asked = *byte == b'\n' && self.at_line_start;
            self.at_line_start = *byte == b'\n' || (*byte == b'\r' && self.at_line_start);
        }
        if self.has_asked && !had_asked {
            self.extend();
        }
    }

    /// Notes that bytes were sent.
    pub(crate) fn sent(&mut self) {
        if self.has_asked {
            self.extend();
        }
    }

    /// Ready once the deadline has passed.
    pub(crate) fn poll_over(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        self.until.as_mut().poll(cx)
    }

    fn extend(&mut self) {
        self.until.as_mut().reset(Instant::now() + self.idle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LONG: Duration = Duration::from_secs(3600);

    #[tokio::test]
    async fn a_request_that_comes_slowly_is_ended() {
        let mut patience = Patience::of(Duration::from_millis(20), LONG);
        patience.received(b"GET / HTTP/1.1\r\nHost: robot");
        std::future::poll_fn(|cx| patience.poll_over(cx)).await;
    }

    #[tokio::test]
    async fn only_answers_extend_the_deadline() {
        let mut patience = Patience::new();
        let begun = patience.until.deadline();
        patience.received(b"GET / HTTP/1.1\r\n\r\n");
        let asked = patience.until.deadline();
        assert!(asked > begun + HEAD);
        sleep(Duration::from_millis(1)).await;
        patience.received(b"GET / HTTP/1.1\r\n\r\n");
        assert_eq!(patience.until.deadline(), asked);
        patience.sent();
        assert!(patience.until.deadline() > asked);
    }

    #[tokio::test]
    async fn a_whole_request_is_waited_for_until_nothing_comes() {
        let head = b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n";
        for cut in 0..head.len() {
            let mut patience = Patience::of(LONG, Duration::from_millis(5));
            patience.received(&head[..cut]);
            assert!(!patience.has_asked);
            patience.received(&head[cut..]);
            assert!(patience.has_asked);
            patience.sent();
            std::future::poll_fn(|cx| patience.poll_over(cx)).await;
        }
    }
}
