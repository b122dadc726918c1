//! Randomly damaged text files, for tests of their parsers.

#[path = "../../core/src/random.rs"]
#[allow(dead_code)]
mod random;

use random::Random;

/// Tokens that parsers tend to stumble over.
const TOKENS: [&str; 16] = [
    "nan",
    "-inf",
    "1e308",
    "1e-320",
    "18446744073709551616",
    "0x10",
    "",
    "\"",
    "'''",
    "[",
    "]",
    "[[",
    "=",
    ".",
    "{",
    "é\u{0}",
];

/// Damages a text this many times: `read`, which returns whether it could be read, must neither
/// panic nor always return the same.
pub fn check(text: &str, times: usize, read: impl Fn(&str) -> bool) {
    assert!(read(text), "whole it is read");
    let mut random = Random(20);
    let mut counts = [0; 2];
    for _ in 0..times {
        let mut characters: Vec<char> = text.chars().collect();
        for _ in 0..1 + random.below(4) {
            damage(&mut characters, &mut random);
        }
        counts[usize::from(read(&characters.iter().collect::<String>()))] += 1;
    }
    assert!(counts.iter().all(|count| *count > times / 100), "{counts:?}");
}

fn damage(text: &mut Vec<char>, random: &mut Random) {
    let at = random.below(text.len().max(1));
    let end = (at + random.below(20)).min(text.len());
    match random.below(4) {
        // Numbers replaced by numbers get furthest.
        0 => {
            let digits = text.iter().skip(at).take_while(|c| c.is_ascii_digit()).count();
            text.splice(at..at + digits, TOKENS[random.below(TOKENS.len())].chars());
        }
        1 => _ = text.splice(at..at, TOKENS[random.below(TOKENS.len())].chars()),
        2 => _ = text.drain(at..end),
        _ => {
            let again: Vec<char> = text[at..end].to_vec();
            text.splice(at..at, again);
        }
    }
}
