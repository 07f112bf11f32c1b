//! Facial expressions from a model's estimates: how probable each was in a span, and how confident the
//! model was.
//!
//! An expression is what a face shows, not what the person feels, and a model's probabilities are usually
//! overconfident. The values are therefore means with their spread, and a confidence.

pub mod analysis;
