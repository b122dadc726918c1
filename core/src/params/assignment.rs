//! Parameters set from text, as in `--set NAME=VALUE`.

use super::{Profile, Value};

/// A parameter and a value for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSetting<'a> {
    /// Its group; if none is given, the one that has it.
    pub group: Option<&'a str>,
    /// Its name.
    pub name: &'a str,
    /// Its value.
    pub value: Value<'a>,
}

/// Why a parameter was not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignError {
    /// There is no parameter of this name, or not in this group.
    Unknown,
    /// The value is invalid: it must be this.
    InvalidValue(&'static str),
}

impl<'a> ParameterSetting<'a> {
    /// Parses `NAME=VALUE` or `GROUP.NAME=VALUE`; `None` if there is no `=`.
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

    /// The setting for `NAME` or `GROUP.NAME`.
    pub fn new(path: &'a str, value: Value<'a>) -> ParameterSetting<'a> {
        let (group, name) = path.split_once('.').map_or((None, path), |(g, n)| (Some(g), n));
        ParameterSetting { group, name, value }
    }
}

impl Profile {
    /// Sets a parameter, checking only its type.
    pub fn assign(&mut self, to: &ParameterSetting) -> Result<(), AssignError> {
        let groups = self.groups().map(|(group, of)| (group, of.get(to.name).is_some()));
        let mut having = groups.iter().filter(|(_, has)| *has);
        let found = having.find(|(group, _)| to.group.is_none_or(|wanted| wanted == *group));
        let (group, _) = found.ok_or(AssignError::Unknown)?;
        self.group_mut(group).set(to.name, to.value).map_err(AssignError::InvalidValue)
    }
}
