//! Arrays of numbers that go into models and come out of them.

/// The most numbers of a tensor that is given to a model [numbers]: 256 MiB.
pub const MOST_NUMBERS: usize = 64 << 20;

/// An array of numbers with its shape, the last dimension first in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// The name of the output; empty for an input.
    pub name: String,
    /// The lengths of its dimensions.
    pub shape: Vec<usize>,
    /// Its numbers.
    pub values: Vec<f32>,
}

impl Tensor {
    /// A tensor of numbers; `None` where there are more or fewer than its shape says.
    pub fn new(name: impl Into<String>, shape: &[usize], values: Vec<f32>) -> Option<Tensor> {
        let count = shape.iter().try_fold(1_usize, |count, side| count.checked_mul(*side))?;
        let (name, shape) = (name.into(), shape.to_vec());
        (count == values.len()).then_some(Tensor { name, shape, values })
    }

    /// A tensor of zeros.
    pub fn zeros(shape: [usize; 4]) -> Tensor {
        let values = vec![0.0; shape.iter().product()];
        Tensor { name: String::new(), shape: shape.to_vec(), values }
    }

    /// Its shape without the dimensions of length one that it starts with.
    pub fn sides(&self) -> &[usize] {
        let ones = self.shape.iter().take_while(|side| **side == 1).count();
        &self.shape[ones..]
    }

    /// Its shape in words: `1 × 17 × 64 × 48`.
    pub fn shown(&self) -> String {
        shown(&self.shape)
    }
}

/// A shape in words.
pub fn shown(shape: &[usize]) -> String {
    let sides: Vec<String> = shape.iter().map(ToString::to_string).collect();
    if sides.is_empty() { "one number".to_owned() } else { sides.join(" × ") }
}

/// The logistic function, which makes a probability of a score.
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
