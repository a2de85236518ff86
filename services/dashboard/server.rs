//! The pages, the stream of news, the orders and the exports, over HTTP.

use super::{
    guard::{COOKIE, Guard},
    order::Order,
    peer,
    scene::Scene,
};
use axum::{
    Extension, Json, Router,
    body::Body,
    extract::{DefaultBodyLimit, FromRequest, Path as UrlPath, Request, State},
    http::{HeaderValue, StatusCode, header},
    middleware::{self, Next},
    response::{
        IntoResponse, Response,
        sse::{Event, KeepAlive, Sse},
    },
    routing::{get, post},
};
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    service::TowerToHyperService,
};
use ipc_types::{Command, Reply};
use serde_json::json;
use std::{convert::Infallible, io, net::TcpListener, path::PathBuf, sync::Arc, sync::mpsc::Sender, time::Duration};
use tokio::{
    sync::{Semaphore, oneshot},
    time::timeout,
};
use tokio_stream::{Stream, StreamExt, once, wrappers::BroadcastStream};
use workbench::web;

/// A command on its way to the pipeline, and where its answer goes.
pub type Errand = (Command, oneshot::Sender<Result<Reply, String>>);

/// What a download holds: type, bytes; or why there is none.
pub type Download = Result<(&'static str, Vec<u8>), String>;

/// Makes the download of this name.
pub type Exporter = dyn Fn(&Scene, &str) -> Download + Send + Sync;

/// Everything that a request can reach.
#[derive(Clone)]
pub struct Shop {
    /// The first page: [`DASHBOARD`] or [`GUIDE`].
    pub home: &'static str,
    /// What there is to see.
    pub scene: Scene,
    /// Who may.
    pub guard: Arc<Guard>,
    /// Commands go here.
    pub errands: Sender<Errand>,
    /// Models are saved here.
    pub folder: PathBuf,
    /// Makes `model.toml`, `report.html`, `log.csv`.
    pub export: Arc<Exporter>,
}

/// Whether a connection is this very user's, over loopback.
#[derive(Clone, Copy)]
struct Own(bool);

/// The page of a running pipeline.
pub const DASHBOARD: &str = include_str!("../web/dashboard.html");
/// The page of a guided recording.
pub const GUIDE: &str = include_str!("../web/guide.html");

/// The files of both pages: name, type, content.
const FILES: [(&str, &str, &str); 8] = [
    ("dashboard.js", "text/javascript", include_str!("../web/dashboard.js")),
    ("guide.js", "text/javascript", include_str!("../web/guide.js")),
    ("charts.js", "text/javascript", web::CHARTS),
    ("parts.js", "text/javascript", web::PARTS),
    ("live.js", "text/javascript", web::LIVE),
    ("style.css", "text/css", web::STYLE),
    ("uplot.js", "text/javascript", web::UPLOT),
    ("uplot.css", "text/css", web::UPLOT_STYLE),
];

/// The longest order, bytes.
const LONGEST_ORDER: usize = 8 * 1024;
/// A request must be here within that.
const REQUEST: Duration = Duration::from_secs(5);
/// Connections at a time; more wait.
const CONNECTIONS: usize = 512;
/// After a connection that could not be taken.
const PAUSE: Duration = Duration::from_millis(50);

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
                      img-src data:; form-action 'none'; frame-ancestors 'none'; base-uri 'none'";

/// Serves until the process ends.
///
/// # Errors
/// Where the listener cannot be used.
pub fn serve(listener: TcpListener, shop: Shop) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let (local, pages) = (shop.guard.is_local(), router(shop));
        let room = Arc::new(Semaphore::new(CONNECTIONS));
        loop {
            let place = Arc::clone(&room).acquire_owned().await.map_err(io::Error::other)?;
            let Ok((stream, peer)) = listener.accept().await else {
                tokio::time::sleep(PAUSE).await;
                continue;
            };
            let own = Own(local && stream.local_addr().is_ok_and(|here| peer::is_ours(peer, here)));
            let service = TowerToHyperService::new(pages.clone().layer(Extension(own)));
            // A head that does not come to its end ends its connection, as does one that stays silent.
            let connection = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(REQUEST)
                .serve_connection(TokioIo::new(stream), service);
            tokio::spawn(async move {
                let _ = connection.await;
                drop(place);
            });
        }
    })
}

fn router(shop: Shop) -> Router {
    Router::new()
        .route("/", get(|State(shop): State<Shop>| async move { page(shop.home) }))
        .route("/{name}", get(|UrlPath(name): UrlPath<String>| async move { file(&name) }))
        .route("/events", get(events))
        .route("/order", post(order))
        .route("/export/{name}", get(export))
        .layer(DefaultBodyLimit::max(LONGEST_ORDER))
        .layer(middleware::from_fn_with_state(shop.clone(), guarded))
        .with_state(shop)
}

/// Nothing is answered before the guard has looked.
async fn guarded(
    State(shop): State<Shop>,
    Extension(Own(own)): Extension<Own>,
    request: Request,
    next: Next,
) -> Response {
    let query = request.uri().query().map(str::to_owned);
    if let Err(refused) = shop.guard.check(own, request.method(), request.headers(), query.as_deref()) {
        return (StatusCode::FORBIDDEN, refused.to_string()).into_response();
    }
    let length = request.headers().get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse().ok());
    if length.is_some_and(|length: u64| length > LONGEST_ORDER as u64) {
        return (StatusCode::PAYLOAD_TOO_LARGE, "no order is that long").into_response();
    }
    let first = request.uri().path() == "/" && query.is_some_and(|q| q.contains("token="));
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    let cookie = format!("{COOKIE}={}; HttpOnly; SameSite=Strict; Path=/", shop.guard.token());
    if let (true, Ok(cookie)) = (first, HeaderValue::from_str(&cookie)) {
        headers.insert(header::SET_COOKIE, cookie);
    }
    response
}

fn page(content: &'static str) -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], content).into_response()
}

fn file(name: &str) -> Response {
    match FILES.iter().find(|f| f.0 == name) {
        Some((_, kind, content)) => ([(header::CONTENT_TYPE, *kind)], *content).into_response(),
        None => (StatusCode::NOT_FOUND, "there is no such page; the dashboard is at /").into_response(),
    }
}

/// The whole first, then what changes; a page that was too slow begins anew.
async fn events(State(shop): State<Shop>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let (whole, news) = shop.scene.open();
    let first = Event::default().event(whole.event).data(whole.data);
    let rest = BroadcastStream::new(news).map(move |message| match message {
        Ok(message) => Event::default().event(message.event).data(&message.data),
        Err(_lagged) => {
            let whole = shop.scene.open().0;
            Event::default().event(whole.event).data(whole.data)
        }
    });
    Sse::new(once(first).chain(rest).map(Ok))
        .keep_alive(KeepAlive::new().interval(Duration::from_secs(2)).text("alive"))
}

async fn order(State(shop): State<Shop>, request: Request) -> Response {
    let refuse = |status, says: String| (status, Json(json!({ "done": false, "says": says }))).into_response();
    let order = match timeout(REQUEST, Json::<Order>::from_request(request, &())).await {
        Ok(Ok(Json(order))) => order,
        Ok(Err(refused)) => return refused.into_response(),
        Err(_) => return refuse(StatusCode::REQUEST_TIMEOUT, "the order was not finished".into()),
    };
    let command = match order.command(&shop.folder) {
        Ok(command) => command,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, error.to_string()),
    };
    let (answer, answered) = oneshot::channel();
    if shop.errands.send((command, answer)).is_err() {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "the pipeline has ended".into());
    }
    match answered.await {
        Ok(Ok(reply)) => {
            Json(json!({ "done": reply.done == 1, "epoch": reply.epoch, "says": reply.says.as_str() })).into_response()
        }
        Ok(Err(error)) => refuse(StatusCode::SERVICE_UNAVAILABLE, error),
        Err(_) => refuse(StatusCode::SERVICE_UNAVAILABLE, "the pipeline has ended".into()),
    }
}

async fn export(State(shop): State<Shop>, UrlPath(name): UrlPath<String>) -> Response {
    // Off the one thread that serves everybody: a report or a log takes a while.
    let made = tokio::task::spawn_blocking(move || (shop.export)(&shop.scene, &name).map(|d| (name, d))).await;
    match made {
        Ok(Ok((name, (kind, bytes)))) => {
            let disposition = format!("attachment; filename=\"{name}\"");
            ([(header::CONTENT_TYPE, kind), (header::CONTENT_DISPOSITION, disposition.as_str())], Body::from(bytes))
                .into_response()
        }
        Ok(Err(says)) => (StatusCode::NOT_FOUND, says).into_response(),
        Err(_) => (StatusCode::INTERNAL_SERVER_ERROR, "that export failed").into_response(),
    }
}
