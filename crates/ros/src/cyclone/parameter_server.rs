//! The parameters of our node, with the services that every ROS 2 node offers.

use std::sync::Arc;

use bytes::Bytes;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, ListParametersResult, Parameter, ParameterDescriptor, ParameterValue,
    SetParametersAtomicallyRequest, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse, SetParametersResult,
};

use super::domain::Participant;
use super::server::Server;
use super::service::Service;

/// The parameter services of our node, offered until this value is dropped.
pub(super) struct ParameterServer {
    _servers: Vec<Server>,
}

/// Returns whether our node uses `/clock`.
pub(super) type FollowsClock = Arc<dyn Fn() -> bool + Send + Sync>;

/// A parameter of our node, which every ROS 2 node has. No parameter can be set, as a session is configured by its
/// study.
struct Known {
    name: &'static str,
    description: &'static str,
    value: fn(&FollowsClock) -> bool,
}

/// The known parameters, in alphabetical order.
const PARAMETERS: [Known; 2] = [
    Known {
        name: "start_type_description_service",
        description: "Whether the service ~/get_type_description is available",
        value: |_| true,
    },
    Known {
        name: "use_sim_time",
        description: "Whether time is taken from /clock",
        value: |follows_clock| follows_clock(),
    },
];

impl ParameterServer {
    /// Starts the services of this node.
    pub(super) fn open(
        participant: &Participant,
        node: &str,
        follows_clock: &FollowsClock,
    ) -> Result<ParameterServer, String> {
        let clock = || Arc::clone(follows_clock);
        let offer = Offer { participant, node };
        let (values, types) = (clock(), clock());
        let servers = vec![
            offer.open("describe_parameters", describe)?,
            offer.open("get_parameter_types", move |request| type_codes(&types, request))?,
            offer.open("get_parameters", move |request| get(&values, request))?,
            offer.open("list_parameters", list)?,
            offer.open("set_parameters", set)?,
            offer.open("set_parameters_atomically", set_all)?,
        ];
        Ok(ParameterServer { _servers: servers })
    }
}

/// The context in which services are offered.
struct Offer<'a> {
    participant: &'a Participant,
    node: &'a str,
}

impl Offer<'_> {
    fn open<Request: Message, Response: Message>(
        &self,
        name: &str,
        answer: impl Fn(&Request) -> Response + Send + Sync + 'static,
    ) -> Result<Server, String> {
        let service = Service::named(&format!("{}/{name}", self.node));
        let answer = move |request: &[u8]| -> Option<Bytes> {
            Some(answer(&Request::decode(request).ok()?).encode())
        };
        Server::open(self.participant, &service, (Request::NAME, Response::NAME), answer)
    }
}

fn find(name: &str) -> Option<&'static Known> {
    PARAMETERS.iter().find(|known| known.name == name)
}

fn get(follows_clock: &FollowsClock, request: &GetParametersRequest) -> GetParametersResponse {
    let value = |name: &String| {
        let known = find(name).map(|known| ParameterValue::bool((known.value)(follows_clock)));
        known.unwrap_or_default()
    };
    GetParametersResponse { values: request.names.iter().map(value).collect() }
}

fn type_codes(
    follows_clock: &FollowsClock,
    request: &GetParameterTypesRequest,
) -> GetParameterTypesResponse {
    let asked = GetParametersRequest { names: request.names.clone() };
    let values = get(follows_clock, &asked).values.into_iter();
    GetParameterTypesResponse { types: values.map(|value| value.r#type).collect() }
}

/// Like rclcpp, describes unknown parameters by their name alone.
fn describe(request: &DescribeParametersRequest) -> DescribeParametersResponse {
    let descriptor = |name: &String| match find(name) {
        Some(known) => ParameterDescriptor {
            name: name.clone(),
            r#type: ParameterValue::BOOL,
            description: known.description.to_owned(),
            read_only: true,
            ..ParameterDescriptor::default()
        },
        None => ParameterDescriptor { name: name.clone(), ..ParameterDescriptor::default() },
    };
    DescribeParametersResponse { descriptors: request.names.iter().map(descriptor).collect() }
}

/// No parameter has a dot in its name, so a prefix can only match a parameter of the same name.
fn list(request: &ListParametersRequest) -> ListParametersResponse {
    let wanted = |name: &&str| {
        request.prefixes.is_empty() || request.prefixes.iter().any(|prefix| prefix == name)
    };
    let names = PARAMETERS.iter().map(|known| known.name).filter(wanted);
    let names = names.map(str::to_owned).collect();
    ListParametersResponse { result: ListParametersResult { names, prefixes: Vec::new() } }
}

fn set(request: &SetParametersRequest) -> SetParametersResponse {
    SetParametersResponse { results: request.parameters.iter().map(refuse).collect() }
}

fn set_all(request: &SetParametersAtomicallyRequest) -> SetParametersAtomicallyResponse {
    let refused = request.parameters.first().map(refuse);
    let nothing = SetParametersResult { successful: true, reason: String::new() };
    SetParametersAtomicallyResponse { result: refused.unwrap_or(nothing) }
}

/// The reason for rejecting a change of a parameter.
fn refuse(parameter: &Parameter) -> SetParametersResult {
    let Parameter { name, .. } = parameter;
    let reason = match find(name) {
        Some(_) => format!("parameter '{name}' is read-only: it is set in the study"),
        None => format!("parameter '{name}' has not been declared"),
    };
    SetParametersResult { successful: false, reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn what_every_node_has_is_listed_and_reported() {
        let follows_clock: FollowsClock = Arc::new(|| true);
        let listed = list(&ListParametersRequest::default()).result.names;
        assert_eq!(listed, ["start_type_description_service", "use_sim_time"]);
        let asked = names(&["use_sim_time", "unknown"]);
        let response = get(&follows_clock, &GetParametersRequest { names: asked.clone() });
        assert_eq!(response.values, [ParameterValue::bool(true), ParameterValue::default()]);
        let types = type_codes(&follows_clock, &GetParameterTypesRequest { names: asked.clone() });
        assert_eq!(types.types, [ParameterValue::BOOL, ParameterValue::NOT_SET]);
        let described = describe(&DescribeParametersRequest { names: asked });
        assert!(described.descriptors[0].read_only && described.descriptors[1].r#type == 0);
    }

    #[test]
    fn only_what_is_below_a_prefix_is_listed() {
        let prefixes = names(&["use_sim_time", "qos_overrides"]);
        let listed = list(&ListParametersRequest { prefixes, depth: 0 });
        assert_eq!(listed.result.names, ["use_sim_time"]);
    }

    #[test]
    fn nothing_can_be_set_and_the_reason_is_said() {
        let parameter = |name: &str| Parameter { name: name.into(), ..Parameter::default() };
        let parameters = vec![parameter("use_sim_time"), parameter("x")];
        let reasons: Vec<String> = set(&SetParametersRequest { parameters: parameters.clone() })
            .results
            .into_iter()
            .map(|result| result.reason)
            .collect();
        assert!(reasons[0].contains("read-only") && reasons[1].contains("not been declared"));
        let result = set_all(&SetParametersAtomicallyRequest { parameters }).result;
        assert!(!result.successful);
        assert!(set_all(&SetParametersAtomicallyRequest::default()).result.successful);
    }
}
