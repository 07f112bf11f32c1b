use super::DefinitionError;
use super::declaration::{Declaration, Item, is_name};

/// The full name of a message type that is written `Type`, `package/Type` or `package/msg/Type`;
/// `None` when it is no such name. `package` is that of the type in which it is written.
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

/// The full name of a type that is asked for.
pub(super) fn checked_name(type_name: &str) -> Result<String, DefinitionError> {
    full_name(type_name, "").ok_or_else(|| DefinitionError::Name(type_name.to_owned()))
}

/// The package of a type's full name.
pub(super) fn package_of(full_name: &str) -> &str {
    full_name.split('/').next().unwrap_or_default()
}

/// How rosbag2 writes the name of a type: `package/Type`.
pub(super) fn short_name(full_name: &str) -> String {
    full_name.replace("/msg/", "/")
}

/// The full names of the types that the `.msg` text of the type `within` names.
pub(super) fn referenced(text: &str, within: &str) -> impl Iterator<Item = String> {
    let named = text.lines().filter_map(|line| match Declaration::read(line).ok()??.item {
        Item::Named(written) => Some(written),
        Item::Plain(_) => None,
    });
    let package = package_of(within);
    named.filter_map(move |written| full_name(written, package))
}
