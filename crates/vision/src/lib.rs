//! What is seen in pictures of cameras, in numbers.

pub mod frame;
pub mod picture;
