#![doc = include_str!("../README.md")]

pub mod cdr;
pub mod standard;
pub mod convert;
pub mod definition;
pub mod ros1;
pub mod catalogue;
pub mod fields;
pub mod value;
pub mod readout;
pub mod pictures;
pub mod video;
pub mod audio;
pub mod hri;
