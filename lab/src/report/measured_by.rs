//! Provenance of measurements: a command on a machine.

/// Name of the fact that holds the command line.
pub const COMMAND: &str = "Command";

/// The command line of this process; of many consecutive arguments (drives, that is) only the first
/// two and the last.
pub(super) fn command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut out = String::from("raywake-lab");
    for run in arguments.chunk_by(|_, next| !next.starts_with('-')) {
        match run {
            [first, .., last] if run.len() > 8 => {
                out += &format!(" {first} {} ... {last}", run[1]);
            }
            _ => run.iter().for_each(|argument| out += &format!(" {argument}")),
        }
    }
    out
}

/// Cores and model of this machine's processor, if Linux reports it.
pub(super) fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    format!("{cores} cores of {}", model.map_or("an unknown processor", |(_, name)| name))
}
