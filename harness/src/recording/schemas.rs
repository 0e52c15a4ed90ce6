//! The texts of the schemas that we write: `ros2msg`, each dependency after a line of 80 equals signs.

/// A type and its dependencies, in the order of their first use.
pub(super) fn text(fields: &str, dependencies: &[&str]) -> String {
    let mut text = fields.to_owned();
    for name in dependencies {
        text.push_str(&"=".repeat(80));
        text.push_str("\nMSG: ");
        text.push_str(name);
        text.push('\n');
        text.push_str(definition(name));
    }
    text
}

fn definition(name: &str) -> &'static str {
    match name {
        "std_msgs/Header" => "builtin_interfaces/Time stamp\nstring frame_id\n",
        "builtin_interfaces/Time" => "int32 sec\nuint32 nanosec\n",
        "geometry_msgs/Pose" => "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
        "geometry_msgs/Quaternion" => "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
        "geometry_msgs/Wrench" => "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
        "geometry_msgs/Twist" => "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
        // Point and Vector3 have the same three fields.
        _ => "float64 x\nfloat64 y\nfloat64 z\n",
    }
}

const HEADER: [&str; 2] = ["std_msgs/Header", "builtin_interfaces/Time"];

pub(super) fn pose() -> String {
    let own = ["geometry_msgs/Pose", "geometry_msgs/Point", "geometry_msgs/Quaternion"];
    text("std_msgs/Header header\ngeometry_msgs/Pose pose\n", &[&HEADER[..], &own].concat())
}

pub(super) fn wrench() -> String {
    let own = ["geometry_msgs/Wrench", "geometry_msgs/Vector3"];
    text("std_msgs/Header header\ngeometry_msgs/Wrench wrench\n", &[&HEADER[..], &own].concat())
}

pub(super) fn twist() -> String {
    let own = ["geometry_msgs/Twist", "geometry_msgs/Vector3"];
    text("std_msgs/Header header\ngeometry_msgs/Twist twist\n", &[&HEADER[..], &own].concat())
}
