//! The picture as it grows, shown in [tev](https://github.com/Tom94/tev) by its protocol over TCP.
//!
//! A thread of its own sends, so that a tev that is slow, or goes away, holds up nothing.

use crate::output::exr::Layers;
use std::io::{Error, ErrorKind, Result};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// How long to wait for a connection, and for anything of a picture to be taken.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long the end of a render may wait for its picture to arrive.
const AT_THE_END: Duration = Duration::from_secs(3);

/// A picture at some moment.
pub struct Snapshot {
    /// What tev calls it; another of the same name takes its place.
    pub name: String,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// All that is to be seen.
    pub layers: Layers,
}

/// The connection to tev.
pub struct Watcher {
    snapshots: Sender<Snapshot>,
    /// Whether the thread waits for a picture.
    ready: Arc<AtomicBool>,
    /// Why nothing is sent any more.
    failure: Arc<Mutex<Option<String>>>,
    thread: JoinHandle<()>,
}

impl Watcher {
    /// Connects to tev at `address`, such as `localhost:14158`; whether that works is found out later.
    pub fn new(address: String) -> Self {
        let (snapshots, pictures) = channel();
        let failure = Arc::new(Mutex::new(None));
        let failed = failure.clone();
        let ready = Arc::new(AtomicBool::new(false));
        let is_ready = ready.clone();
        let thread = std::thread::spawn(move || {
            let sent = connect(&address).and_then(|client| send_all(client, &pictures, &is_ready));
            is_ready.store(false, Ordering::Release);
            if let (Err(e), Ok(mut failure)) = (sent, failed.lock()) {
                *failure = Some(format!(
                    "--watch: no tev at {address} ({e}); the render goes on without"
                ));
            }
        });
        Self {
            snapshots,
            ready,
            failure,
            thread,
        }
    }

    /// Whether the last picture has been sent, and the next would be.
    pub fn is_ready(&self) -> bool {
        self.ready.load(Ordering::Acquire)
    }

    /// Sends a picture, if [`Watcher::is_ready`].
    pub fn show(&self, snapshot: Snapshot) {
        if self.ready.swap(false, Ordering::AcqRel) {
            // A thread that has ended has said why.
            let _ = self.snapshots.send(snapshot);
        }
    }

    /// Why nothing is sent any more: said once.
    pub fn failure(&self) -> Option<String> {
        self.failure.lock().ok()?.take()
    }

    /// Waits a little until what was sent has arrived, or until that has failed.
    pub fn settle(&self) -> Option<String> {
        let start = Instant::now();
        while !self.is_ready() && !self.thread.is_finished() && start.elapsed() < AT_THE_END {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.failure()
    }
}

fn connect(address: &str) -> Result<TevClient> {
    let mut last = Error::new(ErrorKind::NotFound, "the name leads nowhere");
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(TevClient::wrap(stream));
            }
            Err(e) => last = e,
        }
    }
    Err(last)
}

/// Sends what comes, until nothing will come any more.
fn send_all(
    mut client: TevClient,
    pictures: &Receiver<Snapshot>,
    ready: &AtomicBool,
) -> Result<()> {
    let mut shown: Option<(String, (u32, u32))> = None;
    loop {
        ready.store(true, Ordering::Release);
        let Ok(Snapshot { name, size, layers }) = pictures.recv() else {
            return Ok(());
        };
        let (width, height) = size;
        let channels = layers.channels();
        let is_new = !matches!(&shown, Some(known) if *known == (name.clone(), size));
        if is_new {
            let names: Vec<&str> = channels.iter().map(|(name, _)| name.as_str()).collect();
            client.send(PacketCreateImage {
                image_name: &name,
                grab_focus: true,
                width,
                height,
                channel_names: &names,
            })?;
        }
        for (channel, values) in channels {
            client.send(PacketUpdateImage {
                image_name: &name,
                grab_focus: false,
                channel_names: &[channel],
                channel_offsets: &[0],
                channel_strides: &[1],
                x: 0,
                y: 0,
                width,
                height,
                data: values,
            })?;
        }
        shown = Some((name, size));
    }
}
