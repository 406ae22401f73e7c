//! The plant's paints.

use crate::mesh::Material;
use crate::mesh::color::decode;

macro_rules! palette {
    ($($constant:ident $name:literal $srgb:literal),* $(,)?) => {
        /// The materials, in the order of the constants.
        pub(super) fn materials() -> Vec<Material> {
            [$(($name, $srgb)),*]
                .map(|(name, rgb): (&str, u32)| {
                    let [_, r, g, b] = rgb.to_be_bytes();
                    Material::matt(name, decode([r, g, b]))
                })
                .into()
        }
        palette!(@number 0_u32; $($constant $name)*);
    };
    (@number $n:expr; $constant:ident $name:literal $($rest:tt)*) => {
        #[doc = $name]
        pub(super) const $constant: u32 = $n;
        palette!(@number $n + 1; $($rest)*);
    };
    (@number $n:expr;) => {};
}

palette! {
    EARTH "earth" 0xA89B74,
    ASPHALT "asphalt" 0x77736D,
    CONCRETE "concrete" 0xBDB5A6,
    MARKING "road marking" 0xE4DFCC,
    STEEL "steel" 0x7F868C,
    DARK_STEEL "dark steel" 0x4A5158,
    GALVANISED "galvanised steel" 0xA9B0B4,
    RAIL "safety yellow" 0xF0B71E,
    WHITE "white paint" 0xECE9E1,
    SILVER "aluminium cladding" 0xC4C8CA,
    RED "red paint" 0xB3352B,
    BLUE "blue paint" 0x2F6DA8,
    GREEN "green paint" 0x3C7F5C,
    ORANGE "orange paint" 0xD9722B,
    CREAM "cream paint" 0xDCCBA3,
    BRICK "firebrick" 0x9A6B52,
    CABLE "cable" 0x2B2D30,
}
