//! Breathing: from a belt, a thermistor or an impedance, and derived from heart beats and pulses.

pub mod derived;
