//! A picture divided into blocks of pixels.

use crate::picture::Picture;

/// The width and height of a block [pixels].
const SIDE: usize = 8;

/// The mean colours of the blocks of a picture, row by row [0..1]. Incomplete blocks at the right and lower edge are
/// left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Blocks {
    pub columns: usize,
    pub rows: usize,
    pub colours: Vec<[f64; 3]>,
}

impl Blocks {
    pub fn of(picture: &Picture) -> Blocks {
        let (width, height) = (picture.width as usize, picture.height as usize);
        let (columns, rows) = (width / SIDE, height / SIDE);
        let mut sums = vec![[0_u32; 3]; columns * rows];
        for (at, row) in picture.rgb.chunks_exact((3 * width).max(1)).take(rows * SIDE).enumerate()
        {
            let line = &mut sums[at / SIDE * columns..][..columns];
            for (sum, pixels) in line.iter_mut().zip(row.as_chunks::<{ 3 * SIDE }>().0) {
                for pixel in pixels.as_chunks::<3>().0 {
                    for (sum, byte) in sum.iter_mut().zip(pixel) {
                        *sum += u32::from(*byte);
                    }
                }
            }
        }
        let scale = 1.0 / (255.0 * (SIDE * SIDE) as f64);
        let colours = sums.into_iter().map(|sum| sum.map(|sum| f64::from(sum) * scale)).collect();
        Blocks { columns, rows, colours }
    }

    /// The luma of each block (ITU-R BT.601) [0..1].
    pub fn lumas(&self) -> impl Iterator<Item = f64> {
        self.colours.iter().map(|[red, green, blue]| 0.299 * red + 0.587 * green + 0.114 * blue)
    }

    /// The mean luma; NaN if there are no blocks.
    pub fn mean_luma(&self) -> f64 {
        self.lumas().sum::<f64>() / self.colours.len() as f64
    }
}
