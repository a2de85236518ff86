//! Two ways of doing the same work, in turns, so that what else the machine does falls on both.

use std::time::Instant;

/// Turns that each way gets.
const TURNS: usize = 201;

/// How long one turn lasts, about, s.
const TURN: f64 = 1e-3;

/// Prints how many times as long `ours` takes as `alternative`: the median of many pairs of turns, with the range in
/// which half of them lie.
pub fn ratio(name: &str, alternative_name: &str, mut ours: impl FnMut(), mut alternative: impl FnMut()) {
    let calls = [calls_a_turn(&mut ours), calls_a_turn(&mut alternative)];
    let mut ratios: Vec<f64> =
        (0..TURNS).map(|_| seconds_a_call(&mut ours, calls[0]) / seconds_a_call(&mut alternative, calls[1])).collect();
    ratios.sort_by(f64::total_cmp);
    let at = |share: usize| ratios[TURNS * share / 4];
    println!("ratio {name} / {alternative_name}: {:.3} ({:.3}–{:.3})", at(2), at(1), at(3));
}

fn calls_a_turn(work: &mut impl FnMut()) -> u32 {
    let mut calls = 1_u32;
    loop {
        let seconds = seconds_a_call(work, calls) * f64::from(calls);
        if seconds > TURN || calls > 1 << 24 {
            return calls;
        }
        calls *= 2;
    }
}

fn seconds_a_call(work: &mut impl FnMut(), calls: u32) -> f64 {
    let start = Instant::now();
    for _ in 0..calls {
        work();
    }
    start.elapsed().as_secs_f64() / f64::from(calls)
}
