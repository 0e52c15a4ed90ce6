//! Captures: files laid out by hand byte by byte, files of a writer that is not ours, and bytes that are wrong.

use drivers::capture::{Packet, Reader, Skip, Transport};
use proptest::prelude::*;
use sim_core::time::Nanos;

/// What came out of some bytes, cut into pieces of this length.
fn read(bytes: &[u8], piece: usize) -> (Vec<Packet>, Reader, Option<String>) {
    let (mut reader, mut packets, mut why) = (Reader::default(), Vec::new(), None);
    for piece in bytes.chunks(piece) {
        if let Err(damage) = reader.push(piece, &mut packets) {
            why = Some(damage.to_string());
            break;
        }
    }
    if let Err(damage) = reader.finish(&mut packets) {
        why.get_or_insert(damage.to_string());
    }
    (packets, reader, why)
}

fn fixture(name: &str) -> Vec<u8> {
    std::fs::read(fixtures::folder().join("captures").join(name)).unwrap()
}

/// 10.0.0.1:5000 sends "hi" to 10.0.0.2:6000.
const DATAGRAM: [u8; 30] = [
    0x45, 0, 0, 30, 0, 1, 0, 0, 64, 17, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2, // IPv4
    0x13, 0x88, 0x17, 0x70, 0, 10, 0, 0, b'h', b'i', // UDP
];

fn words(values: &[u32], is_big: bool) -> Vec<u8> {
    values.iter().flat_map(|value| if is_big { value.to_be_bytes() } else { value.to_le_bytes() }).collect()
}

/// A pcap of frames, all at 3 s and 5 ticks.
fn pcap(magic: u32, is_big: bool, link: u32, frames: &[&[u8]]) -> Vec<u8> {
    let mut file = words(&[magic], is_big);
    file.extend(if is_big { [0, 2, 0, 4] } else { [2, 0, 4, 0] });
    file.extend(words(&[0, 0, 65_535, link], is_big));
    for frame in frames {
        let length = frame.len() as u32;
        file.extend(words(&[3, 5, length, length], is_big));
        file.extend(*frame);
    }
    file
}

fn block(kind: u32, is_big: bool, body: &[u8]) -> Vec<u8> {
    let mut body = body.to_vec();
    body.resize(body.len().next_multiple_of(4), 0);
    let length = body.len() as u32 + 12;
    [words(&[kind, length], is_big), body, words(&[length], is_big)].concat()
}

/// A section with one interface of raw IP that ticks 2^10 times a second from 1 s on, a name that is stepped over, one packet.
fn pcapng(is_big: bool) -> Vec<u8> {
    let two = |value: u16| if is_big { value.to_be_bytes() } else { value.to_le_bytes() };
    let section = [words(&[0x1a2b_3c4d], is_big), two(1).to_vec(), two(0).to_vec(), vec![0xff; 8]].concat();
    let second = if is_big { 1_u64.to_be_bytes() } else { 1_u64.to_le_bytes() };
    let options = [&two(9)[..], &two(1), &[0x8a, 0, 0, 0], &two(14), &two(8), &second, &two(0), &two(0)].concat();
    let interface = [two(101).to_vec(), two(0).to_vec(), words(&[0], is_big), options].concat();
    let ticks = 2 * 1024 + 256;
    let packet = [words(&[0, 0, ticks, 30, 30], is_big), DATAGRAM.to_vec()].concat();
    [
        block(0x0a0d_0d0a, is_big, &section),
        block(1, is_big, &interface),
        block(4, is_big, &[7; 40]),
        block(6, is_big, &packet),
    ]
    .concat()
}

fn check_datagram(file: &[u8], at: i64) {
    for piece in [1, 7, file.len()] {
        let (packets, reader, why) = read(file, piece);
        assert_eq!(why, None);
        assert_eq!((packets.len(), reader.tally().packets, reader.tally().frames), (1, 1, 1));
        let packet = &packets[0];
        assert_eq!((packet.at, packet.transport, &packet.payload[..]), (Nanos(at), Transport::Udp, &b"hi"[..]));
        assert_eq!((packet.from.to_string(), packet.to.to_string()), ("10.0.0.1:5000".into(), "10.0.0.2:6000".into()));
    }
}

#[test]
fn four_kinds_of_pcap_and_two_of_pcapng_give_the_same_packet() {
    for is_big in [false, true] {
        check_datagram(&pcap(0xa1b2_c3d4, is_big, 101, &[&DATAGRAM]), 3_000_005_000);
        check_datagram(&pcap(0xa1b2_3c4d, is_big, 101, &[&DATAGRAM]), 3_000_000_005);
        check_datagram(&pcapng(is_big), 3_250_000_000);
    }
    // A second section in the other byte order follows on the first.
    let (packets, _, why) = read(&[pcapng(false), pcapng(true)].concat(), 11);
    assert_eq!((packets.len(), why), (2, None));
}

#[test]
fn every_link_layer_carries_the_packet() {
    let with = |head: &[u8]| [head, &DATAGRAM].concat();
    let cooked = |protocol: [u8; 2]| [&[0; 14], &protocol[..]].concat();
    let frames: [(u32, Vec<u8>); 11] = [
        (0, with(&[2, 0, 0, 0])),
        (108, with(&[0, 0, 0, 2])),
        (1, with(&[&[0xaa; 12][..], &[8, 0]].concat())),
        (1, with(&[&[0xaa; 12][..], &[0x81, 0, 0, 7, 8, 0]].concat())),
        (1, with(&[&[0xaa; 12][..], &[0x88, 0xa8, 0, 1, 0x81, 0, 0, 7, 8, 0]].concat())),
        // A frame check sequence of 4 bytes, said in the upper bits, stands behind the packet.
        (0x4400_0001, [&with(&[&[0xaa; 12][..], &[8, 0]].concat())[..], &[9; 4]].concat()),
        (12, DATAGRAM.to_vec()),
        (228, DATAGRAM.to_vec()),
        (113, with(&cooked([8, 0]))),
        (113, with(&[&cooked([0x81, 0])[..], &[0, 7, 8, 0]].concat())),
        (276, with(&[&[8, 0][..], &[0; 18]].concat())),
    ];
    for (link, frame) in frames {
        check_datagram(&pcap(0xa1b2_c3d4, false, link, &[&frame]), 3_000_005_000);
    }
}

#[test]
fn what_is_no_use_is_counted_by_name() {
    let changed = |at: usize, to: &[u8]| {
        let mut frame = DATAGRAM.to_vec();
        frame[at..at + to.len()].copy_from_slice(to);
        frame
    };
    let cases = [
        (Skip::NotIpv4, changed(0, &[0x60])),
        (Skip::Malformed, changed(0, &[0x44])),
        (Skip::Malformed, changed(2, &[0, 99])),
        (Skip::Malformed, changed(2, &[0, 12])),
        (Skip::Fragment, changed(6, &[0x20, 0])),
        (Skip::Fragment, changed(6, &[0, 3])),
        (Skip::NotUdpOrTcp, changed(9, &[1])),
        (Skip::Malformed, changed(24, &[0, 11])),
        (Skip::Malformed, changed(24, &[0, 3])),
        (Skip::Malformed, Vec::new()),
    ];
    for (why, frame) in cases {
        let (packets, reader, damage) = read(&pcap(0xa1b2_c3d4, false, 101, &[&frame, &DATAGRAM]), 9);
        assert_eq!((packets.len(), damage), (1, None), "{why:?} stops nothing");
        assert_eq!(reader.tally().skipped.get(&why), Some(&1), "{why:?}: {:?}", reader.tally());
    }
    // The wire had 30 bytes, the capture kept 25.
    let mut cut = pcap(0xa1b2_c3d4, false, 101, &[&DATAGRAM[..25]]);
    cut[24 + 12] = 30;
    let (packets, reader, _) = read(&cut, 9);
    assert_eq!((packets.len(), reader.tally().skipped.get(&Skip::Cut)), (0, Some(&1)));
    let (_, reader, _) = read(&pcap(0xa1b2_c3d4, false, 105, &[&DATAGRAM]), 9);
    assert_eq!(reader.tally().skipped.get(&Skip::LinkType), Some(&1), "105 is a wireless network");
}

#[test]
fn a_container_that_contradicts_itself_says_where() {
    let check = |file: &[u8], wanted: &str| {
        let (_, _, why) = read(file, 13);
        assert_eq!(why.unwrap(), wanted);
    };
    check(b"", "byte 0: the capture ends 0 bytes into a record");
    check(b"PK\x03\x04 and so on", "byte 0: begins with 50 4b 03 04, which is neither pcap nor pcapng");
    check(&[0x1f, 0x8b, 8, 0], "byte 0: is packed with gzip; unpack it first");
    let file = pcap(0xa1b2_c3d4, false, 101, &[&DATAGRAM, &DATAGRAM]);
    check(&file[..file.len() - 1], "byte 70: the capture ends 45 bytes into a record");
    let mut long = file.clone();
    long[24 + 8..24 + 12].copy_from_slice(&[0xff; 4]);
    check(&long, "byte 24: a frame of 4294967295 bytes, at most 262144 are possible");
    let mut late = file;
    late[24 + 4..24 + 8].copy_from_slice(&1_000_000_u32.to_le_bytes());
    check(&late, "byte 24: a time with 1000000 ticks, which is a second or more");
    let mut uneven = pcapng(false);
    *uneven.last_mut().unwrap() = 1;
    let at = uneven.len() - 64;
    check(&uneven, &format!("byte {at}: a block of 64 bytes ends with the length 16777280"));
}

#[test]
fn a_foreign_writer_is_read() {
    let reference = read(&fixture("udp.pcapng"), 1000);
    assert_eq!((reference.0.len(), reference.2), (30, None));
    for name in ["udp.pcap", "udp_ns_big.pcap"] {
        let (packets, _, why) = read(&fixture(name), 77);
        assert_eq!((packets.len(), why), (30, None), "{name}");
        for (packet, same) in packets.iter().zip(&reference.0) {
            // scapy cuts a double to whole microseconds in one format and rounds it in the other.
            assert!((packet.at.0 - same.at.0).abs() <= 1000, "{name}: {packet:?}");
            assert_eq!(packet, &Packet { at: packet.at, ..same.clone() }, "{name}");
        }
    }
    let [first, reply, sample, ..] = &reference.0[..] else { panic!("packets") };
    assert_eq!((first.at.0, reply.at.0), (1_700_000_000_000_000_000, 1_700_000_000_000_250_000));
    assert_eq!((first.from.to_string(), first.to.port()), ("192.168.1.10:54600".to_owned(), 49152));
    assert!(first.payload.starts_with(b"<Rob Type=\"KUKA\"><RIst X=\"0.0\""), "{first:?}");
    assert_eq!((reply.to, sample.payload.len(), sample.payload[3]), (first.from, 36, 1));
}

#[test]
fn a_stream_is_put_in_order() {
    let (packets, reader, why) = read(&fixture("tcp.pcap"), 31);
    assert_eq!(why, None);
    let text: Vec<u8> = packets.iter().flat_map(|packet| packet.payload.clone()).collect();
    let text = String::from_utf8(text).unwrap();
    assert_eq!((text.matches("<Rob").count(), text.matches("</Rob>").count()), (3, 3));
    assert!(text.ends_with("<IPOC>1008</IPOC></Rob>"), "{text}");
    assert_eq!(reader.tally().skipped, [(Skip::Repeated, 1)].into());
    let broken: Vec<bool> = packets.iter().map(|packet| packet.broken).collect();
    assert_eq!(broken, [true, false, false, false, false], "one stream, no hole");
    assert!(packets.windows(2).all(|pair| pair[0].at <= pair[1].at));
}

/// A segment of `payload` bytes that begins at `sequence`.
fn segment(sequence: u32, acknowledged: Option<u32>, is_back: bool, payload: &[u8]) -> Vec<u8> {
    let mut packet = DATAGRAM[..20].to_vec();
    packet[3] = 40 + payload.len() as u8;
    packet[9] = 6;
    let mut ports = [[0x13, 0x88], [0x17, 0x70]];
    if is_back {
        packet[12..20].rotate_left(4);
        ports.reverse();
    }
    packet.extend(ports.concat());
    packet.extend(sequence.to_be_bytes());
    packet.extend(acknowledged.unwrap_or(0).to_be_bytes());
    packet.extend([0x50, if acknowledged.is_some() { 0x10 } else { 0 }, 0, 0, 0, 0, 0, 0]);
    packet.extend(payload);
    packet
}

#[test]
fn a_hole_is_given_up_when_the_other_side_has_the_bytes() {
    // Bytes 3 to 5 are missing from the capture; the receiver says that it waits for byte 9.
    let frames = [
        segment(0, None, false, b"abc"),
        segment(6, None, false, b"ghi"),
        segment(0, Some(9), true, b""),
        segment(9, None, false, b"jkl"),
    ];
    let frames: Vec<&[u8]> = frames.iter().map(Vec::as_slice).collect();
    let (packets, reader, why) = read(&pcap(0xa1b2_c3d4, false, 101, &frames), 999);
    let seen: Vec<(&[u8], bool)> = packets.iter().map(|packet| (&packet.payload[..], packet.broken)).collect();
    assert_eq!((seen, why), (vec![(&b"abc"[..], true), (b"ghi", true), (b"jkl", false)], None));
    assert_eq!(reader.tally().skipped, [(Skip::Hole, 1)].into());
    // Without that word they wait, and come out at the end.
    let (packets, ..) = read(&pcap(0xa1b2_c3d4, false, 101, &[frames[0], frames[1], frames[3]]), 999);
    assert_eq!(packets.len(), 3);
}

/// The most that a reader may hold: one block and the piece that was pushed.
const HELD_MAX: usize = (512 << 10) + (64 << 10);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_bytes_make_it_panic_or_grow(
        which in 0_usize..6,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        tail in prop::collection::vec(any::<u8>(), 0..64),
        cut in any::<prop::sample::Index>(),
        piece in 1_usize..400,
    ) {
        let mut file = match which {
            0 => fixture("udp.pcap"),
            1 => fixture("udp.pcapng"),
            2 => fixture("udp_ns_big.pcap"),
            3 => fixture("tcp.pcap"),
            4 => pcapng(true),
            _ => pcap(0xa1b2_c3d4, false, 1, &[&DATAGRAM]),
        };
        for (at, to) in changes {
            let at = at.index(file.len());
            file[at] = to;
        }
        file.truncate(cut.index(file.len()) + 1);
        file.extend(tail);
        let (mut reader, mut packets) = (Reader::default(), Vec::new());
        for piece in file.chunks(piece) {
            let alive = reader.push(piece, &mut packets).is_ok();
            prop_assert!(reader.held() <= HELD_MAX);
            prop_assert!(alive || reader.held() == 0);
        }
        let _ = reader.finish(&mut packets);
        let handed: usize = packets.iter().map(|packet| packet.payload.len()).sum();
        prop_assert!(handed <= file.len(), "{handed} bytes came out of {}", file.len());
        let skipped: u64 = reader.tally().skipped.values().sum();
        prop_assert!(reader.tally().packets == packets.len() as u64);
        prop_assert!(reader.tally().frames <= reader.tally().packets + skipped + file.len() as u64);
    }
}
