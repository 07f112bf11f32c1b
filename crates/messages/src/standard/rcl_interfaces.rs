//! `rcl_interfaces`: the parameters of a node, and the services that get and set them.

use super::message;

/// Defines requests with the names of parameters.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident = $ros_name:literal) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $name {
            /// The names of the parameters.
            pub names: Vec<String>,
        }

        message!($name { names } = $ros_name);
    };
}

named!(
    /// Requests the values of parameters.
    GetParametersRequest = "rcl_interfaces/srv/GetParameters_Request"
);
named!(
    /// Requests the types of parameters.
    GetParameterTypesRequest = "rcl_interfaces/srv/GetParameterTypes_Request"
);
named!(
    /// Requests the descriptions of parameters.
    DescribeParametersRequest = "rcl_interfaces/srv/DescribeParameters_Request"
);

/// The values of parameters, in the order of the request.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetParametersResponse {
    /// The values; not set for a parameter that the node does not have.
    pub values: Vec<ParameterValue>,
}

message!(GetParametersResponse { values } = "rcl_interfaces/srv/GetParameters_Response");

/// The types of parameters, in the order of the request.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetParameterTypesResponse {
    /// The types, as codes of [`ParameterValue`].
    pub types: Vec<u8>,
}

message!(GetParameterTypesResponse { types } = "rcl_interfaces/srv/GetParameterTypes_Response");

/// The descriptions of parameters, in the order of the request.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DescribeParametersResponse {
    /// The descriptions.
    pub descriptors: Vec<ParameterDescriptor>,
}

message!(
    DescribeParametersResponse { descriptors } = "rcl_interfaces/srv/DescribeParameters_Response"
);

/// Requests the names of a node's parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersRequest {
    /// The prefixes of the parameters to list; all parameters if empty.
    pub prefixes: Vec<String>,
    /// The maximum number of tokens after the prefix; 0 for no limit.
    pub depth: u64,
}

message!(ListParametersRequest { prefixes, depth } = "rcl_interfaces/srv/ListParameters_Request");

/// The names of a node's parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersResponse {
    /// The names and prefixes of the parameters.
    pub result: ListParametersResult,
}

message!(ListParametersResponse { result } = "rcl_interfaces/srv/ListParameters_Response");

/// The names of parameters, and their prefixes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersResult {
    /// The full names.
    pub names: Vec<String>,
    /// The prefix of each name with a dot, up to the last dot; each once.
    pub prefixes: Vec<String>,
}

message!(ListParametersResult { names, prefixes } = "rcl_interfaces/msg/ListParametersResult");

/// Sets parameters independently of each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersRequest {
    /// The parameters, with their new values.
    pub parameters: Vec<Parameter>,
}

message!(SetParametersRequest { parameters } = "rcl_interfaces/srv/SetParameters_Request");

/// The results of setting parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersResponse {
    /// The result for each parameter.
    pub results: Vec<SetParametersResult>,
}

message!(SetParametersResponse { results } = "rcl_interfaces/srv/SetParameters_Response");

/// Sets parameters atomically: all or none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersAtomicallyRequest {
    /// The parameters, with their new values.
    pub parameters: Vec<Parameter>,
}

message!(
    SetParametersAtomicallyRequest { parameters } =
        "rcl_interfaces/srv/SetParametersAtomically_Request"
);

/// The result of setting parameters atomically.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersAtomicallyResponse {
    /// The result for all parameters.
    pub result: SetParametersResult,
}

message!(
    SetParametersAtomicallyResponse { result } =
        "rcl_interfaces/srv/SetParametersAtomically_Response"
);

/// The result of setting a parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersResult {
    /// Whether the parameter was set.
    pub successful: bool,
    /// The reason if it was not set.
    pub reason: String,
}

message!(SetParametersResult { successful, reason } = "rcl_interfaces/msg/SetParametersResult");

/// A parameter of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameter {
    /// The name of the parameter.
    pub name: String,
    /// The value of the parameter.
    pub value: ParameterValue,
}

message!(Parameter { name, value } = "rcl_interfaces/msg/Parameter");

/// The description of a parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterDescriptor {
    /// The name of the parameter.
    pub name: String,
    /// The type, as a code of [`ParameterValue`].
    pub r#type: u8,
    /// A human-readable description.
    pub description: String,
    /// Constraints other than the ranges, in words.
    pub additional_constraints: String,
    /// Whether the parameter can't be changed while the node runs.
    pub read_only: bool,
    /// Whether the type of the parameter may change.
    pub dynamic_typing: bool,
    /// The range of a floating-point parameter; at most one.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// The range of an integer parameter; at most one.
    pub integer_range: Vec<IntegerRange>,
}

message!(
    ParameterDescriptor {
        name,
        r#type,
        description,
        additional_constraints,
        read_only,
        dynamic_typing,
        floating_point_range,
        integer_range,
    } = "rcl_interfaces/msg/ParameterDescriptor"
);

/// The range of a floating-point parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FloatingPointRange {
    /// The lower bound.
    pub from_value: f64,
    /// The upper bound.
    pub to_value: f64,
    /// The step size; 0 for no restriction.
    pub step: f64,
}

message!(
    FloatingPointRange { from_value, to_value, step } = "rcl_interfaces/msg/FloatingPointRange"
);

/// The range of an integer parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntegerRange {
    /// The lower bound.
    pub from_value: i64,
    /// The upper bound.
    pub to_value: i64,
    /// The step size; 0 for no restriction.
    pub step: u64,
}

message!(IntegerRange { from_value, to_value, step } = "rcl_interfaces/msg/IntegerRange");

/// The value of a parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterValue {
    /// The type, as one of the codes below, which determines the field with the value.
    pub r#type: u8,
    /// The value of a parameter of type [`ParameterValue::BOOL`].
    pub bool_value: bool,
    /// The value of a parameter of type 2.
    pub integer_value: i64,
    /// The value of a parameter of type 3.
    pub double_value: f64,
    /// The value of a parameter of type 4.
    pub string_value: String,
    /// The value of a parameter of type 5.
    pub byte_array_value: Vec<u8>,
    /// The value of a parameter of type 6.
    pub bool_array_value: Vec<bool>,
    /// The value of a parameter of type 7.
    pub integer_array_value: Vec<i64>,
    /// The value of a parameter of type 8.
    pub double_array_value: Vec<f64>,
    /// The value of a parameter of type 9.
    pub string_array_value: Vec<String>,
}

message!(
    ParameterValue {
        r#type,
        bool_value,
        integer_value,
        double_value,
        string_value,
        byte_array_value,
        bool_array_value,
        integer_array_value,
        double_array_value,
        string_array_value,
    } = "rcl_interfaces/msg/ParameterValue"
);

impl ParameterValue {
    /// The type of a parameter that has no value, or that the node does not have.
    pub const NOT_SET: u8 = 0;
    /// The type of a boolean parameter.
    pub const BOOL: u8 = 1;

    /// The value of a boolean parameter.
    pub fn bool(value: bool) -> ParameterValue {
        ParameterValue { r#type: ParameterValue::BOOL, bool_value: value, ..Default::default() }
    }
}
