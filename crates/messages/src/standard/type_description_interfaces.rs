//! `type_description_interfaces`: how a node provides the definitions of its types.

use super::message;

/// Requests the definition of a type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetTypeDescriptionRequest {
    /// The full name: `sensor_msgs/msg/BatteryState`.
    pub type_name: String,
    /// The type hash: `RIHS01_…`.
    pub type_hash: String,
    /// Whether to include the text of the definition.
    pub include_type_sources: bool,
}

message!(
    GetTypeDescriptionRequest { type_name, type_hash, include_type_sources } =
        "type_description_interfaces/srv/GetTypeDescription_Request"
);

/// The response with the definition of a type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GetTypeDescriptionResponse {
    /// Whether the node knows the type.
    pub successful: bool,
    /// The reason if the node does not know the type.
    pub failure_reason: String,
    /// The description of the type.
    pub type_description: TypeDescription,
    /// The texts of the type and of all types that it refers to.
    pub type_sources: Vec<TypeSource>,
    /// Additional information.
    pub extra_information: Vec<KeyValue>,
}

message!(
    GetTypeDescriptionResponse {
        successful,
        failure_reason,
        type_description,
        type_sources,
        extra_information,
    } = "type_description_interfaces/srv/GetTypeDescription_Response"
);

/// A type with all types that it refers to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TypeDescription {
    /// The description of the type itself.
    pub type_description: IndividualTypeDescription,
    /// The types that the type refers to, directly or not, by name.
    pub referenced_type_descriptions: Vec<IndividualTypeDescription>,
}

message!(
    TypeDescription { type_description, referenced_type_descriptions } =
        "type_description_interfaces/msg/TypeDescription"
);

/// The description of a single type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndividualTypeDescription {
    /// The full name.
    pub type_name: String,
    /// The fields, in order.
    pub fields: Vec<Field>,
}

message!(
    IndividualTypeDescription { type_name, fields } =
        "type_description_interfaces/msg/IndividualTypeDescription"
);

/// One field of a type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Field {
    /// The name of the field.
    pub name: String,
    /// The type of the field.
    pub r#type: FieldType,
    /// The default value as text; empty for none.
    pub default_value: String,
}

message!(Field { name, r#type, default_value } = "type_description_interfaces/msg/Field");

/// The type of a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldType {
    /// The type code.
    pub type_id: u8,
    /// The length of an array, the bound of a sequence; 0 for none.
    pub capacity: u64,
    /// The bound of a string; 0 for none.
    pub string_capacity: u64,
    /// The full name of a nested message type; empty for any other.
    pub nested_type_name: String,
}

message!(
    FieldType { type_id, capacity, string_capacity, nested_type_name } =
        "type_description_interfaces/msg/FieldType"
);

/// The text of a definition.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TypeSource {
    /// The full name of the type.
    pub type_name: String,
    /// The format of the text: `msg`, `idl`.
    pub encoding: String,
    /// The text.
    pub raw_file_contents: String,
}

message!(
    TypeSource { type_name, encoding, raw_file_contents } =
        "type_description_interfaces/msg/TypeSource"
);

/// A named value, as text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyValue {
    /// The key.
    pub key: String,
    /// The value.
    pub value: String,
}

message!(KeyValue { key, value } = "type_description_interfaces/msg/KeyValue");
