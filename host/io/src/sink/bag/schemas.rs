//! Definitions of the ROS 2 messages that are written, as carried by MCAP files.

/// A message type: its name, and the names of the definitions it consists of, its own first.
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

/// `foxglove_msgs/SceneUpdate`.
pub(super) const SCENE: Schema = Schema {
    name: "foxglove_msgs/msg/SceneUpdate",
    parts: &[
        "foxglove_msgs/SceneUpdate",
        "foxglove_msgs/SceneEntityDeletion",
        "foxglove_msgs/SceneEntity",
        TIME,
        "builtin_interfaces/Duration",
        "foxglove_msgs/KeyValuePair",
        "foxglove_msgs/ArrowPrimitive",
        "foxglove_msgs/CubePrimitive",
        "foxglove_msgs/SpherePrimitive",
        "foxglove_msgs/CylinderPrimitive",
        "foxglove_msgs/LinePrimitive",
        "foxglove_msgs/TriangleListPrimitive",
        "foxglove_msgs/TextPrimitive",
        "foxglove_msgs/ModelPrimitive",
        "foxglove_msgs/Color",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "geometry_msgs/Vector3",
    ],
};

/// `autoware_perception_msgs/TrackedObjects`.
pub(super) const TRACKED_OBJECTS: Schema = Schema {
    name: "autoware_perception_msgs/msg/TrackedObjects",
    parts: &[
        "autoware_perception_msgs/TrackedObjects",
        "std_msgs/Header",
        TIME,
        "autoware_perception_msgs/TrackedObject",
        "unique_identifier_msgs/UUID",
        "autoware_perception_msgs/ObjectClassification",
        "autoware_perception_msgs/TrackedObjectKinematics",
        "autoware_perception_msgs/Shape",
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/AccelWithCovariance",
        "geometry_msgs/Pose",
        "geometry_msgs/Twist",
        "geometry_msgs/Accel",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "geometry_msgs/Vector3",
        "geometry_msgs/Polygon",
        "geometry_msgs/Point32",
    ],
};

const TIME: &str = "builtin_interfaces/Time";

/// Fields of every definition.
const FIELDS: [(&str, &str); 43] = [
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
    ("foxglove_msgs/Color", "float64 r; float64 g; float64 b; float64 a"),
    ("foxglove_msgs/KeyValuePair", "string key; string value"),
    (
        "foxglove_msgs/SceneUpdate",
        "foxglove_msgs/SceneEntityDeletion[] deletions; foxglove_msgs/SceneEntity[] entities",
    ),
    (
        "foxglove_msgs/SceneEntityDeletion",
        "builtin_interfaces/Time timestamp; uint8 type; string id",
    ),
    (
        "foxglove_msgs/SceneEntity",
        "builtin_interfaces/Time timestamp; string frame_id; string id; \
         builtin_interfaces/Duration lifetime; bool frame_locked; \
         foxglove_msgs/KeyValuePair[] metadata; foxglove_msgs/ArrowPrimitive[] arrows; \
         foxglove_msgs/CubePrimitive[] cubes; foxglove_msgs/SpherePrimitive[] spheres; \
         foxglove_msgs/CylinderPrimitive[] cylinders; foxglove_msgs/LinePrimitive[] lines; \
         foxglove_msgs/TriangleListPrimitive[] triangles; foxglove_msgs/TextPrimitive[] texts; \
         foxglove_msgs/ModelPrimitive[] models",
    ),
    (
        "foxglove_msgs/ArrowPrimitive",
        "geometry_msgs/Pose pose; float64 shaft_length; float64 shaft_diameter; \
         float64 head_length; float64 head_diameter; foxglove_msgs/Color color",
    ),
    (
        "foxglove_msgs/CubePrimitive",
        "geometry_msgs/Pose pose; geometry_msgs/Vector3 size; foxglove_msgs/Color color",
    ),
    (
        "foxglove_msgs/SpherePrimitive",
        "geometry_msgs/Pose pose; geometry_msgs/Vector3 size; foxglove_msgs/Color color",
    ),
    (
        "foxglove_msgs/CylinderPrimitive",
        "geometry_msgs/Pose pose; geometry_msgs/Vector3 size; float64 bottom_scale; \
         float64 top_scale; foxglove_msgs/Color color",
    ),
    (
        "foxglove_msgs/LinePrimitive",
        "uint8 type; geometry_msgs/Pose pose; float64 thickness; bool scale_invariant; \
         geometry_msgs/Point[] points; foxglove_msgs/Color color; foxglove_msgs/Color[] colors; \
         uint32[] indices",
    ),
    (
        "foxglove_msgs/TriangleListPrimitive",
        "geometry_msgs/Pose pose; geometry_msgs/Point[] points; foxglove_msgs/Color color; \
         foxglove_msgs/Color[] colors; uint32[] indices",
    ),
    (
        "foxglove_msgs/TextPrimitive",
        "geometry_msgs/Pose pose; bool billboard; float64 font_size; bool scale_invariant; \
         foxglove_msgs/Color color; string text",
    ),
    (
        "foxglove_msgs/ModelPrimitive",
        "geometry_msgs/Pose pose; geometry_msgs/Vector3 scale; foxglove_msgs/Color color; \
         bool override_color; string url; string media_type; uint8[] data",
    ),
    ("geometry_msgs/Point32", "float32 x; float32 y; float32 z"),
    ("geometry_msgs/Polygon", "geometry_msgs/Point32[] points"),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear; geometry_msgs/Vector3 angular"),
    ("geometry_msgs/Accel", "geometry_msgs/Vector3 linear; geometry_msgs/Vector3 angular"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose; float64[36] covariance"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist; float64[36] covariance"),
    ("geometry_msgs/AccelWithCovariance", "geometry_msgs/Accel accel; float64[36] covariance"),
    ("unique_identifier_msgs/UUID", "uint8[16] uuid"),
    ("autoware_perception_msgs/ObjectClassification", "uint8 label; float32 probability"),
    (
        "autoware_perception_msgs/Shape",
        "uint8 type; geometry_msgs/Polygon footprint; geometry_msgs/Vector3 dimensions",
    ),
    (
        "autoware_perception_msgs/TrackedObjectKinematics",
        "geometry_msgs/PoseWithCovariance pose_with_covariance; \
         geometry_msgs/TwistWithCovariance twist_with_covariance; \
         geometry_msgs/AccelWithCovariance acceleration_with_covariance; \
         uint8 orientation_availability; bool is_stationary",
    ),
    (
        "autoware_perception_msgs/TrackedObject",
        "unique_identifier_msgs/UUID object_id; float32 existence_probability; \
         autoware_perception_msgs/ObjectClassification[] classification; \
         autoware_perception_msgs/TrackedObjectKinematics kinematics; \
         autoware_perception_msgs/Shape shape",
    ),
    (
        "autoware_perception_msgs/TrackedObjects",
        "std_msgs/Header header; autoware_perception_msgs/TrackedObject[] objects",
    ),
];

impl Schema {
    /// The definitions one after another, one field per line.
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
