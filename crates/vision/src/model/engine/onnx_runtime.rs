//! An installed ONNX Runtime, whose library is opened when a model is loaded.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ort::environment::Environment;
use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::{DynValue, Tensor as Value};

use super::{Engine, EngineError, Numbers, Tensor, line, one_input};
use crate::model::descriptor::Number;

/// The open library, and the environment shared by its models: one per process.
static OPEN: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// A model loaded by ONNX Runtime.
pub(super) struct OnnxRuntime {
    name: String,
    engine: String,
    session: Session,
    number: Number,
}

impl OnnxRuntime {
    pub(super) fn load(
        file: &[u8],
        name: String,
        number: Number,
        library: &Path,
    ) -> Result<OnnxRuntime, EngineError> {
        let environment = environment(library)?;
        let engine = format!("ONNX Runtime ({})", library.display());
        let session = session(&environment, file).map_err(|why| EngineError::Load {
            model: name.clone(),
            engine: engine.clone(),
            why: line(&why),
        })?;
        one_input(&name, session.inputs().len())?;
        Ok(OnnxRuntime { name, engine, session, number })
    }
}

/// Opens the library, once per process.
fn environment(library: &Path) -> Result<Environment, EngineError> {
    let refused = |why: &str| EngineError::Library {
        library: library.display().to_string(),
        why: line(&why),
    };
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    match &*open {
        Some((other, environment)) if other == library => return Ok(environment.clone()),
        Some((other, _)) => return Err(refused(&format!("{} is already open", other.display()))),
        None => {}
    }
    let builder = ort::init_from(library).map_err(|error| refused(&error.to_string()))?;
    let environment = builder.with_telemetry(false).build();
    let environment = environment.map_err(|error| refused(&error.to_string()))?;
    *open = Some((library.to_owned(), environment.clone()));
    Ok(environment)
}

/// Creates a session with one thread that waits without spinning: two threads are slower on a busy computer.
fn session(environment: &Environment, file: &[u8]) -> Result<Session, String> {
    let said = |error: ort::Error<_>| error.to_string();
    let builder = Session::builder(environment).map_err(|error| error.to_string())?;
    let builder = builder.with_optimization_level(GraphOptimizationLevel::Level3).map_err(said)?;
    let builder = builder.with_intra_threads(1).map_err(said)?;
    let mut builder = builder.with_intra_op_spinning(false).map_err(said)?;
    builder.commit_from_memory(file).map_err(|error| error.to_string())
}

impl Engine for OnnxRuntime {
    fn label(&self) -> &str {
        &self.engine
    }

    fn run(&mut self, input: &Tensor) -> Result<Vec<Tensor>, EngineError> {
        let model = self.name.clone();
        let failed = |why: String| EngineError::Run { model: model.clone(), why: line(&why) };
        let value = value(input, self.number).map_err(|error| failed(error.to_string()))?;
        let outputs = self.session.run(ort::inputs![value]);
        let outputs = outputs.map_err(|error| failed(error.to_string()))?;
        outputs.iter().map(|(name, value)| tensor(name, &value).map_err(&failed)).collect()
    }
}

fn value(input: &Tensor, number: Number) -> ort::Result<DynValue> {
    let shape = input.shape.clone();
    Ok(match Numbers::of(input, number) {
        Numbers::Float(values) => Value::from_array((shape, values))?.into_dyn(),
        Numbers::Byte(values) => Value::from_array((shape, values))?.into_dyn(),
        Numbers::Int(values) => Value::from_array((shape, values))?.into_dyn(),
    })
}

fn tensor(name: &str, value: &ort::value::ValueRef<'_>) -> Result<Tensor, String> {
    let floats = value.try_extract_tensor::<f32>().map(|(shape, values)| (shape, values.to_vec()));
    let numbers = floats.or_else(|_| {
        let whole = value.try_extract_tensor::<i64>();
        whole.map(|(shape, values)| (shape, values.iter().map(|each| *each as f32).collect()))
    });
    let (shape, values) = numbers.map_err(|error| format!("its output `{name}`: {error}"))?;
    let shape: Vec<usize> = shape.iter().map(|side| usize::try_from(*side).unwrap_or(0)).collect();
    Tensor::new(name, &shape, values).ok_or_else(|| format!("its output `{name}` has no shape"))
}
