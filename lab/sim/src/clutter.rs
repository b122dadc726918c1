//! Matter in the air that sends a laser's light back: rain, fog, dust behind vehicles. Such returns
//! belong to no object.

use crate::ground::Ground;
use crate::object::{Class, Object};
use crate::rng::Rng;
use crate::roughness::roughness;
use crate::scene::Scene;
use crate::target::{Fan, Ray};
use glam::DVec3;
use std::fmt;
use std::str::FromStr;

/// What is in the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clutter {
    /// Nothing.
    #[default]
    None,
    /// Heavy rain: isolated returns within several metres of the sensor.
    Rain,
    /// Fog with about 60 m of visibility, in drifting patches: many returns near the sensor, few
    /// far away.
    Fog,
    /// Dust behind every second moving vehicle.
    Dust,
}

/// A name that is not a clutter's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownClutter(String);

impl fmt::Display for UnknownClutter {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names: Vec<_> = Clutter::ALL.into_iter().map(Clutter::name).collect();
        write!(f, "no clutter is called `{}`; the available ones are {}", self.0, names.join(", "))
    }
}

impl std::error::Error for UnknownClutter {}

/// Fine drops, uniformly distributed.
struct Drops {
    /// Share of rays that a drop sends back unless something solid is nearer.
    share: f64,
    /// Mean range of these returns, m; their distribution is exponential.
    mean_m: f64,
    /// Share of the light that is lost per metre, there and back.
    loss: f64,
    /// Whether they drift in patches.
    patchy: bool,
}

/// Beyond this range no drop reflects strongly enough to be seen, m.
const DROPS_M: f64 = 18.0;
/// A patch of fog is this many times as wide as the widest bump of [`roughness`] (2.3 m), and
/// drifts with the wind, m/s.
const PATCH: f64 = 3.0;
const WIND: f64 = 1.5;

/// Heavy rain: one and a half per cent of all rays.
const RAIN: Drops = Drops { share: 0.015, mean_m: 5.0, loss: 0.004, patchy: false };
/// Fog: by Koschmieder's rule, light is down to a twentieth at the visibility of 60 m.
const FOG: Drops = Drops { share: 0.15, mean_m: 4.0, loss: 0.1, patchy: true };

/// A cloud of dust consists of puffs, one every `PUFF_S` seconds, each lasting `DUST_S` seconds.
const PUFF_S: f64 = 0.1;
const DUST_S: f64 = 3.0;
/// Speed from which a vehicle raises dust, m/s.
const DUSTY: f64 = 3.0;
/// Radius of a fresh puff (m) and its growth (m/s).
const PUFF: [f64; 2] = [0.7, 0.45];
/// Returns per metre of a ray in a fresh puff, and the time in which they fall to about a third, s.
const THICK: [f64; 2] = [0.15, 1.2];
/// Separate the random numbers of puffs from those of drops along the same ray.
const OF_PUFFS: u64 = 0xD057;
const OF_DROPS: u64 = 0xF06;

impl Clutter {
    /// Every kind.
    pub const ALL: [Clutter; 4] = [Clutter::None, Clutter::Rain, Clutter::Fog, Clutter::Dust];

    /// What [`Clutter::from_str`] understands.
    pub fn name(self) -> &'static str {
        match self {
            Clutter::None => "none",
            Clutter::Rain => "rain",
            Clutter::Fog => "fog",
            Clutter::Dust => "dust",
        }
    }

    fn drops(self) -> Option<&'static Drops> {
        match self {
            Clutter::Rain => Some(&RAIN),
            Clutter::Fog => Some(&FOG),
            Clutter::None | Clutter::Dust => None,
        }
    }
}

impl FromStr for Clutter {
    type Err = UnknownClutter;

    fn from_str(name: &str) -> Result<Clutter, UnknownClutter> {
        let found = Clutter::ALL.into_iter().find(|clutter| clutter.name() == name);
        found.ok_or_else(|| UnknownClutter(name.to_string()))
    }
}

/// A ball of dust.
struct Puff {
    centre: DVec3,
    radius: f64,
    /// Returns per metre.
    thick: f64,
}

impl Puff {
    /// A puff raised behind the object at time `then`, as seen at `t`.
    fn behind(object: &Object, ground: &Ground, then: f64, t: f64) -> Puff {
        let (at, age) = (object.path.at(then), t - then);
        let back = 0.5 * object.size[0];
        let [x, y] = [at.x - back * at.yaw.cos(), at.y - back * at.yaw.sin()];
        let radius = PUFF[0] + PUFF[1] * age;
        let centre = DVec3::new(x, y, ground.height(x, y) + 0.6 * radius);
        Puff { centre, radius, thick: THICK[0] * (-age / THICK[1]).exp() }
    }

    /// Section of a ray within it, m.
    fn stretch(&self, ray: &Ray) -> Option<[f64; 2]> {
        let to = self.centre - ray.origin;
        let along = to.dot(ray.direction);
        let half = self.radius * self.radius - (to.length_squared() - along * along);
        let half = (half > 0.0).then(|| half.sqrt())?;
        (along + half > 0.0).then_some([(along - half).max(0.0), along + half])
    }
}

/// What is in the air around one column at one time.
pub(crate) struct Air {
    drops: Option<&'static Drops>,
    puffs: Vec<Puff>,
    t: f64,
}

impl Air {
    pub(crate) fn about(clutter: Clutter, scene: &Scene, fan: &Fan, t: f64) -> Air {
        let mut air = Air { drops: clutter.drops(), puffs: Vec::new(), t };
        if clutter != Clutter::Dust {
            return air;
        }
        // The oldest puff that still exists, the same for every object.
        let first = ((t - DUST_S) / PUFF_S).ceil() as i64;
        for object in scene.objects.iter().filter(|o| raises_dust(o) && is_near(o, fan, t)) {
            let times = (first..).map(|n| n as f64 * PUFF_S).take_while(|&then| then <= t);
            let moving = times.filter(|&then| object.path.at(then).speed > DUSTY);
            let puffs = moving.map(|then| Puff::behind(object, &scene.ground, then, t));
            air.puffs.extend(puffs.filter(|puff| fan.meets(puff.centre, puff.radius)));
        }
        air
    }

    /// Range at which the air sends back a ray that would otherwise go as far as `free`, m.
    pub(crate) fn echo(&self, ray: &Ray, free: f64) -> Option<f64> {
        let drop = self.drops.and_then(|drops| drops.echo(ray, self.t));
        let puffs = self.puffs.iter().zip(0..).filter_map(|(puff, n)| {
            let [from, to] = puff.stretch(ray)?;
            let mut rng = Rng::split(ray.seed ^ OF_PUFFS, n);
            let range = from - (1.0 - rng.unit()).ln() / puff.thick;
            (range < to).then_some(range)
        });
        puffs.chain(drop).filter(|&range| range < free).min_by(f64::total_cmp)
    }

    /// Share of the light that comes back from this range.
    pub(crate) fn transmittance(&self, range: f64) -> f64 {
        self.drops.map_or(1.0, |drops| (-drops.loss * range).exp())
    }
}

impl Drops {
    fn echo(&self, ray: &Ray, t: f64) -> Option<f64> {
        let mut rng = Rng::split(ray.seed, OF_DROPS);
        let range = -self.mean_m * (1.0 - rng.unit()).ln();
        let at = ray.origin + ray.direction * range;
        let patch = || {
            let thick = roughness((at.x - WIND * t) / PATCH, (at.y + at.z) / PATCH);
            (0.5 + 2.0 * thick).clamp(0.0, 1.0)
        };
        let share = self.share * if self.patchy { patch() } else { 1.0 };
        (rng.chance(share) && range < DROPS_M).then_some(range)
    }
}

/// Whether a column can meet the dust of an object.
fn is_near(object: &Object, fan: &Fan, t: f64) -> bool {
    let [now, then] = [t, t - DUST_S].map(|t| object.path.at(t));
    let middle = DVec3::new(0.5 * (now.x + then.x), 0.5 * (now.y + then.y), fan.origin.z);
    // Half as much again, for curved paths; plus the length of a truck and the height of a hill.
    fan.meets(middle, 0.75 * (now.x - then.x).hypot(now.y - then.y) + 20.0)
}

/// True for every second moving vehicle on wheels.
fn raises_dust(object: &Object) -> bool {
    (Class::Car..=Class::Bus).contains(&object.class)
        && object.id % 2 == 1
        && !object.path.is_static()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(count: u64) -> impl Iterator<Item = Ray> {
        (0..count).map(|seed| Ray {
            origin: DVec3::new(0.0, 0.0, 1.7),
            direction: DVec3::new((0.01 * seed as f64).cos(), (0.01 * seed as f64).sin(), 0.0),
            seed: Rng::new(seed).bits(),
        })
    }

    #[test]
    fn names() {
        for clutter in Clutter::ALL {
            assert_eq!(clutter.name().parse(), Ok(clutter));
        }
        assert!("snow".parse::<Clutter>().unwrap_err().to_string().contains("fog"));
    }

    #[test]
    fn drops_reflect_the_stated_share() {
        let nowhere = Scene::empty();
        let fan = Fan {
            origin: DVec3::ZERO,
            forward: DVec3::X,
            across: DVec3::Y,
            spread: 1.0,
            range: 100.0,
        };
        for (clutter, least, most) in
            [(Clutter::None, 0, 0), (Clutter::Rain, 230, 340), (Clutter::Fog, 600, 2400)]
        {
            let air = Air::about(clutter, &nowhere, &fan, 0.0);
            let echoes: Vec<f64> =
                rays(20_000).filter_map(|ray| air.echo(&ray, f64::INFINITY)).collect();
            assert!((least..=most).contains(&echoes.len()), "{clutter:?}: {}", echoes.len());
            assert!(echoes.iter().all(|&range| range < DROPS_M));
            assert_eq!(rays(500).filter_map(|ray| air.echo(&ray, 0.0)).count(), 0, "a wall before");
        }
    }

    #[test]
    fn dust_trails_behind_movers_and_lingers() {
        let mut scene = Scene::empty();
        let start = crate::path::State { x: 30.0, speed: 12.0, ..Default::default() };
        scene.add_car(crate::path::Path::from(start), 1);
        let fan = Fan {
            origin: DVec3::ZERO,
            forward: DVec3::X,
            across: DVec3::Y,
            spread: 1.0,
            range: 100.0,
        };
        let puffs = |t: f64| Air::about(Clutter::Dust, &scene, &fan, t).puffs;
        let (now, later) = (puffs(2.0), puffs(2.05));
        assert_eq!(now.len(), 31);
        let tail = 30.0 + 12.0 * 2.0 - 0.5 * scene.objects[0].size[0];
        assert!(now.iter().all(|p| p.centre.x < tail + 1e-9 && p.centre.x > tail - 36.1));
        // The same puffs a moment later, a little larger.
        assert!((now[3].centre.x - later[2].centre.x).abs() < 1e-9);
        assert!(later[2].radius > now[3].radius && later[2].thick < now[3].thick);
    }
}
