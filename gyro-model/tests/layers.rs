//! Imports go one way: no module of the crate needs, by way of others, one that needs it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};
use syn::{Attribute, File, Item, ItemMod, Path as Named, UseTree, visit::Visit};

/// The modules that one file names.
#[derive(Default)]
struct Modules(BTreeSet<String>);

impl<'ast> Visit<'ast> for Modules {
    fn visit_item(&mut self, item: &'ast Item) {
        if let Item::Mod(ItemMod { attrs, .. }) = item
            && attrs.iter().any(is_test)
        {
            return;
        }
        if let Item::Use(used) = item
            && let UseTree::Path(path) = &used.tree
            && path.ident == "crate"
        {
            self.under(&path.tree);
        }
        syn::visit::visit_item(self, item);
    }

    fn visit_path(&mut self, path: &'ast Named) {
        let mut parts = path.segments.iter();
        if parts.next().is_some_and(|first| first.ident == "crate")
            && let Some(module) = parts.next()
        {
            self.0.insert(module.ident.to_string());
        }
        syn::visit::visit_path(self, path);
    }
}

impl Modules {
    /// The first names under `crate::`.
    fn under(&mut self, tree: &UseTree) {
        match tree {
            UseTree::Path(path) => self.0.insert(path.ident.to_string()),
            UseTree::Name(name) => self.0.insert(name.ident.to_string()),
            UseTree::Rename(renamed) => self.0.insert(renamed.ident.to_string()),
            UseTree::Glob(_) => false,
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.under(tree));
                false
            }
        };
    }
}

fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Ident>().is_ok_and(|name| name == "test")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Which modules each module of the crate names.
fn imports() -> BTreeMap<String, BTreeSet<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in files(&root) {
        let inside = path.strip_prefix(&root).unwrap().with_extension("");
        let module = inside.iter().next().unwrap().to_str().unwrap().to_owned();
        if module == "lib" || inside.ends_with("tests") || inside.ends_with("document") {
            continue;
        }
        let file: File = syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap();
        let mut named = Modules::default();
        named.visit_file(&file);
        all.entry(module).or_default().extend(named.0);
    }
    // What the crate's root passes on.
    let home = BTreeMap::from([
        ("Axis", "axis"),
        ("Model", "model"),
        ("AxisModel", "model"),
        ("Noise", "model"),
        ("Term", "model"),
        ("Record", "record"),
        ("Row", "record"),
    ]);
    let modules: BTreeSet<String> = all.keys().cloned().collect();
    for (module, named) in &mut all {
        let at_home = named.iter().map(|name| home.get(name.as_str()).map_or(name.clone(), |&home| home.to_owned()));
        *named = at_home.filter(|name| modules.contains(name) && name != module).collect();
    }
    all
}

#[test]
fn no_module_needs_one_that_needs_it() {
    let mut left = imports();
    // Takes away, again and again, what needs nothing that is left: what stays is in a circle, or needs one.
    loop {
        let free: Vec<String> = left
            .iter()
            .filter(|(_, needs)| needs.iter().all(|need| !left.contains_key(need)))
            .map(|(m, _)| m.clone())
            .collect();
        if free.is_empty() {
            break;
        }
        left.retain(|module, _| !free.contains(module));
    }
    for needs in left.clone().keys() {
        let inside: BTreeSet<String> = left[needs].iter().filter(|need| left.contains_key(*need)).cloned().collect();
        left.insert(needs.clone(), inside);
    }
    assert!(left.is_empty(), "these need one another: {left:#?}");
}
