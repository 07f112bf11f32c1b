//! Emulated devices on real transports.

pub mod bluetooth;
