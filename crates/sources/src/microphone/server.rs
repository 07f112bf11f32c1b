use std::env;
use std::ffi::{CString, OsString};
use std::fs;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

use bytes::Bytes;
use pulseaudio::protocol::stream::{BufferAttr, StreamFlags};
use pulseaudio::protocol::{
    ChannelMap, ChannelVolume, RecordStreamParams, SampleFormat, SampleSpec, SourceInfo,
};
use pulseaudio::{Client, ClientError, RecordStream};
use teampulse_core::source::SourceError;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use super::FoundMicrophone;

/// The number of blocks per second.
const BLOCKS_PER_SEC: u32 = 50;
/// How many blocks may wait to be processed.
const MOST_WAITING: usize = 256;
/// How long a server may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// The range of rates that are requested [Hz]; the server converts other rates to these.
const RATES_HZ: (u32, u32) = (8_000, 96_000);
/// The size of a sample [bytes].
pub const SAMPLE_BYTES: u32 = 4;

/// The sound server of this computer.
pub(super) struct Server(Client);

/// A block of sound.
pub(super) struct Block {
    /// Samples of one channel, as little-endian 32-bit floats.
    pub data: Bytes,
    /// The number of blocks lost before this one.
    pub lost: u64,
}

/// A microphone that is being recorded, until this is dropped.
pub(super) struct Recording {
    /// The microphone's name for display.
    pub name: String,
    pub rate_hz: u32,
    pub blocks: Receiver<Block>,
    _stream: RecordStream,
    _server: Server,
}

impl Server {
    pub async fn connect() -> Result<Server, SourceError> {
        // Connecting blocks until the server's first answers.
        let connected = spawn_blocking(connect).await;
        let client =
            connected.unwrap_or_else(|error| std::panic::resume_unwind(error.into_panic()));
        client.map(Server).map_err(|error| SourceError::Gone {
            message: format!("connect to the sound server: {}", text(&error)),
            hint: "start PulseAudio (`pulseaudio --start`) or PipeWire (`systemctl --user start pipewire-pulse`)"
                .to_owned(),
        })
    }

    /// Starts to record the microphone with this text in its name or description.
    pub async fn record(device: &str) -> Result<Recording, SourceError> {
        let server = Server::connect().await?;
        let (all, infos) = server.sources().await?;
        let place = FoundMicrophone::chosen(&all, device)?;
        let rate_hz = infos[place].sample_spec.sample_rate.clamp(RATES_HZ.0, RATES_HZ.1);
        let params = RecordStreamParams {
            sample_spec: SampleSpec {
                format: SampleFormat::Float32Le,
                channels: 1,
                sample_rate: rate_hz,
            },
            channel_map: ChannelMap::mono(),
            source_name: CString::new(all[place].name.clone()).ok(),
            cvolume: Some(ChannelVolume::norm(1)),
            buffer_attr: BufferAttr {
                max_length: u32::MAX,
                fragment_size: SAMPLE_BYTES * rate_hz / BLOCKS_PER_SEC,
                ..Default::default()
            },
            // When the microphone is unplugged, the recording must end, not move to another microphone.
            flags: StreamFlags { no_move: true, adjust_latency: true, ..Default::default() },
            ..Default::default()
        };
        let (post, blocks) = channel(MOST_WAITING);
        let mut lost = 0;
        let take = move |data: &[u8]| match post
            .try_send(Block { data: Bytes::copy_from_slice(data), lost })
        {
            Ok(()) => lost = 0,
            Err(_) => lost += 1,
        };
        let begun = timeout(PATIENCE, server.0.create_record_stream(params, take)).await;
        let stream = begun.unwrap_or(Err(ClientError::Disconnected)).map_err(|error| {
            SourceError::Gone {
            message: format!("record {}: {}", all[place].description, text(&error)),
            hint:
                "does another program use it exclusively, or do the desktop's privacy settings mute it?"
                    .to_owned(),
        }
        })?;
        let rate_hz = stream.sample_spec().sample_rate;
        let name = all[place].description.clone();
        Ok(Recording { name, rate_hz, blocks, _stream: stream, _server: server })
    }

    /// Returns the microphones known to the server, including monitors of loudspeakers.
    pub async fn microphones(&self) -> Result<Vec<FoundMicrophone>, SourceError> {
        Ok(self.sources().await?.0)
    }

    async fn sources(&self) -> Result<(Vec<FoundMicrophone>, Vec<SourceInfo>), SourceError> {
        let failed = |error: ClientError| SourceError::Gone {
            message: format!("ask the sound server for microphones: {}", text(&error)),
            hint: "start it again".to_owned(),
        };
        let asked = async { Ok((self.0.server_info().await?, self.0.list_sources().await?)) };
        let (about, infos) = timeout(PATIENCE, asked)
            .await
            .unwrap_or(Err(ClientError::Disconnected))
            .map_err(failed)?;
        let default = about.default_source_name.map(|name| name.to_string_lossy().into_owned());
        let default = default.unwrap_or_default();
        Ok((infos.iter().map(|info| FoundMicrophone::of(info, &default)).collect(), infos))
    }
}

fn connect() -> Result<Client, ClientError> {
    let paths = sockets(|name| env::var_os(name));
    let path =
        paths.into_iter().find(|path| path.exists()).ok_or(ClientError::ServerUnavailable)?;
    let socket = UnixStream::connect(path)?;
    socket.set_read_timeout(Some(PATIENCE))?;
    socket.set_write_timeout(Some(PATIENCE))?;
    let cookie = pulseaudio::cookie_path_from_env().and_then(|path| fs::read(path).ok());
    Client::new_unix(c"teampulse", socket, cookie)
}

/// Returns the paths at which the server's socket may be: the one in `PULSE_SERVER`, or else those below
/// `PULSE_RUNTIME_PATH`, `XDG_RUNTIME_DIR` and `/run`, in this order.
fn sockets(variable: impl Fn(&str) -> Option<OsString>) -> Vec<PathBuf> {
    if let Some(server) = variable("PULSE_SERVER").and_then(|server| server.into_string().ok()) {
        let path = server.strip_prefix("unix:").unwrap_or(&server);
        return vec![PathBuf::from(path)];
    }
    let own = variable("PULSE_RUNTIME_PATH").map(|folder| PathBuf::from(folder).join("native"));
    let user = variable("XDG_RUNTIME_DIR").map(|folder| PathBuf::from(folder).join("pulse/native"));
    let system = PathBuf::from("/run/pulse/native");
    own.into_iter().chain(user).chain([system]).collect()
}

/// Returns the text of an error, with its cause, which the error itself does not state.
fn text(error: &ClientError) -> String {
    match error {
        ClientError::Io(cause) => cause.to_string(),
        ClientError::Disconnected => "it does not answer".to_owned(),
        ClientError::ServerUnavailable => "no sound server runs for this user".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_socket_is_where_the_environment_says() {
        let of = |set: &'static [(&'static str, &'static str)]| {
            let variable = move |name: &str| {
                set.iter().find(|(each, _)| *each == name).map(|(_, value)| OsString::from(value))
            };
            let paths = sockets(variable);
            paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(
            of(&[("PULSE_SERVER", "unix:/tmp/x"), ("XDG_RUNTIME_DIR", "/run/user/1")]),
            "/tmp/x"
        );
        assert_eq!(
            of(&[("XDG_RUNTIME_DIR", "/run/user/1")]),
            "/run/user/1/pulse/native /run/pulse/native"
        );
        assert_eq!(of(&[("PULSE_RUNTIME_PATH", "/p")]), "/p/native /run/pulse/native");
    }
}
