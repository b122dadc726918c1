//! Names of classes in the data sets.

use super::Kind;

/// The kind of a class of KITTI, Argoverse 2, SemanticKITTI or the simulator, ignoring case; `None`
/// for a name that none of them has.
///
/// Bicycles, wheelchairs, animals and signs are [`Kind::Other`]: known, but without a kind of their
/// own.
pub fn kind(class: &str) -> Option<Kind> {
    let name = class.to_ascii_lowercase();
    Some(match name.strip_prefix("moving-").unwrap_or(&name) {
        "car" | "regular_vehicle" => Kind::Car,
        "van" => Kind::Van,
        "truck" | "box_truck" | "large_vehicle" | "truck_cab" => Kind::Truck,
        "bus" | "school_bus" | "articulated_bus" => Kind::Bus,
        "tram" | "railed_vehicle" | "on-rails" => Kind::Tram,
        "motorcycle" | "motorcyclist" => Kind::Motorcycle,
        "cyclist" | "bicyclist" => Kind::Cyclist,
        "pedestrian" | "person" | "person (sitting)" | "person_sitting" | "official_signaler" => {
            Kind::Pedestrian
        }
        name if OTHER.contains(&name) => Kind::Other,
        _ => return None,
    })
}

/// Known classes without a kind of their own.
const OTHER: [&str; 20] = [
    "animal",
    "bicycle",
    "bollard",
    "construction_barrel",
    "construction_cone",
    "dog",
    "message_board_trailer",
    "misc",
    "mobile_pedestrian_crossing_sign",
    "other-vehicle",
    "sign",
    "stop_sign",
    "stroller",
    "traffic_light_trailer",
    "traffic_sign",
    "vehicular_trailer",
    "wheelchair",
    "wheeled_device",
    "wheeled_rider",
    "other",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_data_sets() {
        for (name, expected) in [
            ("Car", Kind::Car),
            ("Person (sitting)", Kind::Pedestrian),
            ("Person_sitting", Kind::Pedestrian),
            ("Misc", Kind::Other),
            ("REGULAR_VEHICLE", Kind::Car),
            ("BICYCLIST", Kind::Cyclist),
            ("BICYCLE", Kind::Other),
            ("ARTICULATED_BUS", Kind::Bus),
            ("moving-on-rails", Kind::Tram),
            ("moving-person", Kind::Pedestrian),
        ] {
            assert_eq!(kind(name), Some(expected), "{name}");
        }
        assert_eq!((kind("Zeppelin"), kind(""), kind("moving-")), (None, None, None));
    }
}
