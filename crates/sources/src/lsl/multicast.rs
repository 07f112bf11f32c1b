//! Multicast on this computer's network interfaces.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use socket2::{Domain, Protocol, SockRef, Socket, Type};
use teampulse_devices::lsl::{GROUPS, MULTICAST_PORT, addresses};
use thiserror::Error;
use tokio::net::UdpSocket;
use tokio::time::timeout;

/// How long a datagram from this computer to itself may take.
const PATIENCE: Duration = Duration::from_millis(500);
/// The range of multicast [hops]: within a site, as in liblsl.
const HOPS: u32 = 24;
/// The multicast group of the organisation, on which every LSL program listens.
const SITE: Ipv4Addr = Ipv4Addr::new(239, 255, 172, 215);
/// The test datagram from this computer to itself; not a request.
const TEST: &[u8] = b"LSL:test\r\n";

/// Why streams on other computers can't be found. The message fits after "failed to".
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MulticastError {
    /// Multicast can't be sent or received.
    #[error("use multicast: {0}")]
    Unavailable(String),
    /// Multicast is sent but does not come back.
    #[error(
        "receive LSL's multicast: a datagram to {SITE}:{MULTICAST_PORT} does not come back to this computer, so a firewall drops it"
    )]
    Swallowed,
}

impl MulticastError {
    /// What the user can do.
    pub fn hint(&self) -> &'static str {
        match self {
            MulticastError::Unavailable(_) => {
                "connect this computer to the network of the senders, or list their addresses as `peers`"
            }
            MulticastError::Swallowed => {
                "run `sudo ufw allow 16571:16603/udp && sudo ufw allow 16572:16603/tcp` (firewalld: \
                 `sudo firewall-cmd --add-port=16571-16603/udp --add-port=16572-16603/tcp`), or list the senders' \
                 addresses as `peers`"
            }
        }
    }
}

/// Checks that a datagram to LSL's group comes back to this computer, on at least one network interface.
pub async fn comes_back() -> Result<(), MulticastError> {
    let unavailable = |error: std::io::Error| MulticastError::Unavailable(error.to_string());
    let ours = local_addresses();
    let listener = listener(&ours).map_err(unavailable)?;
    let sender = sender().map_err(unavailable)?;
    let mut failed = None;
    let mut sent = 0;
    for address in &ours {
        match send(&sender, *address, SITE, TEST).await {
            Ok(()) => sent += 1,
            Err(error) => failed = Some(error),
        }
    }
    if sent == 0 {
        let error =
            failed.map_or("there is no network interface".to_owned(), |error| error.to_string());
        return Err(MulticastError::Unavailable(error));
    }
    let from = sender.local_addr().map_err(unavailable)?.port();
    let arrival = async {
        let mut bytes = [0; 64];
        loop {
            let received = listener.recv_from(&mut bytes).await;
            if received.is_ok_and(|(_, peer)| peer.port() == from) {
                return;
            }
        }
    };
    timeout(PATIENCE, arrival).await.map_err(|_elapsed| MulticastError::Swallowed)
}

/// Creates a socket that sends to groups and to single computers.
pub(super) fn sender() -> std::io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_broadcast(true)?;
    socket.set_multicast_ttl_v4(HOPS)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0).into())?;
    UdpSocket::from_std(socket.into())
}

/// Creates a socket that receives datagrams to LSL's groups, shared with other programs.
fn listener(ours: &[Ipv4Addr]) -> std::io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, MULTICAST_PORT).into())?;
    for address in ours {
        // An interface without multicast is skipped.
        drop(socket.join_multicast_v4(&SITE, address));
    }
    UdpSocket::from_std(socket.into())
}

/// Sends a datagram to a group through the interface with an address.
pub(super) async fn send(
    socket: &UdpSocket,
    through: Ipv4Addr,
    group: Ipv4Addr,
    datagram: &[u8],
) -> std::io::Result<()> {
    SockRef::from(socket).set_multicast_if_v4(&through)?;
    socket.send_to(datagram, (group, MULTICAST_PORT)).await.map(drop)
}

/// Returns LSL's multicast groups.
pub(super) fn groups() -> impl Iterator<Item = Ipv4Addr> {
    GROUPS.into_iter().map(Ipv4Addr::from)
}

/// Returns the addresses of this computer.
pub(super) fn local_addresses() -> Vec<Ipv4Addr> {
    addresses(&std::fs::read_to_string("/proc/net/fib_trie").unwrap_or_default())
}
