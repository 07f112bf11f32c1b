/// Calibration of a sensor with three axes: alignment⁻¹ · (raw − offset) / sensitivity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Raw values at zero.
    pub offset: [f64; 3],
    /// Raw steps per unit.
    pub sensitivity: [f64; 3],
    /// The orientation of the sensor's axes in the device, as rows of direction cosines.
    pub alignment: [[f64; 3]; 3],
}

impl Calibration {
    /// The size of a sensor's stored calibration [bytes]: 3 × i16 offset, 3 × i16 sensitivity, 9 × i8 alignment in
    /// hundredths, big-endian.
    pub const BYTES: usize = 21;

    /// Decodes a calibration. `scale` is the unit of the stored sensitivity; for a gyroscope it is a hundredth. `None`
    /// if the device was never calibrated, or its values can't be inverted.
    pub fn decode(bytes: &[u8; Self::BYTES], scale: f64) -> Option<Self> {
        let numbers = bytes.as_chunks().0;
        let number =
            |at: usize| numbers.get(at).map_or(0.0, |pair| i16::from_be_bytes(*pair).into());
        let alignment =
            |at: usize| bytes.get(12 + at).map_or(0.0, |byte| f64::from(*byte as i8) / 100.0);
        let calibration = Self {
            offset: [0, 1, 2].map(number),
            sensitivity: [3, 4, 5].map(|at| number(at) * scale),
            alignment: [0, 3, 6].map(|row| [row, row + 1, row + 2].map(alignment)),
        };
        let usable = calibration.sensitivity.iter().all(|steps| *steps > 0.0);
        (usable && calibration.determinant().abs() > 0.1).then_some(calibration)
    }

    /// Converts a raw sample to units.
    pub fn apply(&self, raw: [f64; 3]) -> [f64; 3] {
        let scaled = [0, 1, 2].map(|axis| (raw[axis] - self.offset[axis]) / self.sensitivity[axis]);
        let [x, y, z] = self.columns();
        // Cramer's rule.
        let solved = [triple(scaled, y, z), triple(x, scaled, z), triple(x, y, scaled)];
        solved.map(|part| part / self.determinant())
    }

    fn columns(&self) -> [[f64; 3]; 3] {
        [0, 1, 2].map(|column| self.alignment.map(|row| row[column]))
    }

    fn determinant(&self) -> f64 {
        let [x, y, z] = self.columns();
        triple(x, y, z)
    }
}

/// Returns the triple product: first · (second × third).
fn triple(first: [f64; 3], second: [f64; 3], third: [f64; 3]) -> f64 {
    let minor = |one: usize, other: usize| second[one] * third[other] - second[other] * third[one];
    first[0] * minor(1, 2) + first[1] * minor(2, 0) + first[2] * minor(0, 1)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "these numbers are exact")]
    use super::*;

    /// The low-noise accelerometer in the test of pyshimmer's `GetAllCalibrationCommand`.
    const PUBLISHED: [u8; 21] = [
        0x08, 0xcd, 0x08, 0xcd, 0x08, 0xcd, 0, 0x5c, 0, 0x5c, 0, 0x5c, 0, 0x9c, 0, 0x9c, 0, 0, 0,
        0, 0x9c,
    ];

    #[test]
    fn a_published_calibration_decodes_and_turns_the_axes() {
        let calibration = Calibration::decode(&PUBLISHED, 1.0).unwrap();
        assert_eq!(calibration.offset, [2253.0; 3]);
        assert_eq!(calibration.sensitivity, [92.0; 3]);
        assert_eq!(calibration.alignment, [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]);
        let turned = calibration.apply([2253.0 + 92.0, 2253.0, 2253.0 - 920.0]);
        assert_eq!(turned, [0.0, -1.0, 10.0]);
    }

    #[test]
    fn a_device_that_was_never_calibrated_has_none() {
        assert_eq!(Calibration::decode(&[0; 21], 1.0), None);
        assert_eq!(Calibration::decode(&[0xff; 21], 1.0), None);
    }
}
