//! Connections: bounded in number, and with https if there is a certificate.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::serve::Listener;
use rustix::net::sockopt::set_socket_send_buffer_size;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_rustls::TlsAcceptor;

use crate::patience::Patience;
use crate::tls::Tls;

/// The maximum number of simultaneous connections of browsers and programs.
const MOST_CONNECTIONS: usize = 256;
/// The most data that the kernel may hold for a slow client [bytes]: a marker has to wait behind it.
const SEND_BUFFER_BYTES: usize = 64 << 10;
/// The first byte of a TLS connection: the content type of a handshake record.
const HANDSHAKE_RECORD: u8 = 22;
/// The answer to an http request when only https is served.
const PLAIN: &str = "this dashboard is served as https: open the same address with https://\n";

/// A listener with a limited number of connections; any others are closed at once.
pub struct Limited {
    listener: TcpListener,
    room: Arc<Semaphore>,
    acceptor: Option<TlsAcceptor>,
}

impl Limited {
    /// Accepts connections, with https if there is a certificate.
    pub fn new(listener: TcpListener, tls: Option<&Tls>) -> Limited {
        let room = Arc::new(Semaphore::new(MOST_CONNECTIONS));
        Limited { listener, room, acceptor: tls.map(Tls::acceptor) }
    }
}

impl Listener for Limited {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        loop {
            match self.listener.accept().await {
                Ok((stream, address)) => {
                    let Ok(permit) = Arc::clone(&self.room).try_acquire_owned() else { continue };
                    let prepared = stream.set_nodelay(true);
                    let bounded = set_socket_send_buffer_size(&stream, SEND_BUFFER_BYTES);
                    if prepared.is_ok() && bounded.is_ok() {
                        return (Connection::new(stream, self.acceptor.clone(), permit), address);
                    }
                }
                // No file descriptor is left, or the peer has gone: the next connection may succeed.
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

/// A connection that is counted while it is open, and that is closed when it is not used for too long.
pub struct Connection {
    stage: Stage,
    patience: Patience,
    _permit: OwnedSemaphorePermit,
}

type Handshake = dyn Future<Output = io::Result<Box<dyn Stream>>> + Send;

enum Stage {
    /// A TLS handshake, carried out when the connection is first read or written, so that a slow one delays nobody.
    Handshake(Pin<Box<Handshake>>),
    Open(Box<dyn Stream>),
    Failed,
}

/// A stream of bytes that can be read and written.
trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Stream for T {}

impl Connection {
    fn new(
        stream: TcpStream,
        tls: Option<TlsAcceptor>,
        permit: OwnedSemaphorePermit,
    ) -> Connection {
        let stage = match tls {
            None => Stage::Open(Box::new(stream)),
            Some(acceptor) => Stage::Handshake(Box::pin(secure(stream, acceptor))),
        };
        Connection { stage, patience: Patience::new(), _permit: permit }
    }

    /// Waits until the connection can be read and written.
    fn poll_open(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<Pin<&mut dyn Stream>>> {
        if let Stage::Handshake(handshake) = &mut self.stage {
            self.stage = match ready!(handshake.as_mut().poll(cx)) {
                Ok(stream) => Stage::Open(stream),
                Err(error) => {
                    tracing::debug!("failed to secure a connection: {error}");
                    Stage::Failed
                }
            };
        }
        match &mut self.stage {
            Stage::Open(stream) => Poll::Ready(Ok(Pin::new(&mut **stream))),
            _ => Poll::Ready(Err(io::ErrorKind::NotConnected.into())),
        }
    }
}

/// Secures a connection with TLS; a plain http request is answered with a hint to use https.
async fn secure(mut stream: TcpStream, acceptor: TlsAcceptor) -> io::Result<Box<dyn Stream>> {
    let mut first = [0];
    if stream.peek(&mut first).await? == 0 {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    if first != [HANDSHAKE_RECORD] {
        // Unread data would reset the connection, and the answer would be lost.
        let mut request = [0; 4096];
        let _length = stream.read(&mut request).await?;
        let answer = format!(
            "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{PLAIN}",
            PLAIN.len()
        );
        stream.write_all(answer.as_bytes()).await?;
        stream.shutdown().await?;
        return Err(io::Error::new(io::ErrorKind::InvalidData, "not a TLS handshake"));
    }
    Ok(Box::new(acceptor.accept(stream).await?))
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let polled = self.poll_open(cx).map_ok(|stream| stream.poll_read(cx, buffer));
        let read = match polled {
            Poll::Ready(Ok(read)) => read,
            Poll::Ready(Err(error)) => Poll::Ready(Err(error)),
            Poll::Pending => Poll::Pending,
        };
        if read.is_pending() {
            return self.patience.poll_over(cx).map(|()| Err(io::ErrorKind::TimedOut.into()));
        }
        self.patience.received(&buffer.filled()[before..]);
        read
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = ready!(ready!(self.poll_open(cx))?.poll_write(cx, bytes));
        self.patience.sent();
        Poll::Ready(written)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_open(cx))?.poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_open(cx))?.poll_shutdown(cx)
    }
}
