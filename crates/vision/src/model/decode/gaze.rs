//! Gaze direction, as two angles.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Decode, DecodeError, Found, Tensor, misshaped, output};

/// The settings of a gaze direction.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gaze {
    /// The order of the angles: `yaw_pitch` or `pitch_yaw`.
    #[serde(default)]
    pub order: Order,
    /// Whether the angles are in degrees instead of radians.
    #[serde(default)]
    pub is_degrees: bool,
}

/// The order of the angles.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Yaw, then pitch.
    #[default]
    YawPitch,
    /// Pitch, then yaw.
    PitchYaw,
}

impl Decode for Gaze {
    fn decode(&self, outputs: &[Tensor], _: [usize; 2]) -> Result<Found, DecodeError> {
        let numbers: Vec<f32> = outputs.iter().flat_map(|output| output.values.clone()).collect();
        let Ok([first, second]) = <[f32; 2]>::try_from(numbers) else {
            return Err(misshaped(
                output(outputs, None, 0)?,
                "1 × 2, or two outputs of one number",
            ));
        };
        let (yaw, pitch) = match self.order {
            Order::YawPitch => (first, second),
            Order::PitchYaw => (second, first),
        };
        let angle = |angle: f32| {
            if self.is_degrees { f64::from(angle).to_radians() } else { f64::from(angle) }
        };
        Ok(Found::Values(vec![angle(yaw), angle(pitch)]))
    }

    fn channels(&self) -> Vec<(String, &'static str)> {
        vec![("yaw".to_owned(), "rad"), ("pitch".to_owned(), "rad")]
    }
}
