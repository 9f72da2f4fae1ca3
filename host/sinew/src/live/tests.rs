//! A board at 1 kHz on this computer, watched by viewers of every kind at once.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sinew_ident::diagnose::Stop;
use sinew_ident::recording::Recording;
use sinew_ident::recording::foreign;
use sinew_sim::Rig;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message as Frame, WebSocket};

use super::Names;
use super::monitor::{Outputs, Watched, monitor};
use super::serve::{Served, Server};
use super::topics::{Kind, Message, Topic, Topics};
use crate::commission::setup::Setup;
use crate::commission::simulated::start_paced;
use crate::commission::tests::RIG;

/// A viewer's connection, greeted, with the channels that it was told.
struct Viewer {
    socket: WebSocket<TcpStream>,
    channels: Vec<Value>,
}

impl Viewer {
    fn open(address: SocketAddr, protocols: &str) -> Self {
        let mut request = format!("ws://{address}").into_client_request().unwrap();
        let offered = protocols.parse().unwrap();
        request
            .headers_mut()
            .insert("Sec-WebSocket-Protocol", offered);
        let stream = TcpStream::connect(address).unwrap();
        let (socket, answer) = tungstenite::client(request, stream).unwrap();
        let chosen = &answer.headers()["Sec-WebSocket-Protocol"];
        assert!(protocols.contains(chosen.to_str().unwrap()));
        let channels = Vec::new();
        let mut viewer = Self { socket, channels };
        let info = viewer.text();
        assert_eq!(info["op"], "serverInfo", "{info}");
        let advertised = viewer.text();
        assert_eq!(advertised["op"], "advertise", "{advertised}");
        viewer.channels = advertised["channels"].as_array().unwrap().clone();
        viewer
    }

    /// Subscribes to every channel, each by the channel's number and 100.
    fn subscribe(&mut self) {
        let ids = self.channels.iter().map(|channel| &channel["id"]);
        let all: Vec<Value> = ids
            .map(|id| json!({ "id": 100 + id.as_u64().unwrap(), "channelId": id }))
            .collect();
        self.say(&json!({ "op": "subscribe", "subscriptions": all }).to_string());
    }

    fn say(&mut self, text: &str) {
        self.socket.send(Frame::text(text)).unwrap();
    }

    /// The next text; data before it is passed over.
    fn text(&mut self) -> Value {
        loop {
            if let Frame::Text(text) = self.socket.read().unwrap() {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    /// Data until the server closes: topic, time and CDR.
    fn data(mut self) -> Vec<(String, u64, Vec<u8>)> {
        let mut all = Vec::new();
        while let Ok(frame) = self.socket.read() {
            let Frame::Binary(bytes) = frame else {
                continue;
            };
            assert_eq!(bytes[0], 1, "message data");
            let id = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
            let at_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
            let channel = &self.channels[id as usize - 100];
            let topic = channel["topic"].as_str().unwrap().to_owned();
            all.push((topic, at_ns, bytes[13..].to_vec()));
        }
        all
    }
}

/// Floats in front of a message.
fn floats(data: &[u8], count: usize) -> Vec<f64> {
    let numbers = data[4..].chunks_exact(8).take(count);
    numbers
        .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
        .collect()
}

/// The tick behind the floats.
fn tick(data: &[u8], floats: usize) -> u32 {
    let at = 4 + 8 * floats;
    u32::from_le_bytes(data[at..at + 4].try_into().unwrap())
}

/// Every tick between the first and the last, once: how many.
fn whole(data: &[(String, u64, Vec<u8>)], topic: &str, floats: usize) -> usize {
    let of = data.iter().filter(|(name, _, _)| name == topic);
    let seen: Vec<(u32, u64)> = of
        .map(|(_, at_ns, data)| (tick(data, floats), *at_ns))
        .collect();
    for pair in seen.windows(2) {
        assert_eq!(pair[1].0, pair[0].0 + 1, "{topic} has a gap");
        assert_eq!(pair[1].1 - pair[0].1, 1_000_000, "{topic}: 1 ms apart");
    }
    seen.len()
}

const SECONDS: f64 = 4.0;

#[test]
fn viewers_get_every_tick_at_1_khz_whatever_others_do() {
    let text = RIG.replace("rate_hz = 100.0", "rate_hz = 1000.0");
    let rig = Rig::parse(&text, "rig.toml").unwrap();
    let setup = Setup::new(rig, &[]).unwrap();
    let spec = setup.bare_model().unwrap();
    assert_eq!(spec.period_s, 1e-3);
    let lost = Arc::new(AtomicBool::new(false));
    let broken = lost.clone();
    let sensors = move |y: &mut [f32; 2]| {
        if broken.load(Ordering::Relaxed) {
            *y = [f32::NAN; 2];
        }
    };
    let period = Duration::from_millis(1);
    let (mut device, _) = start_paced(&spec, &setup.plant, sensors, period);
    let names = Names::of(&spec);
    let identity = names.greet(&mut device).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let any = "127.0.0.1:0".parse().unwrap();
    let server = Server::listen(any, &Topics::new(&names).all).unwrap();
    let address = server.address;
    let (orders, typed) = channel();

    let mut first = Viewer::open(address, "foxglove.websocket.v1");
    let topics: Vec<&Value> = first.channels.iter().map(|it| &it["topic"]).collect();
    let wanted = [
        "/outputs/q1_rad",
        "/outputs/q2_rad",
        "/inputs/u1_V",
        "/inputs/u2_V",
        "/state",
        "/log",
    ];
    assert_eq!(topics, wanted);
    assert!(first.channels.iter().all(|it| it["encoding"] == "cdr"));
    first.subscribe();
    // Until that was heard.
    first.say("{");
    first.text();
    let first = std::thread::spawn(move || first.data());
    let others = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(500));
        // One that takes nothing, one that is no viewer at all, one that goes away.
        let mut silent = Viewer::open(address, "foxglove.sdk.v1");
        silent.subscribe();
        let mut noise = TcpStream::connect(address).unwrap();
        noise.write_all(&[0xff; 3000]).unwrap();
        let mut gone = Viewer::open(address, "x, foxglove.sdk.v1,foxglove.websocket.v1");
        gone.subscribe();
        drop(gone);
        let mut late = Viewer::open(address, "foxglove.sdk.v1");
        for wrong in [
            "{",
            "[]",
            "{\"op\":7}",
            "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":99}]}",
            "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":-1,\"channelId\":0}]}",
        ] {
            late.say(wrong);
            let status = late.text();
            assert_eq!(
                (&status["op"], &status["level"]),
                (&"status".into(), &1.into())
            );
        }
        late.say("{\"op\":\"unsubscribe\",\"subscriptionIds\":[5]}");
        late.say("{\"op\":\"getParameters\"}");
        late.subscribe();
        let data = late.data();
        drop(silent);
        data
    });
    let ordering = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(1000));
        for order in ["arm", "r 0.05 0.02", "limit -1.5 1.5 0.04 -1.5 1.5 0.04"] {
            orders.send(order.to_owned()).unwrap();
            std::thread::sleep(Duration::from_millis(300));
        }
        lost.store(true, Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(500));
        lost.store(false, Ordering::Relaxed);
        orders
    });
    let outputs = Outputs {
        file: Some(path.clone()),
        server: Some(&server),
        screen: None,
    };
    let stop = Stop::default();
    let watched = monitor(
        &mut device,
        &names,
        &identity,
        outputs,
        &typed,
        Some(SECONDS),
        &stop,
    );
    let watched = watched.unwrap();
    drop(ordering.join().unwrap());
    let served = server.served();
    drop(server);
    let first = first.join().unwrap();
    let late = others.join().unwrap();

    assert_eq!(
        (watched.lost, served.missed),
        (0, 0),
        "{:?}",
        watched.events
    );
    assert_eq!(served.clients, 4);
    // A computer that does other work at once is late; nothing may be lost for that.
    assert!(watched.ticks > 400 * SECONDS as u64, "{}", watched.ticks);
    let output = whole(&first, "/outputs/q2_rad", 6);
    let input = whole(&first, "/inputs/u1_V", 3);
    let state = whole(&first, "/state", 1);
    assert_eq!((output, input), (state, state));
    // The first one was there before the run.
    assert_eq!(state as u64, watched.ticks);
    let later = whole(&late, "/state", 1);
    assert!(later > 500 && later < state, "{later} of {state}");

    let of = |topic: &str| {
        let topic = topic.to_owned();
        first.iter().filter(move |(name, _, _)| *name == topic)
    };
    // Reference, measured, estimate, disturbance, lower, upper.
    let followed = of("/outputs/q1_rad").map(|(_, _, data)| floats(data, 6));
    let followed: Vec<Vec<f64>> = followed.collect();
    assert!(followed.iter().any(|row| (row[0] - 0.05).abs() < 1e-6));
    assert!(
        followed
            .iter()
            .any(|row| row[1].is_nan() && row[2].is_finite())
    );
    assert!(
        followed
            .iter()
            .all(|row| row[4] < row[1] || row[1].is_nan())
    );
    let limits = of("/inputs/u1_V").map(|(_, _, data)| floats(data, 3)[2]);
    let mut limits: Vec<f64> = limits.collect();
    limits.dedup();
    assert_eq!(limits, [2.0, 1.5]);
    let log: String = of("/log")
        .map(|(_, _, data)| String::from_utf8_lossy(data).into_owned())
        .collect();
    for event in ["armed (Rig): Asked", "disarmed: SamplesLost"] {
        assert!(log.contains(event), "{event}: {log}");
    }
    the_file_has_the_same(&path, &watched, &followed);
}

/// The file holds every tick, and is a recording for `sinew convert`.
fn the_file_has_the_same(path: &std::path::Path, watched: &Watched, followed: &[Vec<f64>]) {
    let contents = foreign::contents(path).unwrap();
    let wanted = sinew_convert::Wanted {
        columns: vec![
            ("u1_V".into(), "/inputs/u1_V/command".into()),
            ("q1_rad".into(), "/outputs/q1_rad/measured".into()),
        ],
        base: None,
        join: sinew_convert::Join::Last,
    };
    let recording = foreign::recording(&contents, &wanted, path).unwrap();
    assert_eq!(recording.len() as u64, watched.ticks);
    let measured = recording.column("q1_rad").unwrap();
    for (found, row) in measured.iter().zip(followed) {
        assert!(found.to_bits() == row[1].to_bits() || found.is_nan() && row[1].is_nan());
    }
    assert!((recording.t()[1] - 1e-3).abs() < 1e-12, "the board's clock");
    // Without a choice the signals have their own names.
    let all = Recording::read(path);
    let names = all.map(|it| {
        it.columns()
            .iter()
            .map(|c| c.name.clone())
            .collect::<Vec<_>>()
    });
    let names = names.unwrap_or_else(|error| panic!("{error}"));
    for name in [
        "u1_V",
        "q1_rad",
        "reference_q1_rad",
        "upper_u1_V",
        "status_state",
    ] {
        assert!(names.iter().any(|it| it == name), "{name}: {names:?}");
    }
    // A summary, for viewers that seek: footer and its place.
    let bytes = std::fs::read(path).unwrap();
    let footer = bytes.len() - 8 - 20;
    assert_eq!(bytes[footer - 9], 2);
    let summary = u64::from_le_bytes(bytes[footer..footer + 8].try_into().unwrap());
    assert_eq!(
        bytes[summary as usize], 3,
        "the summary begins with a schema"
    );
}

#[test]
fn a_client_of_another_protocol_is_refused_in_words() {
    let server = Server::listen("127.0.0.1:0".parse().unwrap(), &[]).unwrap();
    let mut stream = TcpStream::connect(server.address).unwrap();
    let request = "GET / HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n";
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
    assert!(answer.contains("foxglove.sdk.v1"), "{answer}");
    let taken = Server::listen(server.address, &[])
        .err()
        .map(|e| e.to_string());
    assert!(taken.is_some_and(|text| text.contains("cannot listen")));
}

#[test]
fn publishing_never_waits_for_a_client_that_takes_nothing() {
    let topic = Topic {
        name: "/state".into(),
        kind: Kind::State,
    };
    let server = Server::listen("127.0.0.1:0".parse().unwrap(), &[topic]).unwrap();
    let mut viewer = Viewer::open(server.address, "foxglove.sdk.v1");
    viewer.subscribe();
    // Until it is served.
    viewer.say("{");
    viewer.text();
    let message = |k: u64| Message {
        topic: 0,
        at_ns: k,
        data: vec![0; 2000],
    };
    let longest = Mutex::new(Duration::ZERO);
    for k in 0..20_000 {
        let began = Instant::now();
        server.publish(vec![message(k)]);
        let mut longest = longest.lock().unwrap();
        *longest = longest.max(began.elapsed());
    }
    let longest = longest.into_inner().unwrap();
    assert!(longest < Duration::from_millis(200), "{longest:?}");
    let Served { missed, clients } = server.served();
    assert!(missed > 5_000 && clients == 1, "{missed}");
    // It is told, once it reads again.
    let status = viewer.text();
    let told = status["message"].as_str().unwrap();
    assert!(told.ends_with("reads too slowly"), "{told}");
    let began = Instant::now();
    drop(server);
    assert!(began.elapsed() < Duration::from_secs(3));
}
