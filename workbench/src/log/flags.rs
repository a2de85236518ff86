//! Flags of the program in a sentence, for those who have none: in a page they are clicks and dropped files, in a library arguments.

use gyro_model::words::Voice;
use std::borrow::Cow;

/// The table in which a page has channels chosen.
const TABLE: &str = "the table of channels below";

/// What is said as a whole, in a page.
const IN_A_PAGE: [(&str, &str); 8] = [
    (" with `--reference FILE`", ": drop it here, too"),
    ("name it with `--reference FILE`", "drop it here"),
    ("give it with `--dbc FILE.dbc`", "drop it here, too"),
    ("`truerate channels LOG --dbc FILE.dbc`", "drop both here"),
    ("`--reference-is-dependent` judges it all the same", "a tick under Channels judges it all the same"),
    ("`--at-rest` gives", "a tick under Channels gives"),
    (" or `--columns F`", ""),
    ("Say it with `--map ", "Say it in `--map "),
];

/// What is said as a whole, by a library.
const IN_A_LIBRARY: [(&str, &str); 1] = [("`truerate channels LOG --dbc FILE.dbc`", "`read(log, dbc=FILE)`")];

/// A sentence in the words of whom it is said to.
#[must_use]
pub fn spoken(text: &str, voice: Voice) -> Cow<'_, str> {
    let phrases: &[(&str, &str)] = match voice {
        Voice::Log | Voice::Stream => return text.into(),
        _ if !text.contains("--") && !text.contains("`truerate ") => return text.into(),
        Voice::Page => &IN_A_PAGE,
        Voice::Library => &IN_A_LIBRARY,
    };
    let mut text = without_commands(text);
    for (phrase, own) in phrases {
        text = text.replace(phrase, own);
    }
    // Code between ticks, and a flag at the start of a sentence.
    let mut out = String::new();
    for (k, part) in text.split('`').enumerate() {
        let said = if k % 2 == 0 { Some(plain(part, voice)) } else { code(part, voice) };
        match said {
            Some(said) => out.push_str(&said),
            None => out.extend(["`", part, "`"]),
        }
    }
    out.into()
}

/// Leaves out what stands in brackets about another command.
fn without_commands(text: &str) -> String {
    let starts = [" (`truerate ", " (the program (`truerate "].map(|begins| text.find(begins));
    let Some(start) = starts.into_iter().flatten().min() else { return text.to_owned() };
    let mut open = 0;
    let closes = text[start..].char_indices().find(|(_, letter)| {
        open += i32::from(*letter == '(') - i32::from(*letter == ')');
        *letter == ')' && open == 0
    });
    let Some((length, _)) = closes else { return text.to_owned() };
    without_commands(&format!("{}{}", &text[..start], &text[start + length + 1..]))
}

/// One flag with its value, where it is one.
fn code(part: &str, voice: Voice) -> Option<String> {
    let (flag, value) = part.strip_prefix("--")?.split_once(' ').unwrap_or((&part[2..], ""));
    if voice == Voice::Page {
        return Some(match flag {
            "map" | "columns" => TABLE.to_owned(),
            "reference" | "dbc" => "a further file, dropped here".to_owned(),
            "at-rest" => "the tick for axes that did not turn".to_owned(),
            _ => "the table of channels".to_owned(),
        });
    }
    let name = flag.replace('-', "_");
    Some(match (flag, value.split_once('=')) {
        ("map", Some((left, right))) => format!("`map={{\"{left}\": \"{right}\"}}`"),
        (_, _) if value.is_empty() && flag != "map" => format!("`{name}=True`"),
        _ if value.is_empty() => format!("`{name}=`"),
        _ => format!("`{name}=\"{value}\"`"),
    })
}

/// Flags that stand in the text itself.
fn plain(part: &str, voice: Voice) -> String {
    let own = |flag: &str| match (voice, flag) {
        (Voice::Page, "--map ") => "channel ".to_owned(),
        (Voice::Page, "--dbc ") => "the DBC file ".to_owned(),
        (Voice::Page, "--columns ") => "the names of columns ".to_owned(),
        (Voice::Page, _) => "the second file ".to_owned(),
        _ => format!("{} ", flag.trim_matches(['-', ' '])),
    };
    ["--map ", "--dbc ", "--columns ", "--reference "]
        .iter()
        .fold(part.to_owned(), |text, flag| text.replace(flag, &own(flag)))
}

#[cfg(test)]
mod tests {
    use super::spoken;
    use gyro_model::words::Voice;

    const SENTENCES: [&str; 7] = [
        "no column `gyro_x`: the header has t, w; name yours with `--map gyro_x=CHANNEL` or `--columns F`; likely: w",
        "no axis has both a gyro and a reference: add ref_angle_z, name yours with `--map ref_angle_z=CHANNEL`, or take it from a second file \
         with `--reference FILE`",
        "is a CAN log: what its frames mean stands in a DBC file, give it with `--dbc FILE.dbc` (`truerate channels FILE` lists the identifiers)",
        "--map w=x: there is no such channel; it has t, gz",
        "gyro_z turns against ref_angle_z: negate one of them, such as with `--map NAME=-1*NAME`",
        "is a CAN log: give its DBC file with `--dbc FILE.dbc` (the program (`truerate channels FILE`) lists the identifiers)",
        "its reference was computed from this gyro; `--reference-is-dependent` judges it all the same",
    ];

    #[test]
    fn a_page_names_what_to_click_or_drop_and_a_library_its_arguments() {
        let page = SENTENCES.map(|text| spoken(text, Voice::Page).into_owned());
        assert!(page.iter().all(|text| !text.contains("--") && !text.contains("truerate ")), "{page:#?}");
        assert!(page[0].contains("name yours with the table of channels below; likely: w"), "{}", page[0]);
        assert!(page[1].ends_with("take it from a second file: drop it here, too"), "{}", page[1]);
        assert!(page[2].ends_with("stands in a DBC file, drop it here, too"), "{}", page[2]);
        let library = SENTENCES.map(|text| spoken(text, Voice::Library).into_owned());
        assert!(library.iter().all(|text| !text.contains("--") && !text.contains("truerate ")), "{library:#?}");
        assert!(library[0].contains("`map={\"gyro_x\": \"CHANNEL\"}` or `columns=\"F\"`"), "{}", library[0]);
        assert!(library[3].starts_with("map w=x: there is no such channel"), "{}", library[3]);
        assert!(library[6].ends_with("`reference_is_dependent=True` judges it all the same"), "{}", library[6]);
        assert!(SENTENCES.iter().all(|text| spoken(text, Voice::Log) == *text));
    }
}
