//! The table of effects in docs/effects.md, and what README has of it, follow the catalogue.

use gyro_model::effects::CATALOGUE;

#[test]
fn the_table_of_effects_has_a_row_for_every_effect_and_the_readme_repeats_some() {
    let table = include_str!("../docs/effects.md");
    let is_row = |line: &&str| line.starts_with("| `") && line.matches(" | ").count() == 2;
    let readme: Vec<&str> = include_str!("../README.md").lines().filter(is_row).collect();
    let effects =
        readme.iter().filter(|line| CATALOGUE.iter().any(|e| line.starts_with(&format!("| `{}` |", e.card().id))));
    let effects: Vec<&&str> = effects.collect();
    assert!(effects.len() >= 6 && effects.iter().all(|row| table.lines().any(|line| line == **row)), "{effects:?}");
    let missing: Vec<String> = CATALOGUE
        .iter()
        .map(|effect| effect.card())
        .map(|card| format!("| `{}` | {} | {} |", card.id, card.title.replace('|', "\\|"), card.typical))
        .filter(|row| !table.lines().any(|line| line == row))
        .collect();
    assert!(missing.is_empty(), "rows that docs/effects.md lacks:\n{}", missing.join("\n"));
}
