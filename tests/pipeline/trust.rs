//! Another user of the machine: can neither read, order, nor stop a pipeline.

use crate::harness::{Pipeline, Place, is_root};
use std::{
    fs,
    os::unix::fs::{MetadataExt, chown},
    process::{Command, Output},
};

const OWNER: u32 = 61_234;
const STRANGER: u32 = 61_235;

/// The beginning of a command that this user runs, as a member of this group.
fn user(uid: u32, gid: u32) -> Vec<String> {
    ["setpriv".to_owned(), format!("--reuid={uid}"), format!("--regid={gid}"), "--clear-groups".to_owned()].into()
}

fn shell(uid: u32, gid: u32, script: &str) -> Output {
    let words = user(uid, gid);
    Command::new(&words[0]).args(&words[1..]).args(["bash", "-c", script]).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Whether this user can run the program at all, which may lie in somebody's home.
fn can_run(uid: u32) -> bool {
    let ran = shell(uid, uid, &format!("{} --version", env!("CARGO_BIN_EXE_truerate"))).status.success();
    if !ran {
        eprintln!("skipped: other users cannot run {}", env!("CARGO_BIN_EXE_truerate"));
    }
    ran
}

/// A pipeline of the owner's that gives its rate everywhere.
fn owners(place: &mut Place) -> Pipeline {
    place.wrapper = user(OWNER, OWNER);
    // Left in its way by somebody else, in the hope that it is opened.
    let bait = format!("/dev/shm/{}000000_bait", place.domain("own").prefix());
    fs::write(&bait, "x").unwrap();
    chown(&bait, Some(STRANGER), Some(STRANGER)).unwrap();
    let folder = place.base.with_extension("rate");
    fs::create_dir(&folder).unwrap();
    chown(&folder, Some(OWNER), Some(OWNER)).unwrap();
    let shared = format!("shm:{}/ring", folder.display());
    let socket = format!("unix:{}/socket", folder.display());
    let mut pipeline =
        place.start_watched("own", "127.0.0.1:0", &["--source", "sim", "--out", &shared, "--out", &socket]);
    pipeline.until("everything", |p| {
        folder.join("socket").exists()
            && p.domain.folder().join("dashboard.url").exists()
            && p.pid("compensator").is_some()
    });
    assert_eq!(fs::metadata(&bait).unwrap().uid(), STRANGER);
    fs::remove_file(bait).unwrap();
    pipeline
}

#[test]
fn another_user_can_neither_read_order_nor_stop() {
    if !is_root() || !can_run(STRANGER) {
        return;
    }
    let mut place = Place::new();
    let mut pipeline = owners(&mut place);
    let folder = place.base.with_extension("rate");
    let prefix = pipeline.domain.prefix().to_owned();
    let open = format!(
        "for f in /dev/shm/{prefix}* {0}/* {1} {1}/own; do [ -r $f -o -w $f ] && echo $f; done; true",
        folder.display(),
        place.base.display()
    );
    let count = fs::read_dir("/dev/shm").unwrap().flatten();
    let count = count.filter(|e| e.file_name().to_string_lossy().starts_with(&prefix)).count();
    assert!(count > 10, "{count} segments: is the prefix right?");
    assert_eq!(text(&shell(STRANGER, STRANGER, &open).stdout), "", "open to everybody");
    // Who is in the group reads the rate, and nothing else.
    let of_group = text(&shell(STRANGER, OWNER, &open).stdout);
    let expected = ["ring", "socket"].map(|name| format!("{}/{name}\n", folder.display())).concat();
    assert_eq!(of_group, expected);
    let ring = folder.join("ring");
    let writes = shell(STRANGER, OWNER, &format!("[ -w {} ]", ring.display()));
    assert!(!writes.status.success(), "the group may write the rate");

    place.wrapper = user(STRANGER, STRANGER);
    let orders: [&[&str]; 4] = [
        &["status", "--instance", "own"],
        &["control", "pause", "--instance", "own"],
        &["run", "--source", "sim", "--dashboard", "off", "--instance", "own"],
        &["service", "kalman", "--instance", "own"],
    ];
    for order in orders {
        let refused = place.output(order);
        let says = text(&refused.stderr);
        assert!(refused.status.code() == Some(1) && says.lines().count() == 1, "{order:?}: {says}");
        assert!(says.contains(&place.base.display().to_string()), "{order:?}: {says}");
    }
    place.wrapper = user(OWNER, OWNER);
    let still = |place: &Place, pipeline: &mut Pipeline| {
        pipeline
            .until("a pipeline as before", |_| place.status("own").is_some_and(|s| s["services"][1]["restarts"] == 0));
    };
    still(&place, &mut pipeline);
    assert_eq!(pipeline.interrupt().code, Some(0));
    assert!(place.left("own").is_empty(), "{:?}", place.left("own"));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn another_user_of_this_machine_needs_the_dashboards_token() {
    if !is_root() || !can_run(STRANGER) {
        return;
    }
    let mut place = Place::new();
    let pipeline = owners(&mut place);
    let read = |name| fs::read_to_string(pipeline.domain.folder().join(name)).unwrap();
    let address = read("dashboard.url");
    let address = address.strip_prefix("http://").unwrap().trim_end_matches('/').to_owned();
    let (ip, port) = address.split_once(':').unwrap();
    let visit = |uid: u32, request: &str| {
        let script = format!(
            "exec 3<>/dev/tcp/{ip}/{port}; printf '{request} HTTP/1.1\\r\\nHost: {address}\\r\\n\
             Content-Length: 0\\r\\nConnection: close\\r\\n\\r\\n' >&3; cat <&3"
        );
        let answer = text(&shell(uid, uid, &script).stdout);
        answer.split_whitespace().nth(1).unwrap_or_default().to_owned()
    };
    for request in ["GET /", "GET /events", "POST /order", "GET /export/model.toml", "GET /?token="] {
        assert_eq!(visit(STRANGER, request), "403", "{request}");
    }
    assert_eq!(visit(OWNER, "GET /"), "200");
    assert_eq!(visit(0, "GET /"), "200");
    assert_eq!(visit(STRANGER, &format!("GET /?token={}", read("dashboard.token"))), "200");
    assert_eq!(pipeline.interrupt().code, Some(0));
    fs::remove_dir_all(place.base.with_extension("rate")).unwrap();
}

#[test]
fn readers_refuse_a_rate_that_somebody_else_made() {
    if !is_root() {
        return;
    }
    let place = Place::new();
    let fake = format!("/dev/shm/truerate-0-fake{}", std::process::id());
    fs::write(&fake, vec![0; 4096]).unwrap();
    chown(&fake, Some(STRANGER), None).unwrap();
    let clients = concat!(env!("CARGO_MANIFEST_DIR"), "/clients");
    let python =
        format!("import sys; sys.path.insert(0, '{clients}/python'); import truerate; truerate.Shared('{fake}')");
    let says = text(&Command::new("python3").args(["-c", &python]).output().unwrap().stderr);
    let source = place.file("open.c");
    fs::write(
        &source,
        format!(
            "#include \"{clients}/c/truerate.h\"\nint main(void) {{ struct truerate r; \
             return truerate_open(&r, \"{fake}\") == -1 && errno == EACCES ? 0 : 1; }}\n"
        ),
    )
    .unwrap();
    let program = place.file("open");
    assert!(Command::new("cc").args(["-o"]).arg(&program).arg(&source).status().unwrap().success());
    let opened = Command::new(&program).status().unwrap();
    fs::remove_file(&fake).unwrap();
    assert!(says.contains("PermissionError") && says.contains("another user"), "{says}");
    assert!(opened.success());
}

#[test]
fn a_folder_that_everybody_may_change_is_refused() {
    let place = Place::new();
    fs::create_dir(&place.base).unwrap();
    fs::set_permissions(&place.base, std::os::unix::fs::PermissionsExt::from_mode(0o777)).unwrap();
    let refused = place.output(&["run", "--source", "sim", "--dashboard", "off", "--instance", "lax"]);
    let says = text(&refused.stderr);
    assert!(refused.status.code() == Some(1) && says.contains("every user may write here"), "{says}");
}
