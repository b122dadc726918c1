//! Argoverse 2's categories, and the classes into which the scene-flow metrics group them.

use crate::labels::Kind;

/// Names of the labelled categories; their numbers in flow files count from 0.
const NAMES: [&str; 30] = [
    "ANIMAL",
    "ARTICULATED_BUS",
    "BICYCLE",
    "BICYCLIST",
    "BOLLARD",
    "BOX_TRUCK",
    "BUS",
    "CONSTRUCTION_BARREL",
    "CONSTRUCTION_CONE",
    "DOG",
    "LARGE_VEHICLE",
    "MESSAGE_BOARD_TRAILER",
    "MOBILE_PEDESTRIAN_CROSSING_SIGN",
    "MOTORCYCLE",
    "MOTORCYCLIST",
    "OFFICIAL_SIGNALER",
    "PEDESTRIAN",
    "RAILED_VEHICLE",
    "REGULAR_VEHICLE",
    "SCHOOL_BUS",
    "SIGN",
    "STOP_SIGN",
    "STROLLER",
    "TRAFFIC_LIGHT_TRAILER",
    "TRUCK",
    "TRUCK_CAB",
    "VEHICULAR_TRAILER",
    "WHEELCHAIR",
    "WHEELED_DEVICE",
    "WHEELED_RIDER",
];

/// What a return belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Category(u8);

impl Category {
    /// Outside all labelled boxes.
    pub const BACKGROUND: Category = Category(0);

    /// Number of categories, including the background.
    pub const COUNT: usize = NAMES.len() + 1;

    /// All of them, the background first.
    pub fn all() -> impl Iterator<Item = Category> {
        (0..Category::COUNT as u8).map(Category)
    }

    /// The category of a number in `classes_0`: -1 is the background, 0 to 29 are labelled.
    pub fn from_number(number: i64) -> Option<Category> {
        (-1..NAMES.len() as i64).contains(&number).then(|| Category((number + 1) as u8))
    }

    /// The category with this name.
    pub fn from_name(name: &str) -> Option<Category> {
        Category::all().find(|c| c.name() == name)
    }

    /// The category closest to a kind of object of any data set; `None` for [`Kind::Other`], which
    /// the metrics would have to ignore.
    pub fn of_kind(kind: Kind) -> Option<Category> {
        Category::from_name(match kind {
            Kind::Car | Kind::Van => "REGULAR_VEHICLE",
            Kind::Truck => "TRUCK",
            Kind::Bus => "BUS",
            Kind::Tram => "RAILED_VEHICLE",
            Kind::Motorcycle => "MOTORCYCLE",
            Kind::Cyclist => "BICYCLIST",
            Kind::Pedestrian => "PEDESTRIAN",
            Kind::Other => return None,
        })
    }

    /// Argoverse's name for it.
    pub fn name(self) -> &'static str {
        match self.0 {
            0 => "BACKGROUND",
            labelled => NAMES[labelled as usize - 1],
        }
    }

    /// Place in tables of [`Category::COUNT`] rows.
    pub fn index(self) -> usize {
        self.0.into()
    }

    /// The class it is graded in; `None` for animals and road furniture, which are ignored.
    pub fn class(self) -> Option<Class> {
        Some(match self.name() {
            "BACKGROUND" => Class::Background,
            "REGULAR_VEHICLE" => Class::Car,
            "PEDESTRIAN" | "STROLLER" | "WHEELCHAIR" | "OFFICIAL_SIGNALER" => Class::Pedestrian,
            "BICYCLE" | "BICYCLIST" | "MOTORCYCLE" | "MOTORCYCLIST" | "WHEELED_DEVICE"
            | "WHEELED_RIDER" => Class::WheeledVru,
            "BOX_TRUCK" | "LARGE_VEHICLE" | "RAILED_VEHICLE" | "TRUCK" | "TRUCK_CAB"
            | "VEHICULAR_TRAILER" | "ARTICULATED_BUS" | "BUS" | "SCHOOL_BUS" => {
                Class::OtherVehicles
            }
            _ => return None,
        })
    }
}

/// Classes of the bucket-normalised error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Everything without a label.
    Background,
    /// Cars and objects of their size.
    Car,
    /// Lorries, buses, trailers, trams.
    OtherVehicles,
    /// People on foot, in wheelchairs, with strollers.
    Pedestrian,
    /// Vulnerable road users on wheels, and their vehicles.
    WheeledVru,
}

impl Class {
    /// All of them, in the order of the grader's tables.
    pub const ALL: [Class; 5] =
        [Class::Background, Class::Car, Class::OtherVehicles, Class::Pedestrian, Class::WheeledVru];

    /// The grader's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Class::Background => "BACKGROUND",
            Class::Car => "CAR",
            Class::OtherVehicles => "OTHER_VEHICLES",
            Class::Pedestrian => "PEDESTRIAN",
            Class::WheeledVru => "WHEELED_VRU",
        }
    }
}
