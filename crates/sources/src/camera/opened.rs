use std::fs;
use std::io;
use std::path::Path;

use rustix::io::Errno;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::SourceError;
use v4l::device::Device;
use v4l::format::{Colorspace, Quantization};
use v4l::video::Capture;
use v4l::video::capture::Parameters;

use super::format::Format;
use super::{Camera, FoundCamera};

/// The default picture size.
const USUAL: (u32, u32) = (640, 480);
/// The largest number of pixels in a picture.
const MOST_PIXELS: u64 = 40_000_000;
/// The largest frame that a camera may announce [bytes].
const MOST_BYTES: u32 = 128 << 20;
/// The largest deviation of the rate from the requested one, as a share of it.
const RATE_WITHIN: f64 = 0.02;

/// A request to a camera.
pub(super) struct Wanted {
    /// Width and height [px].
    pub size: Option<(u32, u32)>,
    pub rate_hz: f64,
    /// The acceptable formats, the best first.
    pub formats: Vec<Format>,
}

/// An opened and configured camera.
pub(super) struct Opened {
    pub device: Device,
    /// The name given by its manufacturer.
    pub name: String,
    pub format: Format,
    pub width: u32,
    pub height: u32,
    /// The length of a row [bytes].
    pub stride: usize,
    /// Whether the colours use the full range from 0 to 255.
    pub is_full_range: bool,
    /// The actual frame rate [Hz].
    pub rate_hz: f64,
}

impl Opened {
    pub fn open(found: &FoundCamera, wanted: &Wanted) -> Result<Opened, SourceError> {
        let failed = |error: &io::Error| refused(found, error);
        let device = Device::with_path(&found.path).map_err(|error| failed(&error))?;
        let offered = device.enum_formats().map_err(|error| failed(&error))?;
        let code_of = |format: &Format| {
            offered.iter().map(|each| each.fourcc).find(|code| Format::of(*code) == Some(*format))
        };
        let chosen = wanted.formats.iter().find_map(|format| Some((*format, code_of(format)?)));
        let Some((format, code)) = chosen else {
            let offered: Vec<String> = offered.iter().map(|each| each.fourcc.to_string()).collect();
            return Err(SourceError::Fatal {
                message: format!("read {}: it supports only {}", found.name, offered.join(", ")),
                hint:
                    "choose another `format`: mjpeg (MJPG), yuyv (YUYV), grey (GREY), depth (Z16)"
                        .into(),
            });
        };
        let (width, height) = wanted.size.unwrap_or(USUAL);
        let asked = v4l::Format::new(width, height, code);
        let set = device.set_format(&asked).map_err(|error| failed(&error))?;
        if wanted.size.is_some_and(|size| size != (set.width, set.height)) || set.fourcc != code {
            return Err(SourceError::Fatal {
                message: format!("read {}: it does not support {width} × {height}", found.name),
                hint: format!("its nearest size is {} × {}", set.width, set.height),
            });
        }
        let row_bytes = set.width as usize * format.pixel_bytes().unwrap_or(0);
        let is_sound = u64::from(set.width) * u64::from(set.height) <= MOST_PIXELS
            && set.size <= MOST_BYTES
            && (set.stride as usize >= row_bytes || format == Format::Jpeg);
        if !is_sound {
            return Err(SourceError::Fatal {
                message: format!(
                    "read {}: it delivers {} × {} pixels, in frames of {} MiB",
                    found.name,
                    set.width,
                    set.height,
                    set.size >> 20
                ),
                hint: format!(
                    "choose a smaller picture: at most {} megapixels",
                    MOST_PIXELS / 1_000_000
                ),
            });
        }
        let rate_hz = rate(&device, wanted.rate_hz);
        Ok(Opened {
            device,
            name: found.name.clone(),
            format,
            width: set.width,
            height: set.height,
            stride: set.stride as usize,
            is_full_range: matches!(set.quantization, Quantization::FullRange)
                || matches!(set.colorspace, Colorspace::JPEG),
            rate_hz,
        })
    }

    /// Warns if the camera's frame rate differs from the requested one.
    pub fn warn(&self, settings: &Camera, outlet: &Outlet) {
        let asked_hz = settings.rate_hz;
        if (self.rate_hz - asked_hz).abs() > RATE_WITHIN * asked_hz {
            let label = settings.label();
            outlet.happen(passing(format!(
                "{label}: the frame rate is {:.1} Hz instead of {asked_hz} Hz at {} × {}",
                self.rate_hz, self.width, self.height
            )));
        }
    }
}

/// Sets the frame rate, and returns the actual one [Hz].
fn rate(device: &Device, wanted_hz: f64) -> f64 {
    let asked = v4l::Fraction::new(1000, (wanted_hz * 1000.0).round() as u32);
    // Some cameras have a fixed rate and reject the request.
    let set = device.set_params(&Parameters::new(asked)).or_else(|_| device.params());
    let interval = set.map(|set| set.interval);
    let rate_hz = interval.map(|each| f64::from(each.denominator) / f64::from(each.numerator));
    rate_hz.ok().filter(|rate_hz| rate_hz.is_finite() && *rate_hz > 0.0).unwrap_or(wanted_hz)
}

/// Returns why a camera cannot be opened, and what the user can do.
pub(super) fn refused(found: &FoundCamera, error: &io::Error) -> SourceError {
    let path = found.path.display();
    let errno = error.raw_os_error().map(Errno::from_raw_os_error);
    let (message, hint) = match errno {
        Some(Errno::ACCESS | Errno::PERM) => (
            format!("read {}: permission denied for {path}", found.name),
            "run `sudo usermod -aG video $USER`, then log out and in again".to_owned(),
        ),
        Some(Errno::BUSY) => (
            format!("read {}: another program is using it", found.name),
            match holders(&found.path).as_slice() {
                [] => {
                    "close the program that shows or records it: a browser, a video call, another recorder".into()
                }
                holders => format!("close {}", holders.join(" or ")),
            },
        ),
        _ => (format!("read {} at {path}: {error}", found.name), "plug it in again".to_owned()),
    };
    SourceError::Gone { message, hint }
}

/// The other programs of this user that have a file open, with their process IDs.
fn holders(path: &Path) -> Vec<String> {
    let own = std::process::id().to_string();
    let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
    let ids = processes.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let ids = ids.filter(|id| *id != own && id.bytes().all(|each| each.is_ascii_digit()));
    let has_open = |id: &String| {
        let files = fs::read_dir(format!("/proc/{id}/fd")).into_iter().flatten().flatten();
        files.map(|file| file.path()).any(|file| fs::read_link(file).is_ok_and(|to| to == path))
    };
    let name = |id: String| {
        let name = fs::read_to_string(format!("/proc/{id}/comm")).unwrap_or_default();
        format!("{} ({id})", name.trim())
    };
    ids.filter(has_open).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_a_file_open_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("video0");
        fs::write(&path, "").unwrap();
        let file = fs::File::open(&path).unwrap();
        let mut other = std::process::Command::new("sleep").arg("60").stdin(file).spawn().unwrap();
        // The new process has its name only once it runs.
        let named = || holders(&path) == [format!("sleep ({})", other.id())];
        let is_named = (0..1000).any(|_| {
            named() || {
                std::thread::yield_now();
                false
            }
        });
        other.kill().unwrap();
        other.wait().unwrap();
        assert!(is_named);
    }

    #[test]
    fn each_refusal_says_what_to_do() {
        let found = FoundCamera {
            path: "/dev/video7".into(),
            name: "Desk Camera".into(),
            link: None,
            is_permitted: false,
        };
        let of = |errno: Errno| {
            let error = io::Error::from_raw_os_error(errno.raw_os_error());
            match refused(&found, &error) {
                SourceError::Gone { message, hint } => (message, hint),
                SourceError::Fatal { .. } => panic!("it ends the session"),
            }
        };
        assert!(of(Errno::ACCESS).1.contains("usermod -aG video"));
        assert_eq!(of(Errno::BUSY).0, "read Desk Camera: another program is using it");
        assert!(of(Errno::NODEV).0.contains("/dev/video7"));
    }
}
