//! `rcl_interfaces`: the parameters of a node, and the services that get and set them.

use super::message;

/// What is asked by name: values, types or descriptions of parameters.
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
    /// Asks a node for the values of parameters.
    GetParametersRequest = "rcl_interfaces/srv/GetParameters_Request"
);
named!(
    /// Asks a node for the types of parameters.
    GetParameterTypesRequest = "rcl_interfaces/srv/GetParameterTypes_Request"
);
named!(
    /// Asks a node to describe parameters.
    DescribeParametersRequest = "rcl_interfaces/srv/DescribeParameters_Request"
);

/// The values of parameters, in the order in which they were asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetParametersResponse {
    /// A value each; not set for a parameter that the node does not have.
    pub values: Vec<ParameterValue>,
}

message!(GetParametersResponse { values } = "rcl_interfaces/srv/GetParameters_Response");

/// The types of parameters, in the order in which they were asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetParameterTypesResponse {
    /// One of the codes of [`ParameterValue`] each.
    pub types: Vec<u8>,
}

message!(GetParameterTypesResponse { types } = "rcl_interfaces/srv/GetParameterTypes_Response");

/// What parameters are, in the order in which they were asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DescribeParametersResponse {
    /// A description each.
    pub descriptors: Vec<ParameterDescriptor>,
}

message!(
    DescribeParametersResponse { descriptors } = "rcl_interfaces/srv/DescribeParameters_Response"
);

/// Asks a node which parameters it has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersRequest {
    /// Only those that are below one of these; all where there are none.
    pub prefixes: Vec<String>,
    /// How many tokens a name may have below its prefix; 0 is any number.
    pub depth: u64,
}

message!(ListParametersRequest { prefixes, depth } = "rcl_interfaces/srv/ListParameters_Request");

/// Which parameters a node has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersResponse {
    /// Their names and prefixes.
    pub result: ListParametersResult,
}

message!(ListParametersResponse { result } = "rcl_interfaces/srv/ListParameters_Response");

/// The names of parameters, and the prefixes that they have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ListParametersResult {
    /// The full names.
    pub names: Vec<String>,
    /// What stands before the last dot of those that have one; each once.
    pub prefixes: Vec<String>,
}

message!(ListParametersResult { names, prefixes } = "rcl_interfaces/msg/ListParametersResult");

/// Asks a node to set parameters, each for itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersRequest {
    /// Their new values.
    pub parameters: Vec<Parameter>,
}

message!(SetParametersRequest { parameters } = "rcl_interfaces/srv/SetParameters_Request");

/// Whether each parameter was set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersResponse {
    /// A result for each.
    pub results: Vec<SetParametersResult>,
}

message!(SetParametersResponse { results } = "rcl_interfaces/srv/SetParameters_Response");

/// Asks a node to set parameters, all or none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersAtomicallyRequest {
    /// Their new values.
    pub parameters: Vec<Parameter>,
}

message!(
    SetParametersAtomicallyRequest { parameters } =
        "rcl_interfaces/srv/SetParametersAtomically_Request"
);

/// Whether all of them were set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersAtomicallyResponse {
    /// One result for all.
    pub result: SetParametersResult,
}

message!(
    SetParametersAtomicallyResponse { result } =
        "rcl_interfaces/srv/SetParametersAtomically_Response"
);

/// Whether a parameter was set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetParametersResult {
    /// Whether it was.
    pub successful: bool,
    /// Why not.
    pub reason: String,
}

message!(SetParametersResult { successful, reason } = "rcl_interfaces/msg/SetParametersResult");

/// A parameter of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: ParameterValue,
}

message!(Parameter { name, value } = "rcl_interfaces/msg/Parameter");

/// What a parameter is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterDescriptor {
    /// Its name.
    pub name: String,
    /// One of the codes of [`ParameterValue`].
    pub r#type: u8,
    /// A sentence for people.
    pub description: String,
    /// What its value must meet besides the ranges, in words.
    pub additional_constraints: String,
    /// Whether it can't be set while the node runs.
    pub read_only: bool,
    /// Whether its type may change.
    pub dynamic_typing: bool,
    /// The range of a number; at most one.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// The range of a whole number; at most one.
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

/// The range of a parameter that is a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FloatingPointRange {
    /// The least.
    pub from_value: f64,
    /// The greatest.
    pub to_value: f64,
    /// The step between; 0 for any number.
    pub step: f64,
}

message!(
    FloatingPointRange { from_value, to_value, step } = "rcl_interfaces/msg/FloatingPointRange"
);

/// The range of a parameter that is a whole number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntegerRange {
    /// The least.
    pub from_value: i64,
    /// The greatest.
    pub to_value: i64,
    /// The step between; 0 for any number.
    pub step: u64,
}

message!(IntegerRange { from_value, to_value, step } = "rcl_interfaces/msg/IntegerRange");

/// The value of a parameter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterValue {
    /// One of the codes below: which of the fields holds it.
    pub r#type: u8,
    /// The value of [`ParameterValue::BOOL`].
    pub bool_value: bool,
    /// That of type 2.
    pub integer_value: i64,
    /// That of type 3.
    pub double_value: f64,
    /// That of type 4.
    pub string_value: String,
    /// That of type 5.
    pub byte_array_value: Vec<u8>,
    /// That of type 6.
    pub bool_array_value: Vec<bool>,
    /// That of type 7.
    pub integer_array_value: Vec<i64>,
    /// That of type 8.
    pub double_array_value: Vec<f64>,
    /// That of type 9.
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
    /// The type of one that is true or false.
    pub const BOOL: u8 = 1;

    /// The value of a parameter that is true or false.
    pub fn bool(value: bool) -> ParameterValue {
        ParameterValue { r#type: ParameterValue::BOOL, bool_value: value, ..Default::default() }
    }
}
