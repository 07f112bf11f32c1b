//! Arrays of numbers: the inputs and outputs of models.

/// The largest number of values in a model's input tensor: 256 MiB.
pub const MOST_NUMBERS: usize = 64 << 20;

/// An array of numbers with its shape, in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// The name of the output; empty for an input.
    pub name: String,
    /// The sizes of the dimensions.
    pub shape: Vec<usize>,
    /// The values.
    pub values: Vec<f32>,
}

impl Tensor {
    /// Creates a tensor; `None` if the number of values does not match the shape.
    pub fn new(name: impl Into<String>, shape: &[usize], values: Vec<f32>) -> Option<Tensor> {
        let count = shape.iter().try_fold(1_usize, |count, side| count.checked_mul(*side))?;
        let (name, shape) = (name.into(), shape.to_vec());
        (count == values.len()).then_some(Tensor { name, shape, values })
    }

    /// Creates a tensor of zeros.
    pub fn zeros(shape: [usize; 4]) -> Tensor {
        let values = vec![0.0; shape.iter().product()];
        Tensor { name: String::new(), shape: shape.to_vec(), values }
    }

    /// The shape without leading dimensions of size one.
    pub fn sides(&self) -> &[usize] {
        let ones = self.shape.iter().take_while(|side| **side == 1).count();
        &self.shape[ones..]
    }

    /// The shape as text: `1 × 17 × 64 × 48`.
    pub fn shown(&self) -> String {
        shown(&self.shape)
    }
}

/// Formats a shape as text.
pub fn shown(shape: &[usize]) -> String {
    let sides: Vec<String> = shape.iter().map(ToString::to_string).collect();
    if sides.is_empty() { "one number".to_owned() } else { sides.join(" × ") }
}

/// The logistic function, which converts a score to a probability.
pub fn sigmoid(score: f32) -> f32 {
    1.0 / (1.0 + (-score.clamp(-80.0, 80.0)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_that_fits_no_numbers_is_refused() {
        assert_eq!(Tensor::new("a", &[2, 3], vec![0.0; 5]), None);
        assert_eq!(Tensor::new("a", &[usize::MAX, 3], vec![0.0; 5]), None);
        let tensor = Tensor::new("a", &[1, 1, 2, 1], vec![0.0; 2]).unwrap();
        assert_eq!((tensor.sides(), tensor.shown().as_str()), (&[2, 1][..], "1 × 1 × 2 × 1"));
    }
}
