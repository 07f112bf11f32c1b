//! What runs models: the engine in pure Rust, which is always there, or an ONNX Runtime that is installed.

mod onnx_runtime;
mod pure;

use std::path::PathBuf;

use thiserror::Error;

use super::descriptor::{Descriptor, Number};
use super::tensor::Tensor;

/// A model that an engine has loaded.
pub trait Engine: Send {
    /// The engine and its version.
    fn label(&self) -> &str;

    /// Runs the model on one input, on one thread.
    fn run(&mut self, input: &Tensor) -> Result<Vec<Tensor>, EngineError>;
}

/// Which engine runs models.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Library {
    /// The one in pure Rust.
    #[default]
    Pure,
    /// The library of an ONNX Runtime, 1.22 or newer.
    OnnxRuntime(PathBuf),
}

/// Why an engine can't load or run a model. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EngineError {
    /// The library of ONNX Runtime can't be used.
    #[error("use {library} as ONNX Runtime: {why}")]
    Library {
        /// The file.
        library: String,
        /// What it says.
        why: String,
    },
    /// The file is no model, or one that needs what the engine lacks.
    #[error("load the model `{model}` with {engine}: {why}")]
    Load {
        /// The model.
        model: String,
        /// The engine.
        engine: String,
        /// What it says.
        why: String,
    },
    /// The model has more inputs than the picture.
    #[error("use the model `{model}`: it has {count} inputs; a model has one, the picture")]
    Inputs {
        /// The model.
        model: String,
        /// How many it has.
        count: usize,
    },
    /// It failed while it ran.
    #[error("run the model `{model}`: {why}")]
    Run {
        /// The model.
        model: String,
        /// What the engine says.
        why: String,
    },
}

/// Loads a file into an engine.
pub fn load(
    file: Vec<u8>,
    descriptor: &Descriptor,
    library: &Library,
) -> Result<Box<dyn Engine>, EngineError> {
    let (model, number) = (descriptor.name.clone(), descriptor.input.number);
    match library {
        Library::Pure => Ok(Box::new(pure::Pure::load(file, model, number)?)),
        Library::OnnxRuntime(path) => {
            Ok(Box::new(onnx_runtime::OnnxRuntime::load(&file, model, number, path)?))
        }
    }
}

/// A number of a tensor as a byte.
fn byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// What of an error fits into a line.
fn line(error: &impl ToString) -> String {
    let words = error.to_string();
    words.split_whitespace().take(60).collect::<Vec<_>>().join(" ")
}

fn one_input(model: &str, count: usize) -> Result<(), EngineError> {
    match count {
        1 => Ok(()),
        _ => Err(EngineError::Inputs { model: model.to_owned(), count }),
    }
}

/// The numbers of a type that an input has.
enum Numbers {
    Float(Vec<f32>),
    Byte(Vec<u8>),
    Int(Vec<i32>),
}

impl Numbers {
    fn of(input: &Tensor, number: Number) -> Numbers {
        let values = input.values.iter().copied();
        match number {
            Number::F32 => Numbers::Float(values.collect()),
            Number::U8 => Numbers::Byte(values.map(byte).collect()),
            Number::I32 => Numbers::Int(values.map(|value| value.round() as i32).collect()),
        }
    }
}
