use super::*;
use crate::pooled::spread::tests::SCHOOLS;

fn schools() -> Vec<Reading> {
    SCHOOLS.iter().map(|&(part, value, variance)| Reading { part, value, variance }).collect()
}

fn near(own: f64, theirs: f64) {
    assert!((own / theirs - 1.0).abs() < 1e-5, "{own} here, {theirs} by metafor");
}

/// `rma.mv(yi, vi, mods=~0+g, random=~1|district/school, method="REML", test="t", dfs="contain", control=list(optimizer="optim",
/// optmethod="BFGS", reltol=1e-15))` of metafor 3.8-1, `g` every second district, and `anova(r, X=c(1,-1))`.
#[test]
fn means_by_a_label_of_the_parts_are_those_of_metafor() {
    let all = schools();
    let labels: Vec<usize> = all.iter().map(|r| r.part % 2).collect();
    let found = by_label(&all, &labels, 2).unwrap();
    near(found.spreads.0, 0.061_168_875_12);
    near(found.spreads.1, 0.032_864_382_972);
    near(found.means[0].0, 0.275_627_046_356);
    near(found.means[1].0, 0.088_865_925_393);
    near(found.means[0].1, 0.115_138_893_557);
    near(found.means[1].1, 0.118_045_024_789);
    near(found.statistic, 1.282_738_996_02);
    near(found.p_value, 0.286_661_032_36);
}

/// The same with `h`, every second school, so that each district has both.
#[test]
fn means_by_a_label_that_one_part_has_both_values_of_are_those_of_metafor() {
    let all = schools();
    let labels: Vec<usize> = (0..all.len()).map(|k| k % 2).collect();
    let found = by_label(&all, &labels, 2).unwrap();
    near(found.spreads.0, 0.062_673_288_018);
    near(found.spreads.1, 0.033_980_960_304);
    near(found.means[0].0, 0.210_144_262_515);
    near(found.means[1].0, 0.155_500_958_157);
    near(found.means[0].1, 0.088_112_640_152);
    near(found.means[1].1, 0.089_267_979_369);
    near(found.statistic, 0.821_645_925_192);
}

#[test]
fn too_few_parts_or_a_value_without_logs_tell_nothing() {
    let all = schools();
    let labels = vec![0; all.len()];
    assert!(by_label(&all, &labels, 2).is_none());
    let few: Vec<Reading> = all.iter().filter(|r| r.part < 3).copied().collect();
    let labels: Vec<usize> = few.iter().map(|r| r.part % 2).collect();
    assert!(by_label(&few, &labels, 2).is_none());
}
