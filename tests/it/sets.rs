//! The sets of recordings in `fixtures/`: sound, the ones that their README lists, and described in words of the catalogue.

use fixtures::{AUX, DEMO, EXPECTATIONS, LEARN, SETS, TEST};
use harness::recording::{Grade, Kind, ReadOptions, from_bytes, read};
use sim_core::effects::standard;

fn names() -> impl Iterator<Item = &'static str> {
    LEARN.into_iter().chain(AUX).chain(TEST)
}

#[test]
fn every_recording_is_sound_and_has_the_hash_of_the_readme() {
    let readme = std::fs::read_to_string(fixtures::folder().join("README.md")).unwrap();
    for set in SETS {
        for name in names() {
            let session = read(&fixtures::session(set, name), &ReadOptions::default()).unwrap();
            assert_eq!(session.grade, Grade::A, "{set}/{name}: {:?}", session.findings);
            let line = format!("{}  {set}/{name}\n", session.sha256);
            assert!(readme.contains(&line), "fixtures/README.md lists {line}");
            let expected = match name {
                "static.mcap" => Kind::Static,
                "excite.mcap" => Kind::FreeFlight,
                _ => Kind::Impact,
            };
            assert_eq!(session.kind, expected, "{set}/{name}");
        }
        let entries = std::fs::read_dir(fixtures::folder().join("sessions").join(set)).unwrap();
        assert_eq!(entries.count(), names().count(), "{set} holds nothing else");
    }
}

#[test]
fn what_is_inside_the_program_is_the_set_on_disk() {
    let mut inside: Vec<&str> = DEMO.iter().map(|recording| recording.name).collect();
    let mut on_disk: Vec<&str> = names().collect();
    inside.sort_unstable();
    on_disk.sort_unstable();
    assert_eq!(inside, on_disk);
    for recording in DEMO {
        let embedded = from_bytes(recording.name, recording.bytes, &ReadOptions::default()).unwrap();
        let file = read(&fixtures::session("cell-a", recording.name), &ReadOptions::default()).unwrap();
        assert_eq!(embedded.sha256, file.sha256);
    }
}

#[test]
fn what_a_set_must_yield_is_said_in_words_of_the_catalogue() {
    assert_eq!(EXPECTATIONS.map(|expectation| expectation.set), SETS);
    let catalog = standard();
    for effect in EXPECTATIONS.iter().flat_map(|expectation| expectation.effects) {
        let kind = catalog.get(effect.id).unwrap_or_else(|| panic!("{} is no effect", effect.id));
        for value in effect.parameters {
            let param = kind.params.iter().find(|param| param.name == value.name).unwrap();
            assert!((param.lower..=param.upper).contains(&value.value), "{} {}", effect.id, value.name);
        }
    }
}
