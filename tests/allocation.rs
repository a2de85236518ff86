//! kalman allocates nothing per sample beyond iceoryx2's one loan, in its real loop.

use gyro_model::{Axis, AxisModel, Model, Row};
use ipc_types::{Parameters, domain::Domain, port::Hub, topic};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};
use truerate::clock::now_ns;
use truerate::{
    kalman::Kalman,
    run_folder::{RunFolder, SourceFacts},
    settings::Settings,
    wire,
};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is handed to the system's allocator unchanged.
#[allow(unsafe_code, reason = "an allocator is unsafe by its trait")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn the_hot_loop_of_kalman_allocates_one_loan_a_sample_and_nothing_else() {
    const RUN: u64 = 1;
    let base = std::env::temp_dir().join(format!("trt-a-{}", std::process::id()));
    let domain = Domain::new(&base, "alloc").unwrap();
    std::fs::create_dir_all(domain.root()).unwrap();
    domain.begin_generation().unwrap();
    let folder = RunFolder::of(&domain);
    folder.set_source(&SourceFacts::default()).unwrap();
    let hub = Hub::join(&domain, "test").unwrap();
    let held = hub.create_all().unwrap();
    let samples = hub.writer(&topic::SAMPLE).unwrap();
    let parameters = hub.writer(&topic::PARAMETERS).unwrap();
    let estimates = hub.reader(&topic::ESTIMATE, None, ipc_types::wait::Wait::Event).unwrap();
    let mut kalman = Kalman::open(&hub, RUN, &Settings::default(), &folder).unwrap();
    let mut model = Model { epoch: 1, ..Model::default() };
    model.axes[2] = Some(AxisModel::base(Axis::Z));
    parameters.give(Parameters { run: RUN, ..wire::parameters_of(&model).unwrap() }).unwrap();
    kalman.turn().unwrap();

    let mut sequence = 0;
    let mut counted = 0;
    let mut taken = 0;
    for round in 0..60 {
        for _ in 0..100 {
            let t = sequence as f64 * 1e-3;
            let mut row = Row { t_ns: i64::try_from(sequence * 1_000_000).unwrap(), ..Row::EMPTY };
            row.gyro[2] = t.sin();
            row.ref_angle[2] = 1.0 - t.cos();
            sequence += 1;
            let mut sample = wire::sample_of(&row, RUN, sequence);
            sample.arrived_ns = now_ns();
            samples.give(sample).unwrap();
        }
        COUNT.set(0);
        kalman.turn().unwrap();
        // The first rounds connect ports and fill queues.
        if round >= 10 {
            counted += COUNT.get();
            taken += 100;
        }
        while let Some(estimate) = estimates.take().unwrap() {
            assert_eq!(estimate.axes[2].present, 1);
        }
    }
    // A heart-beat is a loan too: ten a second.
    let beats = 60;
    assert!(counted <= taken + beats, "{counted} allocations for {taken} samples");
    drop((kalman, estimates, parameters, samples, held, hub));
    std::fs::remove_dir_all(&base).unwrap();
    for entry in std::fs::read_dir("/dev/shm").unwrap().flatten() {
        if entry.file_name().to_string_lossy().starts_with(domain.prefix()) {
            std::fs::remove_file(entry.path()).unwrap();
        }
    }
}
