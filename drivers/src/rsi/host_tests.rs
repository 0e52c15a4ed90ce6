//! The PC's side of the exchange, driven document by document.

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use sim_core::time::Nanos;

    use super::super::vectors::{CONFIG, GPIO, HELLO, HELLO_EMPTY, KRC2_DAT, SEN_ROS, UPPER, frame};
    use super::super::{
        Corrections, EthernetConfig, Event, Form, Frame, Host, HostOptions, Mode, POSE, ReplyError, Telegram, split,
    };

    const MS: i64 = 1_000_000;

    /// A host with its clock and what it said.
    struct Bench {
        host: Host,
        now: Nanos,
        events: Vec<Event>,
    }

    impl Bench {
        fn new(options: HostOptions) -> Self {
            Bench {
                host: Host::new(EthernetConfig::parse(CONFIG).unwrap(), options),
                now: Nanos(0),
                events: Vec::new(),
            }
        }

        /// A document, so many ms after the one before.
        fn take(&mut self, after_ms: i64, document: &[u8]) -> Option<Frame> {
            self.now = self.now + Nanos(after_ms * MS);
            self.host.receive(self.now, document, &mut self.events)
        }

        /// A frame 4 ms after the one before, and its answer without corrections.
        fn cycle(&mut self, ipoc: u64) -> Option<Frame> {
            let frame = self.take(4, &frame(ipoc, 0.0, 0));
            if frame.is_some() {
                self.host.reply(&Corrections::none()).unwrap();
            }
            frame
        }

        /// Frames from here on in steps of 4 ms, until the step and the cycle are known; what was said is forgotten.
        fn running(options: HostOptions, first: u64) -> Self {
            let mut bench = Bench::new(options);
            for i in 0..50 {
                bench.cycle(first + 4 * i).unwrap();
            }
            bench.events.clear();
            bench
        }

        fn said(&mut self) -> Vec<&'static str> {
            core::mem::take(&mut self.events).iter().map(Event::class).collect()
        }
    }

    fn text(bytes: &[u8]) -> &str {
        core::str::from_utf8(bytes).unwrap()
    }

    #[test]
    fn an_exchange_begins_and_is_quiet() {
        let mut bench = Bench::new(HostOptions::default());
        let first = bench.take(0, &frame(680_309_708, 93.9531, 0)).unwrap();
        assert_eq!((first.ipoc, first.session, first.missing, first.delay), (680_309_708, 1, 0, Some(0)));
        assert_eq!(first.pose_mm_deg.unwrap()[0].to_bits(), 93.9531_f64.to_bits());
        assert_eq!(first.external.unwrap()[0].to_bits(), 226_966.932_6_f64.to_bits());
        let reply = bench.host.reply(&Corrections::none()).unwrap();
        let zeros = r#"X="0.0000" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" C="0.0000""#;
        let want = format!(
            r#"<Sen Type="ImFree"><EStr></EStr><Stop>0</Stop><RKorr {zeros}/><DiO>0</DiO><IPOC>0680309708</IPOC></Sen>"#
        );
        // Names and order of the configuration, and the stamp with its zeros.
        assert_eq!(text(&reply), want);
        for i in 1..1000 {
            assert_eq!(bench.cycle(680_309_708 + 4 * i).unwrap().unwrapped, 680_309_708 + 4 * i);
        }
        assert_eq!(bench.said(), ["rsi-started", "rsi-decimals", "rsi-step"]);
        assert_eq!((bench.host.step(), bench.host.decimals()), (Some(4), Some(4)));
    }

    #[test]
    fn corrections_go_by_name_and_are_remembered_as_sent() {
        let mut bench = Bench::running(HostOptions { decimals: 3, ..HostOptions::default() }, 100);
        let mut values = Corrections::six("RKorr", POSE, [1.23456, -0.0001, 2.0, 0.0, -0.0, 5.0005]);
        values.flag("Stop", "", true).number("DiO", "", 125.0).text("EStr", "", "docked");
        bench.take(4, &frame(300, 0.0, 0)).unwrap();
        let reply = bench.host.reply(&values).unwrap();
        let want = concat!(
            r#"<Sen Type="ImFree"><EStr>docked</EStr><Stop>1</Stop>"#,
            r#"<RKorr X="1.235" Y="0.000" Z="2.000" A="0.000" B="0.000" C="5.000"/><DiO>125</DiO><IPOC>0000000300</IPOC></Sen>"#
        );
        // 5.0005 lies just below the middle in binary.
        assert_eq!(text(&reply), want);
        assert_eq!(bench.host.sent("RKorr", "X"), Some("1.235"));
        assert_eq!(bench.host.sent("RKorr", "Q"), None);
        // An absolute offset that nobody changes stays; zero would be a jump back.
        bench.take(4, &frame(304, 0.0, 0)).unwrap();
        let mut one = Corrections::none();
        one.number("RKorr", "Z", 3.0);
        let reply = bench.host.reply(&one).unwrap();
        assert!(text(&reply).contains(r#"X="1.235" Y="0.000" Z="3.000""#));
    }

    #[test]
    fn a_relative_step_is_sent_once() {
        let relative = HostOptions { mode: Mode::Relative, ..HostOptions::default() };
        let mut bench = Bench::running(relative, 100);
        bench.take(4, &frame(300, 0.0, 0)).unwrap();
        let mut values = Corrections::six("RKorr", POSE, [0.6; 6]);
        values.number("DiO", "", 7.0);
        bench.host.reply(&values).unwrap();
        bench.take(4, &frame(304, 0.0, 0)).unwrap();
        let reply = bench.host.reply(&Corrections::none()).unwrap();
        assert!(
            text(&reply).contains(r#"<RKorr X="0.0000""#) && text(&reply).contains("<DiO>7</DiO>"),
            "{}",
            text(&reply)
        );
    }

    #[test]
    fn what_cannot_be_sent_is_refused_and_changes_nothing() {
        let mut bench = Bench::running(HostOptions::default(), 100);
        assert_eq!(bench.host.reply(&Corrections::none()), Err(ReplyError::NothingToAnswer));
        bench.take(4, &frame(300, 0.0, 0)).unwrap();
        let mut cases: Vec<(Corrections, &str)> = Vec::new();
        let mut case = |edit: &dyn Fn(&mut Corrections), what| {
            let mut values = Corrections::six("RKorr", POSE, [9.0; 6]);
            edit(&mut values);
            cases.push((values, what));
        };
        case(
            &|v| _ = v.number("AKorr", "A1", 1.0),
            "AKorr.A1 is not in RECEIVE of the configuration; there are EStr, Stop, RKorr.X",
        );
        case(&|v| _ = v.number("RKorr", "x", 1.0), "RKorr.x is not in RECEIVE");
        case(&|v| _ = v.number("RKorr", "", 1.0), "RKorr is not in RECEIVE");
        case(&|v| _ = v.number("IPOC", "", 1.0), "IPOC is not in RECEIVE");
        case(&|v| _ = v.number("RKorr", "X", f64::NAN), "RKorr.X: NaN is not finite");
        case(&|v| _ = v.number("DiO", "", 0.5), "DiO = 0.5 is no whole number of 32 bits");
        case(&|v| _ = v.number("DiO", "", 3e9), "DiO = 3000000000 is no whole number of 32 bits");
        case(&|v| _ = v.number("Stop", "", 1.0), "Stop = 1 is no BOOL; give a flag");
        case(&|v| _ = v.flag("RKorr", "X", true), "RKorr.X = true is no number");
        case(&|v| _ = v.flag("EStr", "", true), "EStr = true is no STRING; give a text");
        case(&|v| _ = v.text("EStr", "", "</EStr><Stop>1</Stop>"), "is no text of at most 256 bytes without <");
        case(&|v| _ = v.text("EStr", "", &"x".repeat(257)), "is no text of at most 256 bytes");
        for (values, what) in cases {
            let problem = bench.host.reply(&values).unwrap_err();
            assert!(problem.to_string().contains(what), "{problem}");
            assert_eq!(bench.host.sent("RKorr", "X"), Some("0.0000"));
        }
        // The frame still waits for its one answer.
        bench.host.reply(&Corrections::none()).unwrap();
        assert_eq!(bench.host.reply(&Corrections::none()), Err(ReplyError::NothingToAnswer));
        let only = EthernetConfig::parse(&CONFIG.replace("<ONLYSEND>FALSE", "<ONLYSEND>TRUE")).unwrap();
        let mut host = Host::new(only, HostOptions::default());
        host.receive(Nanos(0), &frame(4, 0.0, 0), &mut Vec::new()).unwrap();
        assert_eq!(host.reply(&Corrections::none()), Err(ReplyError::OnlySend));
    }

    #[test]
    fn a_repeated_frame_gets_the_same_answer_and_advances_nothing() {
        let mut bench = Bench::running(HostOptions::default(), 100);
        bench.take(4, &frame(300, 0.0, 0)).unwrap();
        let reply = bench.host.reply(&Corrections::six("RKorr", POSE, [1.0; 6])).unwrap();
        assert_eq!(bench.host.repeat(), None);
        assert_eq!(bench.take(1, &frame(300, 0.0, 0)), None);
        assert_eq!(bench.host.repeat(), Some(reply.as_slice()));
        assert_eq!(bench.take(1, &frame(300, 0.0, 0)), None);
        assert_eq!(bench.take(1, &frame(300, 0.0, 0)), None);
        assert_eq!(bench.said(), ["rsi-duplicate", "rsi-duplicate", "rsi-frozen", "rsi-duplicate"]);
        bench.cycle(304).unwrap();
        assert_eq!(bench.host.repeat(), None);
        assert_eq!(bench.said(), Vec::<&str>::new());
    }

    /// Who asks whenever something has come asks more often than a frame is repeated.
    #[test]
    fn a_repeat_is_answered_once_whatever_comes_after_it() {
        let mut bench = Bench::running(HostOptions::default(), 100);
        bench.take(4, &frame(300, 0.0, 0)).unwrap();
        let reply = bench.host.reply(&Corrections::six("RKorr", POSE, [1.0; 6])).unwrap();
        bench.take(1, &frame(300, 0.0, 0));
        assert_eq!(bench.host.repeat(), Some(reply.as_slice()));
        // A piece of a frame, then bytes that are none.
        assert_eq!(bench.host.repeat(), None);
        bench.host.receive_documents(bench.now, split(b"hello"), &mut bench.events);
        assert_eq!(bench.host.repeat(), None);
        bench.take(1, &frame(300, 0.0, 0));
        bench.host.receive_documents(bench.now, split(&frame(304, 0.0, 0)[..50]), &mut bench.events);
        assert_eq!(bench.host.repeat(), None, "the newest is no repeat");
    }

    #[test]
    fn gaps_swaps_and_wrong_stamps_are_told_apart() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        let after = bench.cycle(208).unwrap();
        assert_eq!(after.missing, 2);
        assert_eq!(bench.events, [Event::Gap { missing: 2, ipoc: 208 }]);
        bench.events.clear();
        // 216 before 212: the late one gets no answer.
        bench.cycle(216).unwrap();
        assert_eq!(bench.cycle(212), None);
        assert_eq!(bench.host.repeat(), None);
        assert_eq!(bench.said(), ["rsi-gap", "rsi-out-of-order"]);
        bench.cycle(221).unwrap();
        bench.cycle(225).unwrap();
        assert_eq!(bench.said(), ["rsi-irregular"]);
    }

    #[test]
    fn a_restart_forgets_the_offset() {
        let mut bench = Bench::running(HostOptions::default(), 4_211_158_252);
        bench.take(4, &frame(4_211_158_452, 0.0, 3)).unwrap();
        bench.host.reply(&Corrections::six("RKorr", POSE, [5.0; 6])).unwrap();
        bench.events.clear();
        let again = bench.take(500, &frame(4, 0.0, 0)).unwrap();
        assert_eq!((again.session, again.unwrapped), (2, 4));
        // The offset counts from the new start: the old one would be a jump.
        assert_eq!(bench.host.sent("RKorr", "X"), Some("0.0000"));
        assert_eq!(bench.events[0], Event::Restarted { from: 4_211_158_452, to: 4 });
    }

    #[test]
    fn the_wrap_at_two_to_the_32_is_no_restart() {
        let top = 1_u64 << 32;
        let mut bench = Bench::running(HostOptions::default(), top - 204);
        let frame = bench.cycle(top - 4).unwrap();
        assert_eq!((frame.unwrapped, bench.said()), (top - 4, vec![]));
        let frame = bench.cycle(0).unwrap();
        assert_eq!((frame.ipoc, frame.unwrapped, frame.session, bench.said()), (0, top, 1, vec!["rsi-wrap"]));
        // A stamp of 64 bits goes on beyond it.
        let mut bench = Bench::running(HostOptions::default(), top - 204);
        bench.cycle(top - 4).unwrap();
        assert_eq!((bench.cycle(top).unwrap().unwrapped, bench.said()), (top, vec![]));
    }

    #[test]
    fn after_a_stall_the_newest_is_answered_and_the_backlog_said() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        bench.take(60, &frame(200, 0.0, 0)).unwrap();
        for i in 1..15 {
            bench.take(0, &frame(200 + 4 * i, 0.0, 0)).unwrap();
        }
        let reply = bench.host.reply(&Corrections::none()).unwrap();
        assert!(text(&reply).contains("<IPOC>0000000256</IPOC>"));
        let counts = |bench: &Bench, class| bench.host.counts().get(class).copied().unwrap_or(0);
        assert_eq!((counts(&bench, "rsi-backlog"), counts(&bench, "rsi-unanswered")), (1, 14));
        // A tap answers nothing and misses nothing.
        let mut tap = Bench::new(HostOptions { answers: false, ..HostOptions::default() });
        for i in 0..10 {
            tap.take(4, &frame(4 * i, 0.0, 0)).unwrap();
        }
        assert_eq!(counts(&tap, "rsi-unanswered"), 0);
    }

    #[test]
    fn silence_is_said_once_and_its_end_too() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        for _ in 0..30 {
            bench.now = bench.now + Nanos(10 * MS);
            bench.host.tick(bench.now, &mut bench.events);
        }
        assert_eq!(bench.events, [Event::Silent { lasted: Nanos(110 * MS) }]);
        bench.cycle(200 + 304).unwrap();
        assert_eq!(bench.said(), ["rsi-silent", "rsi-resumed", "rsi-gap"]);
        let mut unheard = Host::new(EthernetConfig::parse(CONFIG).unwrap(), HostOptions::default());
        unheard.tick(Nanos(i64::MAX), &mut bench.events);
        assert_eq!(bench.events, []);
    }

    #[test]
    fn late_replies_show_in_the_controllers_count() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        for (i, late) in [0, 1, 3, 3, 0, 1].into_iter().enumerate() {
            let seen = bench.take(4, &frame(200 + 4 * i as u64, 0.0, late)).unwrap();
            assert_eq!(seen.delay, Some(late));
            bench.host.reply(&Corrections::none()).unwrap();
        }
        let late = |count, more| Event::Late { count, more };
        assert_eq!(bench.events, [late(1, 1), late(3, 2), late(1, 1)]);
    }

    #[test]
    fn the_first_frame_of_a_krc2_is_dropped() {
        for hello in [HELLO, HELLO_EMPTY] {
            let mut bench = Bench::new(HostOptions::default());
            assert_eq!(bench.take(0, hello.as_bytes()), None);
            assert_eq!(bench.host.reply(&Corrections::none()), Err(ReplyError::NothingToAnswer));
            // Its stamp says nothing: the exchange may begin anywhere.
            bench.take(5000, &frame(4, 0.0, 0)).unwrap();
            assert_eq!(bench.said(), ["rsi-hello", "rsi-started", "rsi-decimals"]);
        }
    }

    #[test]
    fn a_krc2_frame_is_answered_in_its_form() {
        let mut bench = Bench::new(HostOptions::default());
        let frame = bench.take(0, KRC2_DAT.as_bytes()).unwrap();
        assert_eq!((frame.ipoc, frame.telegram.form), (680_309_708, Form::Dat));
        let reply = Telegram::decode(&bench.host.reply(&Corrections::none()).unwrap()).unwrap();
        assert_eq!((reply.form, reply.kind.as_str()), (Form::Dat, "ImFree"));
        assert_eq!(reply.ipoc().unwrap().text, "680309708");
        // What a KRC2 adds in this form is nothing new; what the configuration names must be there.
        let absent: Vec<String> = bench.events.iter().filter(|event| !event.is_news()).map(Event::to_string).collect();
        assert_eq!(absent, ["Delay is in the configuration and not in the frame; is it of this robot?"]);
    }

    #[test]
    fn a_frame_of_another_robot_is_named() {
        let mut bench = Bench::new(HostOptions::default());
        bench.take(0, UPPER.replace("KUKA", "Kuka").as_bytes()).unwrap();
        assert_eq!(bench.said(), ["rsi-type", "rsi-spelling", "rsi-started", "rsi-absent", "rsi-decimals"]);
        bench.take(4, GPIO.as_bytes()).unwrap();
        let said: Vec<String> = core::mem::take(&mut bench.events)
            .into_iter()
            .filter(|event| matches!(event, Event::Absent { .. } | Event::Unexpected { .. }))
            .map(|event| event.to_string())
            .collect();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].starts_with("RIst is in the configuration") && said[1].starts_with("GPIO is in the frame"));
        // Not again in the next frame.
        bench.take(4, GPIO.replace(">1<", ">5<").as_bytes()).unwrap();
        assert_eq!(bench.said(), ["rsi-step", "rsi-unanswered"]);
    }

    #[test]
    fn a_value_that_is_no_number_is_no_pose() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        for (i, bad) in ["1,0000", "nan", "1e-5", "", "1..0"].into_iter().enumerate() {
            let document = String::from_utf8(frame(200 + 4 * i as u64, 0.0, 0)).unwrap();
            let document = document.replacen("\"0.0000\"", &format!("\"{bad}\""), 1);
            let seen = bench.take(4, document.as_bytes()).unwrap();
            assert_eq!((seen.pose_mm_deg, seen.external.is_some()), (None, true));
            assert!(bench.host.reply(&Corrections::none()).is_ok());
        }
        let causes: BTreeMap<&str, u64> = bench.host.causes().clone();
        let names = ["number-comma", "number-empty", "number-exponent", "number-none", "number-not-finite"];
        assert_eq!(causes.into_iter().collect::<Vec<_>>(), names.map(|name| (name, 1)));
        assert_eq!(bench.host.counts()["rsi-number"], 5);
    }

    #[test]
    fn bytes_that_are_no_frame_are_counted_by_cause() {
        let mut bench = Bench::running(HostOptions::default(), 0);
        let good = frame(200, 0.0, 0);
        let no_stamp = r#"<Rob Type="KUKA"><Delay D="0"/></Rob>"#;
        let bad_stamp = r#"<Rob Type="KUKA"><Delay D="0"/><IPOC>-4</IPOC></Rob>"#;
        for bytes in [&good[..100], SEN_ROS.as_bytes(), no_stamp.as_bytes(), bad_stamp.as_bytes(), b"\xff\xfe"] {
            assert_eq!(bench.take(1, bytes), None);
        }
        let causes: Vec<&str> = bench.host.causes().keys().copied().collect();
        assert_eq!(causes, ["ipoc-missing", "ipoc-not-a-number", "not-utf8", "truncated", "wrong-direction"]);
        assert_eq!(bench.host.counts()["rsi-malformed"], 5);
        // Two documents in one datagram, and the rest of a third.
        bench.events.clear();
        let datagram = [good, frame(204, 0.0, 0), frame(208, 0.0, 0)[..50].to_vec()].concat();
        let frames = bench.host.receive_documents(bench.now, split(&datagram), &mut bench.events);
        assert_eq!(frames.iter().map(|frame| frame.ipoc).collect::<Vec<_>>(), [200, 204]);
        assert_eq!(bench.said(), ["rsi-unanswered", "rsi-malformed"]);
    }
}
