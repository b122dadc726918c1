//! The ROS messages that carry sweeps and poses, according to their definitions:
//! `sensor_msgs/PointCloud2`, Livox's `CustomMsg`, `tf2_msgs/TFMessage` and `nav_msgs/Odometry`.

use raywake_core::pose::Pose;
use raywake_core::sweep::Point;

use super::wire::Wire;
use crate::source::poses::rigid;
use crate::source::returns::{Attribute, Fields, Number};

/// Maximum accepted number of fields of a cloud.
const FIELDS_MAX: u32 = 1 << 10;
/// Maximum accepted number of transforms in a message.
const TRANSFORMS_MAX: u32 = 1 << 14;

/// Message type of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum CloudForm {
    #[default]
    PointCloud2,
    /// `CustomMsg` of Livox's drivers.
    Livox,
}

/// Kinds of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageKind {
    Cloud(CloudForm),
    Transforms,
    Odometry,
}

impl MessageKind {
    /// From the name of the schema, in ROS 1 or 2.
    pub fn of(schema: &str) -> Option<MessageKind> {
        match schema {
            "sensor_msgs/msg/PointCloud2" | "sensor_msgs/PointCloud2" => {
                Some(MessageKind::Cloud(CloudForm::PointCloud2))
            }
            livox if livox.starts_with("livox_") && livox.ends_with("/CustomMsg") => {
                Some(MessageKind::Cloud(CloudForm::Livox))
            }
            "tf2_msgs/msg/TFMessage" | "tf2_msgs/TFMessage" | "tf/tfMessage" => {
                Some(MessageKind::Transforms)
            }
            "nav_msgs/msg/Odometry" | "nav_msgs/Odometry" => Some(MessageKind::Odometry),
            _ => None,
        }
    }
}

/// The pose of a frame in another one, at a time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transform {
    pub stamp_ns: i64,
    pub parent: String,
    pub child: String,
    pub parent_from_child: Pose,
}

/// The transforms of a message. Those that are not rigid are left out and counted.
pub(super) fn transforms(mut wire: Wire) -> Result<(Vec<Transform>, u64), String> {
    let count = wire.word()?;
    if count > TRANSFORMS_MAX {
        return Err(format!("{count} transforms, at most {TRANSFORMS_MAX}"));
    }
    let (mut found, mut wrong) = (Vec::new(), 0);
    for _ in 0..count {
        let (stamp_ns, parent) = wire.header()?;
        let child = wire.text()?.trim_start_matches('/');
        match pose(&mut wire)? {
            Some(parent_from_child) => found.push(Transform {
                stamp_ns,
                parent: parent.into(),
                child: child.into(),
                parent_from_child,
            }),
            None => wrong += 1,
        }
    }
    Ok((found, wrong))
}

/// The vehicle's pose; `None` if it is not a valid one.
pub(super) fn odometry(mut wire: Wire) -> Result<Option<Transform>, String> {
    let (stamp_ns, parent) = wire.header()?;
    let child = wire.text()?.trim_start_matches('/');
    let (parent, child) = (parent.into(), child.into());
    let transform = |parent_from_child| Transform { stamp_ns, parent, child, parent_from_child };
    Ok(pose(&mut wire)?.map(transform))
}

/// A translation and a quaternion, x, y, z, w; `None` if they are not a rigid transform.
fn pose(wire: &mut Wire) -> Result<Option<Pose>, String> {
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        *number = wire.double()?;
    }
    let [x, y, z, a, b, c, d] = numbers;
    Ok(rigid([x, y, z], [a, b, c, d]).ok())
}

/// The part of a cloud's message before its points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CloudHeader<'a> {
    pub stamp_ns: i64,
    pub frame: &'a str,
    /// Number of rows, and of points per row.
    pub size: [u32; 2],
}

impl CloudHeader<'_> {
    pub fn read<'a>(form: CloudForm, wire: &mut Wire<'a>) -> Result<CloudHeader<'a>, String> {
        let (stamp_ns, frame) = wire.header()?;
        let rows = match form {
            CloudForm::PointCloud2 => wire.word()?,
            CloudForm::Livox => {
                // The base of the points' times: the same as the header's.
                wire.double()?;
                1
            }
        };
        Ok(CloudHeader { stamp_ns, frame, size: [rows, wire.word()?] })
    }
}

/// Replaces `points` with those of a cloud, in its frame and with times from its stamp; returns
/// whether they have times.
pub(super) fn cloud(
    form: CloudForm,
    mut wire: Wire,
    points: &mut Vec<Point>,
) -> Result<bool, String> {
    points.clear();
    let header = CloudHeader::read(form, &mut wire)?;
    match form {
        CloudForm::PointCloud2 => point_cloud(header, wire, points),
        CloudForm::Livox => livox(header, wire, points),
    }
}

/// Numbers of a Livox point: tag and line are skipped.
const LIVOX: [(&str, Number); 5] = [
    ("offset_time", Number::Unsigned(4)),
    ("x", Number::F32),
    ("y", Number::F32),
    ("z", Number::F32),
    ("reflectivity", Number::Unsigned(1)),
];
/// Bytes of such a point.
const LIVOX_POINT: usize = 19;

fn livox(header: CloudHeader, mut wire: Wire, points: &mut Vec<Point>) -> Result<bool, String> {
    // The lidar's number, and three reserved bytes.
    (0..4).try_for_each(|_| wire.byte().map(|_| ()))?;
    let count = wire.word()? as usize;
    if count != header.size[1] as usize {
        return Err(format!("{count} points, but the header says {}", header.size[1]));
    }
    let (data, step) = wire.records(count, LIVOX_POINT)?;
    let named = LIVOX.map(|(name, number)| (name.to_owned(), number));
    let fields = Fields::find(&named)?.stamped(header.stamp_ns);
    let value = |point: usize, field: usize| {
        let attribute = Attribute { number: LIVOX[field].1, start: 4 * field, step };
        attribute.value(data, point, wire.is_big_endian())
    };
    Ok(fields.returns(count, value, points))
}

fn point_cloud(
    header: CloudHeader,
    mut wire: Wire,
    points: &mut Vec<Point>,
) -> Result<bool, String> {
    let CloudHeader { stamp_ns, size: [height, width], .. } = header;
    let (named, starts) = fields(&mut wire)?;
    let big = wire.byte()? != 0;
    let [step, row_step] = [wire.word()? as usize, wire.word()? as usize];
    let data = wire.bytes()?;
    if let Some(n) = (0..named.len()).find(|&n| starts[n] + named[n].1.size() > step) {
        return Err(format!("field `{}` ends after the {step} bytes of a point", named[n].0));
    }
    let (height, width) = (height as usize, width as usize);
    // Some drivers leave the length of a single row at zero.
    let row_step = if row_step == 0 { width * step } else { row_step };
    let before = row_step.checked_mul(height.saturating_sub(1));
    let wanted = before.and_then(|before| before.checked_add(width * step));
    if row_step < width * step || wanted.is_none_or(|wanted| wanted > data.len()) {
        let (has, of) = (data.len(), format!("{height} x {width} points of {step} bytes"));
        return Err(format!("{has} bytes in rows of {row_step} are too few for {of}"));
    }
    let fields = Fields::find(&named)?.stamped(stamp_ns);
    let value = |point: usize, field: usize| {
        let start = point / width * row_step + starts[field];
        let attribute = Attribute { number: named[field].1, start, step };
        attribute.value(data, point % width, big)
    };
    Ok(fields.returns(height * width, value, points))
}

/// Names, types and first bytes of the numbers of a point.
type NamedFields = (Vec<(String, Number)>, Vec<usize>);

fn fields(wire: &mut Wire) -> Result<NamedFields, String> {
    let count = wire.word()?;
    if count > FIELDS_MAX {
        return Err(format!("{count} fields, at most {FIELDS_MAX}"));
    }
    let (mut named, mut starts) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let (name, start, kind) = (wire.text()?, wire.word()? as usize, wire.byte()?);
        // Its count of numbers: only the first is used.
        wire.word()?;
        let number =
            number(kind).ok_or_else(|| format!("field `{name}` has unknown type {kind}"))?;
        named.push((name.to_owned(), number));
        starts.push(start);
    }
    Ok((named, starts))
}

/// How a field of this type is stored.
fn number(kind: u8) -> Option<Number> {
    Some(match kind {
        1 => Number::Signed(1),
        2 => Number::Unsigned(1),
        3 => Number::Signed(2),
        4 => Number::Unsigned(2),
        5 => Number::Signed(4),
        6 => Number::Unsigned(4),
        7 => Number::F32,
        8 => Number::F64,
        _ => return None,
    })
}
