//! The exchange over a TCP connection before the first sample.

use super::{LslError, StreamInfo};

/// The largest size of a request, or of the headers of a reply [bytes].
const LARGEST_BYTES: usize = 16 << 10;
const END: &[u8] = b"\r\n\r\n";

/// A client's request to a stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// A request for the short description, if the query matches the stream.
    Short(String),
    /// A request for the full description.
    Full,
    /// A request for samples.
    Feed(FeedRequest),
}

/// A request for samples.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedRequest {
    /// The version of the protocol: 110.
    pub version: u32,
    /// The id of the outlet; may be empty.
    pub uid: String,
    /// Whether the client reads subnormal numbers.
    pub supports_subnormals: bool,
    /// The largest number of samples that may wait for the client.
    pub most_waiting: u32,
}

/// The reply to a request for samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeedReply {
    /// Whether numbers are big-endian.
    pub is_big_endian: bool,
    /// Whether subnormal numbers are to be read as zero.
    pub suppress_subnormals: bool,
}

impl FeedRequest {
    /// Encodes a request for the samples of a stream, of which at most `most_waiting` may wait.
    pub fn encode(stream: &StreamInfo, most_waiting: u32) -> String {
        let StreamInfo { uid, hostname, source_id, session_id, .. } = stream;
        let size = stream.format.size();
        let (hostname, source_id) = (on_one_line(hostname), on_one_line(source_id));
        format!(
            "LSL:streamfeed/110 {uid}\r\nNative-Byte-Order: 1234\r\nEndian-Performance: 0\r\n\
             Has-IEEE754-Floats: 1\r\nSupports-Subnormals: 1\r\nValue-Size: {size}\r\n\
             Data-Protocol-Version: 110\r\nMax-Buffer-Length: {most_waiting}\r\nMax-Chunk-Length: 0\r\n\
             Hostname: {hostname}\r\nSource-Id: {source_id}\r\nSession-Id: {session_id}\r\n\r\n"
        )
    }

    fn parse(method: &str, headers: &str) -> Result<FeedRequest, LslError> {
        let mut words = method.split_ascii_whitespace();
        let version = words.next().and_then(|word| word.strip_prefix("LSL:streamfeed/"));
        let version = version.and_then(|version| version.parse().ok());
        let version = version.ok_or(LslError::Headers("the version is missing"))?;
        let uid = words.next().unwrap_or_default().to_owned();
        let mut request = FeedRequest { version, uid, supports_subnormals: true, most_waiting: 0 };
        for (name, value) in headers.lines().filter_map(header) {
            match name.as_str() {
                "supports-subnormals" => request.supports_subnormals = value != "0",
                "max-buffer-length" => request.most_waiting = value.parse().unwrap_or(0),
                _ => {}
            }
        }
        Ok(request)
    }
}

impl FeedReply {
    /// Encodes the headers of the reply.
    pub fn encode(self, uid: &str) -> String {
        let order = if self.is_big_endian { 4321 } else { 1234 };
        let suppress = u8::from(self.suppress_subnormals);
        format!(
            "LSL/110 200 OK\r\nUID: {uid}\r\nByte-Order: {order}\r\nSuppress-Subnormals: {suppress}\r\n\
             Data-Protocol-Version: 110\r\n\r\n"
        )
    }

    fn parse(text: &str, uid: &str) -> Result<FeedReply, LslError> {
        let mut lines = text.lines();
        let status = lines.next().unwrap_or_default().trim();
        let mut words = status.split_ascii_whitespace();
        let is_lsl = words.next().is_some_and(|word| word.starts_with("LSL/"));
        if !is_lsl {
            return Err(LslError::Headers("the reply is not from an LSL outlet"));
        }
        if words.next() != Some("200") {
            return Err(LslError::Refused(status.chars().take(100).collect()));
        }
        let mut reply = FeedReply { is_big_endian: false, suppress_subnormals: false };
        for (name, value) in lines.filter_map(header) {
            match name.as_str() {
                "byte-order" => reply.is_big_endian = value == "4321",
                "suppress-subnormals" => reply.suppress_subnormals = value == "1",
                "uid" if value != uid.to_ascii_lowercase() => {
                    return Err(LslError::Headers("the stream was replaced by another one"));
                }
                "data-protocol-version" if value != "110" => {
                    return Err(LslError::Headers(
                        "the sender uses another version of the LSL protocol",
                    ));
                }
                _ => {}
            }
        }
        Ok(reply)
    }
}

/// Returns the reply that refuses a request for another outlet.
pub fn not_found() -> &'static str {
    "LSL/110 404 Not found\r\n\r\n"
}

/// Returns the name and value of a header, both in lower case.
fn header(line: &str) -> Option<(String, String)> {
    let line = line.split(';').next()?;
    let (name, value) = line.split_once(':')?;
    Some((name.trim().to_ascii_lowercase(), value.trim().to_ascii_lowercase()))
}

fn on_one_line(text: &str) -> String {
    text.chars().filter(|each| !each.is_control()).collect()
}

/// Reads a request from bytes that arrive in pieces.
#[derive(Clone, Debug, Default)]
pub struct RequestReader(Vec<u8>);

impl RequestReader {
    /// Adds bytes; returns the request once it is complete.
    pub fn push(&mut self, bytes: &[u8]) -> Result<Option<Request>, LslError> {
        self.0.extend(bytes.iter().take(LARGEST_BYTES + 1));
        if self.0.len() > LARGEST_BYTES {
            return Err(LslError::Headers("the request is too long"));
        }
        let Some(end) = find(&self.0, b"\n") else { return Ok(None) };
        let method = text(self.0.get(..end))?.trim();
        let rest = self.0.get(end + 1..).unwrap_or_default();
        if method == "LSL:fullinfo" {
            return Ok(Some(Request::Full));
        }
        if method == "LSL:shortinfo" {
            let Some(end) = find(rest, b"\n") else { return Ok(None) };
            return Ok(Some(Request::Short(text(rest.get(..end))?.trim().to_owned())));
        }
        if !method.starts_with("LSL:streamfeed/") {
            return Err(LslError::Headers("the request is not from an LSL inlet"));
        }
        // The end of the line may be the first half of the empty line.
        let Some(end) = find(&self.0, END) else { return Ok(None) };
        let headers = text(self.0.get(..end))?;
        FeedRequest::parse(method, headers).map(|request| Some(Request::Feed(request)))
    }
}

/// Reads the reply to a request for samples from bytes that arrive in pieces.
#[derive(Clone, Debug, Default)]
pub struct ReplyReader(Vec<u8>);

impl ReplyReader {
    /// Adds bytes; returns the reply once it is complete, with the bytes that follow it.
    pub fn push(
        &mut self,
        bytes: &[u8],
        uid: &str,
    ) -> Result<Option<(FeedReply, Vec<u8>)>, LslError> {
        self.0.extend(bytes);
        let Some(end) = find(&self.0, END) else {
            // A refusal may be a single line.
            let is_refusal = find(&self.0, b"\n").is_some() && !self.0.starts_with(b"LSL/110 200");
            if is_refusal {
                FeedReply::parse(text(Some(&self.0))?, uid)?;
            }
            let is_long = self.0.len() > LARGEST_BYTES;
            return if is_long {
                Err(LslError::Headers("the reply is too long"))
            } else {
                Ok(None)
            };
        };
        if end > LARGEST_BYTES {
            return Err(LslError::Headers("the reply is too long"));
        }
        let rest = self.0.split_off(end + END.len());
        let reply = FeedReply::parse(text(Some(&self.0))?, uid)?;
        self.0.clear();
        Ok(Some((reply, rest)))
    }
}

fn text(bytes: Option<&[u8]>) -> Result<&str, LslError> {
    let bytes = bytes.unwrap_or_default();
    std::str::from_utf8(bytes).map_err(|_not_utf8| LslError::Headers("they are not text"))
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|window| window == what)
}
