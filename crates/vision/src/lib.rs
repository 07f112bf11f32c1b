//! What is seen in pictures of cameras.

pub mod picture;
