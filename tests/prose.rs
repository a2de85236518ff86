//! What readers read: where its sentences stand, and that it is written in the words of the field.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};
use syn::{Attribute, Item, LitStr, Macro, visit::Visit};

/// The folders that hold programs and libraries.
const CODE: [&str; 9] = [
    "gyro-model/src",
    "ipc-types/src",
    "page/src",
    "python/src",
    "readers/src",
    "readers-parquet/src",
    "ros2/src",
    "services",
    "workbench/src",
];

/// Where findings, and what to do about them, become sentences.
const WORDS: [&str; 4] =
    ["gyro-model/src/words/", "workbench/src/words.rs", "workbench/src/log/flags.rs", "workbench/src/report/next.rs"];

/// The programs and what connects them: they name their own commands, and have help.
const PROGRAMS: [&str; 3] = ["services/", "ros2/", "ipc-types/"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &Path, end: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let found = entries.map(|entry| entry.unwrap().path());
    let found = found.flat_map(|path| if path.is_dir() { files(&path, end) } else { vec![path] });
    found.filter(|path| path.extension().is_some_and(|own| own == end)).collect()
}

/// A text that a reader may see, and where it is.
struct Said {
    place: String,
    text: String,
    /// Whether it is in an attribute: the help of a command, the sentence of an error.
    is_attribute: bool,
}

/// The string literals of a file's code, without those of its tests.
struct Literals<'a> {
    file: &'a str,
    is_attribute: bool,
    /// Whether comments are the help of a command.
    is_help: bool,
    found: Vec<Said>,
}

impl Literals<'_> {
    fn take(&mut self, literal: &LitStr) {
        let place = self.file.to_owned();
        self.found.push(Said { place, text: literal.value(), is_attribute: self.is_attribute });
    }

    fn tokens(&mut self, tokens: proc_macro2::TokenStream) {
        let mut before = String::new();
        for token in tokens {
            // A comment.
            if before.ends_with("doc=") {
                return;
            }
            before += &token.to_string();
            match token {
                proc_macro2::TokenTree::Group(group) => self.tokens(group.stream()),
                proc_macro2::TokenTree::Literal(literal) => {
                    if let Ok(literal) = syn::parse_str::<LitStr>(&literal.to_string()) {
                        self.take(&literal);
                    }
                }
                _ => {}
            }
        }
    }
}

fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Ident>().is_ok_and(|name| name == "test")
}

/// Whether the comments behind this attribute are the help of a command.
fn makes_help(attribute: &Attribute) -> bool {
    let derives = |name: &str| quoted(attribute).is_some_and(|tokens| tokens.contains(name));
    attribute.path().is_ident("derive") && ["Args", "Parser", "Subcommand", "ValueEnum"].into_iter().any(derives)
}

fn quoted(attribute: &Attribute) -> Option<String> {
    attribute.meta.require_list().ok().map(|list| list.tokens.to_string())
}

impl<'ast> Visit<'ast> for Literals<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes: &[Attribute] = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Enum(item) => &item.attrs,
            _ => &[],
        };
        if !attributes.iter().any(is_test) {
            self.is_help = attributes.iter().any(makes_help);
            syn::visit::visit_item(self, item);
            self.is_help = false;
        }
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        self.is_attribute = true;
        match &attribute.meta {
            syn::Meta::List(list) => self.tokens(list.tokens.clone()),
            syn::Meta::NameValue(named) if self.is_help => syn::visit::visit_expr(self, &named.value),
            _ => {}
        }
        self.is_attribute = false;
    }

    fn visit_lit_str(&mut self, literal: &'ast LitStr) {
        self.take(literal);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.tokens(call.tokens.clone());
    }
}

/// Everything that programs and libraries say.
fn messages() -> &'static [Said] {
    static ALL: OnceLock<Vec<Said>> = OnceLock::new();
    ALL.get_or_init(read)
}

fn read() -> Vec<Said> {
    let mut all = Vec::new();
    for path in CODE.iter().flat_map(|folder| files(&root().join(folder), "rs")) {
        let file = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
        if path.iter().any(|part| ["tests", "tests.rs", "hostile.rs"].iter().any(|name| part == *name)) {
            continue;
        }
        let mut literals = Literals { file: &file, is_attribute: false, is_help: false, found: Vec::new() };
        literals.visit_file(&syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap());
        all.append(&mut literals.found);
    }
    assert!(all.len() > 5000, "only {} texts", all.len());
    all
}

#[test]
fn what_is_found_is_put_into_words_in_one_place() {
    let strays: Vec<String> = messages()
        .iter()
        .filter(|said| !WORDS.iter().any(|home| said.place.starts_with(home)))
        .filter(|said| {
            let is_program = PROGRAMS.iter().any(|program| said.place.starts_with(program));
            let speaks = [" is missing", "this log", "This log"].iter().any(|phrase| said.text.contains(phrase));
            speaks && !(is_program && said.is_attribute) || said.text.contains("`truerate") && !is_program
        })
        .map(|said| format!("{}: {}", said.place, said.text))
        .collect();
    assert!(strays.is_empty(), "these belong to {WORDS:?}:\n{}", strays.join("\n"));
}

/// A phrase that is not written, and what is written in its place.
struct Rule {
    phrase: String,
    rather: String,
    allowed: Vec<String>,
}

fn style() -> Vec<Rule> {
    let text = fs::read_to_string(root().join("tests/prose/style.txt")).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    lines
        .map(|line| {
            let (line, allowed) = line.split_once(" | but ").unwrap_or((line, ""));
            let (phrase, rather) = line.split_once(" | ").unwrap_or_else(|| panic!("no `|` in {line:?}"));
            let allowed = allowed.split(", ").filter(|phrase| !phrase.is_empty()).map(str::to_owned).collect();
            Rule { phrase: phrase.to_owned(), rather: rather.to_owned(), allowed }
        })
        .collect()
}

/// Whether a text has this phrase as whole words; a name with `-` or `_` in it is one word.
fn has(text: &str, phrase: &str) -> bool {
    let is_letter = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "-_".contains(c));
    text.match_indices(phrase).any(|(at, _)| {
        !is_letter(text[..at].chars().next_back()) && !is_letter(text[at + phrase.len()..].chars().next())
    })
}

impl Rule {
    /// Whether it is broken: the phrases that are allowed do not count.
    fn is_broken_by(&self, text: &str) -> bool {
        // A name in the code is no word.
        let words = text.to_lowercase().split(['{', '}']).step_by(2).collect::<Vec<_>>().join("…");
        let words = words.split('`').step_by(2).collect::<Vec<_>>().join("…");
        let text = words.split_whitespace().collect::<Vec<_>>().join(" ");
        has(&self.allowed.iter().fold(text, |text, allowed| text.replace(allowed.as_str(), "…")), &self.phrase)
    }
}

#[test]
fn a_phrase_is_found_as_whole_words_where_it_is_not_allowed() {
    let rule = |line: &str| {
        let (phrase, allowed) = line.split_once('|').unwrap();
        Rule { phrase: phrase.to_owned(), rather: String::new(), allowed: vec![allowed.to_owned()] }
    };
    assert!(rule("is no|there is no").is_broken_by("It is\n  no gyro."));
    assert!(!rule("is no|there is no").is_broken_by("There is no gyro."));
    assert!(!rule("alike|alike to").is_broken_by("falls-alike, alike to"));
}

/// Paragraphs of a document, without its code and its tables' rules, with the line that each begins at.
fn paragraphs(text: &str) -> Vec<(usize, String)> {
    let mut all: Vec<(usize, String)> = Vec::new();
    let (mut is_code, mut is_new) = (false, true);
    for (number, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            if is_new || line.starts_with(['|', '-', '#']) {
                all.push((number + 1, String::new()));
            }
            is_new = line.trim().is_empty();
            if let Some((_, paragraph)) = all.last_mut().filter(|_| !line.starts_with("<!--")) {
                *paragraph += line;
                paragraph.push(' ');
            }
        }
    }
    all
}

#[test]
fn documents_help_and_messages_are_written_in_the_words_of_the_field() {
    let mut texts: Vec<(String, String)> =
        messages().iter().map(|said| (said.place.clone(), said.text.clone())).collect();
    let mut documents = files(&root().join("docs"), "md");
    documents
        .extend(["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "deploy/README.md"].map(|name| root().join(name)));
    for path in documents {
        let name = path.strip_prefix(root()).unwrap().display().to_string();
        let text = fs::read_to_string(&path).unwrap();
        texts.extend(paragraphs(&text).into_iter().map(|(line, text)| (format!("{name}:{line}"), text)));
    }
    let style = style();
    let broken: Vec<String> = texts
        .iter()
        .flat_map(|(place, text)| {
            style
                .iter()
                .filter(|rule| text.contains(' ') && rule.is_broken_by(text))
                .map(move |rule| (place, text, rule))
        })
        .map(|(place, text, rule)| format!("{place}: “{}” (rather: {}) in: {text}", rule.phrase, rule.rather))
        .collect();
    assert!(broken.is_empty(), "{} sentences:\n{}", broken.len(), broken.join("\n"));
}
