use raywake::backend::{Backend, Tables, scalar::Scalar};
use raywake::drive::Drive;
use raywake::source::{self, SweepData};
use raywake_core::digest::Digest;
use raywake_core::params::Profile;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let mut source = source::open(path.as_ref(), &Default::default()).unwrap();
    println!("{}", source.describe());
    let profile = Profile::hdl64();
    let t = || Tables::load(&profile, None, raywake_core::occupancy_constancy::SHIPPED).unwrap();
    let mut drive = Drive::new(
        &profile,
        source.rig(),
        &t(),
        if std::env::args().nth(2).is_some() { Backend::Device(Box::new(raywake::backend::device::Device::new(&profile, &t(), &Default::default()).unwrap())) } else { Backend::Scalar(Box::new(Scalar::new(&profile, t()))) },
    );
    let (mut now, mut before) = (SweepData::default(), SweepData::default());
    let mut digest = Digest::default();
    for n in 0..source.len() {
        source.read(n, &mut now).unwrap();
        let s = drive.step(&now.sweep(), &before.points).unwrap();
        if let Some(f) = &s.flows {
            f.columns.iter().for_each(|c| digest.column(c));
            if n % 20 == 1 {
                println!(
                    "{n} {} pts {} rays, {} solid, {} fg, {} valid {:?} {:?}",
                    now.points.len(),
                    s.rays,
                    f.columns.len(),
                    s.foreground,
                    f.valid,
                    f.turnover,
                    s.prepared.dropped
                );
                for (n, ms) in s.laps.stages() {
                    print!("{n} {ms:.2}  ");
                }
                println!("total {:.2}", s.laps.stages().map(|s| s.1).sum::<f64>());
            }
        }
        drive.tracklets().for_each(|t| digest.tracklet(&t));
        std::mem::swap(&mut now, &mut before);
    }
    println!("{:016x}", digest.value());
}
