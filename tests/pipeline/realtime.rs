//! What the kernel is asked for is in force where it grants it, and said where it does not.

use crate::harness::{Pipeline, Place, is_root};
use serde_json::Value;
use std::fs;
use truerate::realtime::{Policy, set_policy};

/// The policies of a process' threads as the kernel numbers them, and the priority of the first.
fn policies(pid: u32) -> (Vec<u32>, u32) {
    let stat = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let field = |text: &str, n: usize| {
        let fields = text.rsplit(')').next().unwrap().split_whitespace();
        fields.map(str::to_owned).nth(n - 3).and_then(|word| word.parse::<u32>().ok())
    };
    let threads = fs::read_dir(format!("/proc/{pid}/task")).unwrap().flatten();
    let all = threads.filter_map(|entry| field(&stat(&entry.path().join("stat").display().to_string()), 41));
    (all.collect(), field(&stat(&format!("/proc/{pid}/task/{pid}/stat")), 40).unwrap())
}

/// A line of what the kernel says of a process.
fn said(pid: u32, key: &str) -> String {
    let text = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    text.lines().find_map(|line| line.strip_prefix(key)).unwrap().trim().to_owned()
}

/// The status once every process runs.
fn running(place: &Place, pipeline: &mut Pipeline) -> Value {
    let mut status = Value::Null;
    pipeline.until("every process at work", |p| {
        status = place.status(p.domain.name()).unwrap_or_default();
        let services = status["services"].as_array();
        services.is_some_and(|all| all.len() == 3 && all.iter().all(|s| s["state"] == "running"))
    });
    status
}

fn scheduling<'a>(status: &'a Value, name: &str) -> &'a Value {
    let services = status["services"].as_array().unwrap();
    &services.iter().find(|service| service["name"] == name).unwrap()["scheduling"]
}

#[test]
fn processes_run_as_asked_where_the_kernel_grants_it() {
    // A container's root may not have the right.
    let granted = std::thread::spawn(|| set_policy(Policy::Fifo(1)).is_ok()).join().unwrap();
    if !is_root() || !granted {
        eprintln!("skipped: no real-time priority is granted here");
        return;
    }
    let place = Place::new();
    let core = (0..1024).find(|&n| rustix::thread::sched_getaffinity(None).unwrap().is_set(n)).unwrap();
    let cores = format!("kalman={core}");
    let asked = ["--priority", "20", "--cores", &cores, "--lock-memory", "--idle-learning", "--wait", "hybrid(20)"];
    let mut pipeline = place.start("real", &[&["--source", "sim"], &asked[..]].concat());
    let status = running(&place, &mut pipeline);
    let pid = |name| pipeline.pid(name).unwrap();
    for name in ["acquisition", "kalman"] {
        assert_eq!(policies(pid(name)), (vec![1; policies(pid(name)).0.len()], 20), "{name}: SCHED_FIFO");
        assert_ne!(said(pid(name), "VmLck:"), "0 kB", "{name}");
        let shown = scheduling(&status, name);
        assert_eq!((&shown["policy"], &shown["priority"]), (&"fifo".into(), &20.into()), "{shown}");
        assert_eq!(shown["locked_memory"], true, "{shown}");
    }
    assert_eq!(said(pid("kalman"), "Cpus_allowed_list:"), core.to_string());
    let shown = scheduling(&status, "kalman");
    assert_eq!((&shown["cores"], &shown["wait"]), (&serde_json::json!([core]), &"hybrid(20)".into()), "{shown}");
    // The three threads that learn, and those that they start for a search.
    let compensator = pid("compensator");
    pipeline.until("three threads of SCHED_IDLE or more", |_| {
        policies(compensator).0.iter().filter(|&&policy| policy == 5).count() >= 3
    });
    let (learning, priority) = policies(compensator);
    assert_eq!((learning[0], priority), (0, 0), "{learning:?}: the thread that receives is no SCHED_IDLE");
    let shown = scheduling(&status, "compensator");
    assert_eq!((&shown["policy"], &shown["locked_memory"]), (&"other".into(), &false.into()), "{shown}");
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(!ended.error.contains("WARN"), "{}", ended.error);
    assert!(place.left("real").is_empty(), "{:?}", place.left("real"));
}

#[test]
fn what_the_kernel_refuses_is_said_and_the_pipeline_runs() {
    if !is_root() {
        return;
    }
    let mut place = Place::new();
    // Everything that may be refused is.
    let limits =
        ["prlimit", "--rtprio=0", "--memlock=65536", "setpriv", "--bounding-set=-sys_nice,-ipc_lock,-sys_resource"];
    place.wrapper = limits.map(str::to_owned).to_vec();
    let asked = ["--priority", "20", "--cores", "kalman=1023", "--lock-memory"];
    let mut pipeline = place.start("plain", &[&["--source", "sim"], &asked[..]].concat());
    let status = running(&place, &mut pipeline);
    for name in ["acquisition", "kalman"] {
        assert_eq!(policies(pipeline.pid(name).unwrap()).1, 0, "{name}");
        let shown = scheduling(&status, name);
        assert_eq!((&shown["policy"], &shown["locked_memory"]), (&"other".into(), &false.into()), "{shown}");
    }
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let says = [
        "kalman has no real-time priority 20",
        "acquisition has no real-time priority 20",
        "kalman's memory is not locked (the limit is 64 KB)",
        "kalman runs on any core, not on [1023]",
    ];
    for words in says {
        assert_eq!(ended.error.matches(words).count(), 1, "{words}: {}", ended.error);
    }
    assert!(place.left("plain").is_empty(), "{:?}", place.left("plain"));
}

#[test]
fn a_spinning_process_without_a_core_of_its_own_is_refused_a_real_time_priority() {
    let place = Place::new();
    for (words, part) in [
        (&["--priority", "20", "--wait", "spin"][..], "realtime.cores.kalman"),
        (&["--cores", "nobody=1"], "unknown process"),
        (&["--wait", "doze"], "event, spin or hybrid"),
    ] {
        let output = place.output(&[&["run", "--source", "sim", "--dashboard", "off"], words].concat());
        let says = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.code() == Some(1) && says.contains(part) && says.lines().count() == 1,
            "{words:?}: {says}"
        );
    }
}
