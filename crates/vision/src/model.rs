//! User-supplied models: an ONNX file and a descriptor of its input and output.

pub mod chain;
pub mod decode;
pub mod descriptor;
pub mod engine;
pub mod input;
pub mod ready;
pub mod tensor;

use std::path::Path;

use thiserror::Error;

use crate::picture::Picture;
use decode::{DecodeError, Detection, Found};
use descriptor::{Descriptor, DescriptorError, Source};
use engine::{Engine, EngineError, Library};
use input::Placement;
use tensor::Tensor;

/// A loaded model.
pub struct Model {
    /// The descriptor of the model.
    pub descriptor: Descriptor,
    engine: Box<dyn Engine>,
}

/// Why a model cannot be used. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum ModelError {
    /// The descriptor or the model file is invalid.
    #[error(transparent)]
    Descriptor(#[from] DescriptorError),
    /// The engine cannot load or run the model.
    #[error("{0}")]
    Engine(#[from] EngineError),
    /// The outputs do not match the descriptor.
    #[error("read the outputs of the model `{name}`: {error}")]
    Outputs {
        /// The name of the model.
        name: String,
        /// What is wrong with the outputs.
        error: DecodeError,
    },
}

impl Model {
    /// Loads the model of a descriptor, after verifying the model file.
    pub fn load(descriptor: &Path, library: &Library) -> Result<Model, ModelError> {
        let (descriptor, file) = Descriptor::open(descriptor)?;
        let engine = engine::load(file, &descriptor, library)?;
        Ok(Model { descriptor, engine })
    }

    /// The name and version of the engine that runs the model.
    pub fn engine(&self) -> &str {
        self.engine.label()
    }

    /// Runs the model on an input of zeros; returns the raw outputs.
    pub fn dry_run(&mut self) -> Result<Vec<Tensor>, ModelError> {
        let input = Tensor::zeros(self.descriptor.input.shape());
        let outputs = self.engine.run(&input)?;
        self.decode(&outputs)?;
        Ok(outputs)
    }

    /// Runs the model on a picture, or on the part that an earlier model has found for it. Returns `None` if there is
    /// no such part.
    pub fn look(
        &mut self,
        picture: &Picture,
        part: Option<&Detection>,
    ) -> Result<Option<Found>, ModelError> {
        let input = &self.descriptor.input;
        let placement = match (input.source, part) {
            (Source::Frame, _) => Some(Placement::of_picture(input, picture)),
            (Source::Aligned, Some(part)) => Placement::aligned(input, &part.points),
            (Source::Hand, Some(part)) => Placement::of_hand(input, part),
            (_, Some(part)) => Placement::of_part(input, part),
            (_, None) => None,
        };
        let Some(placement) = placement else { return Ok(None) };
        let outputs = self.engine.run(&input::tensor(input, picture, &placement))?;
        let found = self.decode(&outputs)?;
        Ok(Some(found.placed(&placement)))
    }

    fn decode(&self, outputs: &[Tensor]) -> Result<Found, ModelError> {
        let named = |error| ModelError::Outputs { name: self.descriptor.name.clone(), error };
        self.descriptor.output.decode(outputs, self.descriptor.input.size).map_err(named)
    }
}
