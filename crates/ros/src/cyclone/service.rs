//! Services in the mapping of `rmw_cyclonedds`: two topics, and a header in each message.

use teampulse_core::qos::Qos;

use crate::graph::Gid;

/// The length of the CDR header [bytes].
const CDR_HEADER_BYTES: usize = 4;
/// The length of the request header, between the CDR header and the message [bytes].
const CALL_BYTES: usize = 16;

/// The names of a service on the wire.
pub(super) struct Service {
    pub(super) request_topic: String,
    pub(super) reply_topic: String,
}

/// The QoS of services in ROS 2.
pub(super) const QOS: Qos = Qos::reliable(10);

/// The prefix of the ids of Cyclone DDS participants, which is its RTPS vendor id.
const CYCLONE_DDS: [u8; 2] = [0x01, 0x10];

/// Whether the server with this GID uses this mapping. Other implementations place the request header elsewhere, and
/// would take ours for a part of the message.
pub(super) fn speaks_it(server: Gid) -> bool {
    server.bytes().starts_with(&CYCLONE_DDS)
}

/// The request header, which identifies a request or its reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Call {
    /// The client's id, chosen by the client.
    pub(super) client: u64,
    /// The sequence number of the request.
    pub(super) number: i64,
}

impl Service {
    /// The service through which a node provides the definitions of its types.
    pub(super) fn get_type_description(node: &str) -> Service {
        Service::named(&format!("{node}/get_type_description"))
    }

    /// The service with this name.
    pub(super) fn named(name: &str) -> Service {
        Service { request_topic: format!("rq{name}Request"), reply_topic: format!("rr{name}Reply") }
    }
}

impl Call {
    /// Prepends the request header to plain CDR.
    pub(super) fn wrap(self, cdr: &[u8]) -> Vec<u8> {
        let (header, message) = cdr.split_at(CDR_HEADER_BYTES.min(cdr.len()));
        let mut wrapped = Vec::with_capacity(cdr.len() + CALL_BYTES);
        wrapped.extend_from_slice(header);
        if is_little_endian(header) {
            wrapped.extend_from_slice(&self.client.to_le_bytes());
            wrapped.extend_from_slice(&self.number.to_le_bytes());
        } else {
            wrapped.extend_from_slice(&self.client.to_be_bytes());
            wrapped.extend_from_slice(&self.number.to_be_bytes());
        }
        wrapped.extend_from_slice(message);
        wrapped
    }

    /// Splits a message into request header and plain CDR; `None` if it is too short.
    pub(super) fn unwrap(wrapped: &[u8]) -> Option<(Call, Vec<u8>)> {
        let (header, rest) = wrapped.split_at_checked(CDR_HEADER_BYTES)?;
        let (client, rest) = rest.split_first_chunk()?;
        let (number, message) = rest.split_first_chunk()?;
        let call = if is_little_endian(header) {
            Call { client: u64::from_le_bytes(*client), number: i64::from_le_bytes(*number) }
        } else {
            Call { client: u64::from_be_bytes(*client), number: i64::from_be_bytes(*number) }
        };
        Some((call, [header, message].concat()))
    }
}

fn is_little_endian(cdr_header: &[u8]) -> bool {
    cdr_header.get(1).is_some_and(|encoding| encoding & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_call_stands_between_the_header_and_the_message() {
        let call = Call { client: 1, number: 2 };
        let wrapped = call.wrap(&[0, 1, 0, 0, 9]);
        assert_eq!(wrapped, [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 9]);
        let wrapped = call.wrap(&[0, 0, 0, 0, 9]);
        assert_eq!(wrapped, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 9]);
    }

    proptest! {
        #[test]
        fn a_call_comes_back_as_it_was(client: u64, number: i64, message: Vec<u8>, big: bool) {
            let (call, header) = (Call { client, number }, [0, u8::from(!big), 0, 0]);
            let cdr = [&header[..], &message].concat();
            prop_assert_eq!(Call::unwrap(&call.wrap(&cdr)), Some((call, cdr)));
        }

        #[test]
        fn any_bytes_are_read(bytes: Vec<u8>) {
            prop_assert_eq!(Call::unwrap(&bytes).is_some(), bytes.len() >= 20);
        }
    }
}
