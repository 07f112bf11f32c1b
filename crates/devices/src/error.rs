/// Why a session ended by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The device lacks something that the protocol needs, so it is not a device of this kind.
    #[error("the device has no {0}")]
    Missing(&'static str),
    /// The device stopped answering. Close the link and connect again.
    #[error("the device did not answer {0}")]
    NoAnswer(&'static str),
    /// A stream stayed silent after all attempts to restart it. Close the link and connect again.
    #[error("the device sends no {0}")]
    Silent(&'static str),
    /// The device refused a request that the session can't do without.
    #[error("the device refused: {0}")]
    Refused(&'static str),
}

/// Why bytes could not be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// Bytes are missing at the end.
    #[error("{what} has {got} bytes, expected at least {expected}")]
    Truncated {
        /// What was decoded.
        what: &'static str,
        /// The minimum number of bytes needed.
        expected: usize,
        /// The number of bytes present.
        got: usize,
    },
    /// A field has a value that the protocol's documents don't list.
    #[error("{what} is {got:#x}, which is unknown")]
    Unknown {
        /// The name of the field.
        what: &'static str,
        /// The value of the field.
        got: u32,
    },
}
