//! The inputs of an extractor of many streams.

use teampulse_core::stream::Stream;

/// The names of the streams that joined, in order.
///
/// An extractor of a whole session has many inputs: its outputs are not redeclared for each, but at most once a second
/// if there are new ones.
#[derive(Debug, Default)]
pub(crate) struct Inputs {
    names: Vec<String>,
    declared: usize,
}

impl Inputs {
    /// Adds a stream.
    pub(crate) fn join(&mut self, stream: &Stream) {
        if !self.names.contains(&stream.name) {
            self.names.push(stream.name.clone());
        }
    }

    /// All names, if any was added since the last call.
    pub(crate) fn take_news(&mut self) -> Option<Vec<String>> {
        let is_news = self.declared < self.names.len();
        self.declared = self.names.len();
        is_news.then(|| self.names.clone())
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    #[test]
    fn a_new_input_is_reported_once() {
        let mut inputs = Inputs::default();
        let join = |inputs: &mut Inputs, name: &str| {
            inputs.join(&Stream::raw(name, Subject::team(), Shape::Event));
        };
        join(&mut inputs, "/a");
        join(&mut inputs, "/b");
        assert_eq!(inputs.take_news().unwrap(), ["/a", "/b"]);
        join(&mut inputs, "/a");
        assert_eq!(inputs.take_news(), None);
    }
}
