//! TCP connections to the sender of a stream.

use std::time::Duration;

use teampulse_devices::lsl::{
    FeedRequest, LslError, ReplyReader, Sample, SampleReader, StreamInfo,
};
use thiserror::Error;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::resolver::FoundStream;

/// How long a sender may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// The largest description of a stream [bytes].
const LARGEST_BYTES: u64 = 4 << 20;
/// How much data may wait at the sender: seconds of it, or hundreds of samples of an irregular stream, as in liblsl.
const MOST_WAITING: u32 = 360;
/// The largest number of bytes read at once.
const PIECE_BYTES: usize = 64 << 10;

/// Why a stream is no longer read. The message fits after "failed to".
#[derive(Debug, Error)]
pub(super) enum InletError {
    #[error("connect: {0}")]
    Unreached(String),
    #[error("continue: the sender closed the connection")]
    Closed,
    #[error("continue: {0}")]
    Broken(std::io::Error),
    #[error("continue: the sender is silent and does not reply to probes")]
    Silent,
    #[error("{0}")]
    Protocol(#[from] LslError),
}

/// The samples of a stream as they arrive.
pub(super) struct Feed {
    link: TcpStream,
    reader: SampleReader,
    buffer: Vec<u8>,
    /// Samples that arrived together with the headers.
    first: Vec<u8>,
}

/// Requests the full description of a stream, with its channels.
pub(super) async fn described(found: &FoundStream) -> Result<StreamInfo, InletError> {
    let asking = async {
        let mut link = connect(found).await?;
        link.write_all(b"LSL:fullinfo\r\n").await.map_err(InletError::Broken)?;
        let mut document = Vec::new();
        link.take(LARGEST_BYTES).read_to_end(&mut document).await.map_err(InletError::Broken)?;
        Ok(StreamInfo::parse(&String::from_utf8_lossy(&document))?)
    };
    let info: StreamInfo =
        timeout(PATIENCE, asking).await.unwrap_or_else(|_elapsed| Err(silent()))?;
    // The description received over TCP must match the stream that was found.
    let is_same = info.uid == found.info.uid
        && info.format == found.info.format
        && info.channel_count == found.info.channel_count;
    if is_same { Ok(info) } else { Err(LslError::Refused("another stream".into()).into()) }
}

impl Feed {
    /// Requests the samples of a stream.
    pub async fn open(found: &FoundStream) -> Result<Feed, InletError> {
        let opening = async {
            let mut link = connect(found).await?;
            let request = FeedRequest::encode(&found.info, MOST_WAITING);
            link.write_all(request.as_bytes()).await.map_err(InletError::Broken)?;
            let (mut replies, mut buffer) = (ReplyReader::default(), vec![0; PIECE_BYTES]);
            loop {
                let bytes = read(&mut link, &mut buffer).await?;
                if let Some((reply, first)) = replies.push(bytes, &found.info.uid)? {
                    let reader = SampleReader::new(&found.info, reply);
                    return Ok(Feed { link, reader, buffer, first });
                }
            }
        };
        timeout(PATIENCE, opening).await.unwrap_or_else(|_elapsed| Err(silent()))
    }

    /// Returns the next samples, possibly none yet. Cancel-safe: the future may be dropped at any time.
    pub async fn next(&mut self) -> Result<Vec<Sample>, InletError> {
        if !self.first.is_empty() {
            let first = std::mem::take(&mut self.first);
            return Ok(self.reader.push(&first)?);
        }
        let bytes = read(&mut self.link, &mut self.buffer).await?;
        Ok(self.reader.push(bytes)?)
    }
}

async fn connect(found: &FoundStream) -> Result<TcpStream, InletError> {
    let connecting = TcpStream::connect((found.address, found.info.data_port));
    let link = connecting.await.map_err(|error| InletError::Unreached(error.to_string()))?;
    // A request is small and must not be delayed.
    link.set_nodelay(true).map_err(InletError::Broken)?;
    Ok(link)
}

async fn read<'a>(link: &mut TcpStream, buffer: &'a mut [u8]) -> Result<&'a [u8], InletError> {
    match link.read(buffer).await {
        Ok(0) => Err(InletError::Closed),
        Ok(count) => Ok(buffer.get(..count).unwrap_or_default()),
        Err(error) => Err(InletError::Broken(error)),
    }
}

fn silent() -> InletError {
    InletError::Unreached("it does not answer".into())
}
