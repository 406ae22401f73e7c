//! What caches are like, whatever their policy.

use crate::cache::CacheOptions;
use crate::cache::policy::Replacement;
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A cache of its own for nodes, as in the seed paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nodes {
    /// The part (0.01 to 0.99) of the memory that it has.
    pub part: f32,
    /// Which of its blocks makes room; `None` for the policy that the other cache has.
    pub policy: Option<Replacement>,
}

impl Nodes {
    /// The same for [`CacheOptions::nodes`], beside a cache of this policy.
    pub fn beside(self, policy: Replacement) -> (f32, Replacement) {
        (self.part, self.policy.unwrap_or(policy))
    }
}

/// `0.25` or `0.25:lru`.
impl FromStr for Nodes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || {
            let message =
                format!("\"{text}\" is not PART:POLICY, such as 0.25:lru, nor PART for the other's policy");
            Error::option("--nodes", message)
        };
        let (part, policy) = match text.split_once(':') {
            Some((part, policy)) => (part, Some(policy.trim().parse().map_err(|_| wrong())?)),
            None => (text, None),
        };
        Ok(Self { part: part.trim().parse().map_err(|_| wrong())?, policy })
    }
}

impl fmt::Display for Nodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.policy {
            Some(policy) => write!(f, "{}:{policy}", self.part),
            None => write!(f, "{}", self.part),
        }
    }
}

/// What a cache is like, but for its policy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shape {
    /// Bytes of a block.
    pub block: usize,
    /// Blocks that a set holds.
    pub ways: usize,
    /// Locks that sets share.
    pub stripes: usize,
    /// A cache of its own for nodes; `None` for one cache of all.
    pub nodes: Option<Nodes>,
}

/// A property of caches: its name, and what it is of one.
pub type Property = (&'static str, fn(&Shape) -> String);

impl Shape {
    /// All of them, as the options are called.
    const PROPERTIES: [Property; 4] = [
        ("block", |shape| shape.block.to_string()),
        ("ways", |shape| shape.ways.to_string()),
        ("stripes", |shape| shape.stripes.to_string()),
        ("nodes", |shape| shape.nodes.map_or("none".into(), |nodes| nodes.to_string())),
    ];

    /// The properties in which some of these differ.
    pub fn differences(shapes: &[Self]) -> Vec<Property> {
        let differs = |(_, of): &Property| shapes.windows(2).any(|pair| of(&pair[0]) != of(&pair[1]));
        Self::PROPERTIES.into_iter().filter(differs).collect()
    }

    /// These properties in words, each after a comma: `, ways 8, nodes 0.3:lru`.
    pub fn words(&self, properties: &[Property]) -> String {
        properties.iter().map(|(name, of)| format!(", {name} {}", of(self))).collect()
    }

    /// The options of such a cache, with all else as it is in `options`.
    pub fn options(&self, options: CacheOptions) -> CacheOptions {
        let Self { block, ways, stripes, nodes } = *self;
        let nodes = nodes.map(|nodes| nodes.beside(options.policy));
        CacheOptions { block, ways, stripes, nodes, ..options }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_read_as_they_are_written() {
        for text in ["0.25", "0.5:lru", "0.1:s3-fifo"] {
            assert_eq!(text.parse::<Nodes>().expect(text).to_string(), text);
        }
        let alone: Nodes = " 0.25 ".parse().expect("a part");
        assert_eq!(alone.beside(Replacement::Lru), (0.25, Replacement::Lru));
        let both: Nodes = "0.25: fifo".parse().expect("a part and a policy");
        assert_eq!(both.beside(Replacement::Lru), (0.25, Replacement::Fifo));
        for text in ["", "half", "0.2:", "0.2:mru", ":lru"] {
            let message = text.parse::<Nodes>().expect_err(text).to_string();
            assert!(message.starts_with(&format!("--nodes: \"{text}\" is not PART:POLICY")), "{message}");
        }
    }

    #[test]
    fn only_what_differs_is_said() {
        let shape = Shape { block: 4096, ways: 32, stripes: 16, nodes: None };
        let other = Shape { ways: 8, nodes: "0.3:lru".parse().ok(), ..shape };
        assert!(Shape::differences(&[shape, shape]).is_empty() && Shape::differences(&[]).is_empty());
        let differences = Shape::differences(&[shape, shape, other]);
        assert_eq!(shape.words(&differences), ", ways 32, nodes none");
        assert_eq!(other.words(&differences), ", ways 8, nodes 0.3:lru");
    }
}
