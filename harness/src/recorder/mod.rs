//! Records a real cell: robots, sensor, clocks and everything unusual, into a session that `compare` and `diagnose` read.
//!
//! # What may move, and how to be sure that nothing does
//!
//! | way of taking part | what goes to the robot | what may move |
//! |---|---|---|
//! | `tap` | nothing: packets are copied from a capture | nothing through this program |
//! | `proxy` | what the PC's program sends, byte by byte; no document is made or changed | what the PC's program moves |
//! | `peer` | one reply to each frame, with zero in every correction | nothing, if corrections are absolute and started at zero, or relative |
//!
//! To be sure before a robot is involved:
//! 1. Record with `tap` first. It binds no port. A mirror port of the switch, or a capture on the PC, is enough.
//! 2. For `peer`, use an Ethernet configuration whose RECEIVE is connected to no correction in the object graph, or whose ONLYSEND
//!    is TRUE. Then no reply can move anything, whatever it holds.
//! 3. With corrections connected, `peer` refuses a configuration in which a lost packet moves the robot: absolute with HOLDON 0, relative
//!    with HOLDON 1. An absolute zero means "where RSI was started": if another program has corrected before, in the same
//!    RSI session, zero is a jump. Start RSI anew.
//! 4. Keep POSCORR and POSCORRMON at the few millimetres that they have by default, run in T1, a hand at the enabling switch.
//! 5. The end of a recording ends the replies. The controller counts late packets and stops RSI (`RSITimeout`). That is a stop,
//!    not a motion.
//!
//! 6. Corrections of axes (`AK.A1` … `AK.A6`, as the ROS drivers have them) are answered with zero too. Zero is no motion only if the
//!    RSI context leads them to an AXISCORR object, which adds them to the programmed axes. A context that takes them as joint
//!    angles, or adds something to them, moves to that: look into it, or use ONLYSEND. The same holds for `EK` and AXISCORREXT,
//!    and for every other number of RECEIVE.
//!
//! A sensor is asked to stream and to stop; its bias is set only where that was asked for, before the recording begins. What others
//! ask it for is recorded by `tap` and `proxy`: `ft-start`, `ft-stop`, `ft-latch-reset`, `ft-bias-set`, `ft-bias-cleared`. A bias over
//! HTTP is not seen.
//!
//! # How robots are reached
//!
//! Over UDP or TCP, as the Ethernet configuration of each says. Over TCP this program listens; a robot that closes its connection is an
//! event (`net-closed`), may connect again, and the recording goes on until its end; a second client is closed at once
//! (`net-stranger`).
//!
//! # What is written
//!
//! | topic | encoding | content |
//! |---|---|---|
//! | `/robot/pose_command`, `/robot/pose_measured` | PoseStamped | probe tip in the nozzle frame, at the times of the robot with the probe |
//! | `/ft/wrench` | WrenchStamped | reading of the sensor in its own axes |
//! | `/rsi/NAME` | JSON | frames and replies as they came: IPOC, Delay D, pose in mm and deg, external axes, and all other elements as text |
//! | `/ft/raw` | JSON | counters and status as they came |
//! | `/cell/event` | JSON | everything unusual, and what the sensor was asked for: source, class, text |
//!
//! `log_time` is the host's receipt; `header.stamp` and `publish_time` are reconstructed from the device's counter and the lower
//! envelope of its offsets ([`crate::clocks`]). Metadata: `session` (what the operator believes, at the beginning), `clocks` and
//! `counts` (at the end). A dead time of the cell stays in the data.
//!
//! A robot whose clock is far from the host's does not live in real time, as a virtual cell in virtual time: what it does cannot be
//! put beside what the sensor does. One that is too fast ends the recording with an error; one that is too slow is told at the end,
//! and in the metadata `clock_rates`.
//!
//! Not covered: times that the network card stamps; sensors on a serial port without a box that makes a stream of it; a rail that
//! is commanded through RSI.

mod clock;
mod devices;
mod heard;
mod latency;
mod network;
mod pairing;
mod peer;
mod proxy;
mod raw;
mod robot;
mod session;
mod start;
mod tap;
mod topics;

pub use clock::Lines;
pub use devices::{Devices, Way};
pub use heard::Heard;
pub use latency::{Latency, Spread};
pub use peer::Peer;
pub use proxy::Proxy;
pub use session::{AllLines, Recorder, Summary};
pub use start::{remarks, sensor_transport, session_record};
pub use tap::{Back, Matched, Tapped, clocks, tap};
pub use topics::{COMMANDED, EVENT, MEASURED, SENSED, SENSOR_RAW, robot_raw};
