//! Taking part between robot and controller: every packet is sent on as it came, first of all; then it is decoded.
//!
//! ```text
//! robot → [robot side │ proxy] → PC at `listen` of the cell         sensor → [proxy │ sensor side] → PC
//! ```
//! The robot is told the proxy's address, the PC stays where it is. The PC is told the sensor side as its sensor; without it the
//! sensor is not recorded. Latency is counted from reading a packet to having sent it on; what the kernel needs to wake the
//! program comes on top and is not seen here. Over TCP each connection of a robot has one to the PC, and they end together. Not
//! covered: sensors over TCP.

use super::devices::{Devices, Way};
use super::latency::Latency;
use super::network::{note, take};
use super::session::Recorder;
use crate::cell::link::{Calling, Listening, failed, towards};
use crate::cell::{Cell, RobotConfig};
use crate::error::Error;
use drivers::ft;
use drivers::net::{Arrival, Clock, Endpoint, Lock, wait};
use drivers::rsi::Transport;
use std::io::Write;
use std::net::SocketAddr;
use std::os::fd::AsFd;
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(5);
/// How long the PC may take to accept a connection.
const CONNECT: Duration = Duration::from_secs(1);

/// One robot's two ways.
#[derive(Debug)]
struct Between {
    name: String,
    near: Listening,
    far: Calling,
}

impl Between {
    /// The robot has connected anew: so does the proxy. Where nobody listens, the robot finds the way closed, as it would without
    /// a proxy.
    fn connect(&mut self, clock: Clock<'_>, devices: &mut Devices) {
        if let Err(error) = self.far.connect(CONNECT) {
            let text = format!("the robot has connected, and the PC's program does not listen: {error}");
            devices.event(clock(), &self.name, "net-unreachable", text);
            self.near.hang_up();
        }
    }
}

/// Whether a connection was closed: then its other half is closed too.
fn is_end(arrival: &Arrival) -> bool {
    matches!(arrival, Arrival::Closed { .. })
}

/// The sensor's two ways: towards the PC, towards the sensor.
#[derive(Debug)]
struct SensorBetween {
    near: Endpoint,
    far: Endpoint,
}

/// A proxy and what it adds.
#[derive(Debug)]
pub struct Proxy {
    robots: Vec<Between>,
    sensor: Option<SensorBetween>,
    /// From robots to the PC.
    pub to_pc: Latency,
    /// From the PC to robots.
    pub to_robot: Latency,
    /// From the sensor to the PC.
    pub from_sensor: Latency,
}

impl Proxy {
    /// Binds all ports: for each robot in its order where it is to send from now on; and where the PC finds the sensor.
    ///
    /// # Errors
    /// When a port is in use, or their number is not that of the robots.
    pub fn open(
        cell: &Cell,
        devices: &Devices,
        robot_sides: &[SocketAddr],
        sensor_side: Option<SocketAddr>,
    ) -> Result<Self, Error> {
        if robot_sides.len() != cell.config.robots.len() {
            let what = format!("{} addresses for {} robots", robot_sides.len(), cell.config.robots.len());
            let help = "give --robot-side once for each [[robot]] of the cell, in their order";
            return Err(Error::new(what).place("--robot-side").help(help));
        }
        let itself = |argument: &str, side: SocketAddr, whose: &str| {
            let what = format!("{side} is {whose}: the proxy would send to itself");
            Err(Error::new(what).place(argument).help("give a free port of this computer"))
        };
        for (robot, side) in cell.config.robots.iter().zip(robot_sides) {
            if meets(*side, robot.listen) {
                return itself("--robot-side", *side, &format!("where the PC of {} listens", robot.name));
            }
        }
        if let Some(side) = sensor_side.filter(|side| meets(*side, cell.config.sensor.address)) {
            return itself("--sensor-side", side, "where the sensor is");
        }
        if sensor_side.is_some() && cell.sensor()?.transport() != ft::Transport::Udp {
            let help = "record its traffic with --as tap, or leave --sensor-side out";
            return Err(Error::new("the sensor is asked over TCP, and a proxy passes on datagrams alone")
                .place("--sensor-side")
                .help(help));
        }
        let pairs = cell.config.robots.iter().zip(robot_sides).enumerate();
        let robots = pairs.map(|(nth, (robot, side))| between(robot, *side, devices.config(nth).protocol));
        let robots = robots.collect::<Result<_, _>>()?;
        let sensor = sensor_side.map(|side| {
            let near = Endpoint::bind(side, Lock::Latest).map_err(failed)?;
            let address = cell.config.sensor.address;
            let far = Endpoint::bind(towards(address), Lock::Only(address)).map_err(failed)?;
            Ok::<_, Error>(SensorBetween { near, far })
        });
        let none = Latency::default;
        let sensor = sensor.transpose()?;
        Ok(Proxy { robots, sensor, to_pc: none(), to_robot: none(), from_sensor: none() })
    }

    /// Where the robots are expected.
    pub fn addresses(&self) -> Vec<SocketAddr> {
        self.robots.iter().map(|robot| robot.near.local()).collect()
    }

    /// Where the PC finds the sensor.
    pub fn sensor_address(&self) -> Option<SocketAddr> {
        self.sensor.as_ref().map(|sensor| sensor.near.local())
    }

    /// Passes on and records until that is true, or a robot turns out not to live in real time.
    ///
    /// # Errors
    /// When a socket fails, or the session does not take what came.
    pub fn run<W: Write>(
        &mut self,
        devices: &mut Devices,
        recorder: &mut Recorder<W>,
        clock: Clock<'_>,
        until: &dyn Fn() -> bool,
    ) -> Result<(), Error> {
        while !until() && !recorder.is_too_fast() {
            let mut sockets: Vec<&dyn AsFd> = Vec::new();
            for robot in &self.robots {
                sockets.push(robot.near.socket());
                sockets.extend(robot.far.socket());
            }
            if let Some(sensor) = &self.sensor {
                sockets.extend([&sensor.near as &dyn AsFd, &sensor.far]);
            }
            wait(&sockets, WAIT).map_err(|error| Error::new(format!("waiting for the network failed: {error}")))?;
            // A reading that was sent before a frame is there when the frame is, and is passed on before it.
            let frames = (0..self.robots.len()).map(|robot| self.heard(robot, devices, clock));
            let frames: Vec<_> = frames.collect::<Result<_, _>>()?;
            self.sensor(devices, clock)?;
            for (robot, arrivals) in frames.into_iter().enumerate() {
                self.forth(robot, &arrivals, devices, clock)?;
                self.back(robot, devices, clock)?;
            }
            let now = clock();
            // A proxy asks the sensor nothing.
            devices.tick(now);
            devices.write(recorder)?;
            recorder.tick(now)?;
        }
        for robot in &self.robots {
            recorder.count(&robot.name, "net-stranger", robot.near.strangers());
        }
        if let Some(sensor) = &self.sensor {
            recorder.count("ft", "net-stranger", sensor.far.counts().strangers);
        }
        Ok(())
    }

    /// What has come from the robot.
    fn heard(&mut self, nth: usize, devices: &mut Devices, clock: Clock<'_>) -> Result<Vec<Arrival>, Error> {
        let robot = &mut self.robots[nth];
        let mut arrivals = Vec::new();
        if robot.near.receive(clock, &mut arrivals)? {
            devices.connected(nth);
            robot.connect(clock, devices);
        }
        Ok(arrivals)
    }

    /// From the robot to the PC.
    fn forth(
        &mut self,
        nth: usize,
        arrivals: &[Arrival],
        devices: &mut Devices,
        clock: Clock<'_>,
    ) -> Result<(), Error> {
        let robot = &mut self.robots[nth];
        let mut said = Vec::new();
        for arrival in arrivals {
            if let Arrival::Bytes { at, bytes, .. } = arrival {
                robot.far.send(clock, bytes, &mut said)?;
                self.to_pc.add(*at, clock());
            }
        }
        if arrivals.iter().any(is_end) {
            robot.far.hang_up();
        }
        for arrival in arrivals {
            take(nth, arrival, robot.near.is_stream(), devices);
        }
        arrivals.iter().chain(&said).for_each(|arrival| note(&robot.name, arrival, devices));
        Ok(())
    }

    /// From the PC to the robot.
    fn back(&mut self, nth: usize, devices: &mut Devices, clock: Clock<'_>) -> Result<(), Error> {
        let robot = &mut self.robots[nth];
        let (mut arrivals, mut said) = (Vec::new(), Vec::new());
        robot.far.receive(clock, &mut arrivals)?;
        for arrival in &arrivals {
            if let Arrival::Bytes { at, bytes, .. } = arrival {
                robot.near.send(clock, bytes, &mut said)?;
                self.to_robot.add(*at, clock());
            }
        }
        if arrivals.iter().any(is_end) {
            robot.near.hang_up();
        }
        for arrival in &arrivals {
            match arrival {
                Arrival::Bytes { at, bytes, .. } if robot.near.is_stream() => {
                    devices.stream(nth, Way::ToRobot, *at, bytes, false);
                }
                Arrival::Bytes { at, bytes, .. } => {
                    devices.datagram(nth, Way::ToRobot, *at, bytes);
                }
                _ => {}
            }
        }
        arrivals.iter().chain(&said).for_each(|arrival| note(&robot.name, arrival, devices));
        Ok(())
    }

    fn sensor(&mut self, devices: &mut Devices, clock: Clock<'_>) -> Result<(), Error> {
        let Some(SensorBetween { near, far }) = &mut self.sensor else { return Ok(()) };
        let (mut asked, mut answered, mut said) = (Vec::new(), Vec::new(), Vec::new());
        near.receive(clock, &mut |_| true, &mut asked).map_err(failed)?;
        for arrival in &asked {
            if let Arrival::Bytes { at, bytes, .. } = arrival {
                far.send(clock, bytes, &mut said).map_err(failed)?;
                devices.asked(*at, bytes);
            }
        }
        far.receive(clock, &mut |_| true, &mut answered).map_err(failed)?;
        for arrival in &answered {
            let Arrival::Bytes { at, bytes, .. } = arrival else { continue };
            if near.peer().is_some() {
                near.send(clock, bytes, &mut said).map_err(failed)?;
                self.from_sensor.add(*at, clock());
            }
            devices.sensed(*at, bytes);
        }
        asked.iter().chain(&answered).chain(&said).for_each(|arrival| note("ft", arrival, devices));
        Ok(())
    }
}

/// Whether a socket that is bound to the one gets what is sent to the other.
fn meets(side: SocketAddr, other: SocketAddr) -> bool {
    let is_any = side.ip().is_unspecified() || other.ip().is_unspecified();
    side.port() != 0 && side.port() == other.port() && (is_any || side.ip() == other.ip())
}

fn between(robot: &RobotConfig, side: SocketAddr, transport: Transport) -> Result<Between, Error> {
    let far = Calling::to(robot.listen, transport)?;
    let near = Listening::bind(side, transport).map_err(|error| error.place(format!("robot {}", robot.name)))?;
    Ok(Between { name: robot.name.clone(), near, far })
}
