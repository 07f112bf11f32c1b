//! `rmw_dds_common`: the nodes of a DDS participant, and the endpoints of each node.

use bytes::Bytes;

use crate::cdr::{CdrError, Reader, Writer};

/// The id of a participant or an endpoint.
pub type Gid = [u8; 16];

/// The width of a GID on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GidWidth {
    /// 24 bytes, padded with zeros: up to Humble.
    Humble,
    /// 16 bytes: from Iron on.
    Iron,
}

/// A participant's announcement of its nodes, on `ros_discovery_info`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ParticipantEntitiesInfo {
    /// The participant.
    pub gid: Gid,
    /// The nodes of the participant.
    pub node_entities_info_seq: Vec<NodeEntitiesInfo>,
}

/// A node and its endpoints.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeEntitiesInfo {
    /// The node's namespace: `/` or `/robot1`.
    pub node_namespace: String,
    /// The node's name.
    pub node_name: String,
    /// The readers of the node.
    pub reader_gid_seq: Vec<Gid>,
    /// The writers of the node.
    pub writer_gid_seq: Vec<Gid>,
}

impl ParticipantEntitiesInfo {
    /// The full name of the message type.
    pub const NAME: &'static str = "rmw_dds_common/msg/ParticipantEntitiesInfo";

    /// Encodes the message as CDR with its four-byte header.
    pub fn encode(&self, width: GidWidth) -> Bytes {
        let mut to = Writer::new();
        width.write(&self.gid, &mut to);
        to.write(&(self.node_entities_info_seq.len() as u32));
        for node in &self.node_entities_info_seq {
            node.write(width, &mut to);
        }
        to.finish()
    }

    /// Decodes the message from CDR, and detects the width of its GIDs: the width with which the message ends exactly.
    pub fn decode(cdr: &[u8]) -> Result<(ParticipantEntitiesInfo, GidWidth), CdrError> {
        let iron = ParticipantEntitiesInfo::read(cdr, GidWidth::Iron);
        let humble = ParticipantEntitiesInfo::read(cdr, GidWidth::Humble);
        match (iron, humble) {
            (Ok((info, left)), Ok((_, left_of_humble))) if left <= left_of_humble => {
                Ok((info, GidWidth::Iron))
            }
            (_, Ok((info, _))) => Ok((info, GidWidth::Humble)),
            (iron, _) => iron.map(|(info, _)| (info, GidWidth::Iron)),
        }
    }

    /// Reads the message; also returns the number of bytes left after it.
    fn read(cdr: &[u8], width: GidWidth) -> Result<(ParticipantEntitiesInfo, usize), CdrError> {
        let mut from = Reader::new(cdr)?;
        let gid = width.read(&mut from)?;
        let count = from.count(NodeEntitiesInfo::LEAST_BYTES)?;
        let nodes = (0..count).map(|_| NodeEntitiesInfo::read(width, &mut from));
        let node_entities_info_seq = nodes.collect::<Result<_, _>>()?;
        Ok((ParticipantEntitiesInfo { gid, node_entities_info_seq }, from.left()))
    }
}

impl NodeEntitiesInfo {
    /// Two strings and two sequences, each with a length.
    const LEAST_BYTES: usize = 16;

    fn write(&self, width: GidWidth, to: &mut Writer) {
        to.text(&self.node_namespace);
        to.text(&self.node_name);
        for gids in [&self.reader_gid_seq, &self.writer_gid_seq] {
            to.write(&(gids.len() as u32));
            for gid in gids {
                width.write(gid, to);
            }
        }
    }

    fn read(width: GidWidth, from: &mut Reader<'_>) -> Result<NodeEntitiesInfo, CdrError> {
        Ok(NodeEntitiesInfo {
            node_namespace: from.read()?,
            node_name: from.read()?,
            reader_gid_seq: width.read_all(from)?,
            writer_gid_seq: width.read_all(from)?,
        })
    }
}

impl GidWidth {
    /// The width of a GID [bytes].
    pub fn bytes(self) -> usize {
        match self {
            GidWidth::Humble => 24,
            GidWidth::Iron => 16,
        }
    }

    fn write(self, gid: &Gid, to: &mut Writer) {
        to.bytes(gid);
        to.bytes(&[0; 8][..self.bytes() - gid.len()]);
    }

    fn read(self, from: &mut Reader<'_>) -> Result<Gid, CdrError> {
        let bytes = from.bytes(self.bytes())?;
        Ok(*bytes.first_chunk().expect("both widths are at least as long as an id"))
    }

    fn read_all(self, from: &mut Reader<'_>) -> Result<Vec<Gid>, CdrError> {
        let count = from.count(self.bytes())?;
        (0..count).map(|_| self.read(from)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(nodes: usize) -> ParticipantEntitiesInfo {
        let node = |k: usize| NodeEntitiesInfo {
            node_namespace: "/".into(),
            node_name: format!("node{k}"),
            reader_gid_seq: vec![[k as u8; 16]; k],
            writer_gid_seq: vec![[9; 16]; 3],
        };
        let node_entities_info_seq = (0..nodes).map(node).collect();
        ParticipantEntitiesInfo { gid: [1; 16], node_entities_info_seq }
    }

    #[test]
    fn the_width_of_the_ids_is_found_out() {
        for nodes in 0..4 {
            for width in [GidWidth::Humble, GidWidth::Iron] {
                let cdr = info(nodes).encode(width);
                assert_eq!(ParticipantEntitiesInfo::decode(&cdr), Ok((info(nodes), width)));
            }
        }
    }
}
