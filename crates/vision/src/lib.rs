//! Computer vision for camera images: frame measures, face blurring and ONNX models.

pub mod depth;
pub mod frame;
pub mod model;
pub mod picture;
pub mod hide;
