//! The sharpness of a picture.

use crate::picture::Picture;

/// Returns the variance of the Laplacian of the luma, divided by the variance of the luma; NaN without contrast
/// (Pech-Pacheco et al. 2000, doi:10.1109/ICPR.2000.903548).
pub(super) fn of(picture: &Picture) -> f64 {
    let width = picture.width as usize;
    if width < 3 || picture.height < 3 {
        return f64::NAN;
    }
    let lumas: Vec<i32> = picture.rgb.as_chunks::<3>().0.iter().copied().map(luma).collect();
    let (mut of_luma, mut of_laplacian) = (Moments::default(), Moments::default());
    // Every other row is enough and halves the work.
    for row in (1..picture.height as usize - 1).step_by(2) {
        let line = |row: usize| &lumas[row * width..(row + 1) * width];
        let (above, here, below) = (line(row - 1), line(row), line(row + 1));
        for (around, (above, below)) in here.windows(3).zip(above[1..].iter().zip(&below[1..])) {
            let &[left, middle, right] = around else { continue };
            of_luma.add(middle);
            of_laplacian.add(above + below + left + right - 4 * middle);
        }
    }
    let contrast = of_luma.variance();
    if contrast > 0.0 { of_laplacian.variance() / contrast } else { f64::NAN }
}

/// Returns the luma (ITU-R BT.601), in 256ths.
fn luma([red, green, blue]: [u8; 3]) -> i32 {
    77 * i32::from(red) + 150 * i32::from(green) + 29 * i32::from(blue)
}

#[derive(Default)]
struct Moments {
    count: i64,
    sum: i64,
    square: i64,
}

impl Moments {
    fn add(&mut self, number: i32) {
        let number = i64::from(number);
        self.count += 1;
        self.sum += number;
        self.square += number * number;
    }

    fn variance(&self) -> f64 {
        let mean = self.sum as f64 / self.count as f64;
        (self.square as f64 / self.count as f64 - mean * mean).max(0.0)
    }
}
