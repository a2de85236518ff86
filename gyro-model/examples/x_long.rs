use gyro_model::{
    Axis, Model, Record, diagnose,
    simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
};
use std::time::Instant;
fn main() {
    let rows: f64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let hide = ["delay:d=0.008", "temperature-bias", "scale-asymmetry"];
    let mut whole: Option<Record> = None;
    for (k, axis) in Axis::ALL.into_iter().enumerate() {
        let hidden = vec![Hidden::parse(hide[k], axis).unwrap()];
        let motion =
            if k == 1 { Motion::Multisine { travel: 3.0 } } else { Motion::Drive { rate: 1.0 + k as f64, hold: 2.0 } };
        let s = simulate(&Scenario {
            motion,
            seconds: rows / 500.0,
            rate_hz: 500.0,
            hidden,
            sensor: SensorSpec { axis, ..SensorSpec::default() },
            seed: 5 + k as u64,
            ..Scenario::default()
        });
        match &mut whole {
            None => whole = Some(s.record),
            Some(w) => {
                for (a, b) in w.rows.iter_mut().zip(&s.record.rows) {
                    a.gyro[k] = b.gyro[k];
                    a.ref_angle[k] = b.ref_angle[k];
                    if k == 1 {
                        a.temperature = b.temperature;
                    }
                }
            }
        }
    }
    let record = whole.unwrap();
    eprintln!("rows {}", record.len());
    let base = Model::base_for(&record);
    let t = Instant::now();
    let (_, ladders) = diagnose::ladder(&record, &base, &Axis::ALL, &diagnose::Options::default()).unwrap();
    for l in ladders {
        println!("{:?} {:?} {:?} {}", l.axis, l.verdict, l.effects, l.says);
        for s in l.steps {
            println!("   {:?} {:?} {:?}", s.added, s.removed, s.error_over_floor);
        }
    }
    println!("{:.1} s", t.elapsed().as_secs_f64());
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    println!("{}", status.lines().find(|l| l.starts_with("VmHWM")).unwrap());
}
