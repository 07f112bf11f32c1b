//! Commands that other programs send on ROS.

use std::sync::Arc;

use async_trait::async_trait;
use teampulse_core::command::{Command, Sender};
use teampulse_core::outlet::Outlet;
use teampulse_core::qos::Qos;
use teampulse_core::source::{Source, SourceError};
use teampulse_core::text::{LONGEST_LABEL, label};
use teampulse_messages::cdr::Reader;
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError};
use teampulse_ros::graph::{Gid, Graph};

use super::events::Refusals;

/// The topic on which nodes may send commands, if allowed.
pub(super) const COMMANDS: &str = "/session/commands";
const STRING: &str = "std_msgs/msg/String";
/// The queue size of the subscription to commands.
const DEPTH: u32 = 100;
/// The longest message that is read as a command [bytes].
const LARGEST_BYTES: usize = 4096;

/// Commands from ROS nodes: a `std_msgs/String` with the text of a [`Command`] on `/session/commands`.
///
/// Whether they are carried out is up to `[commands]` in the study; by default they are refused.
pub struct RosCommands {
    bus: Arc<dyn Bus>,
}

impl RosCommands {
    /// Creates the source of commands from a bus.
    pub fn new(bus: Arc<dyn Bus>) -> RosCommands {
        RosCommands { bus }
    }

    /// Returns the node that published a message, by its name on the bus.
    fn sender(graph: &Graph, publisher: Gid) -> Sender {
        let known = graph.publishers(COMMANDS).find(|endpoint| endpoint.gid == publisher);
        let node = known.and_then(|endpoint| endpoint.node.clone());
        let node = node.unwrap_or_else(|| graph.computer(publisher));
        Sender::ros(&label(node, LONGEST_LABEL))
    }
}

#[async_trait]
impl Source for RosCommands {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let (to, graph) = (outlet.clone(), self.bus.graph());
        let refusals = Refusals::new(COMMANDS, "the command is not carried out");
        let deliver = Arc::new(move |arrival: Arrival| match read(&arrival.bytes) {
            // The session reports a command that is not allowed as an event.
            Ok(command) => {
                let sender = RosCommands::sender(&graph.borrow(), arrival.publisher);
                drop(to.command(&sender, command));
            }
            Err(reason) => refusals.report(&to, &reason),
        });
        let gone =
            |error: BusError| SourceError::Gone { message: error.to_string(), hint: String::new() };
        // A command is sent only once, so it must not be lost: the subscription's QoS never changes.
        let asked = Asked::Exactly(Qos::reliable(DEPTH));
        let _commands = self.bus.subscribe(COMMANDS, STRING, asked, deliver).map_err(gone)?;
        outlet.closed().await;
        Ok(())
    }
}

/// Reads a command; an error fits after "failed to".
fn read(cdr: &[u8]) -> Result<Command, String> {
    if cdr.len() > LARGEST_BYTES {
        return Err(format!("read a command of {} bytes: expected a few words", cdr.len()));
    }
    let text = Reader::new(cdr).and_then(|mut text| text.read::<String>());
    let text = text.map_err(|error| format!("read a command: {error}"))?;
    let command: Result<Command, _> = label(text, LARGEST_BYTES).parse();
    command.map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_a_text_and_anything_else_is_refused_with_a_reason() {
        assert_eq!(read(b"\0\x01\0\0\x05\0\0\0stop\0"), Ok(Command::Stop));
        assert!(read(b"\0\x01\0\0\x05\0\0\0halt\0").unwrap_err().contains("halt"));
        assert!(read(&[0xff; 9]).is_err());
        assert!(read(&[0; 5000]).unwrap_err().contains("5000 bytes"));
    }
}
