//! The descriptor of a model, in TOML: its file, what goes in, and what comes out.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::decode::Output;
use super::tensor::MOST_NUMBERS;

/// The largest file of a model [bytes].
const MOST_BYTES: u64 = 2 << 30;
/// The largest side of an input [px].
const MOST_SIDE: usize = 4096;

/// A model: its file, its licence, what goes in and what comes out.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Descriptor {
    /// Its name, the last token of the names of its streams: `expression`.
    pub name: String,
    /// What it finds, in a sentence.
    #[serde(default)]
    pub doc: String,
    /// Its ONNX file, beside the descriptor.
    pub file: PathBuf,
    /// The SHA-256 of the file, in hexadecimal. `teampulse models add` writes it; a model without it is not run.
    #[serde(default)]
    pub sha256: String,
    /// The licence of the file, as its publisher names it. Shown wherever the model is.
    pub licence: String,
    /// Where the file comes from.
    #[serde(default)]
    pub origin: String,
    /// The most pictures that it looks at [Hz]. Without it, as many as it can.
    #[serde(default)]
    pub max_hz: Option<f64>,
    /// What goes in.
    pub input: Input,
    /// What comes out.
    pub output: Output,
}

/// What goes into a model: a part of a picture, as numbers.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Its width and height [px].
    pub size: [usize; 2],
    /// The order of its dimensions: `nchw` (colours apart) or `nhwc` (the colours of a pixel together).
    #[serde(default)]
    pub layout: Layout,
    /// The order of its colours: `rgb` or `bgr`.
    #[serde(default)]
    pub color: Colour,
    /// The type of its numbers: `f32`, `u8` or `i32`.
    #[serde(default, rename = "dtype")]
    pub number: Number,
    /// What the brightness of a colour (0 to 255) is multiplied with, before the mean is taken off.
    #[serde(default = "one")]
    pub scale: f32,
    /// What is taken off each colour, in the order of `color`.
    #[serde(default)]
    pub mean: [f32; 3],
    /// What each colour is divided by then, in the order of `color`.
    #[serde(default = "ones")]
    pub std: [f32; 3],
    /// How a part of other proportions is made to fit: `letterbox` (all of it, with a border), `stretch` or `crop` (its
    /// middle).
    #[serde(default)]
    pub resize: Resize,
    /// The brightness of the border, and of what is outside of the picture (0 to 255).
    #[serde(default)]
    pub fill: f32,
    /// What it looks at: the whole `frame`, the `face`, the `person` or the `hand` that an earlier model found, or a face
    /// `aligned` by its five points. A hand whose palm has points is turned with its fingers up.
    #[serde(default)]
    pub source: Source,
    /// How much larger than what was found the part is: 0.25 adds a quarter to each side.
    #[serde(default)]
    pub margin: f64,
}

fn one() -> f32 {
    1.0
}

fn ones() -> [f32; 3] {
    [1.0; 3]
}

/// The order of an input's dimensions.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// One colour after the other.
    #[default]
    Nchw,
    /// One pixel after the other.
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
    /// Of 32 bits, with fractions.
    #[default]
    F32,
    /// Bytes.
    U8,
    /// Whole, of 32 bits.
    I32,
}

/// How a part of other proportions is made to fit.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Resize {
    /// All of it, with a border on two sides.
    #[default]
    Letterbox,
    /// All of it, out of proportion.
    Stretch,
    /// Its middle.
    Crop,
}

/// What a model looks at.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The whole picture.
    #[default]
    Frame,
    /// The face that an earlier model found.
    Face,
    /// The person that an earlier model found.
    Person,
    /// That face, turned and scaled by its five points.
    Aligned,
    /// The hand that an earlier model found, turned by the points of its palm.
    Hand,
}

/// What a model finds that later ones look at.
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

/// Why a descriptor, or the file that it names, can't be used. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DescriptorError {
    /// A file can't be read.
    #[error("read {file}: {why}")]
    File {
        /// The file.
        file: String,
        /// Why.
        why: String,
    },
    /// It is not TOML, or lacks something.
    #[error("read the descriptor: {0}")]
    Syntax(String),
    /// A setting has no meaning.
    #[error("use the descriptor: {0}")]
    Setting(String),
    /// It says nothing of the file's contents.
    #[error(
        "use the model `{0}`: its descriptor has no `sha256` (`teampulse models add` writes it)"
    )]
    NoHash(String),
    /// The file is another one.
    #[error("use the model `{name}`: its file has the SHA-256 {is}, not {expected}")]
    Hash {
        /// The model.
        name: String,
        /// That of the file.
        is: String,
        /// That of the descriptor.
        expected: String,
    },
}

impl Descriptor {
    /// Reads a descriptor.
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

    /// Reads the descriptor in a file, and the model beside it, whose contents have to be those that it names.
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

    /// The last tokens of the names of its streams: its own name, for a model of hands once for each side.
    pub fn streams(&self) -> impl Iterator<Item = String> {
        self.output.sides().iter().map(|side| format!("{}{side}", self.name))
    }

    /// The file of the model, beside the descriptor at this path.
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
            return Some("`max_hz` has to be above 0".to_owned());
        }
        self.input.wrong().or_else(|| self.output.wrong())
    }
}

impl Input {
    /// The shape of its tensor.
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
                "an input of {width} × {height} pixels; each side has 1 to {MOST_SIDE}"
            ));
        }
        if self.std.iter().any(|part| !part.is_finite() || *part == 0.0) || !self.scale.is_finite()
        {
            return Some("`std` and `scale` have to be finite, and `std` not 0".to_owned());
        }
        let is_margin = (-0.9..=10.0).contains(&self.margin);
        (!is_margin).then(|| format!("a margin of {}; it is from -0.9 to 10", self.margin))
    }
}

/// The contents of a model's file.
pub fn contents(file: &Path) -> Result<Vec<u8>, DescriptorError> {
    let about = std::fs::metadata(file).map_err(|error| unread(file, &error))?;
    if !about.is_file() || about.len() > MOST_BYTES {
        let why = format!("a model is a file of at most {} MiB", MOST_BYTES >> 20);
        return Err(DescriptorError::File { file: file.display().to_string(), why });
    }
    std::fs::read(file).map_err(|error| unread(file, &error))
}

/// The SHA-256 of a file's contents, in hexadecimal.
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
