//! Maths on slices and streaming filters: no samples, no I/O, no async. Useful alone.
