//! The estimator's step allocates nothing.
#![allow(unsafe_code)] // a counting allocator is an unsafe trait; it only adds to a counter

use gyro_model::{
    Axis, AxisModel, Model, Row, Term,
    effects::CATALOGUE,
    estimator::{Estimator, Options},
};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|n| n.set(n.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_step_with_every_effect_and_every_reference_allocates_nothing() {
    let mut model = Model::default();
    for axis in Axis::ALL {
        let mut terms = AxisModel::base(axis);
        for effect in CATALOGUE {
            if terms.term(effect.card().id).is_none() {
                let mut term = Term::neutral(*effect, axis);
                term.values = effect.parameters(axis).iter().map(|p| p.typical * 0.1).collect();
                terms.terms.push(term);
            }
        }
        terms.noise.angle_random_walk = 1e-4;
        model.axes[axis.index()] = Some(terms);
    }
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model);
    let row = |k: i32| {
        let t = f64::from(k) * 1e-2;
        Row {
            t_ns: i64::from(k) * 10_000_000,
            gyro: [t.sin(), t.cos(), 0.1],
            ref_angle: [1.0 - t.cos(), if k % 7 == 0 { t.sin() } else { f64::NAN }, f64::NAN],
            ref_quaternion: [1.0, 0.0, 0.0, 0.0],
            accel: [0.0, 0.0, 9.81],
            temperature: 25.0 + t,
            supply: 3.3,
            ..Row::EMPTY
        }
    };
    let before = ALLOCATIONS.with(Cell::get);
    for k in 0..1000 {
        std::hint::black_box(estimator.step(&row(k)));
    }
    assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0);
    // The counter does count.
    drop(std::hint::black_box(vec![0_u8; 16]));
    assert!(ALLOCATIONS.with(Cell::get) > before);
}
