//! Settings: what is missing, out of its limits, or of no use is said with field, value and limit.

use super::super::{Protocol, Settings, Transport};
use super::{EVERY, JR3, SRI, settings};

fn check(text: &str, wanted: &str) {
    let settings: Settings = toml::from_str(text).unwrap();
    let error = settings.sensor().map(|_| ()).and(settings.device().map(|_| ())).expect_err(text).to_string();
    assert_eq!(error, wanted, "{text}");
}

/// The layout of the JR3 with one thing changed.
fn check_layout(from: &str, to: &str, wanted: &str) {
    assert!(JR3.contains(from), "{from}");
    check(&JR3.replacen(from, to, 1), wanted);
}

#[test]
fn every_protocol_has_a_name() {
    for protocol in Protocol::ALL {
        let text = format!("protocol = '{}'", protocol.name());
        let read: Settings = toml::from_str(&text).unwrap();
        assert_eq!(read.protocol, protocol);
    }
    let transport = |text: &str| settings(text).transport();
    assert_eq!((transport(EVERY[0].1), transport("protocol = 'bota'")), (Transport::Udp, Transport::Stream));
    assert_eq!((transport(JR3), transport(SRI)), (Transport::Udp, Transport::Stream));
    assert_eq!(transport("protocol = 'schunk'"), Transport::Split { samples_port: 54843 });
    assert_eq!(transport("protocol = 'schunk'\nsamples_port = 7"), Transport::Split { samples_port: 7 });
}

#[test]
fn a_cell_of_the_documentation_is_read() {
    let text = "protocol = \"rdt\"\naddress = \"127.0.0.1:49153\"\nrate_hz = 1000\ncounts_per_n = 1000000\n\
        counts_per_n_m = 1000000\nmodel = 'axia'";
    let read = settings(text);
    assert_eq!(read.address.as_deref(), Some("127.0.0.1:49153"));
    assert_eq!(read.period().map(|period| period.0), Ok(1_000_000));
    assert!(read.sensor().is_ok() && read.device().is_ok());
    let error = toml::from_str::<Settings>(&format!("{text}\ncounts_per_nm = 1")).expect_err("unknown").to_string();
    assert!(error.contains("counts_per_nm"), "{error}");
}

#[test]
fn what_is_wrong_is_said() {
    check(
        "protocol = 'rdt'\nrate_hz = 1000\ncounts_per_n_m = 1e6",
        "sensor.counts_per_n is missing: counts for one N (N m), from the sensor's page: cfgcpf (cfgcpt), divided by the \
         newtons (newton metres) in its unit; there is no default, since it changes with calibration and units",
    );
    let rdt = EVERY[0].1;
    check(&rdt.replace("1e6", "0"), "sensor.counts_per_n = 0 counts per N is outside [0.000000001, 1000000000000]");
    check(&rdt.replace("1000", "0.5"), "sensor.rate_hz = 0.5 Hz is outside [1, 20000]");
    check(&rdt.replace("1000", "nan"), "sensor.rate_hz = NaN Hz is outside [1, 20000]");
    check(&rdt.replace("rate_hz = 1000", ""), "sensor.rate_hz is missing: samples per second");
    check(&format!("{rdt}\nrecords_per_datagram = 41"), "sensor.records_per_datagram = 41 records is outside [1, 40]");
    check(&format!("{rdt}\nstale_ms = 0"), "sensor.stale_ms = 0 ms is outside [1, 60000]");
    check(&format!("{rdt}\nclock_hz = 0.0"), "sensor.clock_hz = 0 Hz is outside [1, 1000000]");
    check(
        &format!("{rdt}\nfilter = 3"),
        "sensor.filter means nothing to the protocol rdt, only to optoforce; take it out",
    );
    check(
        "protocol = 'schunk'\ncounts_per_n = 1",
        "sensor.counts_per_n means nothing to the protocol schunk, only to rdt and optoforce; take it out",
    );
    check("protocol = 'robotiq'\nrate_hz = 1000", "sensor.rate_hz = 1000 Hz is outside [100, 100]");
    check("protocol = 'optoforce'\nrate_hz = 3000", "sensor.rate_hz = 0 ms between samples is outside [1, 255]");
    check(
        "protocol = 'optoforce'\nrate_hz = 1000\nfilter = 7",
        "sensor.filter = 7 (code of the filter) is outside [0, 6]",
    );
    let long = format!("protocol = 'bota'\nrate_hz = 1000\nconfigure = ['{}']", "x".repeat(65));
    check(&long, "sensor.configure has more than 32 commands, or one of more than 64 bytes");
    check("protocol = 'record'", "sensor.record is missing: the table [sensor.record] with the layout of the records");
}

#[test]
fn what_is_wrong_with_a_layout_is_said() {
    check_layout("length = 15", "length = 0", "sensor.record.length = 0 bytes is outside [1, 4096]");
    check_layout(
        "at = [7, 9, 11]",
        "at = [7, 9, 14]",
        "sensor.record.torque.at = 14: 2 bytes from there do not lie within the 15 bytes of the record",
    );
    check_layout(
        "unit = 'Nm'",
        "unit = 'N'",
        "sensor.record.torque.unit = \"N\" is no unit; one of lbfin, lbfft, Nm, Nmm, kgfcm, kNm",
    );
    check_layout("scale = 0.00244140625", "scale = 0", "sensor.record.torque.scale = 0 makes every reading the same");
    check_layout("scale = 0.00244140625", "offset = inf", "sensor.record.torque.scale = inf is not finite");
    check_layout(
        "at = 13, type = 'u16'",
        "at = 11, type = 'f32'",
        "sensor.record.sequence.type = F32 is no whole number of at most 8 bytes",
    );
    check_layout(
        "bytes = '09'",
        "bytes = '9'",
        "sensor.record.sync.bytes = \"9\" is not an even number of hex digits, at most 4096 bytes",
    );
    check_layout(
        "sync = { bytes = '09' }",
        "framing = 'stream'",
        "sensor.record.sync is missing: in a stream a record is found by bytes that are always the same",
    );
    let with = |more: &str| format!("{JR3}\n{more}");
    check(
        &with("crc = { name = 'crc-16', at = 13, from = 0, to = 13 }"),
        "sensor.record.crc.name = \"crc-16\" is no checksum of the catalogue; for example crc-16-modbus, \
         crc-16-ibm-sdlc, crc-32-iso-hdlc, sum-8",
    );
    check(
        &with("crc = { name = 'crc-16-arc', at = 13, from = 0, to = 14 }"),
        "sensor.record.crc.to = 14: the bytes 0..14 must lie within 0..15 and without the checksum itself",
    );
    check(&with("time = { at = 0, type = 'u8', hz = 0.0 }"), "sensor.record.time.hz = 0 Hz is outside [1, 1e9]");
    check(
        &with("status = { at = 0, type = 'u64' }"),
        "sensor.record.status.type = U64 is no whole number of at most 4 bytes",
    );
}
