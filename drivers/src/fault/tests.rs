//! Faults from a file, through a stream, as text: `number:packet`.

use super::*;
use sim_core::rng::Streams;
use sim_core::time::Nanos;

const PERIOD: Nanos = Nanos(4_000_000);
const FRAME: &str = concat!(
    r#"<Rob Type="KUKA"><RIst X="93.9531" Y="-1.5000"/><EIPos E1="0.0000"/>"#,
    "<Delay D=\"0\"/><IPOC>0042</IPOC></Rob>"
);

#[derive(serde::Deserialize, serde::Serialize)]
struct File {
    fault: Vec<WireFault>,
}

/// The faults of a file that is sound.
pub(super) fn sound(text: &str) -> Vec<WireFault> {
    faults(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn faults(text: &str) -> Result<Vec<WireFault>, String> {
    toml::from_str::<File>(text).map(|file| file.fault).map_err(|error| error.to_string())
}

/// The stream `on` with this fault on it.
fn faulty(on: &str, fault: &str) -> Faulty {
    let list = sound(&format!("[[fault]]\non = \"{on}\"\n{fault}"));
    Faulty::new(list[0].on, Robot::None, &list, PERIOD, &Streams::new(7))
}

/// Packets `p0` to `p9` in, one with each number; what comes out by number 14.
fn order(fault: &str) -> String {
    let (mut link, mut out) = (faulty("rsi-frame", fault), Vec::new());
    for number in 0..15_u64 {
        let packet = format!("p{number}");
        link.pass(number, (number < 10).then_some(packet.as_bytes()), &mut out);
    }
    assert_eq!((link.holds(), link.never_acted().count()), (0, 0), "{fault}");
    let told = out.iter().map(|out| {
        let late = if out.within == Nanos(0) { String::new() } else { format!("+{}us", out.within.0 / 1000) };
        format!("{}{late}:{}", out.number, String::from_utf8_lossy(&out.bytes))
    });
    told.filter(|told| told.split(':').next() != told.split(":p").nth(1)).collect::<Vec<_>>().join(" ")
}

/// What does not pass at once and unchanged; the rest is left out.
#[test]
fn order_changes_as_each_fault_says() {
    let table = [
        ("id = \"duplicate\"\nat = 3\ncopies = 2", ""),
        ("id = \"swap\"\nat = 3\nnext = 2", "5:p3"),
        ("id = \"hold\"\nat = 3\ncycles = 4", "7:p3"),
        ("id = \"delay\"\nat = 3\ncycles = 2", "5:p3 5:p4"),
        ("id = \"delay\"\nat = 3\ncycles = 2\nfor = 3", "5:p3 6:p4 7:p5 7:p6"),
        (
            "id = \"jitter\"\nat = 3\nfor = 3\ndelays_us = [1500, 0, 9000]",
            "3+1500us:p3 7+1000us:p5 7+1000us:p6 7+1000us:p7",
        ),
        ("id = \"silence-then-burst\"\nat = 3\nfor = 3", "6:p3 6:p4 6:p5"),
        ("id = \"two-documents\"\nat = 3", "4:p3p4"),
        ("id = \"drop\"\nat = 3", ""),
    ];
    for (fault, expected) in table {
        assert_eq!(order(fault), expected, "{fault}");
    }
}

/// A controller takes an answer whenever it comes within its cycle.
#[test]
fn an_answer_that_is_late_within_its_cycle_is_not() {
    let acted = |on: &str, delay_us: u32| {
        let mut link = faulty(on, &format!("id = \"jitter\"\nat = 3\nfor = 3\ndelays_us = [{delay_us}]"));
        (0..10).for_each(|number| link.pass(number, Some(b"p"), &mut Vec::new()));
        link.faults().map(|(_, schedule)| (schedule.acted(), schedule.first())).collect::<Vec<_>>()
    };
    assert_eq!(acted("rsi-reply", 3999), [(0, None)]);
    assert_eq!(acted("rsi-reply", 4000), [(3, Some(3))]);
    assert_eq!(acted("rsi-frame", 3999), [(3, Some(3))]);
}

/// How many of 10 arrive, each one or more times.
#[test]
fn for_every_and_chance_say_how_often() {
    let arrive = |fault: &str| {
        let (mut link, mut out) = (faulty("rsi-reply", fault), Vec::new());
        (0..10).for_each(|number| link.pass(number, Some(b"p"), &mut out));
        (out.len(), link.faults().map(|(_, schedule)| schedule.acted()).sum::<u64>())
    };
    assert_eq!(arrive("id = \"drop\"\nat = 3"), (9, 1));
    assert_eq!(arrive("id = \"drop\"\nat = 3\nfor = 3\nevery = 3"), (7, 3));
    assert_eq!(arrive("id = \"drop\"\nat = 3\nfor = 100"), (3, 7));
    assert_eq!(arrive("id = \"duplicate\"\nat = 3\ncopies = 5"), (15, 1));
    let (left, acted) = arrive("id = \"drop\"\nat = 0\nfor = 10\nchance = 0.5");
    assert_eq!(left as u64 + acted, 10);
    assert!((1..10).contains(&acted), "the draw is neither never nor always: {acted}");
    assert_eq!(arrive("id = \"drop\"\nat = 0\nfor = 10\nchance = 0.5"), (left, acted), "the same seed, the same draws");
}

#[test]
fn a_fault_that_waits_for_an_event_starts_with_the_next_packet() {
    let mut link = faulty("rsi-reply", "id = \"drop\"\nat = \"first-contact\"\nfor = 2");
    let mut out = Vec::new();
    for number in 0..10 {
        if number == 4 {
            link.event(Event::FirstContact);
        }
        link.pass(number, Some(b"p"), &mut out);
    }
    assert_eq!(out.iter().map(|out| out.number).collect::<Vec<_>>(), [0, 1, 2, 3, 6, 7, 8, 9]);
    let mut idle = faulty("rsi-reply", "id = \"drop\"\nat = \"first-contact\"");
    (0..10).for_each(|number| idle.pass(number, Some(b"p"), &mut Vec::new()));
    let never: Vec<String> = idle.never_acted().map(WireFault::to_string).collect();
    assert_eq!(never, ["drop on rsi-reply at first contact"]);
}

fn changed(fault: &str) -> String {
    let (mut link, mut out) = (faulty("rsi-frame", &format!("at = 1\n{fault}")), Vec::new());
    link.pass(0, Some(FRAME.replace("0042", "0038").as_bytes()), &mut Vec::new());
    link.pass(1, Some(FRAME.as_bytes()), &mut out);
    assert_eq!(link.never_acted().count(), 0, "{fault}");
    let told: Vec<String> = out.iter().map(|out| String::from_utf8_lossy(&out.bytes).replace('\0', "~")).collect();
    told.join("|")
}

#[test]
fn a_document_changes_in_one_place() {
    let table = [
        ("id = \"truncate\"\nbytes = 9", "<Rob Type", FRAME),
        ("id = \"flip-bit\"\nbit = 8", "<Sob", "<Rob"),
        ("id = \"ipoc-step\"\nstep = 4", "0046", "0042"),
        ("id = \"ipoc-zero\"", "<IPOC>0000<", "<IPOC>0042<"),
        ("id = \"ipoc-previous\"", "0038", "0042"),
        ("id = \"wrong-type\"\ntext = \"kuka\"", "kuka", "KUKA"),
        ("id = \"type-spelling\"", "TYPE=", "Type="),
        ("id = \"attribute-extra\"", "<RIst Extra=\"1.0000\" X=", "<RIst X="),
        ("id = \"attribute-absent\"", "\"93.9531\"/>", "\"93.9531\" Y=\"-1.5000\"/>"),
        ("id = \"attribute-absent\"\nelement = \"EIPos\"", "<EIPos/>", "<EIPos E1=\"0.0000\"/>"),
        ("id = \"decimal-comma\"", "93,9531", "93.9531"),
        ("id = \"nan\"\nelement = \"EIPos\"", "E1=\"NaN\"", "E1=\"0.0000\""),
        ("id = \"exponent\"", "9.39531e1", "93.9531"),
    ];
    for (fault, new, old) in table {
        assert_eq!(changed(fault), FRAME.replace(old, new), "{fault}");
    }
    let moved = FRAME.replace("<IPOC>0042</IPOC>", "").replace("<EIPos", "<IPOC>0042</IPOC><EIPos");
    assert_eq!(changed("id = \"ipoc-middle\""), moved);
    let padded = changed("id = \"nul-padding\"");
    assert_eq!((padded.len(), padded.trim_end_matches('~')), (2048, FRAME));
    let other = changed("id = \"flip-bit\"");
    assert_eq!(
        (other == FRAME, other == changed("id = \"flip-bit\"")),
        (false, true),
        "a random bit, the same each time"
    );
}

/// rdt_sequence, ft_sequence and Fx of what arrives, from records with both counts rising from 10.
fn records(fault: &str) -> String {
    let (mut link, mut out) = (faulty("ft", fault), Vec::new());
    for number in 0..6_u32 {
        let mut bytes: Vec<u8> = [10 + number, 10 + number, 0].iter().flat_map(|word| word.to_be_bytes()).collect();
        bytes.extend([number as i32; 6].iter().flat_map(|count| count.to_be_bytes()));
        link.pass(u64::from(number), Some(&bytes), &mut out);
    }
    assert_eq!(link.never_acted().count(), 0, "{fault}");
    let word = |bytes: &[u8], at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let told = out.iter().map(|out| match out.bytes.len() {
        36 => format!("{}/{}/{}", word(&out.bytes, 0), word(&out.bytes, 4), word(&out.bytes, 12)),
        length => format!("{length} B"),
    });
    told.collect::<Vec<_>>().join(" ")
}

#[test]
fn records_change_in_one_field() {
    let table = [
        ("id = \"rdt-restart\"\nat = 3", "10/10/0 11/11/1 12/12/2 1/13/3 2/14/4 3/15/5"),
        ("id = \"ft-restart\"\nat = 3", "10/10/0 11/11/1 12/12/2 13/0/3 14/1/4 15/2/5"),
        ("id = \"ft-stall\"\nat = 3\nfor = 2", "10/10/0 11/11/1 12/12/2 13/12/2 14/12/2 15/15/5"),
        ("id = \"cpf-change\"\nat = 3\nfactor = 2.0", "10/10/0 11/11/1 12/12/2 13/13/6 14/14/8 15/15/10"),
        ("id = \"length\"\nat = 3\nbytes = 35", "10/10/0 11/11/1 12/12/2 35 B 14/14/4 15/15/5"),
    ];
    for (fault, expected) in table {
        assert_eq!(records(fault), expected, "{fault}");
    }
}

/// Every fault with parameters that it takes.
pub(super) fn example(row: &Row) -> String {
    let parameters = match row.id {
        "swap" => "next = 1",
        "hold" | "delay" => "cycles = 2",
        "jitter" => "delays_us = [9000]",
        "silence-then-burst" if row.on == Stream::Ft => "for = 150",
        "silence-then-burst" => "for = 40",
        "ft-stall" | "ipoc-freeze" => "for = 5",
        // The first bit of Fx, and a bit of the name of the root.
        "flip-bit" if row.on == Stream::Ft => "bit = 103",
        "flip-bit" => "bit = 8",
        "truncate" => "bytes = 30",
        "length" => "bytes = 35",
        "ipoc-step" => "step = 4",
        "ipoc-back" => "ms = 400",
        "ipoc-restart" => "first = 4",
        "ipoc-crossing" => "wraps = true",
        "status-word" => "status = 0x8002_0000",
        "cpf-change" => "factor = 2.0",
        "http-slow" => "delay_ms = 500",
        _ => "",
    };
    // After the first packets, when the driver has learned what is usual; the first request is the only one there may be.
    let at = if row.on == Stream::FtRequest { 0 } else { 60 };
    format!("[[fault]]\nid = \"{}\"\non = \"{}\"\nat = {at}\n{parameters}\n", row.id, row.on.id())
}

#[test]
fn every_row_is_a_fault_that_a_file_can_name() {
    for row in TABLE {
        let list = sound(&example(row));
        assert_eq!((list[0].id(), list[0].on), (row.id, row.on));
        assert!(WireFault::knows(row.id));
        let again = toml::to_string(&File { fault: list.clone() }).expect("a list is a file");
        assert_eq!(sound(&again), list, "{again}");
    }
    assert!(!WireFault::knows("stiffness-hardening"));
}

#[test]
fn what_is_no_fault_is_refused_with_what_and_limit() {
    let table = [
        ("id = \"dorp\"\non = \"ft\"\nat = 1", "unknown variant `dorp`"),
        ("id = \"drop\"\non = \"ft\"\nat = 1\ncopies = 2", "unknown field `copies`"),
        ("id = \"drop\"\non = \"http\"\nat = 1", "cannot act on \"http\"; it acts on rsi-frame, rsi-reply, ft"),
        ("id = \"drop\"\non = \"ft\"\nat = \"noon\"", "at is the number of a packet (0, 1, ...) or \"first-contact\""),
        ("id = \"drop\"\non = \"ft\"\nat = 1\nfor = 0", "for = 0 packets: it would never act"),
        ("id = \"drop\"\non = \"ft\"\nat = 1\nevery = 0", "every = 0 is below 1"),
        ("id = \"drop\"\non = \"ft\"\nat = 1\nchance = 1.5", "chance = 1.5 is outside (0, 1]"),
        ("id = \"hold\"\non = \"ft\"\nat = 1\ncycles = 10001", "cycles = 10001 is outside [1, 10000]"),
        ("id = \"length\"\non = \"ft\"\nat = 1\nbytes = 72", "bytes = 72 is a multiple of 36"),
        ("id = \"jitter\"\non = \"ft\"\nat = 1\ndelays_us = []", "delays_us holds no delay above 0"),
        ("id = \"silence-then-burst\"\non = \"ft\"\nat = 1\nfor = 20000", "for = 20000 packets of silence is outside"),
        ("id = \"wrong-type\"\non = \"rsi-reply\"\nat = 1\ntext = 'a\"'", "a character that ends an attribute"),
    ];
    for (fault, expected) in table {
        let said = faults(&format!("[[fault]]\n{fault}")).unwrap_err();
        assert!(said.contains(expected), "{fault}: {said}");
    }
}

/// Whatever bytes come, each fault leaves them whole enough to go on.
#[test]
fn no_fault_panics_on_any_bytes() {
    let mut random = Streams::new(3).named("bytes");
    let mut byte = |limit: usize| (random.uniform() * limit as f64) as usize;
    for row in TABLE.iter().filter(|row| row.needs == Needs::Bytes) {
        let mut list = sound(&example(row));
        (list[0].at, list[0].count) = (At::Number(0), Some(400));
        let mut link = Faulty::new(row.on, Robot::None, &list, PERIOD, &Streams::new(1));
        for number in 0..400 {
            let mut bytes = if number % 3 == 0 { vec![0; byte(80)] } else { FRAME.as_bytes().to_vec() };
            for _ in 0..byte(20) {
                let (at, alphabet) = (byte(bytes.len() + 1), b"<>/=\" \0.,9AIPOC\xff");
                bytes.insert(at, alphabet[byte(alphabet.len())]);
            }
            bytes.truncate(byte(bytes.len() + 1).max(bytes.len() / 2));
            link.pass(number, Some(&bytes), &mut Vec::new());
        }
    }
}
