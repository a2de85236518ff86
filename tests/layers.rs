//! Imports go one way: no module of a folder needs, by way of its siblings, one that needs it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{Attribute, File, Item, ItemMod, Path as Named, UseTree, visit::Visit};

/// A module by the names that lead to it from the crate's root.
type Module = Vec<String>;

/// The paths that one file names, of uses and of expressions.
#[derive(Default)]
struct Paths(Vec<Vec<String>>);

impl<'ast> Visit<'ast> for Paths {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Mod(ItemMod { attrs, .. }) if attrs.iter().any(is_test) => {}
            Item::Use(used) => self.under(&[], &used.tree),
            _ => syn::visit::visit_item(self, item),
        }
    }

    fn visit_path(&mut self, path: &'ast Named) {
        self.0.push(path.segments.iter().map(|part| part.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }
}

impl Paths {
    fn under(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.under(&with(&path.ident), &path.tree),
            UseTree::Name(name) => self.0.push(with(&name.ident)),
            UseTree::Rename(renamed) => self.0.push(with(&renamed.ident)),
            UseTree::Glob(_) => self.0.push(before.to_vec()),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.under(before, tree)),
        }
    }
}

fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Ident>().is_ok_and(|name| name == "test")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let found = entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    found.filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
}

/// The modules below a folder, and the paths that each of them names.
fn modules(root: &Path) -> BTreeMap<Module, Paths> {
    let mut all = BTreeMap::new();
    for path in files(root) {
        let inside = path.strip_prefix(root).unwrap().with_extension("");
        let mut module: Module = inside.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        module.retain(|part| part != "mod");
        // What only tests have, and the two roots, which name everything.
        let is_left_out = module.iter().any(|part| ["tests", "hostile", "lib", "main"].contains(&part.as_str()));
        if is_left_out || module.is_empty() {
            continue;
        }
        let file: File = syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap();
        let mut paths = Paths::default();
        paths.visit_file(&file);
        all.insert(module, paths);
    }
    all
}

/// The modules of what a crate's root passes on by these names.
fn passed_on(root: &Path) -> BTreeMap<String, Module> {
    let Ok(text) = fs::read_to_string(root.join("lib.rs")) else { return BTreeMap::new() };
    let items = syn::parse_file(&text).unwrap().items;
    let mut paths = Paths::default();
    for item in items {
        if let Item::Use(used) = item {
            paths.under(&[], &used.tree);
        }
    }
    paths.0.into_iter().filter_map(|mut path| path.pop().map(|name| (name, path))).collect()
}

/// The module that a path leads to, seen from `from`.
fn target(
    path: &[String],
    from: &Module,
    all: &BTreeMap<Module, Paths>,
    homes: &BTreeMap<String, Module>,
) -> Option<Module> {
    let mut at = from.clone();
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => {
            (at, rest) = (Vec::new(), &path[1..]);
            if let Some(home) = rest.first().and_then(|name| homes.get(name)) {
                at.clone_from(home);
            }
        }
        "self" => rest = &path[1..],
        "super" => {
            while let [first, more @ ..] = rest
                && first == "super"
            {
                at.pop();
                rest = more;
            }
        }
        // A child, or what is no module of this crate.
        child if all.contains_key(&[from.as_slice(), &[child.to_owned()]].concat()) => {}
        _ => return None,
    }
    at.extend(rest.iter().cloned());
    while !at.is_empty() && !all.contains_key(&at) {
        at.pop();
    }
    (!at.is_empty()).then_some(at)
}

/// Folder by folder, which of its modules needs which other one, by the files in them.
fn needs(root: &Path) -> BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> {
    let (all, homes) = (modules(root), passed_on(root));
    let mut folders: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (from, paths) in &all {
        for to in paths.0.iter().filter_map(|path| target(path, from, &all, &homes)) {
            let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            if let (Some(ours), Some(theirs)) = (from.get(shared), to.get(shared)) {
                let folder = folders.entry(from[..shared].to_vec()).or_default();
                folder.entry(ours.clone()).or_default().insert(theirs.clone());
            }
        }
    }
    folders
}

#[test]
fn no_module_needs_one_that_needs_it() {
    for root in [
        "services",
        "readers/src",
        "readers-parquet/src",
        "workbench/src",
        "ipc-types/src",
        "ros2/src",
        "page/src",
        "gyro-model/src",
    ] {
        for (folder, mut left) in needs(&Path::new(env!("CARGO_MANIFEST_DIR")).join(root)) {
            // Takes away, again and again, what needs nothing that is left: what stays is in a circle, or needs one.
            loop {
                let before = left.len();
                let names: BTreeSet<String> = left.keys().cloned().collect();
                left.retain(|_, needed| needed.iter().any(|need| names.contains(need)));
                if left.len() == before {
                    break;
                }
            }
            assert!(left.is_empty(), "in {root}, {folder:?}, these need one another: {left:#?}");
        }
    }
}
