//! Which drives are learned from, which are held out, and the iteration over all of them.

use super::drives::Labelled;
use super::recorded::Recorded;
use super::simulated::{Simulated, varied};
use crate::grid::Grid;
use glam::DVec3;
use raywake_core::params::{Frame, Profile};
use raywake_io::Error;
use raywake_sim::{Rng, Scenery};
use std::path::PathBuf;

/// Stride between the sweeps used: neighbouring ones are nearly the same.
const STRIDE: usize = 7;
/// One in this many drives is held out.
const HELD_OUT: usize = 5;

/// What to learn from.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Inputs {
    /// Simulated drives; every fifth is held out.
    #[arg(long, default_value_t = 125, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub drives: u32,
    /// Sweeps (or pairs of them) of a simulated drive, 0.7 s apart.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub sweeps: u32,
    /// Seed that chooses the simulated drives, and what is sampled of all drives.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Recorded drives with labels; every seventh sweep is used. Every fifth drive is held out, or
    /// those named.
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    pub data: Vec<PathBuf>,
    /// Recorded drives to hold out instead: names of their folders.
    #[arg(long, value_name = "NAME", num_args = 1.., requires = "data")]
    pub held_out: Vec<String>,
    /// Whether simulated streets rotate over several sceneries instead of the plain one.
    #[arg(skip)]
    pub varied: bool,
    /// Frame of the grid.
    #[arg(skip)]
    pub frame: Frame,
}

/// A drive that can be opened.
#[derive(Clone, Debug, PartialEq)]
enum Material {
    Simulated(u64),
    Recorded(PathBuf),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    material: Material,
    /// Not learned from.
    pub held_out: bool,
}

/// A drive being worked on.
pub struct Visit<'a> {
    /// Grid for its sweeps, with the lattice at a random offset.
    pub grid: &'a mut Grid,
    pub drive: &'a mut dyn Labelled,
    /// Sweeps to use.
    pub sweeps: Vec<usize>,
    /// Not learned from.
    pub held_out: bool,
    /// The drive's own random generator.
    pub rng: Rng,
}

impl Inputs {
    /// The drives in order, simulated ones first. Fails if there are none to learn from or none
    /// held out.
    pub fn plan(&self) -> Result<Vec<Planned>, Error> {
        let name = |path: &PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
        let names: Vec<_> = self.data.iter().map(name).collect();
        if let Some(missing) = self.held_out.iter().find(|n| !names.contains(&Some((*n).clone()))) {
            return Err(Error::Usage(format!("--held-out {missing}: no --data of that name")));
        }
        let fifth = |n: usize| n % HELD_OUT == HELD_OUT - 1;
        let simulated = (0..self.drives as usize)
            .map(|n| Planned { material: Material::Simulated(n as u64), held_out: fifth(n) });
        let recorded = self.data.iter().zip(&names).enumerate().map(|(n, (path, name))| {
            let named = name.as_ref().is_some_and(|name| self.held_out.contains(name));
            let held_out = if self.held_out.is_empty() { fifth(n) } else { named };
            Planned { material: Material::Recorded(path.clone()), held_out }
        });
        let plan: Vec<Planned> = simulated.chain(recorded).collect();
        for (held_out, what) in [(false, "to learn from"), (true, "held out")] {
            if plan.iter().all(|p| p.held_out != held_out) {
                return Err(Error::Usage(format!("no drive is {what}: see --drives, --held-out")));
            }
        }
        Ok(plan)
    }

    /// Profile of the grids.
    fn profile(&self) -> Profile {
        match self.frame {
            Frame::Lattice => Profile::hdl64(),
            Frame::Sensor => Profile::dissertation(),
        }
    }

    /// Calls `work` for every drive, on two threads, and returns the results in the drives' order,
    /// which do not depend on the threads. Fails with the error of the first drive that failed.
    pub fn visit<T: Send>(
        &self,
        plan: &[Planned],
        work: &(impl Fn(Visit) -> Result<T, Error> + Sync),
    ) -> Result<Vec<T>, Error> {
        let part = |first: usize| -> Vec<Result<T, Error>> {
            let mut grid = Grid::new(self.profile());
            let numbers = (first..plan.len()).step_by(2);
            numbers.map(|n| self.visit_one(&mut grid, n, &plan[n], work)).collect()
        };
        let [even, odd] = std::thread::scope(|scope| {
            let odd = scope.spawn(|| part(1));
            [part(0), odd.join().expect("a working thread panicked")]
        });
        let (mut even, mut odd) = (even.into_iter(), odd.into_iter());
        (0..plan.len()).filter_map(|n| if n % 2 == 0 { even.next() } else { odd.next() }).collect()
    }

    fn visit_one<T>(
        &self,
        grid: &mut Grid,
        number: usize,
        planned: &Planned,
        work: &impl Fn(Visit) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let mut rng = Rng::split(self.seed, (1 << 32) + number as u64);
        let half = 0.5 * grid.voxel_m();
        grid.restart(DVec3::from_array([0; 3].map(|_| rng.range(-half, half))));
        let wanted = STRIDE * (self.sweeps as usize - 1) + 1;
        let mut drive: Box<dyn Labelled> = match &planned.material {
            // One more sweep, for the last pair.
            Material::Simulated(n) => {
                let scenery = if self.varied { varied(*n) } else { Scenery::Street };
                Box::new(Simulated::drawn(self.seed, *n, wanted + 1, scenery))
            }
            Material::Recorded(path) => Box::new(Recorded::open(path)?),
        };
        let simulated = matches!(planned.material, Material::Simulated(_));
        let count = if simulated { wanted } else { drive.len() };
        let sweeps = (0..count).step_by(STRIDE).collect();
        let held_out = planned.held_out;
        work(Visit { grid, drive: drive.as_mut(), sweeps, held_out, rng })
    }

    /// One line for a weights file.
    pub fn provenance(&self) -> String {
        let mut line = format!(
            "seed {}, {} simulated drives ({} sweeps)",
            self.seed,
            self.drives,
            u64::from(self.drives) * u64::from(self.sweeps)
        );
        let name = |path: &PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
        let names: Vec<_> = self.data.iter().filter_map(name).collect();
        if !names.is_empty() {
            line += &format!(" and recorded drives {}", names.join(" "));
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(data: &[&str], held_out: &[&str]) -> Inputs {
        let data = data.iter().map(PathBuf::from).collect();
        let held_out = held_out.iter().map(|n| n.to_string()).collect();
        Inputs { data, held_out, sweeps: 1, ..Inputs::default() }
    }

    fn held_out(inputs: &Inputs) -> Vec<usize> {
        let plan = inputs.plan().unwrap();
        (0..plan.len()).filter(|n| plan[*n].held_out).collect()
    }

    #[test]
    fn every_fifth_or_by_name() {
        let mixed = Inputs { drives: 6, ..recorded(&["a/1", "a/2", "a/3", "a/4", "a/5"], &[]) };
        assert_eq!(held_out(&mixed), [4, 10]);
        let named = Inputs { drives: 6, ..recorded(&["a/1", "b/2"], &["1"]) };
        assert_eq!(held_out(&named), [4, 6]);
        assert_eq!(held_out(&recorded(&["a/1", "b/2"], &["2"])), [1]);
    }

    #[test]
    fn parts_without_drives_are_refused() {
        let error = |inputs: &Inputs| inputs.plan().unwrap_err().to_string();
        assert!(error(&Inputs::default()).contains("to learn from"));
        assert!(error(&Inputs { drives: 4, ..Inputs::default() }).contains("held out"));
        assert!(error(&recorded(&["a/1"], &["1"])).contains("to learn from"));
        assert!(error(&recorded(&["a/1", "a/2"], &["3"])).contains("--held-out 3"));
    }

    #[test]
    fn an_unreadable_drive_is_named() {
        let inputs = recorded(&["/nowhere/a", "/nowhere/b"], &["b"]);
        let plan = inputs.plan().unwrap();
        let error = inputs.visit(&plan, &|_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("/nowhere/a"), "{error}");
    }
}
