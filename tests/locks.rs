//! The page in a browser is a workspace of its own. It is built of the same releases of every dependency as the program, so that its
//! numbers are the program's.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The releases of every package that a lock file names.
fn releases(path: &str) -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
    let lock: toml::Table = text.parse().unwrap();
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in lock["package"].as_array().unwrap() {
        let field = |name: &str| package[name].as_str().unwrap().to_owned();
        all.entry(field("name")).or_default().insert(field("version"));
    }
    all
}

#[test]
fn the_page_has_the_releases_of_the_program() {
    let own = releases("Cargo.lock");
    for path in ["page/Cargo.lock"] {
        let shared: Vec<_> = releases(path).into_iter().filter(|(name, _)| own.contains_key(name)).collect();
        assert!(shared.len() > 100, "{path}: {}", shared.len());
        for (name, versions) in shared {
            assert!(
                versions.is_subset(&own[&name]),
                "{path}: {name} {versions:?}, the program has {:?}: copy Cargo.lock to {path}, then run cargo metadata there",
                own[&name]
            );
        }
    }
}
