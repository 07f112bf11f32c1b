//! Reports whether the clock of this machine is synchronised.
#![expect(unsafe_code, reason = "the kernel's clock status has no safe binding")]

/// The state of the clock as reported by the kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clock {
    /// The clock is synchronised, to within this uncertainty [s].
    Synchronised { within_secs: f64 },
    /// The clock is not synchronised.
    Free,
}

/// Returns one line about the clock.
pub(super) fn line() -> String {
    match ask() {
        Ok(clock) => describe(clock),
        Err(error) => {
            format!("clock    ?     failed to find out whether it is synchronised: {error}")
        }
    }
}

fn describe(clock: Clock) -> String {
    match clock {
        Clock::Synchronised { within_secs } => {
            format!("clock    ok    synchronised to within {:.0} ms", within_secs * 1e3)
        }
        Clock::Free => {
            "clock    free  this machine's clock is not synchronised: its recordings can't be aligned with others; start chrony or systemd-timesyncd"
                .into()
        }
    }
}

#[cfg(target_os = "linux")]
fn ask() -> std::io::Result<Clock> {
    // SAFETY: all zeros is a value of this C structure; with no mode set nothing is changed, and
    // the kernel only writes into it.
    let (state, timex) = unsafe {
        let mut timex: libc::timex = std::mem::zeroed();
        (libc::adjtimex(&raw mut timex), timex)
    };
    if state < 0 {
        return Err(std::io::Error::last_os_error());
    }
    let free = state == libc::TIME_ERROR || timex.status & libc::STA_UNSYNC != 0;
    let within_secs = timex.maxerror as f64 * 1e-6;
    Ok(if free { Clock::Free } else { Clock::Synchronised { within_secs } })
}

#[cfg(not(target_os = "linux"))]
fn ask() -> std::io::Result<Clock> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsynchronised_clock_is_reported_with_a_hint() {
        assert!(describe(Clock::Free).contains("start chrony"));
        let kept = describe(Clock::Synchronised { within_secs: 0.012_3 });
        assert_eq!(kept, "clock    ok    synchronised to within 12 ms");
    }
}
