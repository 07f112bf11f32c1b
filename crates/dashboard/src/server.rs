//! The server: addresses, checks and routes.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::connect_info::{ConnectInfo, Connected};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Query, Request, State};
use axum::http::StatusCode;
use axum::http::header::{HeaderName, HeaderValue, LOCATION, SET_COOKIE};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use axum::serve::IncomingStream;
use axum::{Extension, Router};
use serde::Deserialize;
use thiserror::Error;
use tokio::net::TcpListener;

use crate::access::{Access, COOKIE_NAME, Denied, Grant};
use crate::assets::Assets;
use crate::client::{LARGEST_BYTES, serve};
use crate::context::{PORT, Settings};
use crate::hub::Hub;
use crate::listener::Limited;
use crate::rate::Allowance;
use crate::{api, metrics};

/// How many further ports are tried after the first.
const PORTS: u16 = 100;

/// The number of events that programs may post: per second, and in a burst.
const POSTS: (f64, f64) = (50.0, 200.0);

/// The headers of every answer: they allow nothing from other sites, nothing inline, and no display in a frame.
const HEADERS: [(&str, &str); 7] = [
    (
        "content-security-policy",
        "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-embedder-policy", "require-corp"),
    ("cross-origin-resource-policy", "same-origin"),
];

/// The state shared by the routes.
#[derive(Clone)]
pub struct Shared {
    /// The session.
    pub hub: Arc<Hub>,
    /// The rules on who may connect.
    pub access: Arc<Access>,
    assets: Arc<Assets>,
    posts: Arc<Mutex<Allowance>>,
}

impl Shared {
    /// Whether one more event may be posted now.
    pub fn may_post(&self) -> bool {
        self.posts.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// No port could be opened. The message fits after "failed to".
#[derive(Debug, Error)]
#[error("listen on {address}{further}: {error}")]
pub struct NotBound {
    /// The first address that was tried.
    address: SocketAddr,
    /// The text about the other ports; empty if none was tried.
    further: String,
    /// The reason.
    error: io::Error,
}

/// Listens at the address and port of the settings; without a port, at the first free one from [`PORT`] on.
pub async fn bind(settings: &Settings) -> Result<TcpListener, NotBound> {
    let (first, last) = settings.port.map_or((PORT, PORT + PORTS), |port| (port, port));
    let mut failed = io::Error::from(io::ErrorKind::AddrInUse);
    for port in first..=last {
        match TcpListener::bind((settings.listen, port)).await {
            Ok(listener) => return Ok(listener),
            Err(error) => failed = error,
        }
    }
    let further = if last > first { format!(" or a port up to {last}") } else { String::new() };
    let address = SocketAddr::new(settings.listen, first);
    Err(NotBound { address, further, error: failed })
}

/// Serves until the listener fails.
pub async fn run(listener: TcpListener, hub: Arc<Hub>, access: Access) -> io::Result<()> {
    let listener = Limited::new(listener, hub.settings.tls.as_ref());
    let service = routes(hub, access).into_make_service_with_connect_info::<Peer>();
    axum::serve(listener, service).await
}

fn routes(hub: Arc<Hub>, access: Access) -> Router {
    let assets = Arc::new(Assets::compressed());
    let posts = Arc::new(Mutex::new(Allowance::new(POSTS.0, POSTS.1)));
    let shared = Shared { hub, access: Arc::new(access), assets, posts };
    Router::new()
        .route("/ws", any(socket))
        .route("/metrics", get(metrics::answer))
        .merge(api::routes())
        .fallback(page)
        .layer(DefaultBodyLimit::max(LARGEST_BYTES))
        .layer(from_fn_with_state(shared.clone(), check))
        .with_state(shared)
}

/// Admits or refuses a request, and adds the common headers to the answer.
async fn check(
    State(shared): State<Shared>,
    ConnectInfo(Peer(peer)): ConnectInfo<Peer>,
    mut request: Request,
    next: Next,
) -> Response {
    let asks = request.uri().path() != "/";
    let mut answer = match shared.access.admit(request.headers(), peer, asks) {
        Ok(grant) => {
            request.extensions_mut().insert(grant);
            next.run(request).await
        }
        Err(Denied::Token) if !asks => with_token(&shared, &request),
        Err(denied) => refused(denied),
    };
    for (name, value) in HEADERS {
        let (name, value) = (HeaderName::from_static(name), HeaderValue::from_static(value));
        answer.headers_mut().insert(name, value);
    }
    answer
}

#[derive(Deserialize)]
struct Asked {
    token: String,
}

/// Keeps the token of `/?token=…` in a cookie that scripts can't read, and removes it from the address.
fn with_token(shared: &Shared, request: &Request) -> Response {
    let asked = Query::<Asked>::try_from_uri(request.uri());
    let Ok(Query(Asked { token })) = asked else { return refused(Denied::Token) };
    if shared.access.right_of(&token).is_none() {
        return refused(Denied::Token);
    }
    let secure = if shared.hub.settings.tls.is_some() { "; Secure" } else { "" };
    let cookie = format!("{COOKIE_NAME}={token}; HttpOnly; SameSite=Strict; Path=/{secure}");
    (StatusCode::SEE_OTHER, [(LOCATION, "/".to_owned()), (SET_COOKIE, cookie)]).into_response()
}

fn refused(denied: Denied) -> Response {
    let status = match denied {
        Denied::Token => StatusCode::UNAUTHORIZED,
        Denied::Host | Denied::Origin => StatusCode::FORBIDDEN,
    };
    (status, format!("{denied}\n")).into_response()
}

async fn page(State(shared): State<Shared>, request: Request) -> Response {
    let found = shared.assets.answer(request.uri().path(), request.headers());
    found.unwrap_or_else(|| (StatusCode::NOT_FOUND, "page not found\n").into_response())
}

async fn socket(
    State(shared): State<Shared>,
    Extension(grant): Extension<Grant>,
    upgrade: WebSocketUpgrade,
) -> Response {
    upgrade
        .max_message_size(LARGEST_BYTES)
        .max_frame_size(LARGEST_BYTES)
        .on_upgrade(move |socket| serve(socket, shared.hub, grant))
}

/// The IP address of the peer.
#[derive(Clone, Copy, Debug)]
pub struct Peer(pub IpAddr);

impl Connected<IncomingStream<'_, Limited>> for Peer {
    fn connect_info(stream: IncomingStream<'_, Limited>) -> Peer {
        Peer(stream.remote_addr().ip())
    }
}
