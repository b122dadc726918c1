//! Parameters that are set by a text, as `--set NAME=VALUE` has it.

use super::{Profile, Value};

/// A parameter and a value for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSetting<'a> {
    /// Of this group; where none is given, of the one that has it.
    pub group: Option<&'a str>,
    /// Its name.
    pub name: &'a str,
    /// Its value.
    pub value: Value<'a>,
}

/// Why a parameter was not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignError {
    /// There is none of this name, or not in this group.
    Unknown,
    /// The value is not of its type, but must be this.
    Must(&'static str),
}

impl<'a> ParameterSetting<'a> {
    /// From `NAME=VALUE` or `GROUP.NAME=VALUE`; none where there is no `=`.
    pub fn parse(text: &'a str) -> Option<ParameterSetting<'a>> {
        let (path, word) = text.split_once('=')?;
        let (path, word) = (path.trim(), word.trim());
        let value = match (word.parse(), word.parse()) {
            (Ok(flag), _) => Value::Flag(flag),
            (_, Ok(number)) => Value::Number(number),
            _ => Value::Word(word),
        };
        Some(ParameterSetting::new(path, value))
    }

    /// Of `NAME` or `GROUP.NAME`.
    pub fn new(path: &'a str, value: Value<'a>) -> ParameterSetting<'a> {
        let (group, name) = path.split_once('.').map_or((None, path), |(g, n)| (Some(g), n));
        ParameterSetting { group, name, value }
    }
}

impl Profile {
    /// Sets a parameter, unchecked but for its type.
    pub fn assign(&mut self, to: &ParameterSetting) -> Result<(), AssignError> {
        let groups = self.groups().map(|(group, of)| (group, of.get(to.name).is_some()));
        let mut having = groups.iter().filter(|(_, has)| *has);
        let found = having.find(|(group, _)| to.group.is_none_or(|wanted| wanted == *group));
        let (group, _) = found.ok_or(AssignError::Unknown)?;
        self.group_mut(group).set(to.name, to.value).map_err(AssignError::Must)
    }
}
