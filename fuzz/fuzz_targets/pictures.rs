//! Any bytes as a picture, a depth picture or a frame of video, alone and in messages: a picture or an error, never a
//! panic.
#![no_main]

use bytes::Bytes;
use libfuzzer_sys::fuzz_target;
use teampulse_devices::camera::whole_jpeg;
use teampulse_messages::video::{COMPRESSED_VIDEO, FFMPEG_PACKET, VideoFrame};
use teampulse_vision::depth::{Depth, Intrinsics, Patch};
use teampulse_vision::picture::Picture;

fuzz_target!(|bytes: &[u8]| {
    let _ = Picture::from_jpeg(bytes);
    let _ = whole_jpeg(bytes);
    let message = Bytes::from([&[0, 1, 0, 0][..], bytes].concat());
    let _ = Picture::read("sensor_msgs/msg/CompressedImage", &message);
    let _ = Picture::read("sensor_msgs/msg/Image", &message);
    let intrinsics = Intrinsics::read(&message).ok();
    if let Ok(depth) = Depth::read(&message) {
        let number = |place: usize| f64::from(bytes.get(place).copied().unwrap_or_default());
        let place = [number(0) - 9.0, number(1) - 9.0];
        let patch = Patch { side: bytes.len() as u32 % 50, most_spread_m: number(2) / 50.0 };
        let found = patch.distance(&depth, place).ok();
        let _ = intrinsics.zip(found).map(|(camera, far)| camera.in_space(place, far));
    }
    for type_name in [COMPRESSED_VIDEO, FFMPEG_PACKET] {
        let _ = VideoFrame::read(type_name, &message).map(|frame| frame.needs());
    }
});
