//! The dashboard against those who mean no good: plain HTTP, written by hand.

use crate::harness::{Pipeline, Place};
use std::{
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
    time::Duration,
};

/// Status and body of the answer to these bytes; status 0 where the connection was just closed.
fn answer(address: SocketAddr, request: &[u8]) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    // What the server does not want to read any more is not written either.
    let _ = stream.write_all(request);
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let status = text.split_whitespace().nth(1).and_then(|word| word.parse().ok()).unwrap_or(0);
    (status, text.split_once("\r\n\r\n").map_or_else(String::new, |(_, body)| body.to_owned()))
}

fn get(address: SocketAddr, path: &str) -> (u16, String) {
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    answer(address, request.as_bytes())
}

fn post(address: SocketAddr, path: &str, body: &[u8]) -> (u16, String) {
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\n\r\n",
        body.len()
    );
    answer(address, &[head.as_bytes(), body].concat())
}

/// Where the dashboard of a simulated vehicle listens, and its token.
fn dashboard(place: &Place, instance: &str, address: &str) -> (Pipeline, SocketAddr, Option<String>) {
    let mut pipeline = place.start_watched(instance, address, &["--source", "sim"]);
    let mut url = None;
    pipeline.until("the dashboard's address", |p| {
        url = std::fs::read_to_string(p.domain.folder().join("dashboard.url")).ok();
        url.is_some() && p.pid("compensator").is_some()
    });
    let url = url.unwrap();
    let (authority, query) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
    let port = authority.rsplit(':').next().unwrap();
    let token = query.strip_prefix("?token=").map(str::to_owned);
    (pipeline, format!("127.0.0.1:{port}").parse().unwrap(), token)
}

#[test]
fn beyond_loopback_the_dashboard_wants_its_token() {
    let place = Place::new();
    let (pipeline, address, token) = dashboard(&place, "open", "0.0.0.0:0");
    let token = token.unwrap();
    let undo = br#"{"do":"undo"}"#;
    for wrong in [String::new(), "?token=".to_owned(), format!("?token={}", "0".repeat(32))] {
        for path in ["/", "/dashboard.js", "/events", "/export/model.toml"] {
            assert_eq!(get(address, &format!("{path}{wrong}")).0, 403, "{path}{wrong}");
        }
        assert_eq!(post(address, &format!("/order{wrong}"), undo).0, 403, "{wrong}");
    }
    let (status, page) = get(address, &format!("/?token={token}"));
    assert!(status == 200 && page.contains("<html"), "{status}: {page}");
    let (status, says) = post(address, &format!("/order?token={token}"), undo);
    assert!(status == 200 && says.contains("nothing to undo"), "{status}: {says}");
    assert_eq!(pipeline.interrupt().code, Some(0));
    assert!(place.left("open").is_empty(), "{:?}", place.left("open"));
}

#[test]
fn nothing_that_a_client_sends_ends_the_dashboard_or_leaves_its_folder() {
    let place = Place::new();
    let (pipeline, address, _) = dashboard(&place, "guarded", "127.0.0.1:0");
    let before = pipeline.pid("dashboard").unwrap();
    let escaped = place.file("escaped.toml");
    let paths =
        ["/../../etc/passwd", "/export/../../etc/passwd", "/export/%2e%2e%2fetc%2fpasswd", "/export//etc/passwd"];
    for path in paths {
        let (status, body) = get(address, path);
        assert!((400..500).contains(&status) && !body.contains("root:"), "{path}: {status}: {body}");
    }
    let save = |name: &str| format!("{{\"do\":\"save\",\"argument\":{}}}", serde_json::json!(name));
    let orders = [
        save(escaped.to_str().unwrap()),
        save("../escaped.toml"),
        save("..\\escaped.toml"),
        save(".escaped.toml"),
        save("escaped.toml\0"),
        save("escaped.sh"),
        format!(r#"{{"do":"add","effect":"{}","axis":"z"}}"#, "a".repeat(5000)),
        format!(r#"{{"do":"hide","effect":"delay","argument":"{}"}}"#, "d=1,".repeat(1000)),
        r#"{"do":"add","effect":"delay","axis":"q"}"#.to_owned(),
        r#"{"do":"explode"}"#.to_owned(),
        "[".repeat(4000),
        "\u{0}".to_owned(),
    ];
    for order in orders {
        let (status, body) = post(address, "/order", order.as_bytes());
        assert!((400..500).contains(&status), "{order}: {status}: {body}");
    }
    assert_eq!(post(address, "/order", &vec![b' '; 1 << 20]).0, 413);
    for junk in [&b"\xff\xfe\x00\r\n\r\n"[..], b"GET / HTTP/9.9\r\n\r\n", &[0; 4096], b"GET \r\n\r\n"] {
        assert!((400..600).contains(&answer(address, junk).0), "{junk:?}");
    }
    assert_eq!(get(address, "/").0, 200);
    assert_eq!(pipeline.pid("dashboard"), Some(before), "it had to be started again");
    assert!(!escaped.exists() && !place.file("../escaped.toml").exists());
    let ended = pipeline.interrupt();
    assert!(ended.code == Some(0) && !ended.error.contains("panicked"), "{}", ended.error);
}

#[test]
fn half_a_request_does_not_keep_its_connection() {
    let place = Place::new();
    let (pipeline, address, _) = dashboard(&place, "halves", "127.0.0.1:0");
    let halves = [
        format!("GET / HTTP/1.1\r\nHost: {address}\r\nX-Half: "),
        format!(
            "POST /order HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\nContent-Type: application/json\r\n\
             Content-Length: 1000\r\n\r\n{{"
        ),
    ];
    for half in halves {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream.write_all(half.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("it is closed from the other side");
        let text = String::from_utf8_lossy(&answer);
        assert!(answer.is_empty() || text.starts_with("HTTP/1.1 408"), "{text}");
    }
    let claim = format!(
        "POST /order HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\nContent-Type: application/json\r\n\
         Content-Length: 1000000000000\r\n\r\n"
    );
    assert_eq!(answer(address, claim.as_bytes()).0, 413);
    assert_eq!(get(address, "/").0, 200, "others are served");
    assert_eq!(pipeline.interrupt().code, Some(0));
}
