use std::fs;
use std::path::PathBuf;

/// The text of a type in an installed ROS: `share/<package>/msg/<Type>.msg` below one of the
/// prefixes.
pub(crate) fn installed(prefixes: &[PathBuf], type_name: &str) -> Option<String> {
    let parts: Vec<&str> = type_name.split('/').collect();
    let [package, "msg", name] = parts[..] else { return None };
    // The name comes from the network: it must not lead to any other path.
    let is_plain =
        |part: &str| part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    if !is_plain(package) || !is_plain(name) {
        return None;
    }
    let file = |prefix: &PathBuf| {
        prefix.join("share").join(package).join("msg").join(name).with_extension("msg")
    };
    prefixes.iter().find_map(|prefix| fs::read_to_string(file(prefix)).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_is_found_below_any_prefix_and_nowhere_else() {
        let (empty, full) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let folder = full.path().join("share/a/msg");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("X.msg"), "uint8 x").unwrap();
        let prefixes = [empty.path().to_owned(), full.path().to_owned()];
        assert_eq!(installed(&prefixes, "a/msg/X").as_deref(), Some("uint8 x"));
        for name in ["a/msg/Y", "a/srv/X", "../a/msg/X", "a/msg/../msg/X", "", "a/msg/"] {
            assert_eq!(installed(&prefixes, name), None, "{name}");
        }
    }
}
