//! The configuration of Cyclone DDS: what ROS 2's variables mean, room for images, and what the
//! user adds.

use crate::environment::Environment;
use crate::receiving::BUFFER_BYTES;

/// How far discovery reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Range {
    /// As the library's own configuration says.
    SystemDefault,
    /// The local network.
    Subnet,
    /// This machine.
    Localhost,
    /// Nowhere.
    Off,
}

/// How many messages of a reliable publisher are kept that came behind one that is missing, until
/// that is sent again: several times what publishers remember. The library's own 128 are 13 ms at
/// 10,000 messages a second; what comes behind them is thrown away and must be sent again, too, so
/// that one lost packet in a thousand takes a tenth of all messages.
const KEPT_BEHIND_A_GAP: u32 = 4096;
/// After how long what is missing is asked for again [ms]: publishers may remember no more than the
/// last 100 ms, which is how long the library waits by itself, and each time no more than 256 messages
/// are asked for.
const ASKED_AGAIN_MS: u32 = 20;
/// How many participants on one machine find each other without multicast, as in
/// `rmw_cyclonedds`.
const PARTICIPANTS: u32 = 32;

/// The configuration for an environment, to be given to
/// [`Participation`](super::Participation): as `rmw_cyclonedds` would write it, with larger
/// receive buffers and a thread for each socket (which saves a system call for every packet), and `CYCLONEDDS_URI` behind, so that it has the last word.
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
    /// As `rcl` reads it: `ROS_LOCALHOST_ONLY` still counts when it is on, and what is not
    /// understood is kept on this machine.
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

/// The peers that are asked without multicast.
fn peers(environment: &Environment) -> String {
    let named = environment.static_peers.split(';').map(str::trim);
    let named = named.filter(|peer| !peer.is_empty() && environment.localhost_only != "1");
    // Asked on the whole network too: who stays on this machine is not found by multicast.
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
