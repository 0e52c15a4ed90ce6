//! The catalogue as data: it equals the folder, and every entry is complete.

use sim_core::effects::standard;
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn the_catalogue_is_the_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim-core/src/effects");
    let files =
        std::fs::read_dir(&folder).expect("the folder of the effects").map(|entry| entry.expect("an entry").path());
    let names = files.map(|path| path.file_stem().expect("a file name").to_string_lossy().replace('_', "-"));
    let names: BTreeSet<String> = names.filter(|name| name != "mod").collect();
    let ids: Vec<String> = standard().kinds().iter().map(|kind| kind.id.to_string()).collect();
    assert!(ids.windows(2).all(|pair| pair[0] < pair[1]), "ids are sorted and unique: {ids:?}");
    assert_eq!(ids, names.into_iter().collect::<Vec<_>>());
}

#[test]
fn every_entry_is_complete() {
    for kind in standard().kinds() {
        let id = &kind.id;
        assert_eq!(kind.wires.len(), 1, "{id} rewrites one wire");
        for text in [&kind.about, &kind.fingerprint, &kind.experiment] {
            let first = text.chars().next().expect("a text");
            assert!(first.is_lowercase() && !text.ends_with('.'), "{id}: {text:?} is a fragment");
        }
        for param in &kind.params {
            let name = format!("{id} {}", param.name);
            assert!(param.lower <= param.off && param.off <= param.upper, "{name}: off is within the bounds");
            assert!(param.scale > 0.0 && !param.starts.is_empty(), "{name} can be fitted");
            for start in &param.starts {
                assert!((param.lower..=param.upper).contains(start), "{name} starts within the bounds");
            }
        }
        let moved = kind.params.iter().any(|p| p.starts.iter().any(|start| (start - p.off).abs() > 0.0));
        assert!(moved, "{id}: a fit starts away from off");
    }
}
