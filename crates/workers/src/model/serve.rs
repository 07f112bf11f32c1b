//! The process that runs models: it reads pictures and writes results, within a memory limit.

use std::env::var_os;
use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;

use bytes::Bytes;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use teampulse_vision::model::chain::{Chain, Findings};
use teampulse_vision::model::decode::Detection;
use teampulse_vision::model::engine::Library;
use teampulse_vision::model::{Model, ModelError};
use teampulse_vision::picture::Picture;

use super::wire::{Announced, Reply};

/// The command-line argument that starts this process.
pub const COMMAND: &str = "__model";

/// The longest header line before a picture [bytes].
const LONGEST_LINE: u64 = 4096;
/// The largest message with a picture [bytes].
const MOST_BYTES: usize = 256 << 20;

/// The rectangle of a face that may be anywhere in the picture: left, top, width and height [px].
const ANYWHERE: [f32; 4] = [0.0, 0.0, 1e6, 1e6];

/// Limits the memory of this process: a larger allocation fails, or aborts it.
pub fn limit_memory(mib: u64) {
    let limit = Some(mib << 20);
    let Rlimit { maximum, .. } = getrlimit(Resource::As);
    let limit = maximum.map_or(limit, |maximum| limit.map(|limit| limit.min(maximum)));
    let limited = setrlimit(Resource::As, Rlimit { current: limit, maximum: limit });
    limited.unwrap_or_else(|error| tracing::warn!("failed to limit the memory of models: {error}"));
}

/// The engine that runs models: the library in the settings, or else the library in `ORT_DYLIB_PATH`, with which other
/// programs find ONNX Runtime, or else pure Rust.
pub fn library(setting: Option<PathBuf>) -> Library {
    let found = setting.or_else(|| var_os("ORT_DYLIB_PATH").map(PathBuf::from));
    let found = found.filter(|path| !path.as_os_str().is_empty());
    found.map_or(Library::Pure, Library::OnnxRuntime)
}

/// Loads models, then replies to each picture until there are no more. The reason for an early exit is also written as
/// a reply.
pub fn serve(
    descriptors: &[PathBuf],
    library: &Library,
    mut pictures: impl BufRead,
    mut replies: impl Write,
) -> Result<(), String> {
    let mut said = |reply: &Reply| {
        let mut line = serde_json::to_vec(reply).map_err(io::Error::from)?;
        line.push(b'\n');
        replies.write_all(&line)?;
        replies.flush()
    };
    let answered = answer(descriptors, library, &mut pictures, &mut said);
    if let Err(why) = &answered {
        // If the session is gone, there is nothing to report.
        said(&Reply::Failed(why.clone())).ok();
    }
    answered
}

fn answer(
    descriptors: &[PathBuf],
    library: &Library,
    pictures: &mut impl BufRead,
    said: &mut impl FnMut(&Reply) -> io::Result<()>,
) -> Result<(), String> {
    let loaded = descriptors.iter().map(|path| Model::load(path, library));
    let loaded: Result<Vec<Model>, ModelError> = loaded.collect();
    let mut chain = Chain::new(loaded.map_err(|error| error.to_string())?);
    let engine = chain.models().first().map(|model| model.engine().to_owned());
    let gone = |error: io::Error| format!("reply: {error}");
    said(&Reply::Ready { engine: engine.unwrap_or_default() }).map_err(gone)?;
    while let Some((type_name, message)) = next(pictures)? {
        let reply = match Picture::read(&type_name, &message) {
            Ok(picture) => seen(&mut chain, &picture)?,
            Err(error) => Reply::Unreadable(error.to_string()),
        };
        said(&reply).map_err(gone)?;
    }
    Ok(())
}

fn seen(chain: &mut Chain, picture: &Picture) -> Result<Reply, String> {
    let Findings { numbers, faces } = chain.look(picture).map_err(|error| error.to_string())?;
    let finite = |number: f64| Some(number).filter(|number| number.is_finite());
    let size = [picture.width, picture.height].map(|side| Some(f64::from(side)));
    let outputs = chain.models().iter().map(|model| &model.descriptor.output);
    let of_streams = outputs.flat_map(|output| output.sides().iter().map(|_| output.has_places()));
    let of_stream = |(numbers, has_places): (Vec<f64>, bool)| {
        let size = size.into_iter().filter(|_| has_places);
        numbers.into_iter().map(finite).chain(size).collect()
    };
    let numbers = numbers.into_iter().zip(of_streams).map(of_stream).collect();
    let sides = |face: &Detection| [face.left, face.top, face.width, face.height];
    // JSON has only finite numbers; a face without a position may be anywhere.
    let known = |sides: [f32; 4]| sides.iter().all(|side| side.is_finite()).then_some(sides);
    let faces = faces.iter().map(|face| known(sides(face)).unwrap_or(ANYWHERE)).collect();
    Ok(Reply::Seen { numbers, faces })
}

/// The next picture message, and its type; `None` if there are no more.
fn next(pictures: &mut impl BufRead) -> Result<Option<(String, Bytes)>, String> {
    let mut line = Vec::new();
    let read = pictures.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
    match read {
        Ok(0) => return Ok(None),
        Ok(_) => {}
        Err(error) => return Err(format!("read a picture: {error}")),
    }
    let announced: Announced = serde_json::from_slice(&line)
        .map_err(|error| format!("read the header of a picture: {error}"))?;
    if announced.bytes > MOST_BYTES {
        let mib = MOST_BYTES >> 20;
        return Err(format!(
            "read a picture of {} bytes; at most {mib} MiB are supported",
            announced.bytes
        ));
    }
    let mut message = Vec::new();
    let read = pictures.by_ref().take(announced.bytes as u64).read_to_end(&mut message);
    match read {
        Ok(count) if count == announced.bytes => {
            Ok(Some((announced.type_name, Bytes::from(message))))
        }
        Ok(_) => Err("read a picture: it is truncated".to_owned()),
        Err(error) => Err(format!("read a picture: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn replies(descriptors: &[PathBuf], pictures: &[u8]) -> (Result<(), String>, Vec<Reply>) {
        let mut written = Vec::new();
        let ended = serve(descriptors, &Library::Pure, pictures, &mut written);
        let lines = written.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        (ended, lines.map(|line| serde_json::from_slice(line).unwrap()).collect())
    }

    #[test]
    fn a_model_that_can_not_be_loaded_is_said_before_the_end() {
        let (ended, replies) = replies(&["nowhere.toml".into()], &[]);
        let why = ended.unwrap_err();
        assert!(why.starts_with("read nowhere.toml: "), "{why}");
        assert_eq!(replies, [Reply::Failed(why)]);
    }

    #[test]
    fn a_picture_that_is_none_is_answered_and_one_that_is_cut_off_ends_it() {
        let head = br#"{"type":"sensor_msgs/msg/Image","bytes":4}"#;
        let picture = [head, &b"\n"[..], &[0, 1, 0, 0]].concat();
        let (ended, replies) =
            replies(&[], &[&picture[..], &picture[..picture.len() - 1]].concat());
        assert_eq!(ended.unwrap_err(), "read a picture: it is truncated");
        assert!(matches!(replies[1], Reply::Unreadable(_)), "{replies:?}");
        assert_eq!(replies.len(), 3);
    }

    proptest! {
        #[test]
        fn any_bytes_end_it_with_a_reason_or_with_their_end(bytes: Vec<u8>) {
            let (ended, replies) = replies(&[], &bytes);
            prop_assert_eq!(ended.is_err(), matches!(replies.last(), Some(Reply::Failed(_))));
        }
    }
}
