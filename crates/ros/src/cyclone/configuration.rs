//! The configuration of Cyclone DDS: ROS 2's environment variables, buffers for images, and the user's
//! additions.

use crate::environment::Environment;
use crate::receiving::BUFFER_BYTES;

/// The range of discovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Range {
    /// The library's own default.
    SystemDefault,
    /// The local network.
    Subnet,
    /// Only this machine.
    Localhost,
    /// No discovery.
    Off,
}

/// The number of messages of a reliable publisher that are kept while an earlier one is retransmitted: several times
/// the usual history of publishers. The library's default of 128 is 13 ms at 10,000 messages a second; later messages
/// are discarded and must be retransmitted, too, so that one lost packet in a thousand costs a tenth of all messages.
const KEPT_BEHIND_A_GAP: u32 = 4096;
/// The delay after which a missing message is requested again [ms]. The library's default is 100 ms, but publishers may
/// keep only the last 100 ms, and each request covers at most 256 messages.
const ASKED_AGAIN_MS: u32 = 20;
/// The most participants on one machine that find each other without multicast, as in `rmw_cyclonedds`.
const PARTICIPANTS: u32 = 32;

/// Returns the configuration for an environment, for [`Participation`](super::Participation): like that of
/// `rmw_cyclonedds`, with larger receive buffers and a thread for each socket (which saves a system call per packet),
/// followed by `CYCLONEDDS_URI`, which takes precedence.
pub fn configuration(environment: &Environment) -> String {
    let range = Range::of(environment);
    let multicast = match range {
        Range::Localhost | Range::Off => {
            "<General><AllowMulticast>false</AllowMulticast></General>"
        }
        Range::SystemDefault | Range::Subnet => "",
    };
    let discovery = match range {
        Range::SystemDefault => String::new(),
        Range::Subnet | Range::Localhost => format!(
            "<Discovery><ParticipantIndex>auto</ParticipantIndex>\
             <MaxAutoParticipantIndex>{PARTICIPANTS}</MaxAutoParticipantIndex>{}</Discovery>",
            peers(environment)
        ),
        Range::Off => format!(
            "<Discovery><ParticipantIndex>none</ParticipantIndex>\
             <Tag>ros_discovery_off_{}</Tag></Discovery>",
            environment.process_id
        ),
    };
    format!(
        "<CycloneDDS><Domain>{multicast}{discovery}<Internal>\
         <SocketReceiveBufferSize max=\"{BUFFER_BYTES}B\"/>\
         <PrimaryReorderMaxSamples>{KEPT_BEHIND_A_GAP}</PrimaryReorderMaxSamples>\
         <SecondaryReorderMaxSamples>{KEPT_BEHIND_A_GAP}</SecondaryReorderMaxSamples>\
         <NackDelay>{ASKED_AGAIN_MS}ms</NackDelay>\
         <MultipleReceiveThreads>true</MultipleReceiveThreads></Internal></Domain></CycloneDDS>,{}",
        environment.cyclonedds_uri
    )
}

impl Range {
    /// Follows `rcl`: `ROS_LOCALHOST_ONLY` is still respected when set, and unknown values restrict
    /// discovery to this machine.
    fn of(environment: &Environment) -> Range {
        if environment.localhost_only == "1" {
            return Range::Localhost;
        }
        match environment.discovery_range.as_str() {
            "" | "SUBNET" => Range::Subnet,
            "SYSTEM_DEFAULT" => Range::SystemDefault,
            "OFF" => Range::Off,
            _ => Range::Localhost,
        }
    }
}

/// The peers that are contacted without multicast.
fn peers(environment: &Environment) -> String {
    let named = environment.static_peers.split(';').map(str::trim);
    let named = named.filter(|peer| !peer.is_empty() && environment.localhost_only != "1");
    // Localhost is also needed on a subnet: participants limited to this machine are not found by
    // multicast.
    let peers: Vec<String> = std::iter::once("localhost")
        .chain(named)
        .map(|peer| format!("<Peer address=\"{}\"/>", escaped(peer)))
        .collect();
    format!("<Peers>{}</Peers>", peers.concat())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(change: impl FnOnce(&mut Environment)) -> String {
        let mut environment = Environment { process_id: 7, ..Environment::default() };
        change(&mut environment);
        configuration(&environment)
    }

    #[test]
    fn without_an_environment_the_local_network_is_searched() {
        assert_eq!(
            of(|_| {}),
            "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex>\
             <MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>\
             <Peers><Peer address=\"localhost\"/></Peers></Discovery><Internal>\
             <SocketReceiveBufferSize max=\"33554432B\"/>\
             <PrimaryReorderMaxSamples>4096</PrimaryReorderMaxSamples>\
             <SecondaryReorderMaxSamples>4096</SecondaryReorderMaxSamples>\
             <NackDelay>20ms</NackDelay>\
             <MultipleReceiveThreads>true</MultipleReceiveThreads></Internal></Domain></CycloneDDS>,"
        );
    }

    #[test]
    fn localhost_means_no_multicast_and_this_machine_as_a_peer() {
        let range = of(|environment| environment.discovery_range = "LOCALHOST".into());
        assert!(range.contains("<AllowMulticast>false"));
        assert!(range.contains("<Peers><Peer address=\"localhost\"/></Peers>"));
        assert_eq!(range, of(|environment| environment.localhost_only = "1".into()));
        assert_eq!(range, of(|environment| environment.discovery_range = "unheard_of".into()));
    }

    #[test]
    fn static_peers_are_asked_unless_discovery_is_off() {
        let peers = "192.168.0.7; robot1;";
        let asked = "<Peer address=\"192.168.0.7\"/><Peer address=\"robot1\"/>";
        let with = |range: &str| {
            of(|environment| {
                environment.static_peers = peers.into();
                environment.discovery_range = range.into();
            })
        };
        assert!(with("SUBNET").contains(asked) && with("LOCALHOST").contains(asked));
        assert!(!with("OFF").contains("Peer ") && !with("SYSTEM_DEFAULT").contains("Peer "));
        assert!(with("OFF").contains("<Tag>ros_discovery_off_7</Tag>"));
    }

    #[test]
    fn a_peer_cannot_write_configuration() {
        let peer = of(|environment| environment.static_peers = "\"/><X a=\"&".into());
        assert!(peer.contains("<Peer address=\"&quot;/>&lt;X a=&quot;&amp;\"/>"));
    }

    #[test]
    fn the_user_has_the_last_word() {
        let uri = "file:///etc/cyclone.xml";
        assert!(
            of(|environment| environment.cyclonedds_uri = uri.into()).ends_with(&format!(",{uri}"))
        );
    }
}
