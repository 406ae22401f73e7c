//! Squares in Morton order: each four of places that follow one another are a square, each four of these, and so on.

/// The place with number `i` of a square of up to 65536 a side: how far right, and how far down.
pub const fn place(i: u32) -> (u32, u32) {
    (every_second_bit(i), every_second_bit(i >> 1))
}

/// Bits 0, 2, 4 and so on, moved together.
const fn every_second_bit(i: u32) -> u32 {
    let i = i & 0x5555_5555;
    let i = (i | i >> 1) & 0x3333_3333;
    let i = (i | i >> 2) & 0x0f0f_0f0f;
    let i = (i | i >> 4) & 0x00ff_00ff;
    (i | i >> 8) & 0x0000_ffff
}

#[cfg(test)]
mod tests {
    use super::place;

    #[test]
    fn fours_are_squares_of_squares() {
        let first: Vec<(u32, u32)> = (0..8).map(place).collect();
        assert_eq!(first, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)]);
        assert_eq!(place(16), (4, 0));
        assert_eq!(place(0b1001_1110), (0b0110, 0b1011));
        assert_eq!(place(u32::MAX), (0xffff, 0xffff));
    }
}
