use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::Stopwatch;
use teampulse_core::clocks::THIS_HOST;
use teampulse_core::data::Data;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::Reading;
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;
use teampulse_devices::camera::whole_jpeg;
use v4l::buffer::{Flags, Metadata, Type};
use v4l::io::mmap::Stream;
use v4l::io::traits::{CaptureStream, Stream as _};

use super::encode::Encoder;
use super::format::Format;
use super::opened::Opened;
use super::picture;

/// A camera that delivers no frame for this long is stuck.
const SILENCE: Duration = Duration::from_secs(2);
/// The longest single wait for a frame [ms].
const LOOK_MILLIS: i32 = 200;
/// The number of buffers that the driver may fill while one is read.
const BUFFERS: u32 = 4;
/// The value of `POLLIN`.
const READABLE: i16 = 1;
/// A jump of the driver's counter larger than this is a restart of the counter, not a loss.
const MOST_LOST: u32 = 10_000;

/// How reading a camera ended.
#[derive(Debug)]
pub(super) enum Ended {
    /// The session has ended.
    Closed,
    /// The camera was unplugged, or its driver failed.
    Gone(String),
    /// The camera delivers no frames.
    Silent(String),
}

/// Reads a camera until it is gone or the session ends.
pub(super) fn capture(
    opened: &Opened,
    stream: StreamId,
    outlet: &Outlet,
    label: &str,
    stop: &AtomicBool,
) -> Ended {
    let mut frames = Frames::new(opened, stream, outlet, label);
    match read(opened, &mut frames, stop) {
        Ok(()) if stop.load(Ordering::Acquire) || outlet.is_closed() => Ended::Closed,
        Ok(()) => {
            let secs = SILENCE.as_secs();
            Ended::Silent(format!("read {label}: it delivered no frame for {secs} s"))
        }
        Err(error) => Ended::Gone(error.to_string()),
    }
}

/// Reads frames; returns when the session ends or frames stop arriving.
fn read(opened: &Opened, frames: &mut Frames, stop: &AtomicBool) -> std::io::Result<()> {
    let mut buffers = Stream::with_buffers(&opened.device, Type::VideoCapture, BUFFERS)?;
    // The first buffer is returned to the driver with each request for the next frame.
    for index in 1..BUFFERS as usize {
        // A driver may provide fewer buffers.
        if CaptureStream::queue(&mut buffers, index).is_err() && index == 1 {
            break;
        }
    }
    buffers.start()?;
    let mut silent = Stopwatch::start();
    loop {
        if stop.load(Ordering::Acquire) || frames.outlet.is_closed() {
            return Ok(());
        }
        // Wait for a frame before dequeueing it: dequeueing blocks without a time limit.
        if opened.device.handle().poll(READABLE, LOOK_MILLIS)? == 0 {
            if silent.elapsed() > SILENCE {
                return Ok(());
            }
            continue;
        }
        let (bytes, about) = CaptureStream::next(&mut buffers)?;
        silent = Stopwatch::start();
        let bytes = bytes.get(..about.bytesused as usize).unwrap_or(bytes);
        frames.take(bytes, about);
    }
}

/// Receives frames and offers them to the session.
struct Frames {
    outlet: Outlet,
    stream: StreamId,
    label: String,
    format: Format,
    /// The minimum size of a frame of raw pixels [bytes].
    least_bytes: usize,
    size: (u32, u32),
    stride: usize,
    encoder: Option<Encoder>,
    last: Option<u32>,
    /// Whether the last frame was damaged; damage is reported once, until a frame is intact again.
    is_failing: bool,
}

impl Frames {
    fn new(opened: &Opened, stream: StreamId, outlet: &Outlet, label: &str) -> Frames {
        let encoder = match opened.format {
            Format::Jpeg | Format::Depth => None,
            Format::Yuyv | Format::Rgb | Format::Grey => {
                Some(Encoder::start(opened, stream, outlet.clone(), label))
            }
        };
        outlet.stamped_by(stream, THIS_HOST);
        // From now on losses can be counted.
        outlet.lost(stream, 0);
        let rows = opened.height as usize;
        let row_bytes = opened.width as usize * opened.format.pixel_bytes().unwrap_or(0);
        Frames {
            outlet: outlet.clone(),
            stream,
            label: label.to_owned(),
            format: opened.format,
            least_bytes: rows.saturating_sub(1) * opened.stride + row_bytes,
            size: (opened.width, opened.height),
            stride: opened.stride,
            encoder,
            last: None,
            is_failing: false,
        }
    }

    fn take(&mut self, frame: &[u8], about: &Metadata) {
        self.count(about.sequence);
        let is_damaged = about.flags.contains(Flags::ERROR);
        let taken = self.taken(about);
        let whole = match self.format {
            _ if is_damaged => None,
            Format::Jpeg => whole_jpeg(frame),
            _ => Some(frame).filter(|frame| frame.len() >= self.least_bytes),
        };
        let Some(whole) = whole else {
            self.outlet.lost(self.stream, 1);
            if !self.is_failing {
                let why = if is_damaged { "reported by its driver" } else { "truncated" };
                let label = format!("{}: a damaged frame ({why}) was dropped", self.label);
                self.outlet.happen(passing(label));
            }
            self.is_failing = true;
            return;
        };
        self.is_failing = false;
        match (&self.encoder, self.format) {
            (Some(encoder), _) => encoder.take(whole, taken),
            (None, Format::Depth) => {
                self.offer(picture::distances(whole, self.size, self.stride, taken), taken);
            }
            (None, _) => self.offer(picture::file(whole, taken), taken),
        }
    }

    /// Counts the frames that the driver dropped.
    fn count(&mut self, sequence: u32) {
        let lost = self.last.map_or(0, |last| sequence.wrapping_sub(last).wrapping_sub(1));
        self.last = Some(sequence);
        if (1..MOST_LOST).contains(&lost) {
            self.outlet.lost(self.stream, u64::from(lost));
        }
    }

    /// Returns the session's time at which a frame was taken, if the driver stamps frames by the machine's clock.
    fn taken(&self, about: &Metadata) -> Option<Time> {
        let is_monotonic = about.flags & Flags::TIMESTAMP_MASK == Flags::TIMESTAMP_MONOTONIC;
        let stamp = about.timestamp;
        let stamp_ns =
            stamp.sec.checked_mul(1_000_000_000)?.checked_add(stamp.usec.checked_mul(1000)?)?;
        let ahead_ns = self.outlet.clock().ahead_of_monotonic_nanos();
        is_monotonic.then(|| Time::from_nanos(stamp_ns.saturating_add(ahead_ns)))
    }

    fn offer(&self, message: Bytes, taken: Option<Time>) {
        offer(&self.outlet, self.stream, message, taken);
    }
}

/// Publishes a picture.
pub(super) fn offer(outlet: &Outlet, stream: StreamId, message: Bytes, taken: Option<Time>) {
    let data = Data::Message(message);
    outlet.offer(Reading { index: None, stream, device_time: None, source_time: taken, data });
}
