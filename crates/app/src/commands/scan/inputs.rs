//! This computer's keyboards, mice and gamepads.

use serde::Serialize;
use teampulse_sources::inputs::FoundInput;

use crate::output;

/// A keyboard, mouse or gamepad.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Input {
    device: String,
    name: String,
    kinds: Vec<&'static str>,
    /// The command that gives this user permission to read it, if that is missing.
    permit: Option<&'static str>,
}

impl Input {
    /// Returns all input devices of this computer.
    pub fn all() -> Vec<Input> {
        FoundInput::all().iter().map(Input::of).collect()
    }

    fn of(found: &FoundInput) -> Input {
        Input {
            device: found.path.display().to_string(),
            name: found.name.clone(),
            kinds: found.kinds.iter().map(|kind| kind.name()).collect(),
            permit: (!found.is_permitted).then_some("sudo usermod -aG input $USER"),
        }
    }

    fn line(&self) -> String {
        let Input { device, name, kinds, .. } = self;
        format!("  {name:<38} {device:<38} {}", kinds.join(", "))
    }
}

/// Prints input devices, with the lines of a study that read them.
pub fn show(inputs: &[Input]) {
    if inputs.is_empty() {
        return;
    }
    output::line(format!("keyboards, mice and gamepads: {}", inputs.len()));
    output::lines(inputs.iter().map(Input::line));
    if let Some(command) = inputs.iter().find_map(|input| input.permit) {
        output::line(format!(
            "    no permission for some: `{command}`, then log out and in again; on X11, keyboards and mice are read \
             without it"
        ));
    }
    output::line(
        "\nlines for a study, with the person who uses them; which keys are pressed is never recorded:",
    );
    output::line(source());
}

/// Returns the lines of a study that read all input devices.
fn source() -> &'static str {
    "[[sources]]\ntype   = \"inputs\"\nperson = \"p001\"\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_are_those_of_a_study() {
        let study: toml::Table = toml::from_str(source()).expect("lines of a study");
        assert_eq!(study["sources"][0]["type"].as_str(), Some("inputs"));
    }
}
