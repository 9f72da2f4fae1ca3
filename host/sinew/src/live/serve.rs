//! A watched run on a WebSocket, by the protocol of Foxglove, which PlotJuggler speaks too
//! (`foxglove.sdk.v1`, `foxglove.websocket.v1`: the same messages here).
//!
//! Clients read and steer nothing. Each has a thread and a queue of its own: who reads too slowly
//! loses ticks and is told how many, who does not read at all is cut off, and whoever talks to the
//! board never waits for any of them.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message as Frame, WebSocket};

use super::topics::{ENCODING, Message, SCHEMA_ENCODING, Topic};
use sinew_ident::error::{Error, Result};

/// Subprotocols, the preferred one first.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Header of a request and its answer.
const PROTOCOL: &str = "Sec-WebSocket-Protocol";
/// Most clients at a time.
const CLIENTS: usize = 16;
/// Ticks that wait for a client: four seconds at 1 kHz.
const QUEUE: usize = 4096;
/// Most subscriptions of a client.
const SUBSCRIPTIONS: usize = 1024;
/// Longest message of a client.
const LONGEST: usize = 1 << 16;
/// Most bytes that wait in one connection; ticks beyond wait in the queue.
const WAITING: usize = 1 << 22;
/// Longest wait for a request, and for a client that takes nothing.
const PATIENCE: Duration = Duration::from_secs(5);
/// Wait of a client's thread for the next tick, and of the listener for the next client.
const PAUSE: Duration = Duration::from_millis(5);
/// Longest time that the end of a run waits for clients to take what is queued.
const FAREWELL: Duration = Duration::from_secs(1);

/// Messages of one tick.
type Batch = Arc<Vec<Message>>;

/// A server of one run.
pub struct Server {
    /// Address of the listener.
    pub address: SocketAddr,
    shared: Arc<Shared>,
}

struct Shared {
    /// Messages that every client gets first.
    greeting: [String; 2],
    topics: usize,
    clients: Mutex<Vec<Client>>,
    ended: AtomicBool,
    /// Threads of clients.
    alive: AtomicUsize,
    served: AtomicU64,
    missed: AtomicU64,
}

struct Client {
    queue: SyncSender<Batch>,
    missed: Arc<AtomicU64>,
}

/// Clients of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Clients that connected.
    pub clients: u64,
    /// Ticks that were left out for one that read too slowly.
    pub missed: u64,
}

impl Server {
    /// Listens at an address; clients are served from now on.
    ///
    /// # Errors
    /// `Failed` where the address is taken or is none of this computer's.
    pub fn listen(address: SocketAddr, topics: &[Topic]) -> Result<Self> {
        let failed = |e: std::io::Error| {
            Error::failed(format!("cannot listen at {address}: {e}"))
                .help("--serve PORT takes another port; --serve 0 takes any that is free")
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let shared = Arc::new(Shared {
            greeting: greeting(topics),
            topics: topics.len(),
            clients: Mutex::default(),
            ended: AtomicBool::new(false),
            alive: AtomicUsize::new(0),
            served: AtomicU64::new(0),
            missed: AtomicU64::new(0),
        });
        let accepting = shared.clone();
        std::thread::spawn(move || accept(&listener, &accepting));
        Ok(Self { address, shared })
    }

    /// Hands the messages of a tick to every client; never waits for one.
    pub fn publish(&self, messages: Vec<Message>) {
        let batch = Arc::new(messages);
        self.clients().retain(|client| {
            match client.queue.try_send(batch.clone()) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => {
                    client.missed.fetch_add(1, Ordering::Relaxed);
                    self.shared.missed.fetch_add(1, Ordering::Relaxed);
                    true
                }
                // Its thread has ended.
                Err(TrySendError::Disconnected(_)) => false,
            }
        });
    }

    /// Clients so far.
    pub fn served(&self) -> Served {
        Served {
            clients: self.shared.served.load(Ordering::Relaxed),
            missed: self.shared.missed.load(Ordering::Relaxed),
        }
    }

    fn clients(&self) -> std::sync::MutexGuard<'_, Vec<Client>> {
        let clients = self.shared.clients.lock();
        clients.unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Server {
    /// Lets clients take what is queued, for a moment.
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::SeqCst);
        self.clients().clear();
        let until = Instant::now() + FAREWELL;
        while self.shared.alive.load(Ordering::SeqCst) > 0 && Instant::now() < until {
            std::thread::sleep(PAUSE);
        }
    }
}

/// Server and topics as the protocol says them.
fn greeting(topics: &[Topic]) -> [String; 2] {
    let started = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let session = started.map_or(0, |since| since.as_millis());
    let info = json!({
        "op": "serverInfo",
        "name": concat!("sinew monitor ", env!("CARGO_PKG_VERSION")),
        "capabilities": [],
        "supportedEncodings": [],
        "metadata": {},
        "sessionId": session.to_string(),
    });
    let channels: Vec<Value> = (topics.iter().enumerate())
        .map(|(id, topic)| {
            json!({
                "id": id,
                "topic": topic.name,
                "encoding": ENCODING,
                "schemaName": topic.kind.schema_name(),
                "schema": topic.kind.schema(),
                "schemaEncoding": SCHEMA_ENCODING,
            })
        })
        .collect();
    let advertise = json!({ "op": "advertise", "channels": channels });
    [info.to_string(), advertise.to_string()]
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    while !shared.ended.load(Ordering::SeqCst) {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(PAUSE);
            continue;
        };
        if shared.alive.load(Ordering::SeqCst) >= CLIENTS {
            // Closed: a client tries again later.
            continue;
        }
        shared.alive.fetch_add(1, Ordering::SeqCst);
        let counted = Counted(shared.clone());
        std::thread::spawn(move || serve(stream, &counted.0));
    }
}

/// One of the threads that are alive, for as long as it is kept.
struct Counted(Arc<Shared>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.alive.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Chooses a subprotocol, or refuses.
#[expect(
    clippy::result_large_err,
    reason = "the type of tungstenite's callbacks"
)]
fn choose(
    request: &Request,
    mut response: Response,
) -> std::result::Result<Response, ErrorResponse> {
    let offered = request.headers().get_all(PROTOCOL).iter();
    let offered: Vec<&str> = offered
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(',').map(str::trim))
        .collect();
    let Some(chosen) = PROTOCOLS.iter().find(|name| offered.contains(name)) else {
        let mut refused = ErrorResponse::new(Some(format!(
            "this server speaks {}\n",
            PROTOCOLS.join(" and ")
        )));
        *refused.status_mut() = StatusCode::BAD_REQUEST;
        return Err(refused);
    };
    (response.headers_mut()).insert(PROTOCOL, HeaderValue::from_static(chosen));
    Ok(response)
}

/// Serves one client until it is gone or the run is over.
fn serve(stream: TcpStream, shared: &Shared) {
    let Some(mut client) = Connection::open(stream) else {
        return;
    };
    for text in &shared.greeting {
        client.say(Frame::text(text.clone()));
    }
    let (sender, queue) = sync_channel(QUEUE);
    let missed = Arc::new(AtomicU64::new(0));
    let own = Client {
        queue: sender,
        missed: missed.clone(),
    };
    {
        let clients = shared.clients.lock();
        let mut clients = clients.unwrap_or_else(PoisonError::into_inner);
        if shared.ended.load(Ordering::SeqCst) {
            return;
        }
        clients.push(own);
    }
    shared.served.fetch_add(1, Ordering::Relaxed);
    client.run(&queue, &missed, shared.topics);
}

/// A client's end of the line.
struct Connection {
    socket: WebSocket<TcpStream>,
    /// Subscriptions of each topic.
    subscriptions: BTreeMap<usize, Vec<u32>>,
    /// Something waits to be taken, since then.
    waiting: Option<Instant>,
    gone: bool,
}

impl Connection {
    /// None where the client asks for something else, or for nothing in time.
    fn open(stream: TcpStream) -> Option<Self> {
        // A listener that does not block hands that on, on some systems.
        stream.set_nonblocking(false).ok()?;
        stream.set_read_timeout(Some(PATIENCE)).ok()?;
        stream.set_write_timeout(Some(PATIENCE)).ok()?;
        stream.set_nodelay(true).ok()?;
        let config = WebSocketConfig::default()
            .max_message_size(Some(LONGEST))
            .max_frame_size(Some(LONGEST))
            .write_buffer_size(1 << 14)
            .max_write_buffer_size(WAITING);
        let socket = tungstenite::accept_hdr_with_config(stream, choose, Some(config)).ok()?;
        socket.get_ref().set_nonblocking(true).ok()?;
        Some(Self {
            socket,
            subscriptions: BTreeMap::new(),
            waiting: None,
            gone: false,
        })
    }

    fn run(&mut self, queue: &Receiver<Batch>, missed: &AtomicU64, topics: usize) {
        let mut over = false;
        while !self.gone {
            self.hear(topics);
            self.flush();
            if self.waiting.is_some() {
                // What comes meanwhile waits in the queue.
                std::thread::sleep(PAUSE);
                continue;
            }
            let lost = missed.swap(0, Ordering::Relaxed);
            if lost > 0 {
                self.warn(&format!(
                    "{lost} ticks were left out: this client reads too slowly"
                ));
            }
            if over {
                return self.close();
            }
            match queue.recv_timeout(PAUSE) {
                Ok(batch) => {
                    self.batch(&batch);
                    // As many as are there, for one write.
                    while self.waiting.is_none()
                        && let Ok(batch) = queue.try_recv()
                    {
                        self.batch(&batch);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => over = true,
            }
        }
    }

    fn batch(&mut self, batch: &[Message]) {
        for message in batch {
            let ids = self.subscriptions.get(&message.topic);
            for id in ids.cloned().unwrap_or_default() {
                let mut bytes = Vec::with_capacity(13 + message.data.len());
                bytes.push(1);
                bytes.extend(id.to_le_bytes());
                bytes.extend(message.at_ns.to_le_bytes());
                bytes.extend(&message.data);
                self.say(Frame::binary(bytes));
            }
        }
    }

    /// Everything that the client has said.
    fn hear(&mut self, topics: usize) {
        while !self.gone {
            match self.socket.read() {
                Ok(Frame::Text(text)) => self.told(&text, topics),
                // Messages of clients' own topics: this server has no such capability.
                Ok(Frame::Binary(_)) => self.warn("this server takes no messages"),
                // Pings are answered by the library.
                Ok(_) => {}
                Err(error) => {
                    self.gone |= !is_blocked(&error);
                    return;
                }
            }
        }
    }

    fn told(&mut self, text: &str, topics: usize) {
        let Ok(said) = serde_json::from_str::<Value>(text) else {
            return self.warn("a message that is no JSON");
        };
        let list = |key: &str| said[key].as_array().cloned().unwrap_or_default();
        let number = |value: &Value| value.as_u64().and_then(|id| u32::try_from(id).ok());
        match said["op"].as_str() {
            Some("subscribe") => {
                for one in list("subscriptions") {
                    let topic = number(&one["channelId"]).map(|topic| topic as usize);
                    let (Some(id), Some(topic)) = (number(&one["id"]), topic) else {
                        self.warn("a subscription without id or channelId");
                        continue;
                    };
                    let count: usize = self.subscriptions.values().map(Vec::len).sum();
                    if topic >= topics {
                        self.warn(&format!("there is no channel {topic}"));
                    } else if self.subscriptions.values().any(|ids| ids.contains(&id)) {
                        self.warn(&format!("subscription {id} is there already"));
                    } else if count >= SUBSCRIPTIONS {
                        self.warn("too many subscriptions");
                    } else {
                        self.subscriptions.entry(topic).or_default().push(id);
                    }
                }
            }
            Some("unsubscribe") => {
                let ids: Vec<u32> = list("subscriptionIds").iter().filter_map(number).collect();
                for subscribed in self.subscriptions.values_mut() {
                    subscribed.retain(|id| !ids.contains(id));
                }
            }
            // What a client says of itself, and questions about capabilities that are not there.
            Some(_) => {}
            None => self.warn("a message without `op`"),
        }
    }

    fn warn(&mut self, text: &str) {
        let status = json!({ "op": "status", "level": 1, "message": text });
        self.say(Frame::text(status.to_string()));
    }

    fn say(&mut self, frame: Frame) {
        if !self.gone {
            let written = self.socket.write(frame);
            self.written(written);
        }
    }

    fn flush(&mut self) {
        if !self.gone {
            let written = self.socket.flush();
            if written.is_ok() {
                self.waiting = None;
            }
            self.written(written);
        }
    }

    /// A frame that does not go out waits, for a while; any other failure is the end.
    fn written(&mut self, written: tungstenite::Result<()>) {
        if let Err(error) = written {
            let since = *self.waiting.get_or_insert_with(Instant::now);
            self.gone |= !is_blocked(&error) || since.elapsed() > PATIENCE;
        }
    }

    fn close(&mut self) {
        // The client may be gone already; nothing is lost with a farewell.
        let _ = self.socket.close(None);
        let until = Instant::now() + FAREWELL / 2;
        while Instant::now() < until {
            match self.socket.read() {
                Err(error) if is_blocked(&error) => std::thread::sleep(PAUSE),
                Err(_) => return,
                Ok(_) => {}
            }
        }
    }
}

/// Nothing to read yet, or no room to write.
fn is_blocked(error: &tungstenite::Error) -> bool {
    matches!(error, tungstenite::Error::Io(error) if error.kind() == ErrorKind::WouldBlock)
}
