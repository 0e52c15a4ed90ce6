//! Bytes of a made-up cell, and captures of them, laid out by hand.

use crate::shell::Shell;
use harness::cell::Cell;
use std::net::SocketAddrV4;
use std::path::Path;

/// The bench inside the program.
pub fn bench() -> Cell {
    Cell::find(Path::new("bench")).unwrap()
}

/// What a robot controller sends.
pub fn rob(ipoc: u64, rist: [f64; 6], rsol: [f64; 6]) -> Vec<u8> {
    let six = |tag: &str, [x, y, z, a, b, c]: [f64; 6]| {
        format!("<{tag} X=\"{x:.9}\" Y=\"{y:.9}\" Z=\"{z:.9}\" A=\"{a:.9}\" B=\"{b:.9}\" C=\"{c:.9}\"/>")
    };
    let (rist, rsol) = (six("RIst", rist), six("RSol", rsol));
    format!("<Rob Type=\"KUKA\">{rist}{rsol}<Delay D=\"0\"/><IPOC>{ipoc}</IPOC></Rob>").into_bytes()
}

/// What the PC answers.
pub fn sen(ipoc: u64, z_mm: f64, c_deg: f64) -> Vec<u8> {
    format!(
        "<Sen Type=\"ImFree\"><RKorr X=\"0.0\" Y=\"0.0\" Z=\"{z_mm:.9}\" A=\"0.0\" B=\"0.0\" C=\"{c_deg:.9}\"/>\
         <IPOC>{ipoc}</IPOC></Sen>"
    )
    .into_bytes()
}

/// A record of an ATI Net F/T with a million counts for one N and one N m.
pub fn rdt(sequence: u32, sample: u32, force_n: [f64; 3]) -> Vec<u8> {
    let counts = force_n.map(|force_n| (force_n * 1e6).round() as i32 as u32);
    let words = [sequence, sample, 0, counts[0], counts[1], counts[2], 0, 0, 0];
    words.iter().flat_map(|word| word.to_be_bytes()).collect()
}

/// A capture that grows.
#[derive(Default)]
pub struct Capture(Vec<(i64, Vec<u8>)>);

impl Capture {
    /// A datagram at this time since 1970.
    pub fn udp(&mut self, at_ns: i64, from: &str, to: &str, payload: &[u8]) {
        let (from, to): (SocketAddrV4, SocketAddrV4) = (from.parse().unwrap(), to.parse().unwrap());
        let length = payload.len() as u16;
        let mut packet = vec![0x45, 0];
        packet.extend((length + 28).to_be_bytes());
        packet.extend([0, 1, 0, 0, 64, 17, 0, 0]);
        packet.extend(from.ip().octets());
        packet.extend(to.ip().octets());
        for word in [from.port(), to.port(), length + 8, 0] {
            packet.extend(word.to_be_bytes());
        }
        packet.extend(payload);
        self.0.push((at_ns, packet));
    }

    /// A whole message on a connection, the first that the capture has of it.
    pub fn tcp(&mut self, at_ns: i64, from: &str, to: &str, payload: &[u8]) {
        self.udp(at_ns, from, to, payload);
        let (_, packet) = self.0.last_mut().unwrap();
        packet[9] = 6;
        packet.truncate(24);
        packet[2..4].copy_from_slice(&(payload.len() as u16 + 40).to_be_bytes());
        packet.extend([0, 0, 0, 1, 0, 0, 0, 1, 5 << 4, 0x18, 1, 0, 0, 0, 0, 0]);
        packet.extend(payload);
    }

    /// Each packet becomes the first piece of a longer one.
    pub fn fragment(&mut self) {
        self.0.iter_mut().for_each(|(_, packet)| packet[6] = 0x20);
    }

    /// The file: pcap with nanoseconds, raw IP.
    pub fn pcap(&mut self) -> Vec<u8> {
        self.pcap_of(usize::MAX)
    }

    /// The same with a snapshot length.
    pub fn pcap_of(&mut self, most: usize) -> Vec<u8> {
        self.0.sort_by_key(|(at_ns, _)| *at_ns);
        let word = |value: u32| value.to_le_bytes();
        let mut file = [0xa1b2_3c4d, 0x0004_0002, 0, 0, 65_535, 101].map(word).concat();
        for (at_ns, packet) in &self.0 {
            let kept = &packet[..packet.len().min(most)];
            let lengths = [kept, packet].map(|bytes| bytes.len() as u32);
            let times = [(at_ns / 1_000_000_000) as u32, (at_ns % 1_000_000_000) as u32];
            file.extend([times, lengths].concat().into_iter().flat_map(word));
            file.extend(kept);
        }
        file
    }
}

/// The bench as files in a folder, its texts changed on the way.
pub fn files(shell: &Shell, cell: impl Fn(String) -> String, rsi: impl Fn(String) -> String) {
    let bench = bench();
    let texts = [
        ("cell.toml", cell(bench.source.text)),
        ("models/bench.toml", bench.model.text),
        ("rsi/bench.xml", rsi(bench.rsi[0].text.clone())),
    ];
    for (name, text) in texts {
        let path = shell.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
}
