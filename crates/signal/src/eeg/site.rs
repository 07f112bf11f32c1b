//! The electrode site of a channel, by its name.

/// Pairs of frontal sites, left first, in order of preference.
pub(super) const FRONTAL_PAIRS: [(&str, &str); 3] = [("F3", "F4"), ("AF7", "AF8"), ("F7", "F8")];
/// Sites above the eyes, and others where blinks still show, best first.
const BLINK_SITES: [&[&str]; 2] = [
    &["FP1", "FP2", "FPZ", "AF7", "AF8", "AF3", "AF4", "AFZ", "VEOG", "VEOGU"],
    &["F7", "F8", "F3", "F4", "FZ", "F1", "F2", "F5", "F6"],
];

/// The site of the international 10–20 system in a channel's name, in capitals: the first word of names such
/// as `EEG Fz-Ref`, `Fz..` and `RAW_AF7` that is not a generic word for channels.
pub(super) fn site(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words = words.map(str::to_ascii_uppercase);
    let mut words =
        words.filter(|word| !["", "EEG", "RAW", "CHANNEL", "CH"].contains(&word.as_str()));
    words.next().unwrap_or_default()
}

/// The channel at a site.
pub(super) fn channel_at(names: &[String], place: &str) -> Option<usize> {
    names.iter().position(|name| site(name) == place)
}

/// The channels in which blinks show best.
pub(super) fn blink_channels(names: &[String]) -> Vec<usize> {
    let at = |places: &&[&str]| -> Vec<usize> {
        let sits_there = |index: &usize| places.contains(&site(&names[*index]).as_str());
        (0..names.len()).filter(sits_there).collect()
    };
    BLINK_SITES.iter().map(at).find(|channels| !channels.is_empty()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_from_the_names_that_devices_give() {
        for (name, place) in
            [("Fz", "FZ"), ("EEG Fp1-Ref", "FP1"), ("Fz..", "FZ"), ("RAW_AF7", "AF7"), ("", "")]
        {
            assert_eq!(site(name), place);
        }
    }

    #[test]
    fn blinks_are_looked_for_above_the_eyes_first() {
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(blink_channels(&names(&["TP9", "AF7", "AF8", "TP10"])), [1, 2]);
        assert_eq!(blink_channels(&names(&["F3", "Fz", "Pz"])), [0, 1]);
        assert_eq!(blink_channels(&names(&["O1", "O2"])), [0; 0]);
        assert_eq!(channel_at(&names(&["O1", "fz"]), "FZ"), Some(1));
    }
}
