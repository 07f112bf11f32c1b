//! The server: addresses, checks and routes.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::extract::connect_info::{ConnectInfo, Connected};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Query, Request, State};
use axum::http::StatusCode;
use axum::http::header::{HeaderName, HeaderValue, LOCATION, SET_COOKIE};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use axum::serve::{IncomingStream, Listener};
use axum::{Extension, Router};
use rustix::net::sockopt::set_socket_send_buffer_size;
use serde::Deserialize;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::access::{Access, COOKIE_NAME, Denied, Grant};
use crate::assets::Assets;
use crate::client::{LARGEST_BYTES, serve};
use crate::context::{PORT, Settings};
use crate::hub::Hub;
use crate::rate::Allowance;
use crate::{api, metrics};

/// How many ports after the first are tried.
const PORTS: u16 = 100;
/// The most connections at once, of browsers and programs.
const MOST_CONNECTIONS: usize = 256;
/// What the kernel may hold for a slow client [bytes]: a marker waits behind it.
const SEND_BUFFER_BYTES: usize = 64 << 10;

/// The events that programs may post each second, and at once.
const POSTS: (f64, f64) = (50.0, 200.0);

/// What every answer says: nothing from elsewhere, nothing inline, in no frame.
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

/// What the routes share.
#[derive(Clone)]
pub struct Shared {
    /// The session.
    pub hub: Arc<Hub>,
    /// Who may connect.
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

/// Listens where the settings say, or at the next free port.
pub async fn bind(settings: &Settings) -> io::Result<TcpListener> {
    let ports = match settings.port {
        Some(port) => port..=port,
        None => PORT..=PORT + PORTS,
    };
    let mut failed = io::Error::from(io::ErrorKind::AddrInUse);
    for port in ports {
        match TcpListener::bind((settings.listen, port)).await {
            Ok(listener) => return Ok(listener),
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

/// Serves until the listener fails.
pub async fn run(listener: TcpListener, hub: Arc<Hub>, access: Access) -> io::Result<()> {
    let listener = Limited { listener, room: Arc::new(Semaphore::new(MOST_CONNECTIONS)) };
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

/// Admits or refuses a request, and adds the headers of every answer.
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
        Err(Denied::Token) if !asks => with_token(&shared.access, &request),
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

/// Keeps the token of `/?token=…` in a cookie that scripts can't read, and takes it out of the address.
fn with_token(access: &Access, request: &Request) -> Response {
    let asked = Query::<Asked>::try_from_uri(request.uri());
    let Ok(Query(Asked { token })) = asked else { return refused(Denied::Token) };
    if access.right_of(&token).is_none() {
        return refused(Denied::Token);
    }
    let cookie = format!("{COOKIE_NAME}={token}; HttpOnly; SameSite=Strict; Path=/");
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
    found.unwrap_or_else(|| (StatusCode::NOT_FOUND, "there is no such page\n").into_response())
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

/// The address of the other end.
#[derive(Clone, Copy, Debug)]
pub struct Peer(pub IpAddr);

impl Connected<IncomingStream<'_, Limited>> for Peer {
    fn connect_info(stream: IncomingStream<'_, Limited>) -> Peer {
        Peer(stream.remote_addr().ip())
    }
}

/// A listener with a bound on its connections: one too many is closed at once.
#[derive(Debug)]
struct Limited {
    listener: TcpListener,
    room: Arc<Semaphore>,
}

impl Listener for Limited {
    type Io = Counted;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Counted, SocketAddr) {
        loop {
            match self.listener.accept().await {
                Ok((stream, address)) => {
                    let Ok(permit) = Arc::clone(&self.room).try_acquire_owned() else { continue };
                    let prepared = stream.set_nodelay(true);
                    let bounded = set_socket_send_buffer_size(&stream, SEND_BUFFER_BYTES);
                    if prepared.is_ok() && bounded.is_ok() {
                        return (Counted { stream, _permit: permit }, address);
                    }
                }
                // No file is left, or the other end has gone: the next one may be fine.
                Err(error) => {
                    tracing::debug!("failed to accept a connection: {error}");
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
            }
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A connection that is counted as long as it lives.
#[derive(Debug)]
struct Counted {
    stream: TcpStream,
    _permit: OwnedSemaphorePermit,
}

mod pass_through {
    //! A counted connection reads and writes as its stream does.

    use std::pin::Pin;
    use std::task::{Context, Poll};

    use super::{AsyncRead, AsyncWrite, Counted, ReadBuf, io};

    impl AsyncRead for Counted {
        fn poll_read(
            mut self: Pin<&mut Self>,
            cx: &mut Context<'_>,
            buffer: &mut ReadBuf<'_>,
        ) -> Poll<io::Result<()>> {
            Pin::new(&mut self.stream).poll_read(cx, buffer)
        }
    }

    impl AsyncWrite for Counted {
        fn poll_write(
            mut self: Pin<&mut Self>,
            cx: &mut Context<'_>,
            bytes: &[u8],
        ) -> Poll<io::Result<usize>> {
            Pin::new(&mut self.stream).poll_write(cx, bytes)
        }

        fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            Pin::new(&mut self.stream).poll_flush(cx)
        }

        fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            Pin::new(&mut self.stream).poll_shutdown(cx)
        }
    }
}
