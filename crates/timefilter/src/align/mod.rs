//! Alignment: values of many streams at common times, onto a grid or onto a pivot stream.
