//! README's table of effects follows the catalogue.

use gyro_model::effects::CATALOGUE;

#[test]
fn the_readme_has_a_row_for_every_effect() {
    let readme = include_str!("../README.md");
    let missing: Vec<String> = CATALOGUE
        .iter()
        .map(|effect| effect.card())
        .map(|card| format!("| `{}` | {} | {} |", card.id, card.title.replace('|', "\\|"), card.typical))
        .filter(|row| !readme.lines().any(|line| line == row))
        .collect();
    assert!(missing.is_empty(), "rows that README.md lacks:\n{}", missing.join("\n"));
}
