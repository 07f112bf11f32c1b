//! The engine in pure Rust: rten.

use std::sync::Arc;

use rten::{RunOptions, ThreadPool, Value, ValueOrView};

use super::{Engine, EngineError, Numbers, Tensor, line, one_input};
use crate::model::descriptor::Number;

const NAME: &str = "rten 0.27";

/// A model loaded by rten.
pub(super) struct Pure {
    name: String,
    model: rten::Model,
    number: Number,
    outputs: Vec<String>,
    thread: Arc<ThreadPool>,
}

impl Pure {
    pub(super) fn load(file: Vec<u8>, name: String, number: Number) -> Result<Pure, EngineError> {
        let model = rten::Model::load(file).map_err(|error| EngineError::Load {
            model: name.clone(),
            engine: NAME.to_owned(),
            why: line(&error),
        })?;
        one_input(&name, model.input_ids().len())?;
        let named = |id| model.node_info(id).and_then(|node| node.name()).unwrap_or_default();
        let outputs = model.output_ids().iter().map(|id| named(*id).to_owned()).collect();
        let thread = Arc::new(ThreadPool::with_num_threads(1));
        Ok(Pure { name, model, number, outputs, thread })
    }

    fn failed(&self, why: &impl ToString) -> EngineError {
        EngineError::Run { model: self.name.clone(), why: line(why) }
    }
}

impl Engine for Pure {
    fn label(&self) -> &str {
        NAME
    }

    fn run(&mut self, input: &Tensor) -> Result<Vec<Tensor>, EngineError> {
        let shape = input.shape.as_slice();
        let value = match Numbers::of(input, self.number) {
            Numbers::Float(values) => {
                Value::from_shape(shape, values).map_err(|it| self.failed(&it))?
            }
            Numbers::Byte(values) => {
                Value::from_shape(shape, values).map_err(|it| self.failed(&it))?
            }
            Numbers::Int(values) => {
                Value::from_shape(shape, values).map_err(|it| self.failed(&it))?
            }
        };
        let ids = self.model.input_ids().iter().copied();
        let inputs = ids.zip([ValueOrView::Value(value)]).collect();
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&self.thread)));
        let outputs = self.model.run(inputs, self.model.output_ids(), Some(options));
        let outputs = outputs.map_err(|error| self.failed(&error))?;
        let named = outputs.into_iter().zip(&self.outputs);
        let numbers = |(value, name): (Value, &String)| {
            let why = || self.failed(&format!("its output `{name}` is not an array of numbers"));
            tensor(name, &value).ok_or_else(why)
        };
        named.map(numbers).collect()
    }
}

fn tensor(name: &str, value: &Value) -> Option<Tensor> {
    use rten_tensor::prelude::*;
    let (shape, values) = match value {
        Value::FloatTensor(tensor) => (tensor.shape().to_vec(), tensor.iter().copied().collect()),
        Value::Int32Tensor(tensor) => {
            (tensor.shape().to_vec(), tensor.iter().map(|value| *value as f32).collect())
        }
        Value::UInt8Tensor(tensor) => {
            (tensor.shape().to_vec(), tensor.iter().map(|value| f32::from(*value)).collect())
        }
        Value::Int8Tensor(tensor) => {
            (tensor.shape().to_vec(), tensor.iter().map(|value| f32::from(*value)).collect())
        }
        _ => return None,
    };
    Tensor::new(name, &shape, values)
}
