//! This computer's cameras.

use serde::Serialize;
use teampulse_sources::camera::FoundCamera;

use crate::output;

/// A camera of this computer.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Camera {
    device: String,
    name: String,
    /// The command that gives this user permission to open it, if that is missing.
    permit: Option<&'static str>,
}

impl Camera {
    /// Returns all cameras of this computer.
    pub fn all() -> Vec<Camera> {
        FoundCamera::all().iter().map(Camera::of).collect()
    }

    fn of(found: &FoundCamera) -> Camera {
        let device = found.link.as_ref().unwrap_or(&found.path).display().to_string();
        let permit = (!found.is_permitted).then_some("sudo usermod -aG video $USER");
        Camera { device, name: found.name.clone(), permit }
    }

    fn line(&self) -> String {
        let Camera { device, name, permit } = self;
        let permit = permit
            .map(|command| format!("\n    no permission: `{command}`, then log out and in again"));
        format!("  {name:<38} {device}{}", permit.unwrap_or_default())
    }

    /// Returns the lines of a study that read it. Its pictures are not recorded unless `record` is set.
    fn source(&self) -> String {
        let device = toml::Value::from(self.device.as_str());
        format!("[[sources]]\ntype   = \"camera\"\nperson = \"p001\"\ndevice = {device}\n")
    }
}

/// Prints cameras, with the lines of a study that read them.
pub fn show(cameras: &[Camera]) {
    if cameras.is_empty() {
        return;
    }
    output::line(format!("cameras: {}", cameras.len()));
    output::lines(cameras.iter().map(Camera::line));
    output::line(
        "\nlines for a study, each with the `person` or `robot` that it shows, or neither:",
    );
    output::lines(cameras.iter().map(Camera::source));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_has_lines_of_a_study_and_the_command_that_it_needs() {
        let camera = Camera::of(&FoundCamera {
            path: "/dev/video2".into(),
            name: "Desk Camera".into(),
            link: Some("/dev/v4l/by-id/usb-desk-index0".into()),
            is_permitted: false,
        });
        assert!(camera.line().contains("`sudo usermod -aG video $USER`, then log out"));
        let study: toml::Table = toml::from_str(&camera.source()).expect("lines of a study");
        let source = &study["sources"][0];
        assert_eq!(source["type"].as_str(), Some("camera"));
        assert_eq!(source["device"].as_str(), Some("/dev/v4l/by-id/usb-desk-index0"));
    }
}
