use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::Access;
use teampulse_core::source::SourceError;
use v4l::capability::Flags;
use v4l::device::Device;

/// A camera connected to this computer, as the kernel describes it; it is not opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundCamera {
    /// The device node, such as `/dev/video0`.
    pub path: PathBuf,
    /// The name given by its manufacturer.
    pub name: String,
    /// A link to the camera that stays the same when it is plugged in again, such as `/dev/v4l/by-id/…`; a link by USB
    /// port if the manufacturer gave it no serial number.
    pub link: Option<PathBuf>,
    /// Whether this user may read it.
    pub is_permitted: bool,
}

impl FoundCamera {
    /// Returns this computer's cameras, in the order of their node names.
    pub fn all() -> Vec<FoundCamera> {
        FoundCamera::below(Path::new("/"))
    }

    /// Returns the cameras of a file tree with `sys` and `dev`.
    pub(super) fn below(root: &Path) -> Vec<FoundCamera> {
        let Ok(entries) = fs::read_dir(root.join("sys/class/video4linux")) else {
            return Vec::new();
        };
        let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| name.starts_with("video")).collect();
        names.sort_by_key(|name| (name.len(), name.clone()));
        names.iter().filter_map(|name| of(root, name)).collect()
    }

    /// Returns the camera whose name or path contains this text; without a text, the only camera.
    pub(super) fn chosen(text: &str) -> Result<FoundCamera, SourceError> {
        choose(&FoundCamera::all(), text)
    }

    /// The camera's identity across reconnections: its link, or else its node.
    pub(super) fn identity(&self) -> String {
        self.link.as_ref().unwrap_or(&self.path).display().to_string()
    }

    fn is_meant(&self, text: &str) -> bool {
        let is_in = |name: &str| name.to_lowercase().contains(&text.to_lowercase());
        let is_path = |path: &Path| {
            let path = path.to_string_lossy();
            // `/dev/video1` does not match `/dev/video10`.
            path == text || (!text.starts_with("/dev/video") && is_in(&path))
        };
        is_in(&self.name) || is_path(&self.path) || self.link.as_deref().is_some_and(is_path)
    }
}

fn choose(all: &[FoundCamera], text: &str) -> Result<FoundCamera, SourceError> {
    let listed = |cameras: &[FoundCamera]| {
        let each = cameras.iter().map(|each| format!("{} ({})", each.name, each.identity()));
        each.collect::<Vec<_>>().join(", ")
    };
    let mut meant = all.to_vec();
    meant.retain(|camera| text.is_empty() || camera.is_meant(text));
    match (meant.len(), all.len()) {
        (1, _) => Ok(meant.remove(0)),
        (0, 0) => Err(SourceError::Gone {
            message: "find a camera: this computer has none".to_owned(),
            hint: "plug it in; `ls /dev/video*` lists the cameras known to the kernel".to_owned(),
        }),
        (0, _) => Err(SourceError::Gone {
            message: format!("find the camera `{text}` among {}", listed(all)),
            hint: "plug it in, or set `device` to a part of one of these".to_owned(),
        }),
        _ => Err(SourceError::Fatal {
            message: format!("choose among {}", listed(&meant)),
            hint: "set `device` to a part of the name or path of one".to_owned(),
        }),
    }
}

fn of(root: &Path, node: &str) -> Option<FoundCamera> {
    let class = root.join("sys/class/video4linux").join(node);
    let path = root.join("dev").join(node);
    if !takes_pictures(&path, &class) {
        return None;
    }
    let name = fs::read_to_string(class.join("name")).unwrap_or_default().trim().to_owned();
    let link =
        ["by-id", "by-path"].iter().find_map(|by| link_to(&root.join("dev/v4l").join(by), &path));
    let is_permitted = rustix::fs::access(&path, Access::READ_OK | Access::WRITE_OK).is_ok();
    Some(FoundCamera { path, name, link, is_permitted })
}

/// Whether a node delivers pictures: USB cameras have a second node for metadata.
fn takes_pictures(path: &Path, class: &Path) -> bool {
    let capabilities = Device::with_path(path).and_then(|device| device.query_caps());
    capabilities.map_or_else(
        // Without permission to open it: the first node of a camera delivers pictures.
        |_| fs::read_to_string(class.join("index")).is_ok_and(|index| index.trim() == "0"),
        |known| known.capabilities.contains(Flags::VIDEO_CAPTURE | Flags::STREAMING),
    )
}

fn link_to(folder: &Path, node: &Path) -> Option<PathBuf> {
    let links = fs::read_dir(folder).ok()?.flatten().map(|link| link.path());
    let mut links: Vec<PathBuf> =
        links.filter(|link| fs::canonicalize(link).is_ok_and(|to| to == node)).collect();
    links.sort();
    links.into_iter().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file tree with a camera of two nodes and one of a single node.
    fn tree() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let nodes = [
            ("video0", "Desk Camera", "0"),
            ("video1", "Desk Camera", "1"),
            ("video10", "Door", "0"),
        ];
        fs::create_dir_all(root.path().join("dev/v4l/by-id")).unwrap();
        for (node, name, index) in nodes {
            let class = root.path().join("sys/class/video4linux").join(node);
            fs::create_dir_all(&class).unwrap();
            fs::write(class.join("name"), format!("{name}\n")).unwrap();
            fs::write(class.join("index"), format!("{index}\n")).unwrap();
            fs::write(root.path().join("dev").join(node), "").unwrap();
        }
        let link = root.path().join("dev/v4l/by-id/usb-desk-0123-index0");
        std::os::unix::fs::symlink(root.path().join("dev/video0"), link).unwrap();
        root
    }

    #[test]
    fn cameras_are_found_without_the_nodes_of_their_metadata() {
        let root = tree();
        let found = FoundCamera::below(root.path());
        let names: Vec<&str> = found.iter().map(|each| each.name.as_str()).collect();
        assert_eq!(names, ["Desk Camera", "Door"]);
        assert!(found[0].identity().ends_with("by-id/usb-desk-0123-index0"));
        assert!(found[1].identity().ends_with("dev/video10"));
    }

    #[test]
    fn one_is_chosen_by_a_part_of_its_name_or_of_a_path() {
        let root = tree();
        let all = || FoundCamera::below(root.path());
        let name = |text: &str| choose(&all(), text).map(|found| found.name).ok();
        assert_eq!(name("door"), Some("Door".to_owned()));
        assert_eq!(name("usb-desk-0123"), Some("Desk Camera".to_owned()));
        let message = |cameras: Vec<FoundCamera>, text: &str| match choose(&cameras, text) {
            Err(SourceError::Fatal { message, .. }) => format!("fatal: {message}"),
            Err(error) => error.to_string(),
            Ok(found) => panic!("{found:?}"),
        };
        assert!(message(all(), "").starts_with("fatal: choose among Desk Camera ("));
        assert!(message(all(), "window").starts_with("find the camera `window` among Desk"));
        assert_eq!(message(Vec::new(), ""), "find a camera: this computer has none");
    }

    #[test]
    fn a_node_is_no_part_of_another_one() {
        let camera = |node: &str| FoundCamera {
            path: format!("/dev/{node}").into(),
            name: "Camera".to_owned(),
            link: None,
            is_permitted: true,
        };
        let all = vec![camera("video1"), camera("video10")];
        assert_eq!(choose(&all, "/dev/video1").unwrap().identity(), "/dev/video1");
    }
}
