//! Finds the streams of Lab Streaming Layer that the study reads, and checks whether streams of other computers can be
//! found at all.

use std::time::Duration;

use teampulse_core::counted::counted;
use teampulse_sources::lsl::{FoundStream, Lsl, MulticastError, comes_back, resolve};

use crate::failure::Failure;
use crate::output;
use crate::required::no_lsl;
use crate::study::Study;

/// How long the senders have to reply.
const PATIENCE: Duration = Duration::from_millis(1500);

/// How a study uses LSL.
#[derive(Debug, Default)]
pub struct Wanted {
    sources: Vec<Lsl>,
    has_outlets: bool,
}

/// The results of a search: lines to print, and the requested streams that no sender offers.
#[derive(Debug, Default, PartialEq, Eq)]
struct Findings {
    lines: Vec<String>,
    missing: Vec<String>,
}

impl Wanted {
    /// Reads from a study which streams it reads from LSL, and whether it offers any.
    pub fn of(study: &Study) -> Result<Wanted, Failure> {
        let has_outlets = study.kinds("sinks").iter().any(|kind| kind == "lsl");
        Ok(Wanted { sources: study.settings_of("sources", "lsl")?, has_outlets })
    }

    /// Searches for the requested streams and prints what was found; returns the missing streams.
    pub async fn look(&self) -> Vec<String> {
        let Findings { lines, missing } = self.findings().await;
        output::lines(lines);
        missing
    }

    async fn findings(&self) -> Findings {
        let mut findings = Findings::default();
        if self.sources.is_empty() && !self.has_outlets {
            return findings;
        }
        for lsl in &self.sources {
            // An invalid query was already rejected when the source was built.
            let Ok(query) = lsl.query() else { continue };
            match resolve(&query, &lsl.peers, PATIENCE).await {
                Ok(found) => take(&mut findings, lsl, &query, &found),
                Err(error) => {
                    findings.missing.push(format!("LSL: failed to search for streams: {error}"));
                }
            }
        }
        findings.lines.extend(comes_back().await.err().map(|error| unreached(&error)));
        findings
    }
}

fn take(findings: &mut Findings, lsl: &Lsl, query: &str, found: &[FoundStream]) {
    let (read, own): (Vec<_>, Vec<_>) = found.iter().partition(|found| lsl.reads(&found.info));
    let line = |found: &FoundStream| {
        let info = &found.info;
        let rate =
            if info.rate_hz > 0.0 { format!("{} Hz", info.rate_hz) } else { "irregular".into() };
        let line =
            format!("lsl      ok    {} ({}) {rate} on {}", info.name, info.kind, info.hostname);
        // Names come from the network.
        teampulse_core::text::on_one_line(&line).into_owned()
    };
    findings.lines.extend(read.iter().copied().map(line));
    findings.lines.extend(own.first().map(|found| {
        format!(
            "note     LSL: {} with {query} from teampulse itself: read only if selected by name or source_id, such as name = \"{}\"",
            counted(own.len(), "stream", "streams"),
            found.info.name
        )
    }));
    if read.is_empty() {
        findings.missing.push(no_lsl(query));
    }
}

fn unreached(error: &MulticastError) -> String {
    format!(
        "note     LSL: failed to {error}; streams of other computers are not found: {}",
        error.hint()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_study_without_lsl_is_not_asked_about_it() {
        assert_eq!(Wanted::default().findings().await, Findings::default());
    }

    #[test]
    fn a_firewall_is_named_with_the_remedy() {
        let line = unreached(&MulticastError::Swallowed);
        assert!(line.contains("a firewall drops it"), "{line}");
        assert!(line.contains("sudo ufw allow 16571:16603/udp"), "{line}");
    }

    #[test]
    fn a_stream_that_nobody_sends_is_missing() {
        let mut findings = Findings::default();
        take(&mut findings, &Lsl::default(), "type='EEG'", &[]);
        assert_eq!(findings.missing, ["an LSL stream with type='EEG'"]);
    }
}
