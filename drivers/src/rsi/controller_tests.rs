//! The controller against replies written by hand: what it sends, takes, refuses, limits, and how it stops.

use super::super::*;
use crate::fault::Action;

const SEND: &str = concat!(
    r#"<ELEMENT TAG="DEF_RIst" TYPE="DOUBLE" INDX="INTERNAL" /><ELEMENT TAG="DEF_RSol" TYPE="DOUBLE" INDX="INTERNAL" />"#,
    r#"<ELEMENT TAG="DEF_EIPos" TYPE="DOUBLE" INDX="INTERNAL" /><ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL" />"#,
    r#"<ELEMENT TAG="GPIO.01" TYPE="BOOL" INDX="1" />"#
);

pub(super) fn config(hold: &str) -> EthernetConfig {
    let channel = |(index, tag): (usize, String)| {
        format!("<ELEMENT TAG=\"{tag}\" TYPE=\"DOUBLE\" INDX=\"{}\" HOLDON=\"{hold}\" />", index + 1)
    };
    let tags = POSE.map(|name| format!("RKorr.{name}")).into_iter().chain(["EKorr.E1".to_owned()]);
    let receive: String = tags.enumerate().map(channel).collect();
    EthernetConfig::parse(&format!(
        "<ROOT><CONFIG><IP_NUMBER>127.0.0.1</IP_NUMBER><PORT>49152</PORT><SENTYPE>ImFree</SENTYPE>\
         <ONLYSEND>FALSE</ONLYSEND></CONFIG><SEND><ELEMENTS>{SEND}</ELEMENTS></SEND><RECEIVE><ELEMENTS>{receive}\
         <ELEMENT TAG=\"Stop\" TYPE=\"BOOL\" INDX=\"8\" HOLDON=\"0\" /></ELEMENTS></RECEIVE></ROOT>"
    ))
    .expect("a sound configuration")
}

fn settings(hold: &str, mode: Mode) -> Settings {
    Settings { mode, decimals: 4, ..Settings::new(config(hold), Family::Krc4) }
}

const START: [f64; 6] = [100.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// A controller, and what one cycle after the other tells of it.
struct Bench {
    controller: Controller,
    events: Vec<ControllerEvent>,
}

impl Bench {
    fn new(settings: Settings) -> Bench {
        Bench { controller: Controller::new(settings, START, [0.0; 6]), events: Vec::new() }
    }

    /// One cycle. In the reply `#` is the IPOC of the frame; an empty text is no reply.
    fn cycle(&mut self, reply: &str) -> &mut Self {
        let frame = self.controller.frame(&START, &[0.0; 6]);
        let ipoc = Telegram::decode(&frame).ok().and_then(|frame| frame.ipoc()).map(|ipoc| ipoc.text);
        let reply = reply.replace('#', &ipoc.unwrap_or_default());
        self.controller.cycle((!reply.is_empty()).then_some(reply.as_bytes()), &mut self.events);
        self
    }

    /// Classes of the events since the last call.
    fn told(&mut self) -> String {
        let classes: Vec<_> = self.events.drain(..).map(|event| event.class().replace("controller-", "")).collect();
        classes.join(" ")
    }

    fn x(&self) -> f64 {
        self.controller.target_mm_deg()[0]
    }
}

/// A reply that asks for this much along X.
fn x(value: &str) -> String {
    format!("<Sen Type=\"ImFree\"><RKorr X=\"{value}\"/><IPOC>#</IPOC></Sen>")
}

#[test]
fn a_frame_says_what_the_configuration_asks_for() {
    let mut controller = Controller::new(settings("1", Mode::Absolute), START, [2.5; 6]);
    let frame = controller.frame(&[1.0, -0.00001, 3.5, 4.0, 5.0, 6.0], &[226_966.932_6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let expected = concat!(
        r#"<Rob Type="KUKA"><RIst X="1.0000" Y="0.0000" Z="3.5000" A="4.0000" B="5.0000" C="6.0000"/>"#,
        r#"<RSol X="100.0000" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" C="0.0000"/>"#,
        r#"<EIPos E1="226966.9326" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
        r#"<Delay D="0"/><GPIO 01="0"/><IPOC>0</IPOC></Rob>"#
    );
    assert_eq!(String::from_utf8_lossy(&frame), expected);
    assert_eq!(controller.greeting(), None);
    let again = controller.frame(&[f64::NAN; 6], &[f64::INFINITY; 6]);
    assert_eq!(String::from_utf8_lossy(&again), expected.replace("<IPOC>0<", "<IPOC>4<"), "what is not finite repeats");
}

#[test]
fn a_krc2_writes_tabs_and_puts_the_ipoc_in_the_middle() {
    let settings = Settings {
        form: Form::Dat,
        frame_bytes: 2048,
        ipoc_digits: 10,
        decimals: 0,
        ..Settings::new(config("1"), Family::Krc2)
    };
    let mut controller = Controller::new(settings, START, [0.0; 6]);
    let frame = controller.frame(&START, &[0.0; 6]);
    assert_eq!(frame.len(), 2048);
    let expected = "<Rob Type=\"KUKA\">\n\t<Dat TaskType=\"b\">\n\t\t<RIst X=\"100\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\"/>\
        \n\t\t<RSol X=\"100\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\"/>\
        \n\t\t<EIPos E1=\"0\" E2=\"0\" E3=\"0\" E4=\"0\" E5=\"0\" E6=\"0\"/>\n\t\t<IPOC>0000000000</IPOC>\
        \n\t\t<Delay D=\"0\"/>\n\t\t<GPIO 01=\"0\"/>\n\t</Dat>\n</Rob>\n";
    assert_eq!(String::from_utf8_lossy(&frame).trim_end_matches('\0'), expected);
    let greeting = controller.greeting().expect("a KRC2 greets");
    assert_eq!(Telegram::decode(&greeting).expect("a document").elements.len(), 1);
    let second = Telegram::decode(&controller.frame(&START, &[0.0; 6])).expect("a document");
    assert_eq!((second.form, second.ipoc().map(|ipoc| ipoc.value)), (Form::Dat, Some(12)));
}

/// The reply, what the controller tells of it, and where X goes.
#[test]
fn a_reply_is_taken_or_refused() {
    let table = [
        (x("1.5"), "", 101.5),
        (x("1.5").replace("ImFree", "imfree"), "wrong-type late", 100.0),
        (x("1.5").replace("Type", "TYPE"), "wrong-type late", 100.0),
        (x("1.5").replace('#', "4"), "wrong-ipoc late", 100.0),
        (x("1.5").replace("<IPOC>#</IPOC>", ""), "wrong-ipoc late", 100.0),
        (String::new(), "late", 100.0),
        (x("1,5"), "bad-reply stopped", 100.0),
        (x("NaN"), "bad-reply stopped", 100.0),
        (x("1.5e0"), "bad-reply stopped", 100.0),
        (x("1.5").replace("</Sen>", ""), "bad-reply stopped", 100.0),
        (x("1.5").replace("Sen", "Rob"), "bad-reply stopped", 100.0),
        (x("1.5").replace("<IPOC", "<Lamp on=\"1\"/><IPOC"), "", 101.5),
        (format!("{}\0\0\0", x("1.5")), "", 101.5),
        (format!("{}{}", x("1.5").replace('#', "7"), x("1.5")), "wrong-ipoc", 101.5),
    ];
    for (reply, told, target_mm) in table {
        let mut bench = Bench::new(settings("1", Mode::Absolute));
        bench.cycle(&reply);
        assert_eq!((bench.told().as_str(), bench.x()), (told, target_mm), "{reply}");
    }
    let mut rsi6 = Bench::new(Settings { family: Family::IiQka, ..settings("1", Mode::Absolute) });
    assert_eq!(rsi6.cycle(&x("1.5").replace("<IPOC", "<Lamp on=\"1\"/><IPOC")).told(), "mapping late");
    let mut lenient = Bench::new(Settings { bad_stops: false, ..settings("1", Mode::Absolute) });
    assert_eq!(lenient.cycle(&x("1,5")).told(), "bad-reply late");
}

/// X after each of: 1 mm asked, no reply, no reply, -1 mm asked.
#[test]
fn holdon_and_mode_decide_what_a_lost_reply_does() {
    let table = [
        ("1", Mode::Absolute, [101.0, 101.0, 101.0, 99.0]),
        ("0", Mode::Absolute, [101.0, 100.0, 100.0, 99.0]),
        ("1", Mode::Relative, [101.0, 102.0, 103.0, 102.0]),
        ("0", Mode::Relative, [101.0, 101.0, 101.0, 100.0]),
    ];
    for (hold, mode, expected) in table {
        let mut bench = Bench::new(settings(hold, mode));
        let targets = [x("1.0"), String::new(), String::new(), x("-1.0")].map(|reply| bench.cycle(&reply).x());
        assert_eq!(targets, expected, "HOLDON {hold}, {mode:?}");
        let fell = if hold == "0" { "late fell-to-zero late" } else { "late late" };
        assert_eq!(bench.told(), fell, "{mode:?}");
    }
}

/// K-EXP's crash: 4.9 mm away, one lost packet, and the robot is sent home in one cycle of 4 ms.
#[test]
fn one_lost_reply_sends_an_absolute_robot_home_in_one_cycle() {
    let mut bench = Bench::new(settings("0", Mode::Absolute));
    let away = bench.cycle(&x("4.9")).x();
    let home = bench.cycle("").x();
    assert_eq!((away, home), (104.9, 100.0));
}

#[test]
fn corrections_saturate_silently_and_do_not_wind_up() {
    let mut bench = Bench::new(settings("1", Mode::Relative));
    for _ in 0..8 {
        bench.cycle(&x("1.0"));
    }
    assert_eq!((bench.x(), bench.controller.stat(), bench.told().as_str()), (105.0, 2, "limited"));
    assert_eq!((bench.cycle(&x("-1.0")).x(), bench.controller.stat()), (104.0, 1));
    let rail = x("0.0").replace("<IPOC", "<EKorr E1=\"-7.5\"/><IPOC");
    assert_eq!(bench.cycle(&rail).controller.external_target(), [-5.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_correction_that_is_too_long_stops() {
    let mut bench = Bench::new(settings("1", Mode::Absolute));
    bench.cycle(&x("4.0").replace("X=", "Y=\"4.0\" Z=\"4.0\" X="));
    assert_eq!(bench.told(), "stopped");
    let said = bench.controller.stopped().expect("it stopped").to_string();
    assert_eq!(said, "RSI stopped in cycle 0: a correction of 6.928 mm exceeds 6 mm | Stop by $CORRECTION function");
}

#[test]
fn the_computer_stops_with_a_rising_edge() {
    let stop = |value: &str| x("1.0").replace("<IPOC", &format!("<Stop>{value}</Stop><IPOC"));
    let mut bench = Bench::new(settings("1", Mode::Absolute));
    bench.cycle(&stop("0")).cycle(&stop("1"));
    assert_eq!(bench.controller.stopped().map(|stop| (&stop.reason, stop.cycle)), Some((&StopReason::Commanded, 1)));
    assert_eq!(bench.controller.frame(&START, &[0.0; 6]), b"", "frames cease");
    bench.told();
    assert_eq!((bench.cycle(&x("2.0")).told().as_str(), bench.x()), ("", 101.0), "and nothing moves");
}

/// With the limit 3 the fourth late reply stops, and each family prints its own words.
#[test]
fn too_many_late_replies_stop_with_the_words_of_the_family() {
    let rsi = "KSS29002 Signal flow (running): Object ETHERNET1 returns error RSITimeout";
    let krc2 = "SEN: RSI execution error <execute> - RSI stopped | ERX: Defined timeout limit was reached. \
                Answer from server missed!";
    for (family, words) in [(Family::Krc4, rsi), (Family::Krc5, rsi), (Family::IiQka, rsi), (Family::Krc2, krc2)] {
        let late = LateRule::Total { limit: 3 };
        let mut bench = Bench::new(Settings { family, late, ..settings("1", Mode::Absolute) });
        for _ in 0..3 {
            bench.cycle("").cycle(&x("0.0"));
        }
        assert_eq!((bench.controller.late(), bench.controller.stopped()), (3, None));
        bench.cycle("");
        let said = bench.controller.stopped().expect("it stopped").to_string();
        assert_eq!(said, format!("RSI stopped in cycle 6: 4 late replies | {words}"));
    }
}

#[test]
fn a_krc2_warns_when_half_the_window_is_late() {
    let late = LateRule::Total { limit: 100 };
    let warning = Some(LateRule::Percent { limit: 50.0, window: 4 });
    let mut bench = Bench::new(Settings { late, warning, ..settings("1", Mode::Absolute) });
    bench.cycle("").cycle("").cycle("").cycle("");
    assert_eq!(bench.told(), "late late late warning late");
}

/// IPOC of the next frames; each is answered, and every answer is taken.
fn stamps(bench: &mut Bench, count: usize) -> Vec<u64> {
    let stamps = (0..count).map(|_| bench.cycle(&x("0.0")).controller.ipoc().expect("a frame was sent")).collect();
    assert_eq!(bench.told(), "");
    stamps
}

#[test]
fn the_clock_crosses_jumps_freezes_and_starts_again() {
    for (wraps, expected) in [
        (true, [4_294_967_288, 4_294_967_292, 0, 4]),
        (false, { [4_294_967_288, 4_294_967_292, 4_294_967_296, 4_294_967_300] }),
    ] {
        let mut settings = settings("1", Mode::Absolute);
        settings.cross_at(2, wraps);
        let mut bench = Bench::new(settings);
        let crossing = Action::IpocCrossing { wraps };
        let acts: Vec<bool> = (0..4).map(|_| (bench.controller.disturb(&crossing), stamps(&mut bench, 1)).0).collect();
        assert_eq!(acts, [false, false, true, false]);
        let last = bench.controller.ipoc().expect("a frame was sent");
        assert_eq!(last, expected[3]);
    }
    let mut bench = Bench::new(Settings { first_ipoc: 1000, ..settings("1", Mode::Absolute) });
    assert!(!bench.controller.disturb(&Action::IpocFreeze {}), "nothing to repeat yet");
    assert_eq!(stamps(&mut bench, 2), [1000, 1004]);
    assert!(bench.controller.disturb(&Action::IpocFreeze {}));
    assert_eq!(stamps(&mut bench, 2), [1004, 1008]);
    assert!(bench.controller.disturb(&Action::IpocBack { ms: 400 }));
    assert_eq!(stamps(&mut bench, 2), [612, 616]);
    bench.cycle(&x("2.0"));
    assert!(bench.controller.disturb(&Action::IpocRestart { first: 8 }));
    assert_eq!(bench.x(), 102.0, "it starts again where it is");
    assert_eq!(stamps(&mut bench, 2), [8, 12]);
    assert!(!bench.controller.disturb(&Action::Drop {}));
}

/// Over the real configuration files nothing but the names changes; `ONLYSEND` takes no reply and counts none.
#[test]
fn a_controller_that_only_sends_counts_nothing() {
    let mut config = config("0");
    config.only_send = true;
    let mut bench = Bench::new(Settings { config, ..settings("0", Mode::Absolute) });
    bench.cycle(&x("1.0")).cycle("").cycle("garbage");
    assert_eq!((bench.told().as_str(), bench.x(), bench.controller.late()), ("", 100.0, 0));
}

#[test]
fn no_bytes_panic_the_controller() {
    let mut random = sim_core::rng::Streams::new(5).named("replies");
    let mut below = |limit: usize| (random.uniform() * limit as f64) as usize;
    let lenient =
        Settings { bad_stops: false, late: LateRule::Consecutive { limit: u32::MAX }, ..settings("0", Mode::Relative) };
    let mut bench = Bench::new(lenient);
    for _ in 0..20_000 {
        let mut reply = x("-1.25").into_bytes();
        for _ in 0..below(4) {
            let at = below(reply.len());
            reply[at] = below(256) as u8;
        }
        bench.cycle(&String::from_utf8_lossy(&reply));
        bench.events.clear();
        assert!(bench.controller.target_mm_deg().iter().all(|value| value.is_finite()));
    }
}
