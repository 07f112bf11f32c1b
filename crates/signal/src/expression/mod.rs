//! What a model's estimates of an expression say of a span: how probable each was, and how sure the model was.
//!
//! An expression is what a face shows, not what somebody feels, and a model's probabilities are more certain than it is
//! right. So the values are means, with their spread, and a confidence beside them.

pub mod analysis;
