use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::Access;
use teampulse_devices::inputs::Kind;
use teampulse_devices::inputs::evdev::Abilities;

/// A keyboard, mouse or gamepad connected to this computer, as the kernel describes it; no input is read from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundInput {
    /// The device node, such as `/dev/input/event3`.
    pub path: PathBuf,
    /// The name given by its manufacturer.
    pub name: String,
    /// The kinds of device that it is.
    pub kinds: Vec<Kind>,
    /// Whether this user may read it.
    pub is_permitted: bool,
}

impl FoundInput {
    /// Returns this computer's input devices, in the order of their node names.
    pub fn all() -> Vec<FoundInput> {
        FoundInput::below(Path::new("/"))
    }

    /// Returns the devices in a tree with `sys` and `dev`.
    pub(super) fn below(root: &Path) -> Vec<FoundInput> {
        let Ok(entries) = fs::read_dir(root.join("sys/class/input")) else { return Vec::new() };
        let mut names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
        names.sort();
        let names = names.iter().filter_map(|name| name.to_str());
        names.filter(|name| name.starts_with("event")).filter_map(|name| of(root, name)).collect()
    }

    /// Whether one of these texts is part of the device's name or of one of its paths; always true if there are no
    /// texts.
    pub(super) fn is_chosen(&self, texts: &[String]) -> bool {
        texts.is_empty()
            || is_named(&self.name, texts)
            || paths_of(&self.path).iter().any(|path| is_named(&path.to_string_lossy(), texts))
    }
}

/// Whether one of these texts is part of a name, ignoring case.
pub(super) fn is_named(name: &str, texts: &[String]) -> bool {
    let name = name.to_lowercase();
    texts.iter().any(|text| name.contains(&text.to_lowercase()))
}

fn of(root: &Path, event: &str) -> Option<FoundInput> {
    let device = root.join("sys/class/input").join(event).join("device");
    let bits = |file| bits_of(&fs::read_to_string(device.join("capabilities").join(file)).ok()?);
    let axes = bits("abs").unwrap_or_default();
    let abilities = Abilities {
        keys: bits("key").unwrap_or_default(),
        relative: bits("rel").unwrap_or_default(),
        absolute: axes.into_iter().map(|code| (code, 0, 0)).collect(),
    };
    let kinds = abilities.kinds();
    if kinds.is_empty() {
        return None;
    }
    let name = fs::read_to_string(device.join("name")).unwrap_or_default().trim().to_owned();
    let path = root.join("dev/input").join(event);
    let is_permitted = rustix::fs::access(&path, Access::READ_OK).is_ok();
    Some(FoundInput { path, name, kinds, is_permitted })
}

/// Returns the indices of the bits set in 64-bit hexadecimal words, the last word first.
fn bits_of(text: &str) -> Option<Vec<u16>> {
    let words = text.split_whitespace().rev().map(|word| u64::from_str_radix(word, 16).ok());
    let words: Vec<u64> = words.collect::<Option<_>>()?;
    let is_set = |bit: &u16| {
        let word = words.get(usize::from(bit / 64)).copied().unwrap_or(0);
        word >> (bit % 64) & 1 == 1
    };
    Some((0..0x300).filter(is_set).collect())
}

/// Returns a device's node and its links, whose names stay the same when this or another device is plugged in
/// elsewhere.
fn paths_of(node: &Path) -> Vec<PathBuf> {
    let folder = node.parent().unwrap_or(node);
    let links =
        ["by-id", "by-path"].into_iter().filter_map(|by| fs::read_dir(folder.join(by)).ok());
    let links = links.flatten().flatten().map(|link| link.path());
    let leads_here = |link: &PathBuf| fs::canonicalize(link).is_ok_and(|to| to == node);
    links.filter(leads_here).chain([node.to_owned()]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keyboard_is_found_by_what_the_kernel_says_of_it() {
        let root = tempfile::tempdir().unwrap();
        let device = root.path().join("sys/class/input/event3/device");
        fs::create_dir_all(device.join("capabilities")).unwrap();
        fs::create_dir_all(root.path().join("dev/input/by-path")).unwrap();
        let node = root.path().join("dev/input/event3");
        fs::write(&node, "").unwrap();
        std::os::unix::fs::symlink(&node, root.path().join("dev/input/by-path/usb-2-kbd")).unwrap();
        fs::write(device.join("name"), "Example Keyboard\n").unwrap();
        let keys = "402000000 3803078f800d001 feffffdfffefffff fffffffffffffffe\n";
        fs::write(device.join("capabilities/key"), keys).unwrap();
        let found = FoundInput::below(root.path());
        let [keyboard] = &found[..] else { panic!("{found:?}") };
        assert_eq!(
            (keyboard.name.as_str(), &keyboard.kinds[..]),
            ("Example Keyboard", &[Kind::Keyboard][..])
        );
        let is_chosen = |text: &str| keyboard.is_chosen(&[text.to_owned()]);
        assert!(is_chosen("example") && is_chosen("by-path/usb-2") && is_chosen("event3"));
        assert!(!is_chosen("usb-3") && keyboard.is_chosen(&[]));
    }

    #[test]
    fn bits_are_counted_from_the_last_word() {
        assert_eq!(bits_of("1 8000000000000003\n"), Some(vec![0, 1, 63, 64]));
        assert_eq!(bits_of("x"), None);
    }
}
