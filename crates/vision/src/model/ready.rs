//! Descriptors of published models. Users download the model files under the files' own licences.

/// A descriptor without a model file, which `teampulse models add` completes.
#[derive(Clone, Copy, Debug)]
pub struct Ready {
    /// The name of the model.
    pub name: &'static str,
    /// The text of the descriptor, without a file hash.
    pub text: &'static str,
}

/// The table of all ready-made descriptors.
pub const READY: &[Ready] = &[
    Ready { name: "yunet", text: include_str!("../../descriptors/yunet.toml") },
    Ready { name: "fer", text: include_str!("../../descriptors/fer.toml") },
    Ready { name: "mediapipe_pose", text: include_str!("../../descriptors/mediapipe_pose.toml") },
    Ready { name: "rtmpose", text: include_str!("../../descriptors/rtmpose.toml") },
    Ready { name: "mediapipe_palm", text: include_str!("../../descriptors/mediapipe_palm.toml") },
    Ready { name: "mediapipe_hand", text: include_str!("../../descriptors/mediapipe_hand.toml") },
    Ready { name: "emotieff", text: include_str!("../../descriptors/emotieff.toml") },
];

/// Returns the ready-made descriptor with this name.
pub fn named(name: &str) -> Option<&'static Ready> {
    READY.iter().find(|ready| ready.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::descriptor::Descriptor;

    #[test]
    fn every_ready_descriptor_is_read_and_lacks_only_the_hash_of_its_file() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/descriptors");
        assert_eq!(std::fs::read_dir(folder).unwrap().count(), READY.len());
        for ready in READY {
            let read = Descriptor::parse(ready.text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((read.name.as_str(), read.sha256.as_str()), (ready.name, ""));
            assert!(!read.licence.is_empty() && read.origin.starts_with("https://"), "{read:?}");
        }
    }
}
