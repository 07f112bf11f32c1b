//! What is seen in pictures of cameras, in numbers.

pub mod depth;
pub mod frame;
pub mod model;
pub mod picture;
pub mod hide;
