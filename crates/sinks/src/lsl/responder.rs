//! Replies to discovery and to clock probes.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use socket2::{Domain, Protocol, Socket, Type};
use teampulse_core::clock::monotonic;
use teampulse_devices::lsl::{
    Discovery, GROUPS, MULTICAST_PORT, ProbeReply, ProbeRequest, Query, StreamInfo,
};
use tokio::net::UdpSocket;
use tokio::time::sleep;

use crate::local_addresses::local_addresses;

/// The largest request [bytes].
const LARGEST_BYTES: usize = 8192;

/// The streams that are offered.
#[derive(Clone, Debug, Default)]
pub(super) struct Directory(Arc<Mutex<Vec<Arc<StreamInfo>>>>);

impl Directory {
    pub fn add(&self, info: &Arc<StreamInfo>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(info));
    }

    pub fn remove(&self, info: &StreamInfo) {
        let mut infos = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        infos.retain(|known| known.uid != info.uid);
    }

    fn all(&self) -> Vec<Arc<StreamInfo>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A socket that receives discovery requests, shared with other LSL programs.
pub(super) fn open() -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, MULTICAST_PORT).into())?;
    for group in GROUPS.map(Ipv4Addr::from).into_iter().filter(Ipv4Addr::is_multicast) {
        for address in local_addresses() {
            // An interface without multicast is skipped.
            socket.join_multicast_v4(&group, &address).ok();
        }
    }
    UdpSocket::from_std(socket.into())
}

/// Replies to discovery, for all streams.
pub(super) async fn respond(socket: UdpSocket, directory: Directory) {
    let mut buffer = vec![0; LARGEST_BYTES];
    loop {
        let (datagram, peer) = receive(&socket, &mut buffer).await;
        if let Some(asked) = Discovery::parse(datagram) {
            reply(&socket, &asked, peer.ip(), &directory.all()).await;
        }
    }
}

/// Replies to discovery requests sent to this stream alone, and to clock probes.
pub(super) async fn respond_services(socket: UdpSocket, info: Arc<StreamInfo>) {
    let mut buffer = vec![0; LARGEST_BYTES];
    loop {
        let (datagram, peer) = receive(&socket, &mut buffer).await;
        let received_secs = monotonic().as_secs_f64();
        if let Some(ProbeRequest { wave, sent_secs }) = ProbeRequest::parse(datagram) {
            let replied_secs = monotonic().as_secs_f64();
            let reply = ProbeReply { wave, sent_secs, received_secs, replied_secs };
            // If this fails, the peer asks again.
            socket.send_to(reply.encode().as_bytes(), peer).await.ok();
        } else if let Some(asked) = Discovery::parse(datagram) {
            reply(&socket, &asked, peer.ip(), std::slice::from_ref(&info)).await;
        }
    }
}

async fn reply(socket: &UdpSocket, asked: &Discovery, peer: IpAddr, infos: &[Arc<StreamInfo>]) {
    let Some(query) = Query::parse(&asked.query) else { return };
    for info in infos.iter().filter(|info| query.matches(info)) {
        // If this fails, the peer asks again.
        socket.send_to(asked.reply(info).as_bytes(), SocketAddr::new(peer, asked.port)).await.ok();
    }
}

async fn receive<'a>(socket: &UdpSocket, buffer: &'a mut [u8]) -> (&'a [u8], SocketAddr) {
    loop {
        match socket.recv_from(buffer).await {
            Ok((count, peer)) => return (buffer.get(..count).unwrap_or_default(), peer),
            // The error of a datagram that was sent to a closed port.
            Err(_) => sleep(Duration::from_millis(1)).await,
        }
    }
}
