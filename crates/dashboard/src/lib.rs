#![doc = include_str!("../README.md")]

pub mod wire;
mod context;
mod sink;
mod relay;
mod convert;
mod history;
mod recent;
mod pictures;
mod cameras;
mod recording;
mod playhead;
mod replay;
mod machine;
mod network;
mod echo;
mod hub;
mod server;
mod listener;
mod tls;
mod access;
mod tokens;
mod assets;
mod client;
mod joining;
mod outbox;
mod rate;
mod acts;
mod api;
mod metrics;

pub use client::receive_any;
pub use context::{BusView, Context, Disk, FindUnmet, PORT, Settings};
pub use playhead::Playhead;
pub use replay::{Recording, Shown, show};
pub use sink::Dashboard;
pub use tls::{Tls, TlsError, TlsFile};
pub use tokens::{Tokens, TokensError};
