use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::Access;

/// A serial port of this computer, and what the kernel knows about the attached device. Nothing is sent to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundPort {
    /// The path to open: the name below `/dev/serial/by-id` if there is one, as port numbers change.
    pub path: PathBuf,
    /// The manufacturer's name of the device, such as `FTDI FT232R USB UART`; for the port of a Bluetooth device, its
    /// address.
    pub device: String,
    /// The USB vendor and product ids.
    pub usb: Option<(u16, u16)>,
    /// The address of the Bluetooth device that `rfcomm` bound to the port.
    pub bluetooth: Option<String>,
    /// The group whose members may open the port, if this user may not.
    pub lacks_group: Option<String>,
}

impl FoundPort {
    /// Returns this computer's ports with a device attached, in the order of their names.
    pub fn all() -> Vec<FoundPort> {
        FoundPort::below(Path::new("/"))
    }

    /// Returns the ports in a tree with `sys` and `dev`.
    fn below(root: &Path) -> Vec<FoundPort> {
        let Ok(entries) = fs::read_dir(root.join("sys/class/tty")) else { return Vec::new() };
        let mut names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
        names.sort();
        let names = names.iter().filter_map(|name| name.to_str());
        names.filter_map(|name| FoundPort::of(root, name)).collect()
    }

    fn of(root: &Path, name: &str) -> Option<FoundPort> {
        let kernel = root.join("sys/class/tty").join(name);
        let node = root.join("dev").join(name);
        let bluetooth = read(&kernel.join("address")).filter(|_| name.starts_with("rfcomm"));
        let usb = usb_device(&kernel);
        if bluetooth.is_none() && usb.is_none() {
            return None;
        }
        let device = bluetooth.clone().or_else(|| {
            let folder = usb.as_ref()?;
            let words = ["manufacturer", "product"].map(|file| read(&folder.join(file)));
            Some(words.into_iter().flatten().collect::<Vec<_>>().join(" "))
        });
        let lacks_group = match rustix::fs::access(&node, Access::READ_OK | Access::WRITE_OK) {
            Err(rustix::io::Errno::ACCESS) => Some(group_of(root, &node)),
            _ => None,
        };
        Some(FoundPort {
            path: by_id(root, &node).unwrap_or(node),
            device: device.unwrap_or_default(),
            usb: usb.and_then(|folder| {
                let number = |file| u16::from_str_radix(&read(&folder.join(file))?, 16).ok();
                number("idVendor").zip(number("idProduct"))
            }),
            bluetooth,
            lacks_group,
        })
    }
}

/// Returns the folder of the USB device that a port belongs to.
fn usb_device(kernel: &Path) -> Option<PathBuf> {
    let interface = fs::canonicalize(kernel.join("device")).ok()?;
    let found = interface.ancestors().find(|folder| folder.join("idVendor").exists());
    found.map(Path::to_owned)
}

/// Returns a path to a port that stays the same when the device is plugged in elsewhere.
fn by_id(root: &Path, node: &Path) -> Option<PathBuf> {
    let node = fs::canonicalize(node).ok()?;
    let links = fs::read_dir(root.join("dev/serial/by-id")).ok()?.flatten();
    let mut links: Vec<PathBuf> = links.map(|link| link.path()).collect();
    links.sort();
    links.into_iter().find(|link| fs::canonicalize(link).is_ok_and(|to| to == node))
}

/// Returns the name of the group that a port belongs to; `dialout`, as on Debian, if it can't be read.
fn group_of(root: &Path, node: &Path) -> String {
    use std::os::unix::fs::MetadataExt;
    let number = fs::metadata(node).map(|metadata| metadata.gid().to_string());
    let groups = fs::read_to_string(root.join("etc/group")).unwrap_or_default();
    let name = number.ok().and_then(|number| group_named(&groups, &number));
    name.unwrap_or_else(|| "dialout".to_owned())
}

/// Returns the name of the group with this number, from the contents of `/etc/group`.
fn group_named(groups: &str, number: &str) -> Option<String> {
    let fields = groups.lines().map(|line| line.split(':').collect::<Vec<_>>());
    let mut found = fields.filter(|fields| fields.get(2) == Some(&number));
    found.next()?.first().map(|name| (*name).to_owned())
}

/// Returns the single line in a file of the kernel.
fn read(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// A machine with a USB port, a port of Bluetooth and a console.
    fn machine() -> tempfile::TempDir {
        let root = tempfile::tempdir().expect("a folder");
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("is written");
        };
        let usb = "sys/devices/usb1/1-1";
        write(&format!("{usb}/idVendor"), "0403\n");
        write(&format!("{usb}/idProduct"), "6001\n");
        write(&format!("{usb}/manufacturer"), "FTDI\n");
        write(&format!("{usb}/product"), "FT232R USB UART\n");
        write(&format!("{usb}/1-1:1.0/ttyUSB0/port_number"), "0\n");
        write("sys/class/tty/rfcomm0/address", "00:06:66:A0:00:01\n");
        write("sys/class/tty/tty1/dev", "4:1\n");
        write("sys/class/tty/ttyUSB0/dev", "188:0\n");
        for node in ["ttyUSB0", "rfcomm0", "tty1"] {
            write(&format!("dev/{node}"), "");
        }
        let at = |path: &str| root.path().join(path);
        let interface = at(&format!("{usb}/1-1:1.0/ttyUSB0"));
        symlink(interface, at("sys/class/tty/ttyUSB0/device")).expect("a link");
        fs::create_dir_all(at("dev/serial/by-id")).expect("a folder");
        symlink("../../ttyUSB0", at("dev/serial/by-id/usb-FTDI_A1-if00")).expect("a link");
        root
    }

    #[test]
    fn ports_are_known_by_what_the_kernel_knows_of_their_devices() {
        let root = machine();
        let [bluetooth, usb] = &FoundPort::below(root.path())[..] else { panic!("not two") };
        assert_eq!(bluetooth.path, root.path().join("dev/rfcomm0"));
        assert_eq!(bluetooth.bluetooth.as_deref(), Some("00:06:66:A0:00:01"));
        assert_eq!(usb.path, root.path().join("dev/serial/by-id/usb-FTDI_A1-if00"));
        assert_eq!(
            (usb.device.as_str(), usb.usb),
            ("FTDI FT232R USB UART", Some((0x0403, 0x6001)))
        );
        assert_eq!(usb.lacks_group, None);
    }

    #[test]
    fn without_a_port_there_is_none() {
        let empty = tempfile::tempdir().expect("a folder");
        assert_eq!(FoundPort::below(empty.path()), Vec::new());
    }

    #[test]
    fn a_group_has_the_name_that_this_system_gives_it() {
        let groups = "root:x:0:\ndialout:x:20:ann\nuucp:x:986:\n";
        assert_eq!(group_named(groups, "20").as_deref(), Some("dialout"));
        assert_eq!(group_named(groups, "986").as_deref(), Some("uucp"));
        assert_eq!(group_named(groups, "2"), None);
    }
}
