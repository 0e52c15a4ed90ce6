//! Topics of a recorded session beside those of every session, with their JSON schemas.

use crate::recording::JsonTopic;

/// Pose that the robots are told, relative.
pub const COMMANDED: &str = "/robot/pose_command";
/// Pose that the robots report, relative.
pub const MEASURED: &str = "/robot/pose_measured";
/// Reading of the sensor.
pub const SENSED: &str = "/ft/wrench";

/// Everything unusual.
pub const EVENT: JsonTopic<'static> = JsonTopic {
    topic: "/cell/event",
    name: "dockhil.Event",
    schema: r#"{"type":"object","properties":{"source":{"type":"string","description":"robot, ft, capture, network or recorder"},"class":{"type":"string"},"text":{"type":"string"}},"required":["source","class","text"]}"#,
};

/// The sensor's counters as they came.
pub const SENSOR_RAW: JsonTopic<'static> = JsonTopic {
    topic: "/ft/raw",
    name: "dockhil.SensorRaw",
    schema: r#"{"type":"object","properties":{"received_ns":{"type":"integer"},"sequence":{"type":["integer","null"]},"device_s":{"type":["number","null"]},"status":{"type":"integer"}},"required":["received_ns","sequence","device_s","status"]}"#,
};

/// A robot's frame as it came, and what was sent to it; the topic bears its name.
pub fn robot_raw(topic: &str) -> JsonTopic<'_> {
    JsonTopic {
        topic,
        name: "dockhil.RobotRaw",
        schema: r#"{"type":"object","properties":{"direction":{"enum":["from-robot","to-robot"]},"received_ns":{"type":"integer"},"ipoc":{"type":["integer","null"]},"delay_d":{"type":["integer","null"]},"pose_mm_deg":{"type":["array","null"],"items":{"type":"number"}},"external":{"type":["array","null"],"items":{"type":"number"}},"type":{"type":"string","description":"of a reply"},"elements":{"type":"object","description":"all other elements of the document, as text, by their names in the Ethernet configuration","additionalProperties":{"type":"string"}}},"required":["direction","received_ns","ipoc","elements"]}"#,
    }
}
