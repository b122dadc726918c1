//! Integer expressions of constants, as they appear in kernels.

use raywake_core::stages::CONSTANTS;
use std::collections::HashMap;

/// The constants that a kernel sees.
pub struct Constants(HashMap<String, i64>);

impl Constants {
    /// Those of core and those declared by the file itself.
    pub fn of(source: &str) -> Constants {
        let shared = CONSTANTS.iter().map(|(name, value, _)| (name.to_string(), *value));
        let mut all = Constants(shared.collect());
        for line in source.lines() {
            let declared = line.strip_prefix("const ").and_then(|l| l.split_once(';'));
            let Some((name, text)) = declared.and_then(|(l, _)| l.split_once('=')) else {
                continue;
            };
            let name = name.split(':').next().unwrap_or_default().trim().to_string();
            if let Some(value) = all.value(text) {
                all.0.insert(name, value);
            }
        }
        all
    }

    /// The value of an expression of numbers, constants, `+ - * / %`, parentheses, `i32()` and
    /// `u32()`.
    pub fn value(&self, text: &str) -> Option<i64> {
        let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        let text = text.replace("i32(", "(").replace("u32(", "(");
        let mut rest = text.as_str();
        let value = self.sum(&mut rest)?;
        rest.is_empty().then_some(value)
    }

    /// Number of iterations of `for (var n = A; n < B; n += C)`, if A, B and C are constants.
    pub fn iterations(&self, code: &str) -> Option<i64> {
        let header = code.trim().strip_prefix("for (")?.strip_suffix(") {")?;
        let mut parts = header.split(';').map(str::trim);
        let (start, condition, advance) = (parts.next()?, parts.next()?, parts.next()?);
        let (name, from) = start.strip_prefix("var ")?.split_once(" = ")?;
        let condition = condition.strip_prefix(name)?.trim_start();
        let (to, inclusive) = match condition.strip_prefix("<= ") {
            Some(to) => (to, 1),
            None => (condition.strip_prefix("< ")?, 0),
        };
        let by = self.value(advance.strip_prefix(name)?.trim_start().strip_prefix("+= ")?)?;
        let span = self.value(to)? + inclusive - self.value(from)?;
        Some((span + by - 1) / by)
    }

    fn sum(&self, rest: &mut &str) -> Option<i64> {
        let mut value = self.product(rest)?;
        while let Some(sign) = rest.chars().next().filter(|c| "+-".contains(*c)) {
            *rest = &rest[1..];
            let next = self.product(rest)?;
            value += if sign == '+' { next } else { -next };
        }
        Some(value)
    }

    fn product(&self, rest: &mut &str) -> Option<i64> {
        let mut value = self.atom(rest)?;
        while let Some(sign) = rest.chars().next().filter(|c| "*/%".contains(*c)) {
            *rest = &rest[1..];
            let next = self.atom(rest)?;
            value = match sign {
                '*' => value * next,
                '/' => value.checked_div(next)?,
                _ => value.checked_rem(next)?,
            };
        }
        Some(value)
    }

    fn atom(&self, rest: &mut &str) -> Option<i64> {
        if let Some(inner) = rest.strip_prefix('-') {
            *rest = inner;
            return Some(-self.atom(rest)?);
        }
        if let Some(inner) = rest.strip_prefix('(') {
            *rest = inner;
            let value = self.sum(rest)?;
            *rest = rest.strip_prefix(')')?;
            return Some(value);
        }
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (word, others) = rest.split_at(end);
        *rest = others;
        match word.trim_end_matches('u').parse() {
            Ok(number) => Some(number),
            Err(_) => self.0.get(word).copied(),
        }
    }
}
