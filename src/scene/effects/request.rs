//! Which effects a user asks for: `--effects`.

use super::effect::{Effect, EffectSet};
use crate::error::{Error, Result};
use std::str::FromStr;

/// What to make of the effects that a scene calls for.
///
/// Written `auto` (those called for), `none`, a list such as `shadows,textures` (these and no others), or changes to
/// `auto` such as `+ambient-occlusion,-shadows`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// Nothing that the scene calls for counts.
    only_these: bool,
    /// On in any case.
    on: EffectSet,
    /// Off in any case.
    off: EffectSet,
}

impl Request {
    /// Matt surfaces alone.
    pub const NONE: Self = Self { only_these: true, on: EffectSet::NONE, off: EffectSet::NONE };

    /// The same with an effect off.
    #[must_use]
    pub fn without(self, effect: Effect) -> Self {
        Self { on: self.on.with(effect, false), off: self.off.with(effect, true), ..self }
    }

    /// What the user says of an effect; `None`: the scene decides.
    pub fn of(&self, effect: Effect) -> Option<bool> {
        if self.off.has(effect) {
            Some(false)
        } else if self.on.has(effect) {
            Some(true)
        } else {
            self.only_these.then_some(false)
        }
    }
}

impl FromStr for Request {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |message: String| Error::option("--effects", message);
        match text.trim() {
            "auto" => return Ok(Self::default()),
            "none" => return Ok(Self::NONE),
            _ => {}
        }
        let mut request = Self::default();
        let mut plain = None;
        for word in text.split(',').map(str::trim) {
            let (sign, name) = match word.strip_prefix('+') {
                Some(name) => (Some(true), name),
                None => match word.strip_prefix('-') {
                    Some(name) => (Some(false), name),
                    None => (None, word),
                },
            };
            let effect: Effect =
                name.parse().map_err(|()| wrong(format!("there is no \"{name}\"; {}", forms())))?;
            if plain.replace(sign.is_none()).is_some_and(|before| before != sign.is_none()) {
                return Err(wrong(format!(
                    "\"{text}\" mixes a list with changes by + and -; write one of both"
                )));
            }
            if request.on.or(request.off).has(effect) {
                return Err(wrong(format!("{effect} is given twice")));
            }
            if sign == Some(false) {
                request.off = request.off.with(effect, true);
            } else {
                request.on = request.on.with(effect, true);
            }
        }
        request.only_these = plain == Some(true);
        Ok(request)
    }
}

/// What can be written.
fn forms() -> String {
    let names: Vec<&str> = Effect::ALL.iter().map(|effect| effect.name()).collect();
    format!("write auto, none, +NAME, -NAME or a list of names: {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str, effect: Effect) -> Option<bool> {
        text.parse::<Request>().expect(text).of(effect)
    }

    #[test]
    fn all_forms_are_understood() {
        assert_eq!(said("auto", Effect::Shadows), None);
        assert_eq!(said("none", Effect::Shadows), Some(false));
        assert_eq!(said("shadows, textures", Effect::Shadows), Some(true));
        assert_eq!(said("shadows,textures", Effect::Bump), Some(false));
        assert_eq!(said("+bump,-shadows", Effect::Bump), Some(true));
        assert_eq!(said("+bump,-shadows", Effect::Shadows), Some(false));
        assert_eq!(said("+bump,-shadows", Effect::Textures), None);
        let without = "shadows".parse::<Request>().expect("a list").without(Effect::Shadows);
        assert_eq!(without.of(Effect::Shadows), Some(false));
    }

    #[test]
    fn nonsense_is_refused_in_one_line() {
        for text in ["", "shine", "auto,shadows", "+", "shadows,-bump", "+bump,+bump", "bump,bump"] {
            let message = text.parse::<Request>().expect_err(text).to_string();
            assert!(message.starts_with("--effects: ") && !message.contains('\n'), "{message}");
        }
    }
}
