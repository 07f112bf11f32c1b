use super::DefinitionError;
use super::declaration::{Declaration, Item, is_name};

/// The full name of a message type written as `Type`, `package/Type` or `package/msg/Type`; `None` if it is
/// not a valid name. `package` is that of the referring type.
pub(super) fn full_name(written: &str, package: &str) -> Option<String> {
    let parts: Vec<&str> = written.split('/').collect();
    let (package, folder, name) = match parts[..] {
        [name] => (package, "msg", name),
        [package, name] => (package, "msg", name),
        [package, folder @ ("msg" | "srv" | "action"), name] => (package, folder, name),
        _ => return None,
    };
    (is_name(package) && is_name(name)).then(|| format!("{package}/{folder}/{name}"))
}

/// The full name of a requested type.
pub(super) fn checked_name(type_name: &str) -> Result<String, DefinitionError> {
    full_name(type_name, "").ok_or_else(|| DefinitionError::Name(type_name.to_owned()))
}

/// The package of a type's full name.
pub(super) fn package_of(full_name: &str) -> &str {
    full_name.split('/').next().unwrap_or_default()
}

/// The name of a type in rosbag2's format: `package/Type`.
pub(super) fn short_name(full_name: &str) -> String {
    full_name.replace("/msg/", "/")
}

/// The full names of the types referred to in the `.msg` text of the type `within`.
pub(super) fn referenced(text: &str, within: &str) -> impl Iterator<Item = String> {
    let named = text.lines().filter_map(|line| match Declaration::read(line).ok()??.item {
        Item::Named(written) => Some(written),
        Item::Plain(_) => None,
    });
    let package = package_of(within);
    named.filter_map(move |written| full_name(written, package))
}
