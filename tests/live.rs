//! A viewer that connects receives every message, paced by their times.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use raywake_core::sweep::Point;
use raywake_io::sink::bag::BagSink;
use raywake_io::sink::streams::{Content, StreamTargets};
use raywake_io::source::SweepData;
use raywake_objects::tracked::TrackedObject;
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// Stamps of the sweeps, s; the last one jumps by a year.
const STAMPS_S: [f64; 4] = [0.0, 0.1, 0.2, 3.2e7];

type Viewer = WebSocket<MaybeTlsStream<TcpStream>>;

/// Connects and subscribes to all topics. Returns their names by number.
fn viewer(address: SocketAddr) -> (Viewer, Vec<String>) {
    let mut request = format!("ws://{address}").into_client_request().unwrap();
    request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().unwrap());
    let (mut socket, _) = connect(request).unwrap();
    loop {
        let Message::Text(text) = socket.read().unwrap() else { continue };
        let said: serde_json::Value = serde_json::from_str(&text).unwrap();
        if said["op"] != "advertise" {
            continue;
        }
        let channels = said["channels"].as_array().unwrap();
        let subscribed = (0..).zip(channels).map(|(id, channel): (u32, _)| {
            assert_eq!(channel["encoding"], "cdr");
            serde_json::json!({"id": id, "channelId": channel["id"]})
        });
        let subscribed = subscribed.collect::<Vec<_>>();
        let ask = serde_json::json!({"op": "subscribe", "subscriptions": subscribed});
        socket.send(Message::text(ask.to_string())).unwrap();
        let names = channels.iter().map(|c| c["topic"].as_str().unwrap().to_owned());
        return (socket, names.collect());
    }
}

/// Topics of all messages until the server closes, and how long that took.
fn seen(address: SocketAddr) -> (Vec<String>, Duration) {
    let (mut socket, names) = viewer(address);
    let (mut topics, mut first) = (Vec::new(), None);
    while let Ok(message) = socket.read() {
        if let Message::Binary(bytes) = message {
            // An operation (1: a message), a subscription, a time, the content.
            assert_eq!(bytes[0], 1);
            let id = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
            topics.push(names[id as usize].clone());
            first.get_or_insert_with(Instant::now);
        }
    }
    (topics, first.unwrap().elapsed())
}

#[test]
fn a_viewer_sees_all_of_it() {
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let streams = StreamTargets { live: Some(free), ..StreamTargets::default() };
    let mut sink = BagSink::create(&streams, 0, Content::Objects).unwrap().unwrap();
    assert!(!sink.has_viewer());
    let taken = BagSink::create(&streams, 0, Content::Flow).err().unwrap().to_string();
    assert!(taken.contains("--live 127.0.0.1:"), "{taken}");
    let viewer = thread::spawn(move || seen(free));
    while !sink.has_viewer() {
        thread::sleep(Duration::from_millis(5));
    }
    let objects = [TrackedObject::default(), TrackedObject { id: 1, ..TrackedObject::default() }];
    for stamp_s in STAMPS_S {
        let points = vec![Point::default(); 3];
        let sweep = SweepData { stamp_s, points, ..SweepData::default() };
        sink.objects(&sweep, &[-1, 0, 1], &objects).unwrap();
    }
    sink.finish().unwrap();
    let (topics, took) = viewer.join().unwrap();
    let count = |name: &str| topics.iter().filter(|topic| *topic == name).count();
    let expected = [("tf", 4), ("raywake/objects", 8), ("raywake/tracked_objects", 4)];
    for (name, times) in expected {
        assert_eq!(count(&format!("/{name}")), times, "{name} of {topics:?}");
    }
    // As long as the stamps are apart, except for the jump.
    assert!(took >= Duration::from_millis(200), "{took:?}");
}
