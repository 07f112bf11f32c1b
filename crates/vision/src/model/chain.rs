//! A chain of models that process each picture in turn: detectors of faces, persons or hands first, then the models
//! that process these.

use super::decode::{Detection, Found};
use super::descriptor::{Descriptor, Source, Subject};
use super::{Model, ModelError};
use crate::picture::Picture;

/// The largest number of hands in a picture that a hand model processes.
const MOST_HANDS: usize = 4;

/// Models in the order in which they process a picture.
pub struct Chain {
    models: Vec<Model>,
}

/// What the models have found in a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// The channel values of each stream of each model: NaN where it found nothing, or had no input.
    pub numbers: Vec<Vec<f64>>,
    /// All faces found by any of the models.
    pub faces: Vec<Detection>,
}

/// Returns what is wrong with a chain, if anything: a model needs a part that no earlier model finds.
pub fn missing(descriptors: &[Descriptor]) -> Option<String> {
    descriptors.iter().enumerate().find_map(|(place, descriptor)| {
        let wanted = subject(descriptor.input.source)?;
        let finds = |earlier: &Descriptor| earlier.output.finds() == Some(wanted);
        let is_found = descriptors[..place].iter().any(finds);
        let name = &descriptor.name;
        (!is_found).then(|| format!("`{name}` needs a {wanted}, which no model before it finds"))
    })
}

fn subject(source: Source) -> Option<Subject> {
    match source {
        Source::Frame => None,
        Source::Face | Source::Aligned => Some(Subject::Face),
        Source::Person => Some(Subject::Person),
        Source::Hand => Some(Subject::Hand),
    }
}

impl Chain {
    /// Creates a chain of models in this order.
    pub fn new(models: Vec<Model>) -> Chain {
        Chain { models }
    }

    /// The models.
    pub fn models(&mut self) -> &mut [Model] {
        &mut self.models
    }

    /// Processes a picture.
    pub fn look(&mut self, picture: &Picture) -> Result<Findings, ModelError> {
        let mut parts: Vec<(Subject, Detection)> = Vec::new();
        let mut looked = Findings::default();
        for model in &mut self.models {
            let wanted = subject(model.descriptor.input.source);
            let is_wanted = |(subject, _): &&(Subject, Detection)| Some(*subject) == wanted;
            let is_for_both = model.descriptor.output.sides().len() > 1;
            let most = if is_for_both { MOST_HANDS } else { 1 };
            let mut found = Vec::new();
            for (_, part) in parts.iter().filter(is_wanted).take(most) {
                found.extend(model.look(picture, Some(part))?);
            }
            if wanted.is_none() {
                found.extend(model.look(picture, None)?);
            }
            if let (Some(subject), Some(Found::Detections(found))) =
                (model.descriptor.output.finds(), found.first())
            {
                let best = found.iter().take(MOST_HANDS);
                parts.extend(best.map(|part| (subject, part.clone())));
                if subject == Subject::Face {
                    looked.faces.extend_from_slice(found);
                }
            }
            looked.numbers.extend(model.descriptor.output.numbers(&found));
        }
        Ok(looked)
    }
}
