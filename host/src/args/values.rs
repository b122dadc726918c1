//! Parsers of option values.

#[cfg(feature = "pcap")]
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use raywake_simd::Simd;

/// Parses a number of at least one.
pub(super) fn count(text: &str) -> Result<usize, String> {
    let count = text.parse().map_err(|_| "not a number")?;
    if count > 0 { Ok(count) } else { Err("must be at least 1".into()) }
}

/// Parses the corners of a rectangle.
pub(super) fn vehicle_box(text: &str) -> Result<[[f32; 2]; 2], String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let numbers = numbers.map_err(|_| "expected four numbers: X0,Y0,X1,Y1")?;
    match numbers[..] {
        [a, b, c, d] if a < c && b < d && numbers.iter().all(|n| n.is_finite()) => {
            Ok([[a, b], [c, d]])
        }
        _ => Err("expected X0,Y0,X1,Y1 with X0 below X1 and Y0 below Y1".into()),
    }
}

/// Parses a size in bytes: a number with or without a unit.
pub(super) fn size(text: &str) -> Result<u64, String> {
    let digits = text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (number, unit) = text.split_at(digits);
    let unit = match unit.trim() {
        "" | "B" => 1,
        "kB" => 1_000,
        "MB" => 1_000_000,
        "GB" => 1_000_000_000,
        "KiB" => 1 << 10,
        "MiB" => 1 << 20,
        "GiB" => 1 << 30,
        _ => return Err("expected a whole number with B, kB, MB, GB, KiB, MiB or GiB".into()),
    };
    let bytes = number.parse::<u64>().ok().and_then(|n| n.checked_mul(unit));
    bytes.ok_or_else(|| "not a number of bytes".into())
}

/// Parses the name of an instruction set that this processor has.
pub(super) fn simd(text: &str) -> Result<Simd, String> {
    let found = Simd::available().find(|simd| simd.name() == text);
    found.ok_or_else(|| {
        let names: Vec<&str> = Simd::available().map(Simd::name).collect();
        format!("this processor supports {}", names.join(", "))
    })
}

/// Parses a duration in seconds.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number")?;
    let duration = Duration::try_from_secs_f64(seconds).map_err(|e| e.to_string())?;
    if duration.is_zero() { Err("must be more than 0".into()) } else { Ok(duration) }
}

/// Parses an address to listen on; a port alone means the loopback address.
#[cfg(feature = "pcap")]
pub(super) fn listen(text: &str) -> Result<SocketAddr, String> {
    let port = text.parse().map(|port: u16| (Ipv4Addr::LOCALHOST, port).into());
    port.or_else(|_| text.parse()).map_err(|_| "expected ADDRESS:PORT, or a PORT".into())
}

/// Parses a duration in ms, at most a minute.
#[cfg(feature = "pcap")]
pub(super) fn milliseconds(text: &str) -> Result<Duration, String> {
    let ms: f64 = text.parse().map_err(|_| "not a number")?;
    let believed = (0.1..=60_000.0).contains(&ms);
    believed.then(|| Duration::from_secs_f64(ms * 1e-3)).ok_or("must be 0.1 to 60000".into())
}

/// Parses a speed factor.
#[cfg(feature = "pcap")]
pub(super) fn factor(text: &str) -> Result<f64, String> {
    let factor: f64 = text.parse().map_err(|_| "not a number")?;
    let believed = (0.01..=1000.0).contains(&factor);
    believed.then_some(factor).ok_or("must be 0.01 to 1000".into())
}

/// Parses the log-odds to clip at. Beyond 20 a probability is 1 in single precision.
pub(super) fn nats(text: &str) -> Result<f32, String> {
    let nats: f32 = text.parse().map_err(|_| "not a number")?;
    if (0.001..=20.0).contains(&nats) { Ok(nats) } else { Err("must be 0.001 to 20".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(feature = "pcap")]
    fn of_live_input() {
        let listens = ["2368", "0.0.0.0:99", "[::1]:5"].map(|s| listen(s).unwrap().to_string());
        assert_eq!(listens, ["127.0.0.1:2368", "0.0.0.0:99", "[::1]:5"]);
        assert!(["", "x", "70000", "1.2.3.4"].iter().all(|s| listen(s).is_err()));
        assert_eq!(milliseconds("50"), Ok(Duration::from_millis(50)));
        assert!(["0", "-1", "nan", "1e9"].iter().all(|s| milliseconds(s).is_err()));
        assert!(factor("2") == Ok(2.0) && ["0", "-1", "nan"].iter().all(|s| factor(s).is_err()));
    }

    #[test]
    fn numbers() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        assert!(["0", "-1", "nan", "inf", "x"].iter().all(|s| seconds(s).is_err()));
        assert!(count("0").is_err());
        assert!(nats("3") == Ok(3.0) && ["0", "-3", "nan", "21"].iter().all(|s| nats(s).is_err()));
        let sizes = ["7", "64MiB", "2 kB", "3GB"].map(size);
        assert_eq!(sizes, [Ok(7), Ok(64 << 20), Ok(2000), Ok(3_000_000_000)]);
        assert!(
            ["", "MB", "-1", "1.5MB", "4M", "99999999999999GB"].iter().all(|s| size(s).is_err())
        );
    }
}
