//! The house itself: its size, its shape, and whether its README tells the truth about it.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Longest source file, in lines.
const LINES_MAX: usize = 500;
/// The members, which with these two files are the eight names of the top level.
const MEMBERS: [&str; 6] = ["benches", "drivers", "fixtures", "harness", "sim-core", "tests"];
/// Files at the top that are no member, no dotfile, and not made by a build.
const FILES: [&str; 5] = ["Cargo.lock", "Cargo.toml", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).unwrap()
}

/// Every source file of the members, with its text.
fn sources() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders: Vec<PathBuf> = MEMBERS.iter().map(|member| root().join(member)).collect();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                found.push((path, text));
            }
        }
    }
    found.sort();
    assert!(found.len() > 50, "the members have sources");
    found
}

/// The modules that stand in files or folders of their own and are built for tests only.
fn only_for_tests(sources: &[(PathBuf, String)]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for (path, text) in sources {
        let folder = path.parent().unwrap_or(path);
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let base = if ["mod", "lib", "main"].contains(&stem) { folder.to_owned() } else { folder.join(stem) };
        for declared in text.split("#[cfg(test)]\n").skip(1).filter_map(|rest| rest.lines().next()) {
            if let Some(file) = declared.strip_prefix("#[path = \"").and_then(|rest| rest.strip_suffix("\"]")) {
                found.push(folder.join(file));
            } else if let Some(name) = declared.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) {
                found.extend([base.join(format!("{name}.rs")), base.join(name)]);
            }
        }
    }
    found
}

#[test]
fn no_file_is_longer_than_five_hundred_lines() {
    for (path, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= LINES_MAX, "{} has {lines} lines, limit {LINES_MAX}", path.display());
    }
}

#[test]
fn the_top_level_is_the_whole_picture() {
    // What a build, or a user who tries the README, leaves there.
    let ignored = std::fs::read_to_string(root().join(".gitignore")).unwrap();
    for entry in std::fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let known = MEMBERS.contains(&name.as_str()) || FILES.contains(&name.as_str());
        let left = name.starts_with('.') || ignored.lines().any(|line| line.trim_matches('/') == name);
        assert!(known || left, "{name} is at the top level");
    }
}

/// Clippy says the same; this also sees what is compiled under no target.
#[test]
fn nothing_unwraps_outside_tests() {
    let sources = sources();
    let tests = only_for_tests(&sources);
    let is_built = |path: &Path| {
        path.components().any(|part| part.as_os_str() == "src") && !tests.iter().any(|test| path.starts_with(test))
    };
    for (path, text) in sources.iter().filter(|(path, _)| is_built(path)) {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        assert!(!code.contains(".unwrap()"), "{} unwraps", path.display());
        for banned in ["#[allow(", "#![allow(", "#[ignore", "#[should_panic"] {
            assert!(!text.contains(banned), "{} holds {banned}", path.display());
        }
    }
}

#[test]
fn every_module_says_what_it_is() {
    for (path, text) in sources() {
        assert!(text.starts_with("//!"), "{} begins with a sentence about itself", path.display());
    }
}

#[test]
fn the_readme_knows_every_crate_and_every_exit_code() {
    let readme = readme();
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    for member in MEMBERS {
        assert!(manifest.contains(&format!("\"{member}\"")), "{member} is a member");
        assert!(readme.contains(&format!("`{member}/`")), "README.md says what {member} is");
    }
    for code in ["| 0 |", "| 1 |", "| 2 |", "| 3 |", "| 4 |", "| 101 |", "| 130 |"] {
        assert!(readme.contains(code), "README.md says what exit code {code} is");
    }
}

/// An invariant in the README ends with the name of the test that holds it, such as `the_schema_is_current`.
#[test]
fn every_test_that_the_readme_names_exists() {
    let readme = readme();
    let section = readme.split("\n## Invariants\n").nth(1).and_then(|rest| rest.split("\n## ").next()).unwrap();
    let sources = sources();
    let mut names = 0;
    for line in section.lines().filter(|line| line.starts_with("- ")) {
        let words: Vec<&str> = line.split('`').skip(1).step_by(2).collect();
        let tests: Vec<&&str> = words.iter().filter(|word| word.matches('_').count() > 1).collect();
        assert!(!tests.is_empty() || line.contains(".ci/run"), "no test holds: {line}");
        for test in tests {
            let signature = format!("fn {test}()");
            assert!(sources.iter().any(|(_, text)| text.contains(&signature)), "there is no test {test}");
            names += 1;
        }
    }
    assert!(names > 5, "the README has invariants");
}

/// With `std`, nalgebra takes products of larger matrices from `matrixmultiply`, whose kernels depend on the processor.
#[test]
fn linear_algebra_is_the_same_on_every_processor() {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "-e", "normal", "-p", "dockhil", "--prefix", "none", "-f", "{p} [{f}]"])
        .current_dir(root())
        .output()
        .unwrap();
    let text = String::from_utf8(tree.stdout).unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let algebra: Vec<&str> = text.lines().filter(|line| line.starts_with("nalgebra ")).collect();
    assert!(!algebra.is_empty(), "{text}");
    for line in algebra {
        let features = line.split('[').nth(1).unwrap().trim_end_matches([']', ' ', '(', '*', ')']);
        assert!(features.split(',').all(|feature| feature != "std"), "{line}");
        assert!(features.split(',').any(|feature| feature == "libm-force"), "{line}");
    }
    assert!(!text.contains("matrixmultiply"), "{text}");
}
