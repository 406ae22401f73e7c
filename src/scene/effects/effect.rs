//! What a picture can show beside matt surfaces, and sets of it.

use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

macro_rules! effects {
    ($($(#[$doc:meta])* $effect:ident = $name:literal;)*) => {
        /// Something that a picture can show, and that costs time.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Effect {
            $($(#[$doc])* $effect,)*
        }

        impl Effect {
            /// All of them, in the order of reports.
            pub const ALL: &[Self] = &[$(Self::$effect,)*];

            /// Its name, as `--effects` takes it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$effect => $name,)* }
            }
        }
    };
}

effects! {
    /// Pictures on surfaces: their colours, and how they throw light back.
    Textures = "textures";
    /// Surfaces that seem uneven: height and normal maps.
    Bump = "bump";
    /// Normals of the model in place of its triangles'.
    SmoothNormals = "smooth-normals";
    /// Holes that a picture cuts into surfaces.
    CutOuts = "cut-outs";
    /// Surfaces that are there in part, which light passes straight on.
    Transparency = "transparency";
    /// Surfaces that give off light are seen to do so.
    Emission = "emission";
    /// Lights that are seen in surfaces which the scene is not seen in.
    Highlights = "highlights";
    /// Shadows of the sun, or of a lamp that is a point.
    Shadows = "shadows";
    /// Light from surfaces, and its shadows.
    SoftShadows = "soft-shadows";
    /// Mirrors.
    Reflection = "reflection";
    /// Mirrors that are not quite smooth.
    Glossy = "glossy";
    /// More reflection at grazing angles.
    Fresnel = "fresnel";
    /// Light that goes through surfaces and is bent.
    Refraction = "refraction";
    /// Light that is lost in what it goes through.
    Absorption = "absorption";
    /// Less of the light from everywhere in corners.
    AmbientOcclusion = "ambient-occlusion";
    /// Light from surfaces that are lit themselves.
    Interreflection = "interreflection";
    /// Light from a picture that is all around.
    Environment = "environment";
    /// What is nearer or farther than the camera is focused to is blurred.
    DepthOfField = "depth-of-field";
    /// More samples where neighbouring samples differ.
    Antialiasing = "antialiasing";
}

impl Effect {
    /// Whether one sample shows a chance value of it, so that many have to be averaged.
    pub const fn is_sampled(self) -> bool {
        matches!(
            self,
            Self::SoftShadows
                | Self::Glossy
                | Self::AmbientOcclusion
                | Self::Interreflection
                | Self::Environment
                | Self::DepthOfField
        )
    }
}

impl Effect {
    /// What it does with each hit or sample; `None` if it casts rays of its own, which are counted then.
    const fn uses(self) -> Option<&'static str> {
        match self {
            Self::Textures | Self::Bump => Some("look-ups"),
            Self::SmoothNormals => Some("normals"),
            Self::Emission => Some("lights seen"),
            Self::Highlights => Some("highlights"),
            Self::Fresnel => Some("reflectances"),
            Self::Absorption => Some("ways inside"),
            Self::DepthOfField => Some("lens points"),
            Self::Antialiasing => Some("more samples"),
            Self::CutOuts
            | Self::Transparency
            | Self::Shadows
            | Self::SoftShadows
            | Self::Reflection
            | Self::Glossy
            | Self::Refraction
            | Self::AmbientOcclusion
            | Self::Interreflection
            | Self::Environment => None,
        }
    }

    /// Whether it casts rays of its own.
    pub const fn casts_rays(self) -> bool {
        self.uses().is_none()
    }

    /// What is counted of it: rays, if it [casts](Self::casts_rays) some, or else what it does with each hit or sample.
    pub const fn unit(self) -> &'static str {
        match self.uses() {
            Some(uses) => uses,
            None => "rays",
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Effect {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        Self::ALL.iter().copied().find(|effect| effect.name() == name).ok_or(())
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A set of effects: one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EffectSet(u32);

impl EffectSet {
    /// None.
    pub const NONE: Self = Self(0);

    /// Those named.
    pub const fn of(effects: &[Effect]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < effects.len() {
            bits |= 1 << effects[i] as u32;
            i += 1;
        }
        Self(bits)
    }

    /// Whether an effect is in it.
    #[inline]
    pub const fn has(self, effect: Effect) -> bool {
        self.0 >> effect as u32 & 1 == 1
    }

    /// Whether any of `others` is in it.
    #[inline]
    pub const fn has_any(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }

    /// Whether it is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The same with an effect put in or taken out.
    #[must_use]
    pub const fn with(self, effect: Effect, is_in: bool) -> Self {
        let bit = 1 << effect as u32;
        Self(if is_in { self.0 | bit } else { self.0 & !bit })
    }

    /// Those in both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Those in either.
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Its effects, in the order of reports.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.iter().copied().filter(move |&effect| self.has(effect))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back() {
        for &effect in Effect::ALL {
            assert_eq!(effect.name().parse(), Ok(effect));
        }
        assert_eq!("shine".parse::<Effect>(), Err(()));
    }

    #[test]
    fn rays_are_counted_of_what_casts_them() {
        for &effect in Effect::ALL {
            assert_eq!(effect.casts_rays(), effect.unit() == "rays", "{effect}");
        }
    }

    #[test]
    fn sets_hold_what_was_put_in() {
        let set = EffectSet::of(&[Effect::Antialiasing, Effect::Textures]);
        assert!(set.has(Effect::Textures) && !set.has(Effect::Bump));
        assert_eq!(set.iter().collect::<Vec<_>>(), [Effect::Textures, Effect::Antialiasing]);
        assert_eq!(set.with(Effect::Textures, false).iter().collect::<Vec<_>>(), [Effect::Antialiasing]);
        assert!(set.and(EffectSet::of(&[Effect::Bump])).is_empty());
        assert!(set.has_any(EffectSet::of(&[Effect::Textures, Effect::Bump])));
        assert_eq!(set.or(EffectSet::of(&[Effect::Bump])).iter().count(), 3);
    }
}
