//! Summary of the segments of a span.

use super::pieces::Piece;
use crate::analysis::Reason;
use crate::robust::median_in_place;

/// Medians and means over segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signs {
    pub(super) kurtosis: Result<f64, Reason>,
    qrs_share: Result<f64, Reason>,
    base_share: Result<f64, Reason>,
    pub(super) flat: f64,
    pub(super) saturated: f64,
    moved: f64,
}

impl Signs {
    pub(super) fn of(pieces: &[Piece]) -> Option<Signs> {
        let mean =
            |value: fn(&Piece) -> f64| pieces.iter().map(value).sum::<f64>() / pieces.len() as f64;
        let typical = |value: fn(&Piece) -> f64| {
            let known = pieces.iter().map(value).filter(|value| value.is_finite());
            median_in_place(&mut known.collect::<Vec<_>>()).ok_or(Reason::Undefined)
        };
        (!pieces.is_empty()).then(|| Signs {
            kurtosis: typical(|piece| piece.kurtosis),
            qrs_share: typical(|piece| piece.qrs_share),
            base_share: typical(|piece| piece.base_share),
            flat: mean(|piece| piece.flat),
            saturated: mean(|piece| piece.saturated),
            moved: mean(|piece| f64::from(u8::from(piece.moved))),
        })
    }

    /// The results in the order of the values.
    pub(super) fn values(signs: Option<Signs>) -> [Result<f64, Reason>; 6] {
        signs.map_or([Err(Reason::Short); 6], |signs| {
            let Signs { kurtosis, qrs_share, base_share, flat, saturated, moved } = signs;
            [kurtosis, qrs_share, base_share, Ok(flat), Ok(saturated), Ok(moved)]
        })
    }
}
