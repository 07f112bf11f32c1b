//! Notifications that arrive through a socket of their own. `BlueZ` and the D-Bus daemon encode, route and decode
//! each signal; on a socket a notification is one read.

use std::os::fd::OwnedFd;
use std::os::unix::net;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::net::UnixDatagram;
use tokio::sync::mpsc::WeakSender;
use tokio::task::AbortHandle;

use teampulse_devices::gatt::Uuid;

use super::bus::Value;

/// The largest notification: the value of an attribute (Core specification, vol. 3, part F, 3.2.9).
const MOST_BYTES: usize = 512;

/// A socket on which `BlueZ` sends the notifications of a characteristic. Closed when dropped, which ends them.
#[derive(Debug)]
pub(super) struct Acquired {
    task: AbortHandle,
}

/// The receiver of a device's notifications, as long as its link is up.
#[derive(Clone, Debug)]
pub(super) struct Receiver {
    /// Where they wait.
    pub values: WeakSender<Value>,
    /// How many found no place there.
    pub lost: Arc<AtomicU64>,
}

impl Drop for Acquired {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Acquired {
    /// Forwards what arrives on a socket until `BlueZ` closes it, or the link is lost.
    pub fn forward(socket: OwnedFd, characteristic: Uuid, to: Receiver) -> std::io::Result<Self> {
        // A socket of packets: it is read like one of datagrams.
        let socket = net::UnixDatagram::from(socket);
        socket.set_nonblocking(true)?;
        let socket = UnixDatagram::from_std(socket)?;
        let task = tokio::spawn(async move {
            let mut packet = [0; MOST_BYTES];
            while let Ok(length @ 1..) = socket.recv(&mut packet).await {
                let Some(values) = to.values.upgrade() else { return };
                if values.try_send((characteristic, packet[..length].to_vec())).is_err() {
                    to.lost.fetch_add(1, Ordering::Relaxed);
                }
            }
        });
        Ok(Acquired { task: task.abort_handle() })
    }
}
