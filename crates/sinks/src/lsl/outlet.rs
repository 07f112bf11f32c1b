//! An outlet: serves a stream to any number of inlets.

use std::io;
use std::net::Ipv4Addr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use teampulse_core::clock::monotonic;
use teampulse_devices::lsl::{
    FeedReply, FeedRequest, PORTS, Request, RequestReader, SampleWriter, StreamInfo, not_found,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::Semaphore;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};
use tokio::sync::broadcast::{Receiver, Sender, channel};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::responder::{Directory, respond_services};

/// The maximum number of batches that wait for a slow inlet; beyond it, the oldest are skipped.
const WAITING: usize = 4096;
/// The maximum number of inlets of a stream.
const MOST_INLETS: usize = 32;
/// How long an inlet may take to send its request.
const PATIENCE: Duration = Duration::from_secs(10);
/// The maximum amount of data gathered into one packet [bytes].
const GATHERED_BYTES: usize = 64 << 10;

/// A stream that is served until this is dropped.
pub(super) struct Outlet {
    info: Arc<StreamInfo>,
    samples: Sender<Bytes>,
    directory: Directory,
    _tasks: JoinSet<()>,
}

impl Outlet {
    /// Opens the ports of the outlet, and announces it.
    pub async fn open(mut info: StreamInfo, directory: &Directory) -> io::Result<Outlet> {
        let (listener, services) = (listener().await?, services().await?);
        info.data_port = listener.local_addr()?.port();
        info.service_port = services.local_addr()?.port();
        info.created_secs = monotonic().as_secs_f64();
        let info = Arc::new(info);
        let (samples, _) = channel(WAITING);
        let mut tasks = JoinSet::new();
        tasks.spawn(accept(listener, Arc::clone(&info), samples.clone()));
        tasks.spawn(respond_services(services, Arc::clone(&info)));
        directory.add(&info);
        Ok(Outlet { info, samples, directory: directory.clone(), _tasks: tasks })
    }

    /// The description of the stream.
    pub fn info(&self) -> &StreamInfo {
        &self.info
    }

    /// Sends samples to all inlets; if there are none, the samples are discarded.
    pub fn send(&self, samples: Bytes) {
        self.samples.send(samples).ok();
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        self.directory.remove(&self.info);
    }
}

async fn listener() -> io::Result<TcpListener> {
    for port in PORTS {
        if let Ok(listener) = TcpListener::bind((Ipv4Addr::UNSPECIFIED, port)).await {
            return Ok(listener);
        }
    }
    TcpListener::bind((Ipv4Addr::UNSPECIFIED, 0)).await
}

async fn services() -> io::Result<UdpSocket> {
    for port in PORTS {
        if let Ok(socket) = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).await {
            return Ok(socket);
        }
    }
    UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).await
}

async fn accept(listener: TcpListener, info: Arc<StreamInfo>, samples: Sender<Bytes>) {
    let places = Arc::new(Semaphore::new(MOST_INLETS));
    let mut inlets = JoinSet::new();
    loop {
        let Ok((link, peer)) = listener.accept().await else {
            // This happens, for example, if no more files can be opened.
            sleep(Duration::from_millis(100)).await;
            continue;
        };
        while inlets.try_join_next().is_some() {}
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            tracing::warn!(stream = %info.name, %peer, "more than {MOST_INLETS} LSL inlets: this one is refused");
            continue;
        };
        let (info, samples) = (Arc::clone(&info), samples.clone());
        inlets.spawn(async move {
            if let Err(error) = serve(link, &info, &samples).await {
                tracing::debug!(stream = %info.name, %peer, "an LSL inlet ended: {error}");
            }
            drop(place);
        });
    }
}

/// Serves the request of one client.
async fn serve(mut link: TcpStream, info: &StreamInfo, samples: &Sender<Bytes>) -> io::Result<()> {
    link.set_nodelay(true)?;
    let asking = timeout(PATIENCE, request(&mut link)).await;
    match asking.map_err(io::Error::other)?? {
        Request::Full => link.write_all(info.full_xml().as_bytes()).await,
        Request::Short(query) => {
            let query = teampulse_devices::lsl::Query::parse(&query);
            if query.is_some_and(|query| query.matches(info)) {
                link.write_all(info.short_xml().as_bytes()).await?;
            }
            Ok(())
        }
        Request::Feed(feed)
            if feed.version < 110 || (!feed.uid.is_empty() && feed.uid != info.uid) =>
        {
            link.write_all(not_found().as_bytes()).await
        }
        Request::Feed(feed) => {
            // Subscribes before the reply, so that nothing that follows it is missed.
            let waiting = samples.subscribe();
            link.write_all(&head(info, &feed)).await?;
            // An inlet without room for samples only wants to know the format.
            if feed.most_waiting == 0 { Ok(()) } else { stream(link, info, waiting).await }
        }
    }
}

async fn request(link: &mut TcpStream) -> io::Result<Request> {
    let (mut reader, mut buffer) = (RequestReader::default(), [0; 4096]);
    loop {
        let count = link.read(&mut buffer).await?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let read = reader.push(buffer.get(..count).unwrap_or_default());
        if let Some(request) = read.map_err(io::Error::other)? {
            return Ok(request);
        }
    }
}

/// The reply to a request for samples, and the test patterns.
fn head(info: &StreamInfo, feed: &FeedRequest) -> Vec<u8> {
    let suppress_subnormals = info.format.is_float() && !feed.supports_subnormals;
    let reply = FeedReply { is_big_endian: false, suppress_subnormals };
    let mut head = reply.encode(&info.uid).into_bytes();
    head.extend(SampleWriter::new(info).patterns());
    head
}

async fn stream(
    mut link: TcpStream,
    info: &StreamInfo,
    mut samples: Receiver<Bytes>,
) -> io::Result<()> {
    let (mut incoming, mut outgoing) = link.split();
    let mut ignored = [0; 64];
    loop {
        let first = tokio::select! {
            first = samples.recv() => first,
            // An inlet sends nothing more until it leaves.
            read = incoming.read(&mut ignored) => match read? {
                0 => return Ok(()),
                _ => continue,
            },
        };
        let mut packet = match first {
            Ok(bytes) => bytes.to_vec(),
            Err(RecvError::Lagged(count)) => {
                tracing::warn!(stream = %info.name, "a slow LSL inlet missed {count} batches");
                continue;
            }
            Err(RecvError::Closed) => return Ok(()),
        };
        while packet.len() < GATHERED_BYTES {
            match samples.try_recv() {
                Ok(bytes) => packet.extend(bytes),
                Err(TryRecvError::Lagged(count)) => {
                    tracing::warn!(stream = %info.name, "a slow LSL inlet missed {count} batches");
                }
                Err(TryRecvError::Empty | TryRecvError::Closed) => break,
            }
        }
        outgoing.write_all(&packet).await?;
    }
}
