#![doc = include_str!("../README.md")]
#![cfg_attr(
    test,
    expect(clippy::float_cmp, reason = "tests compare exactly where the arithmetic is exact")
)]

pub mod body;
pub mod task;
pub mod robots;
pub mod devices;
pub mod noise;
