//! Model descriptors in TOML: the file, its input and its output.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::decode::Output;
use super::tensor::MOST_NUMBERS;

/// The largest model file [bytes].
const MOST_BYTES: u64 = 2 << 30;
/// The largest side of an input [px].
const MOST_SIDE: usize = 4096;

/// A model: its file, its licence, its input and its output.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Descriptor {
    /// The name of the model, which is the last token of its stream names: `expression`.
    pub name: String,
    /// A sentence that says what the model computes.
    #[serde(default)]
    pub doc: String,
    /// The ONNX file, next to the descriptor.
    pub file: PathBuf,
    /// The SHA-256 of the file, in hexadecimal. `teampulse models add` writes it; a model without it is not run.
    #[serde(default)]
    pub sha256: String,
    /// The licence of the file, as named by its publisher. It is shown wherever the model is shown.
    pub licence: String,
    /// The origin of the file.
    #[serde(default)]
    pub origin: String,
    /// The highest rate at which the model processes pictures [Hz]. By default as high as possible.
    #[serde(default)]
    pub max_hz: Option<f64>,
    /// The input.
    pub input: Input,
    /// The output.
    pub output: Output,
}

/// The input of a model: a part of a picture, as numbers.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The width and height of the input [px].
    pub size: [usize; 2],
    /// The memory layout: `nchw` (planar colours) or `nhwc` (interleaved colours).
    #[serde(default)]
    pub layout: Layout,
    /// The order of the colours: `rgb` or `bgr`.
    #[serde(default)]
    pub color: Colour,
    /// The type of the numbers: `f32`, `u8` or `i32`.
    #[serde(default, rename = "dtype")]
    pub number: Number,
    /// The factor applied to colour values (0 to 255) before the mean is subtracted.
    #[serde(default = "one")]
    pub scale: f32,
    /// The mean subtracted from each colour, in the order of `color`.
    #[serde(default)]
    pub mean: [f32; 3],
    /// The divisor applied to each colour after that, in the order of `color`.
    #[serde(default = "ones")]
    pub std: [f32; 3],
    /// How a part with other proportions is fitted: `letterbox` (the whole part, with a border), `stretch`, or `crop`
    /// (the middle of the part).
    #[serde(default)]
    pub resize: Resize,
    /// The value of the border, and of the area outside the picture (0 to 255).
    #[serde(default)]
    pub fill: f32,
    /// The part of the picture that the model processes: the whole `frame`, the `face`, the `person` or the `hand`
    /// found by an earlier model, or a face `aligned` by its five points. A hand whose palm has points is rotated so
    /// that its fingers point up.
    #[serde(default)]
    pub source: Source,
    /// How much larger than the part the input is: 0.25 adds a quarter of its width and height, half of it on each
    /// side.
    #[serde(default)]
    pub margin: f64,
}

fn one() -> f32 {
    1.0
}

fn ones() -> [f32; 3] {
    [1.0; 3]
}

/// The memory layout of an input.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// Planar: one colour after the other.
    #[default]
    Nchw,
    /// Interleaved: one pixel after the other.
    Nhwc,
}

/// The order of an input's colours.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// Red, green, blue.
    #[default]
    Rgb,
    /// Blue, green, red.
    Bgr,
}

/// The type of an input's numbers.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Number {
    /// 32-bit floating point.
    #[default]
    F32,
    /// Bytes.
    U8,
    /// 32-bit integers.
    I32,
}

/// How a part with other proportions is fitted.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Resize {
    /// The whole part, with a border on two sides.
    #[default]
    Letterbox,
    /// The whole part, distorted.
    Stretch,
    /// The middle of the part.
    Crop,
}

/// The part of a picture that a model processes.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The whole picture.
    #[default]
    Frame,
    /// The face found by an earlier model.
    Face,
    /// The person found by an earlier model.
    Person,
    /// The face found by an earlier model, rotated and scaled by its five points.
    Aligned,
    /// The hand found by an earlier model, rotated by the points of its palm.
    Hand,
}

/// What a model finds for later models.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Subject {
    /// A face.
    Face,
    /// A person.
    Person,
    /// A hand.
    Hand,
}

impl std::fmt::Display for Subject {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Subject::Face => "face",
            Subject::Person => "person",
            Subject::Hand => "hand",
        })
    }
}

/// Why a descriptor, or its model file, cannot be used. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DescriptorError {
    /// A file cannot be read.
    #[error("read {file}: {why}")]
    File {
        /// The path of the file.
        file: String,
        /// The reason.
        why: String,
    },
    /// The descriptor is not TOML, or a field is missing.
    #[error("read the descriptor: {0}")]
    Syntax(String),
    /// A setting is invalid.
    #[error("use the descriptor: {0}")]
    Setting(String),
    /// The descriptor has no hash of the model file.
    #[error(
        "use the model `{0}`: its descriptor has no `sha256` (`teampulse models add` writes it)"
    )]
    NoHash(String),
    /// The hash of the model file differs.
    #[error("use the model `{name}`: its file has the SHA-256 {is}, not {expected}")]
    Hash {
        /// The name of the model.
        name: String,
        /// The hash of the file.
        is: String,
        /// The hash in the descriptor.
        expected: String,
    },
}

impl Descriptor {
    /// Parses a descriptor.
    pub fn parse(text: &str) -> Result<Descriptor, DescriptorError> {
        let read: Descriptor = toml::from_str(text)
            .map_err(|error| DescriptorError::Syntax(error.to_string().trim_end().to_owned()))?;
        match read.wrong() {
            Some(wrong) => Err(DescriptorError::Setting(wrong)),
            None => Ok(read),
        }
    }

    /// Reads the descriptor in a file.
    pub fn read(path: &Path) -> Result<Descriptor, DescriptorError> {
        let text = std::fs::read_to_string(path).map_err(|error| unread(path, &error))?;
        Descriptor::parse(&text)
    }

    /// Reads the descriptor in a file, and the model next to it, whose hash must match.
    pub fn open(path: &Path) -> Result<(Descriptor, Vec<u8>), DescriptorError> {
        let descriptor = Descriptor::read(path)?;
        let name = descriptor.name.clone();
        if descriptor.sha256.is_empty() {
            return Err(DescriptorError::NoHash(name));
        }
        let file = contents(&descriptor.model_file(path))?;
        let (is, expected) = (sha256(&file), descriptor.sha256.to_lowercase());
        if is == expected {
            Ok((descriptor, file))
        } else {
            Err(DescriptorError::Hash { name, is, expected })
        }
    }

    /// The last tokens of the stream names: the model's name, with a suffix for each side if it is a hand model.
    pub fn streams(&self) -> impl Iterator<Item = String> {
        self.output.sides().iter().map(|side| format!("{}{side}", self.name))
    }

    /// The path of the model file, next to the descriptor at this path.
    pub fn model_file(&self, path: &Path) -> PathBuf {
        path.parent().unwrap_or(Path::new("")).join(&self.file)
    }

    fn wrong(&self) -> Option<String> {
        let is_token = self.name.starts_with(|letter: char| letter.is_ascii_lowercase())
            && self.name.chars().all(|letter| matches!(letter, 'a'..='z' | '0'..='9' | '_'));
        if !is_token {
            return Some(format!("the name `{}` is not of the form [a-z][a-z0-9_]*", self.name));
        }
        if self.max_hz.is_some_and(|rate| !rate.is_finite() || rate <= 0.0) {
            return Some("`max_hz` must be above 0".to_owned());
        }
        self.input.wrong().or_else(|| self.output.wrong())
    }
}

impl Input {
    /// The shape of the input tensor.
    pub fn shape(&self) -> [usize; 4] {
        let [width, height] = self.size;
        match self.layout {
            Layout::Nchw => [1, 3, height, width],
            Layout::Nhwc => [1, height, width, 3],
        }
    }

    fn wrong(&self) -> Option<String> {
        let [width, height] = self.size;
        if !self.size.iter().all(|side| (1..=MOST_SIDE).contains(side))
            || width * height * 3 > MOST_NUMBERS
        {
            return Some(format!(
                "the input is {width} × {height} pixels; each side must be from 1 to {MOST_SIDE}"
            ));
        }
        if self.std.iter().any(|part| !part.is_finite() || *part == 0.0) || !self.scale.is_finite()
        {
            return Some("`std` and `scale` must be finite, and `std` not 0".to_owned());
        }
        let is_margin = (-0.9..=10.0).contains(&self.margin);
        (!is_margin).then(|| format!("the margin is {}; it must be from -0.9 to 10", self.margin))
    }
}

/// Reads the contents of a model file.
pub fn contents(file: &Path) -> Result<Vec<u8>, DescriptorError> {
    let about = std::fs::metadata(file).map_err(|error| unread(file, &error))?;
    let mib = |bytes: u64| bytes >> 20;
    let wrong = if !about.is_file() {
        Some("it is not a file".to_owned())
    } else if about.len() > MOST_BYTES {
        Some(format!("it has {} MiB; at most {} MiB are read", mib(about.len()), mib(MOST_BYTES)))
    } else {
        None
    };
    if let Some(why) = wrong {
        return Err(DescriptorError::File { file: file.display().to_string(), why });
    }
    std::fs::read(file).map_err(|error| unread(file, &error))
}

/// Returns the SHA-256 of a file's contents, in hexadecimal.
pub fn sha256(file: &[u8]) -> String {
    let digest: [u8; 32] = Sha256::digest(file).into();
    digest
        .iter()
        .flat_map(|byte| [byte >> 4, byte & 15])
        .map(|half| char::from_digit(u32::from(half), 16).unwrap_or('?'))
        .collect()
}

fn unread(file: &Path, error: &std::io::Error) -> DescriptorError {
    DescriptorError::File { file: file.display().to_string(), why: error.to_string() }
}

#[cfg(test)]
mod tests;
