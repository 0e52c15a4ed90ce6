//! The Ethernet configurations that people load on real controllers: each is read, and drives an exchange.
//!
//! The files stay outside the project (K-SDK, kuka_experimental, FZI; see reference/PROTOCOLS.md, section 4). No document of
//! the frames here comes from the code that is tested: they are written with `format!` from the layout.

use std::path::{Path, PathBuf};

use drivers::rsi::{
    Corrections, EthernetConfig, Event, Frame, Host, HostOptions, Kind, Mode, Root, Telegram, Transport, Trap, layout,
};
use sim_core::time::Nanos;

/// File, port, SENTYPE, elements that are sent, elements that are taken, made for a KRC2.
type Expected = (&'static str, u16, &'static str, &'static str, &'static str, bool);

const FILES: [Expected; 6] = [
    ("kuka_experimental/KR_C2_ros_rsi_ethernet.xml", 49152, "ImFree", "RIst RSol AIPos ASPos Delay", "AK", true),
    ("kuka_experimental/KR_C4_ros_rsi_ethernet.xml", 49152, "ImFree", "RIst RSol AIPos ASPos Delay", "AK", false),
    (
        "fzi/ros_rsi_ethernet.xml",
        49152,
        "KukaRsiDriver",
        "RIst RSol AIPos ASPos Delay GearTorque ProgStatus OvPro",
        "AK",
        false,
    ),
    ("kroshu/rsi_ethernet.xml", 59152, "KROSHU", "RIst AIPos EIPos Delay", "Stop AK", false),
    ("kroshu/rsi_ext_axis_ethernet.xml", 59152, "KROSHU", "RIst AIPos EIPos Delay", "Stop AK EK", false),
    ("kroshu/rsi_gpio_ethernet.xml", 59152, "KROSHU", "RIst AIPos EIPos Delay GPIO", "Stop AK GPIO", false),
];

/// The configurations, or none, said aloud.
fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("DOCKHIL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let folder = shared.join("data/protocols/kuka_rsi_config");
    if !folder.exists() {
        eprintln!("skipped: {} is missing; set DOCKHIL_SHARED", folder.display());
        return None;
    }
    Some(folder)
}

fn read(path: &Path) -> EthernetConfig {
    let xml = std::fs::read_to_string(path).unwrap();
    EthernetConfig::parse(&xml).unwrap_or_else(|problem| panic!("{}: {problem}", path.display()))
}

/// What a controller with this configuration sends; the first value of each element moves.
fn document(config: &EthernetConfig, ipoc: u64, cycle: u64) -> String {
    let value = |kind: Kind, name: &str, first: bool| match kind {
        Kind::Double if first => format!("{}.{:04}", cycle % 90, cycle * 7 % 10_000),
        Kind::Double => "0.5000".to_owned(),
        Kind::Long if name == "D" => "0".to_owned(),
        _ => "1".to_owned(),
    };
    let mut body = String::new();
    for slot in layout(&config.send) {
        body.push_str(&format!("<{}", slot.element));
        for (i, (name, channel)) in slot.fields.iter().enumerate() {
            body.push_str(&format!(" {name}=\"{}\"", value(config.send[*channel].kind, name, i == 0)));
        }
        body.push_str("/>");
    }
    format!("<Rob Type=\"KUKA\">{body}<IPOC>{ipoc:010}</IPOC></Rob>")
}

/// A value for everything that the configuration takes.
fn corrections(config: &EthernetConfig, cycle: u64) -> Corrections {
    let mut values = Corrections::none();
    for slot in layout(&config.receive) {
        for (name, channel) in &slot.fields {
            match config.receive[*channel].kind {
                Kind::Double => values.number(&slot.element, name, cycle as f64 * -0.001),
                Kind::Bool => values.flag(&slot.element, name, cycle % 2 == 1),
                Kind::Long => values.number(&slot.element, name, 3.0),
                Kind::String => values.text(&slot.element, name, "text"),
            };
        }
    }
    values
}

fn check_reply(config: &EthernetConfig, frame: &Frame, reply: &[u8]) {
    let telegram = Telegram::decode(reply).unwrap();
    assert_eq!((telegram.root, telegram.kind.as_str()), (Root::Sen, config.sentype.as_str()));
    let mut want: Vec<(String, Vec<String>)> = layout(&config.receive)
        .into_iter()
        .map(|slot| (slot.element, slot.fields.into_iter().map(|(name, _)| name).filter(|n| !n.is_empty()).collect()))
        .collect();
    want.push(("IPOC".to_owned(), Vec::new()));
    let got: Vec<(String, Vec<String>)> = telegram
        .elements
        .iter()
        .map(|element| (element.tag.clone(), element.attributes.iter().map(|(name, _)| name.clone()).collect()))
        .collect();
    assert_eq!(got, want, "names and order of the configuration, the stamp last");
    assert_eq!(telegram.ipoc(), frame.telegram.ipoc(), "the stamp as it came, zeros and all");
    let text = String::from_utf8(reply.to_vec()).unwrap();
    assert!(!text.contains("-0.0000\"") && !text.contains(','), "{text}");
}

#[test]
fn the_configurations_of_real_controllers_are_read() {
    let Some(folder) = folder() else { return };
    for (file, port, sentype, sends, takes, krc2) in FILES {
        let config = read(&folder.join(file));
        assert_eq!((config.port, config.sentype.as_str(), config.krc2), (port, sentype, krc2), "{file}");
        assert_eq!((config.protocol, config.only_send, config.length_prefix), (Transport::Udp, false, false), "{file}");
        let names = |channels| layout(channels).into_iter().map(|slot| slot.element).collect::<Vec<_>>().join(" ");
        assert_eq!(names(&config.send), sends, "{file}");
        assert_eq!(names(&config.receive), takes, "{file}");
        // Their corrections are absolute and hold; relative ones must not be sent with them.
        assert_eq!(config.check(Mode::Absolute), Ok(()), "{file}");
        let refused = config.check(Mode::Relative).unwrap_err();
        assert!(refused.to_string().contains("HOLDON=\"1\"") && refused.to_string().contains("AK.A1"), "{refused}");
        let placeholder = config.traps().contains(&Trap::AddressPlaceholder);
        assert_eq!(placeholder, !file.starts_with("fzi"), "{file}");
    }
}

#[test]
fn the_configurations_of_real_controllers_drive_an_exchange() {
    let Some(folder) = folder() else { return };
    for (file, ..) in FILES {
        let config = read(&folder.join(file));
        let mut host = Host::new(config.clone(), HostOptions::default());
        let mut events = Vec::new();
        for cycle in 0..1000_u64 {
            let now = Nanos(cycle as i64 * 4_000_000);
            // Over the wrap of 32 bits.
            let ipoc = ((1_u64 << 32) - 2000 + 4 * cycle) % (1 << 32);
            let frame = host.receive(now, document(&config, ipoc, cycle).as_bytes(), &mut events).unwrap();
            assert_eq!(frame.pose_mm_deg.is_some(), config.sends("RIst"), "{file}");
            assert_eq!((frame.external.is_some(), frame.delay), (config.sends("EIPos"), Some(0)), "{file}");
            let reply = host.reply(&corrections(&config, cycle)).unwrap();
            check_reply(&config, &frame, &reply);
        }
        let classes: Vec<&str> = events.iter().map(Event::class).collect();
        assert_eq!(classes, ["rsi-started", "rsi-decimals", "rsi-step", "rsi-wrap"], "{file}");
        assert_eq!(host.sent("AK", "A1"), Some("-0.9990"), "{file}");
    }
}

#[test]
fn an_object_graph_is_not_mistaken_for_a_configuration() {
    let Some(folder) = folder() else { return };
    let xml = std::fs::read_to_string(folder.join("kuka_experimental/KR_C4_ros_rsi.rsi.xml")).unwrap();
    let problem = EthernetConfig::parse(&xml).unwrap_err().to_string();
    assert!(problem.starts_with("line 2: the file begins with <RSIObjects>"), "{problem}");
}
