//! Any bytes, and any damage to a valid file, give a recording or an error, never a panic.

mod files;

use proptest::prelude::*;
use teampulse_formats::{Content, Recording, read};

/// Whether every number belongs to a sample, and every sample is complete.
fn is_consistent(recording: &Recording) -> bool {
    recording.signals.iter().all(|signal| {
        let width = signal.channels.len().max(1);
        match &signal.content {
            Content::Even(runs) => {
                runs.iter().all(|run| run.samples.len() % width == 0 && run.period_ns > 0.0)
            }
            Content::Uneven { at_ns, values } => values.len() == at_ns.len() * width,
            Content::Marks(_) => true,
        }
    })
}

proptest! {
    #[test]
    fn any_bytes_behind_a_beginning_are_read_or_refused(
        which in 0_usize..5,
        bytes in prop::collection::vec(any::<u8>(), 0..600),
    ) {
        let beginnings: [&[u8]; 5] = [b"PK\x03\x04", b"Obj\x01", b"XDF:", b"0       ", b"\xffBIOSEMI"];
        let file = [beginnings[which], &bytes].concat();
        let result = read(&file).expect("it begins like a format");
        prop_assert!(result.as_ref().map_or(true, is_consistent));
        prop_assert!(result.is_ok() || !result.unwrap_err().hint().is_empty());
    }

    #[test]
    fn damaged_files_are_read_or_refused(
        which in 0_usize..8,
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let back = || files::xdf_with_stamps(&[0.0, 0.25, 9.0, 3.0], 4.0);
        let bounded = || files::xdf_with_boundaries(2.5).0;
        let integers = || files::xdf_with_integers(&[0, 5, i64::MAX]);
        let reset = || {
            let offsets = [(0.0, 3.0), (5.0, 3.0), (-90.0, 100.0), (-85.0, 100.0)];
            files::xdf_with_offsets(&[0.0, 0.25, -90.0, -89.75], 4.0, &offsets)
        };
        let (of_devices, of_edf) = ([files::e4, files::embrace_plus, files::xdf], files::edf);
        let mut file = match which {
            3 => of_edf(),
            4 => back(),
            5 => bounded(),
            6 => integers(),
            7 => reset(),
            device => of_devices[device](),
        };
        let at = at.index(file.len());
        file[at] = byte;
        if is_cut {
            file.truncate(cut.index(file.len()));
        }
        if let Some(Ok(recording)) = read(&file) {
            prop_assert!(is_consistent(&recording));
        }
    }
}
