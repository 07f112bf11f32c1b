//! What the workers of a study need: streams and model descriptors.

use std::path::{Path, PathBuf};

use teampulse_core::pattern::Pattern;
use teampulse_vision::model::descriptor::{Descriptor, DescriptorError};
use teampulse_workers::{Blur, Model, Program};

use crate::study::{Study, StudyError};

/// The streams and descriptors that workers name.
pub struct Workers {
    pub streams: Vec<Pattern>,
    descriptors: Vec<PathBuf>,
}

impl Workers {
    /// Reads the streams and descriptors that a study's workers name.
    pub fn of(study: &Study) -> Result<Workers, StudyError> {
        let programs: Vec<Program> = study.settings_of("workers", "program")?;
        let models: Vec<Model> = study.settings_of("workers", "model")?;
        let blurs: Vec<Blur> = study.settings_of("workers", "blur")?;
        let of_programs = programs.into_iter().flat_map(|program| program.streams);
        let of_models = models.iter().flat_map(|model| model.streams.clone());
        let of_blurs = blurs.into_iter().flat_map(|blur| blur.descriptors);
        Ok(Workers {
            streams: of_programs.chain(of_models).collect(),
            descriptors: models
                .into_iter()
                .flat_map(|model| model.descriptors)
                .chain(of_blurs)
                .collect(),
        })
    }

    /// Returns a message for each descriptor that can't be read, with the reason.
    pub fn unread(&self) -> Vec<String> {
        self.descriptors.iter().filter_map(|path| failure(path)).collect()
    }
}

fn failure(path: &Path) -> Option<String> {
    match Descriptor::read(path).err()? {
        error @ DescriptorError::File { .. } => Some(format!("a model: failed to {error}")),
        error => Some(format!("the model {}: failed to {error}", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_without_a_descriptor_are_named() {
        let text = r#"
            [[workers]]
            type = "model"
            streams = ["/robot1/front/compressed"]
            descriptors = ["/nowhere/yunet.toml"]
        "#;
        let study = Study::parse(Path::new("study.toml"), text.to_owned()).expect("a study");
        let workers = Workers::of(&study).expect("workers");
        assert_eq!(workers.streams.len(), 1);
        let unread = workers.unread();
        assert!(unread.len() == 1 && unread[0].contains("/nowhere/yunet.toml"), "{unread:?}");
    }
}
