//! Definitions of the messages of ROS 2 that are written, as MCAP files carry them.

/// A kind of message: its name, and the names of the definitions that make it, its own first.
pub(super) struct Schema {
    pub name: &'static str,
    parts: &'static [&'static str],
}

/// `sensor_msgs/PointCloud2`.
pub(super) const POINT_CLOUD: Schema = Schema {
    name: "sensor_msgs/msg/PointCloud2",
    parts: &["sensor_msgs/PointCloud2", "std_msgs/Header", TIME, "sensor_msgs/PointField"],
};

/// `tf2_msgs/TFMessage`.
pub(super) const TRANSFORMS: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    parts: &[
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped",
        "std_msgs/Header",
        TIME,
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3",
        "geometry_msgs/Quaternion",
    ],
};

/// `visualization_msgs/Marker`.
pub(super) const MARKER: Schema = Schema {
    name: "visualization_msgs/msg/Marker",
    parts: &[
        "visualization_msgs/Marker",
        "std_msgs/Header",
        TIME,
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "geometry_msgs/Vector3",
        "std_msgs/ColorRGBA",
        "builtin_interfaces/Duration",
        "sensor_msgs/CompressedImage",
        "visualization_msgs/UVCoordinate",
        "visualization_msgs/MeshFile",
    ],
};

const TIME: &str = "builtin_interfaces/Time";

/// Fields of every definition.
const FIELDS: [(&str, &str); 17] = [
    (TIME, "int32 sec; uint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec; uint32 nanosec"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp; string frame_id"),
    ("std_msgs/ColorRGBA", "float32 r; float32 g; float32 b; float32 a"),
    ("geometry_msgs/Point", "float64 x; float64 y; float64 z"),
    ("geometry_msgs/Vector3", "float64 x; float64 y; float64 z"),
    ("geometry_msgs/Quaternion", "float64 x; float64 y; float64 z; float64 w"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position; geometry_msgs/Quaternion orientation"),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation; geometry_msgs/Quaternion rotation",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header; string child_frame_id; geometry_msgs/Transform transform",
    ),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms"),
    ("sensor_msgs/PointField", "string name; uint32 offset; uint8 datatype; uint32 count"),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header; uint32 height; uint32 width; sensor_msgs/PointField[] fields; \
         bool is_bigendian; uint32 point_step; uint32 row_step; uint8[] data; bool is_dense",
    ),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header; string format; uint8[] data"),
    ("visualization_msgs/UVCoordinate", "float32 u; float32 v"),
    ("visualization_msgs/MeshFile", "string filename; uint8[] data"),
    (
        "visualization_msgs/Marker",
        "std_msgs/Header header; string ns; int32 id; int32 type; int32 action; \
         geometry_msgs/Pose pose; geometry_msgs/Vector3 scale; std_msgs/ColorRGBA color; \
         builtin_interfaces/Duration lifetime; bool frame_locked; geometry_msgs/Point[] points; \
         std_msgs/ColorRGBA[] colors; string texture_resource; \
         sensor_msgs/CompressedImage texture; visualization_msgs/UVCoordinate[] uv_coordinates; \
         string text; string mesh_resource; visualization_msgs/MeshFile mesh_file; \
         bool mesh_use_embedded_materials",
    ),
];

impl Schema {
    /// The definitions one after the other, a field a line.
    pub fn text(&self) -> String {
        let fields = |part: &str| {
            let found = FIELDS.iter().find(|(name, _)| *name == part);
            found.map_or(String::new(), |(_, fields)| fields.replace("; ", "\n"))
        };
        let head = |part: &str| format!("\n{}\nMSG: {part}\n", "=".repeat(80));
        let (own, others) = self.parts.split_first().expect("a message has a definition");
        others.iter().fold(fields(own), |text, part| text + &head(part) + &fields(part))
    }
}
