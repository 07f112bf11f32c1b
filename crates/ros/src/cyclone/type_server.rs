//! Provides the definitions of our types, like every ROS 2 node.

use teampulse_messages::catalogue;
use teampulse_messages::definition::Definition;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::type_description_interfaces::{
    GetTypeDescriptionRequest as Request, GetTypeDescriptionResponse as Response,
};

use super::domain::Participant;
use super::names;
use super::server::Server;
use super::service::Service;
use crate::definitions;

/// The service `get_type_description` of our node.
pub(super) struct TypeServer {
    _server: Server,
}

impl TypeServer {
    /// Starts to answer requests for this node.
    pub(super) fn open(participant: &Participant, node: &str) -> Result<TypeServer, String> {
        let service = Service::get_type_description(node);
        let answer = |request: &[u8]| Some(answer(&Request::decode(request).ok()?).encode());
        let server = Server::open(participant, &service, (Request::NAME, Response::NAME), answer)?;
        Ok(TypeServer { _server: server })
    }
}

/// The user data with the type hash of a shipped type.
pub(super) fn shipped_hash(type_name: &str) -> String {
    names::user_data(catalogue::shipped(type_name).as_ref().map_or("", |schema| &schema.hash))
}

fn answer(request: &Request) -> Response {
    let refuse = |failure_reason| Response { failure_reason, ..Response::default() };
    let Some(schema) = catalogue::shipped(&request.type_name) else {
        return refuse(format!("{} is not known here", request.type_name));
    };
    if !request.type_hash.is_empty() && request.type_hash != schema.hash {
        return refuse(format!("{} has a different hash here: {}", schema.name, schema.hash));
    }
    let definition = match Definition::of(&schema) {
        Ok(definition) => definition,
        Err(error) => return refuse(format!("failed to {error}")),
    };
    let sources =
        if request.include_type_sources { definitions::sources(&schema) } else { Vec::new() };
    Response {
        successful: true,
        type_description: definition.type_description(),
        type_sources: sources,
        ..Response::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(type_name: &str, type_hash: &str) -> Response {
        let (type_name, type_hash) = (type_name.to_owned(), type_hash.to_owned());
        answer(&Request { type_name, type_hash, include_type_sources: true })
    }

    #[test]
    fn a_shipped_type_is_reported_with_all_that_it_is_made_of() {
        let hash = catalogue::shipped("nav_msgs/msg/Odometry").unwrap().hash.clone();
        let response = ask("nav_msgs/msg/Odometry", &hash);
        assert!(response.successful, "{}", response.failure_reason);
        let described = response.type_description.referenced_type_descriptions.len();
        assert_eq!(response.type_sources.len(), described + 1);
        assert!(response.type_sources[0].raw_file_contents.contains("child_frame_id"));
    }

    #[test]
    fn what_is_not_known_is_refused_with_a_reason() {
        assert_eq!(ask("a/msg/X", "").failure_reason, "a/msg/X is not known here");
        assert!(
            ask("nav_msgs/msg/Odometry", "RIHS01_00").failure_reason.contains("a different hash")
        );
    }
}
