/// The values around each, `width` of them and fewer at the ends, kept in order.
///
/// Calls `of` with the sorted values around each in turn.
pub(super) fn around_each(values: &[f64], width: usize, of: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let half = width / 2;
    let mut sorted: Vec<f64> = Vec::with_capacity(width + 1);
    let place =
        |sorted: &[f64], value: f64| sorted.partition_point(|each| each.total_cmp(&value).is_lt());
    let mut around = Vec::with_capacity(values.len());
    let mut next = 0;
    for centre in 0..values.len() {
        while next < values.len() && next <= centre + half {
            sorted.insert(place(&sorted, values[next]), values[next]);
            next += 1;
        }
        if centre > half {
            sorted.remove(place(&sorted, values[centre - half - 1]));
        }
        around.push(of(&sorted));
    }
    around
}
