//! `tracklet_labels.xml`: the boxes that a labeller would see, as KITTI's development kit stores
//! them (boost serialisation).
//!
//! An object has poses from the first to the last frame on which the camera sees a return of it; on
//! frames in between without one, its pose is marked as unset and fully occluded. Boxes are
//! upright, as KITTI's are: (tx, ty, tz) lies half the height below the centre, and rz is the
//! heading.

use super::calibration::Camera;
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_sim::{Class, ObjectState, SimSweep};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Box of one frame.
struct ObjectRow {
    /// Bottom centre (m) and heading (rad) in the vehicle frame.
    at: DVec3,
    yaw: f64,
    /// Whether the camera sees a return of the object.
    seen: bool,
    /// Number of corners in the image.
    corners: usize,
}

/// One labelled object.
struct Tracklet {
    class: Class,
    size: [f64; 3],
    first_frame: usize,
    rows: Vec<ObjectRow>,
}

/// The labels of a drive, frame by frame.
pub struct Tracklets {
    camera: Camera,
    by_id: BTreeMap<u32, Tracklet>,
}

impl Tracklets {
    /// No labels yet.
    pub fn new(camera: Camera) -> Tracklets {
        Tracklets { camera, by_id: BTreeMap::new() }
    }

    /// Adds a frame; frames must come in order with none left out. `objects` are those at its
    /// stamp.
    pub fn add(&mut self, frame: usize, sweep: &SimSweep, objects: &[ObjectState]) {
        let in_view =
            |position: [f32; 3]| self.camera.sees(DVec3::from_array(position.map(f64::from)));
        let returns = sweep.points.iter().zip(&sweep.truth);
        let seen: BTreeSet<u32> = returns
            .filter(|(p, t)| t.object != 0 && in_view(p.position))
            .map(|(_, t)| t.object)
            .collect();
        let vehicle_from_world = sweep.world_from_vehicle.inverse();
        for object in objects {
            let seen = seen.contains(&object.id);
            if !seen && !self.by_id.contains_key(&object.id) {
                continue;
            }
            let row = self.row(vehicle_from_world * object.world_from_object, object.size, seen);
            let (class, size) = (object.class, object.size);
            let begin = || Tracklet { class, size, first_frame: frame, rows: Vec::new() };
            self.by_id.entry(object.id).or_insert_with(begin).rows.push(row);
        }
    }

    fn row(&self, centre: Pose, size: [f64; 3], seen: bool) -> ObjectRow {
        let half = DVec3::from_array(size) * 0.5;
        let corner = |n: usize| {
            let sign = |bit: usize| if n & bit == 0 { -1.0 } else { 1.0 };
            centre.transform(half * DVec3::new(sign(1), sign(2), sign(4)))
        };
        ObjectRow {
            at: centre.translation - DVec3::new(0.0, 0.0, half.z),
            yaw: centre.yaw_rad(),
            seen,
            corners: (0..8).filter(|&n| self.camera.sees(corner(n))).count(),
        }
    }

    /// The content of the file.
    pub fn xml(mut self) -> String {
        for tracklet in self.by_id.values_mut() {
            let last = tracklet.rows.iter().rposition(|row| row.seen).unwrap_or(0);
            tracklet.rows.truncate(last + 1);
        }
        let mut text = String::from(
            "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\" ?>\n\
             <!DOCTYPE boost_serialization>\n\
             <boost_serialization signature=\"serialization::archive\" version=\"9\">\n\
             <tracklets class_id=\"0\" tracking_level=\"0\" version=\"0\">\n",
        );
        let _ = writeln!(text, "\t<count>{}</count>", self.by_id.len());
        text += "\t<item_version>1</item_version>\n";
        let (mut first, mut first_pose) = (true, true);
        for tracklet in self.by_id.values() {
            tracklet.write(&mut text, &mut first, &mut first_pose);
        }
        text + "</tracklets>\n</boost_serialization>\n"
    }
}

/// The attributes that boost gives only to the first element of a class.
fn attributes(first: &mut bool, class_id: usize, version: usize) -> String {
    match std::mem::replace(first, false) {
        true => format!(" class_id=\"{class_id}\" tracking_level=\"0\" version=\"{version}\""),
        false => String::new(),
    }
}

impl Tracklet {
    fn write(&self, text: &mut String, first: &mut bool, first_pose: &mut bool) {
        let (item, poses) = match *first {
            true => (attributes(first, 1, 1), attributes(&mut true, 2, 0)),
            false => Default::default(),
        };
        let ([l, w, h], kind) = (self.size, object_type(self.class));
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\t<item{item}>\n\t\t<objectType>{kind}</objectType>\n\t\t<h>{h}</h>\n\t\t<w>{w}</w>\n\
             \t\t<l>{l}</l>\n\t\t<first_frame>{}</first_frame>\n\t\t<poses{poses}>\n\
             \t\t\t<count>{}</count>\n\t\t\t<item_version>2</item_version>\n",
            self.first_frame,
            self.rows.len()
        );
        for row in &self.rows {
            let _ = writeln!(text, "\t\t\t<item{}>", attributes(first_pose, 3, 2));
            for (name, value) in row.fields() {
                let _ = writeln!(text, "\t\t\t\t<{name}>{value}</{name}>");
            }
            *text += "\t\t\t</item>\n";
        }
        *text += "\t\t</poses>\n\t\t<finished>1</finished>\n\t</item>\n";
    }
}

impl ObjectRow {
    /// Elements of a pose. State 0: unset, 2: labelled; occlusion 0: visible (or partly, which is
    /// not distinguished), 2: fully; truncation 0: in the image, 1: truncated, 2: outside.
    fn fields(&self) -> [(&'static str, f64); 15] {
        let truncation = match self.corners {
            8 => 0.0,
            0 if !self.seen => 2.0,
            _ => 1.0,
        };
        [
            ("tx", self.at.x),
            ("ty", self.at.y),
            ("tz", self.at.z),
            ("rx", 0.0),
            ("ry", 0.0),
            ("rz", self.yaw),
            ("state", if self.seen { 2.0 } else { 0.0 }),
            ("occlusion", if self.seen { 0.0 } else { 2.0 }),
            ("occlusion_kf", 0.0),
            ("truncation", truncation),
            ("amt_occlusion", 0.0),
            ("amt_occlusion_kf", -1.0),
            ("amt_border_l", 0.0),
            ("amt_border_r", 0.0),
            ("amt_border_kf", -1.0),
        ]
    }
}

/// KITTI's name of a class; "Misc" if it has none.
fn object_type(class: Class) -> &'static str {
    match class {
        Class::Car => "Car",
        Class::Van => "Van",
        Class::Truck => "Truck",
        Class::Tram => "Tram",
        Class::Cyclist => "Cyclist",
        Class::Pedestrian => "Pedestrian",
        _ => "Misc",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::Twist;
    use raywake_core::sweep::Point;
    use raywake_sim::{Drive, Options, Truth};

    #[test]
    fn gaps_are_unset_and_ends_cut() {
        let drive = Drive::new(1, Options { sweeps: 0, density: 0.0, ..Options::default() });
        let mut tracklets = Tracklets::new(Camera::new(&drive.rig()));
        let object = ObjectState {
            id: 7,
            class: Class::Bus,
            world_from_object: Pose::planar(15.0, 2.0, -0.2, 0.0),
            size: [12.0, 2.5, 3.0],
            velocity_world: DVec3::ZERO,
        };
        // Seen in front, behind the camera, of another object, and not at all.
        for (frame, (x, id)) in
            [(9.0, 0), (9.0, 7), (-9.0, 7), (9.0, 7), (9.0, 3)].iter().enumerate()
        {
            let sweep = SimSweep {
                stamp_s: 0.1 * frame as f64,
                points: vec![Point { position: [*x, 1.0, -0.5], ..Point::default() }],
                truth: vec![Truth { object: *id, ..Truth::default() }],
                world_from_vehicle: Pose::IDENTITY,
                twist: Twist::ZERO,
            };
            tracklets.add(frame, &sweep, &[object]);
        }
        let xml = tracklets.xml();
        let count = |text: &str| xml.matches(text).count();
        assert_eq!((count("<objectType>Misc<"), count("<first_frame>1<")), (1, 1));
        assert_eq!((count("<count>1<"), count("<count>3<"), count("<tx>15<")), (1, 1, 3));
        assert_eq!((count("<state>2<"), count("<state>0<"), count("<occlusion>2<")), (2, 1, 1));
        assert_eq!((count("<tz>-1.7<"), count("<rz>0<")), (3, 3));
    }

    #[test]
    fn an_empty_drive() {
        let drive = Drive::new(1, Options { sweeps: 0, density: 0.0, ..Options::default() });
        let xml = Tracklets::new(Camera::new(&drive.rig())).xml();
        assert!(xml.contains("<count>0</count>") && xml.ends_with("</boost_serialization>\n"));
    }
}
