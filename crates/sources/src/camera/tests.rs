use teampulse_core::clock::Clock;
use teampulse_core::registry::SettingsError;
use v4l::device::Device;

use super::*;

fn settings(text: &str) -> Result<Camera, SettingsError> {
    let camera: Camera =
        toml::from_str(text).map_err(|error| SettingsError::new(error.to_string()))?;
    camera.check().map(|()| camera)
}

fn error(text: &str) -> String {
    settings(text).unwrap_err().to_string()
}

fn opened(format: Format) -> Opened {
    Opened {
        // No request is sent to it.
        device: Device::with_path("/dev/null").unwrap(),
        name: "Desk Camera".to_owned(),
        format,
        width: 640,
        height: 480,
        stride: 1280,
        is_full_range: false,
        rate_hz: 30.0,
    }
}

#[test]
fn streams_are_named_by_whom_they_show() {
    let name = |text: &str, format| settings(text).unwrap().stream(&opened(format)).name;
    let side = "person = \"p001\"\nname = \"side\"";
    assert_eq!(name(side, Format::Yuyv), "/humans/persons/p001/side/image_raw/compressed");
    assert_eq!(name("robot = \"robot1\"", Format::Depth), "/robot1/camera/image_rect_raw");
    assert_eq!(name("", Format::Jpeg), "/cameras/camera/image_raw/compressed");
}

#[test]
fn pictures_are_live_only_unless_the_study_records_them() {
    let stream = |text: &str| settings(text).unwrap().stream(&opened(Format::Jpeg));
    assert_eq!(stream("").audience, Audience::Live);
    assert!(stream("").doc.ends_with("; shown live, not recorded"));
    assert_eq!(stream("record = true").audience, Audience::Everybody);
    assert_eq!(stream("record = true\nfaces = \"blur\"").audience, Audience::Workers);
    assert_eq!(stream("").signal, Signal::Image);
}

#[test]
fn wrong_settings_say_what_is_wrong() {
    assert!(error("person = \"p001\"\nrobot = \"r1\"").contains("both a person and a robot"));
    assert!(error("name = \"a b\"").contains("not a ROS name"));
    assert!(error("width = 640").contains("only one of"));
    assert!(error("width = 640\nheight = 0").contains("picture size"));
    assert!(error("rate_hz = 0").contains("frame rate"));
    assert!(error("format = \"h264\"").contains("h264"));
}

#[tokio::test]
async fn a_computer_without_the_camera_says_so_and_tries_again() {
    let queue = teampulse_core::outlet::Queue::new();
    let outlet = queue.outlet(Clock::host(), teampulse_core::streams::Streams::default());
    let settings = settings("device = \"no such camera\"").unwrap();
    let ended = CameraReader { settings, read_before: None }.run(&outlet).await;
    let Err(SourceError::Gone { message, hint }) = ended else { panic!("{ended:?}") };
    assert!(message.starts_with("find "), "{message}");
    assert!(hint.starts_with("plug it in"), "{hint}");
}
