//! Inference engines: one in pure Rust, which is always available, and an installed ONNX Runtime.

mod onnx_runtime;
mod pure;

use std::path::PathBuf;

use thiserror::Error;

use super::descriptor::{Descriptor, Number};
use super::tensor::Tensor;

/// A model loaded by an engine.
pub trait Engine: Send {
    /// The name and version of the engine.
    fn label(&self) -> &str;

    /// Runs the model on one input, on one thread.
    fn run(&mut self, input: &Tensor) -> Result<Vec<Tensor>, EngineError>;
}

/// The engine that runs models.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Library {
    /// The engine in pure Rust.
    #[default]
    Pure,
    /// The library of an ONNX Runtime, 1.22 or newer.
    OnnxRuntime(PathBuf),
}

/// Why an engine cannot load or run a model. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EngineError {
    /// The ONNX Runtime library cannot be used.
    #[error("use {library} as ONNX Runtime: {why}")]
    Library {
        /// The path of the library.
        library: String,
        /// The error of the library.
        why: String,
    },
    /// The file is not a model, or needs an operator that the engine lacks.
    #[error("load the model `{model}` with {engine}: {why}")]
    Load {
        /// The name of the model.
        model: String,
        /// The name of the engine.
        engine: String,
        /// The error of the engine.
        why: String,
    },
    /// The model has several inputs.
    #[error(
        "use the model `{model}`: it has {count} inputs; only models with one input, the picture, are supported"
    )]
    Inputs {
        /// The name of the model.
        model: String,
        /// The number of the model's inputs.
        count: usize,
    },
    /// Inference failed.
    #[error("run the model `{model}`: {why}")]
    Run {
        /// The name of the model.
        model: String,
        /// The error of the engine.
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

/// Converts a number of a tensor to a byte.
fn byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// Shortens an error to one line.
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

/// The input types.
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
