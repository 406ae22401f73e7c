//! Every implementation against plain scalar arithmetic, on ordinary and on special values.

use super::*;

/// Pairs of values that tell rules apart: signs of zero, NaN, infinities, denormals.
const VALUES: [f32; 14] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1.5,
    -3.25,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    1e-40,
    -1e-40,
    f32::MAX,
    f32::MIN_POSITIVE,
    0.1,
];

/// Checks every operation of one lane type against `f32`'s own lane type.
fn check<const W: usize, L: Lanes<W>>() {
    let n = VALUES.len();
    for shift in 0..n * n {
        let a: [f32; W] = std::array::from_fn(|i| VALUES[(shift + i) % n]);
        let b: [f32; W] = std::array::from_fn(|i| VALUES[(shift / n + i * 5) % n]);
        let (x, y) = (L::load(&a), L::load(&b));

        let same = |name: &str, got: L, want: fn(f32, f32) -> f32| {
            for (i, got) in got.store().into_iter().enumerate() {
                let want = want(a[i], b[i]);
                let equal = got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan());
                assert!(equal, "{name}({}, {}) is {got}, not {want}", a[i], b[i]);
            }
        };
        same("add", x + y, |a, b| a + b);
        same("sub", x - y, |a, b| a - b);
        same("mul", x * y, |a, b| a * b);
        same("div", x / y, |a, b| a / b);
        same("min", x.min(y), Lanes::min);
        same("max", x.max(y), Lanes::max);
        same("abs", x.abs(), |a, _| a.abs());
        same("copysign", x.copysign(y), |a, b| a.copysign(b));

        let bits = |f: fn(f32, f32) -> bool| (0..W).fold(0, |m, i| m | u32::from(f(a[i], b[i])) << i);
        assert_eq!(x.lt(y).bits(), bits(|a, b| a < b));
        assert_eq!(x.le(y).bits(), bits(|a, b| a <= b));
        assert_eq!(x.eq(y).bits(), bits(|a, b| a == b));
        let full = (1u64 << W) as u32 - 1;
        assert_eq!((!x.lt(y)).bits() & full, !bits(|a, b| a < b) & full);
        assert_eq!((x.lt(y) | x.eq(y)).bits(), bits(|a, b| a <= b));
        assert_eq!((x.le(y) & x.eq(y)).bits(), bits(|a, b| a == b));
        assert_eq!(x.lt(y).any(), bits(|a, b| a < b) != 0);

        let pattern = (shift as u32).wrapping_mul(2654435761) & full;
        let mask = L::mask_from_bits(pattern);
        assert_eq!(mask.bits() & full, pattern);
        let first = shift % 31;
        assert_eq!(
            L::mask_of_first(first).bits() & full,
            ((1 << first) - 1) & full,
            "the first {first} of {W}"
        );
        let picked = L::select(mask, x, y).store();
        for i in 0..W {
            let want = if pattern >> i & 1 == 1 { a[i] } else { b[i] };
            assert_eq!(picked[i].to_bits(), want.to_bits());
        }

        let ids = L::ids_select(mask, L::ids(shift as i32), L::ids(i32::MAX));
        for (i, id) in L::ids_store(ids).into_iter().enumerate() {
            assert_eq!(id, if pattern >> i & 1 == 1 { shift as i32 } else { i32::MAX });
        }
        assert_eq!(L::ids_less(ids, L::ids(shift as i32 + 1)).bits() & full, pattern);

        for (i, with) in L::ids_store(L::ids_with(mask, ids, 0x155)).into_iter().enumerate() {
            assert_eq!(with, if pattern >> i & 1 == 1 { shift as i32 | 0x155 } else { i32::MAX });
        }
        assert_eq!(
            L::ids_store(L::ids_with(!mask, L::ids(6), 3)),
            std::array::from_fn(|i| if pattern >> i & 1 == 1 { 6 } else { 7 })
        );

        // Of an id only the last bits count.
        let tagged = x.tag(ids);
        let (begins, tags) = (L::of_tagged(tagged).store(), L::ids_store(L::tags(tagged)));
        for (i, (begin, id)) in begins.into_iter().zip(L::ids_store(ids)).enumerate() {
            assert_eq!((begin.to_bits(), tags[i]), (a[i].to_bits() >> TAG << TAG, id & TAGS));
        }
    }
}

/// Checks what eight lanes can do beside that, against a model of each.
fn check_eight<L: Eight>() {
    let a: [f32; 8] = std::array::from_fn(|i| i as f32 + 0.5);
    let b = a.map(|x| x + 100.0);
    let (x, y) = (L::load(&a), L::load(&b));
    let four = |from: usize| -> &[f32; 4] { b[from..from + 4].try_into().unwrap() };
    assert_eq!(L::of_fours([four(1), four(3)]).store(), [1, 2, 3, 4, 3, 4, 5, 6].map(|i| b[i]));
    let [a2, b2] =
        [[0, 1], [2, 3]].map(|[i, j]| [a[i], a[j], b[i], b[j], a[i + 4], a[j + 4], b[i + 4], b[j + 4]]);
    assert_eq!((x.first_pairs(y).store(), x.last_pairs(y).store()), (a2, b2));

    let rows: [[f32; 8]; 4] = std::array::from_fn(|i| a.map(|x| x + 10.0 * i as f32));
    let turned = L::transpose_fours([0, 1, 2, 3].map(|i| L::load(&rows[i])));
    for (j, turned) in turned.into_iter().enumerate() {
        assert_eq!(turned.store(), std::array::from_fn(|lane| rows[lane & 3][lane & 4 | j]));
    }

    let (first, second) = (x.splat_in_fours::<0>().store(), x.splat_in_fours::<1>().store());
    let (third, fourth) = (x.splat_in_fours::<2>().store(), x.splat_in_fours::<3>().store());
    for (place, splat) in [first, second, third, fourth].into_iter().enumerate() {
        assert_eq!(splat, std::array::from_fn(|lane| a[lane & 4 | place]));
    }

    for bits in 0..256u32 {
        // Numbers beyond the lanes show that only the low bits count.
        let places: [i32; 8] = std::array::from_fn(|i| (bits.wrapping_mul(2654435761) >> (3 * i)) as i32);
        let ids = L::ids_load(&places);
        assert_eq!(L::ids_store(ids), places);
        assert_eq!(x.pick(ids).store(), places.map(|place| a[(place & 7) as usize]));
        let fours: [f32; 8] = std::array::from_fn(|i| a[i & 4 | (places[i] & 3) as usize]);
        assert_eq!(x.pick_in_fours(ids).store(), fours);
        let names = L::ids_load(&std::array::from_fn(|i| i as i32 - 4));
        assert_eq!(L::ids_store(L::ids_pick(names, ids)), places.map(|place| (place & 7) - 4));
        assert_eq!(L::ids_store(L::ids_shift::<5>(ids)), places.map(|place| (place as u32 >> 5) as i32));
        assert_eq!(L::ids_store(L::ids_and(ids, names)), std::array::from_fn(|i| places[i] & (i as i32 - 4)));
        let narrow = places.map(|place| place as u16);
        assert_eq!(L::ids_store(L::ids_widen(&narrow)), narrow.map(i32::from));

        let nibbles = bits.wrapping_mul(2654435761);
        let apart = std::array::from_fn(|lane| (nibbles >> (4 * lane)) as i32);
        assert_eq!(L::ids_store(L::ids_nibbles(nibbles)), apart);

        let (mut values, mut kept) = ([0.0; 8], [0; 8]);
        x.compact(bits, &mut values);
        L::ids_compact(ids, bits, &mut kept);
        let lanes: Vec<usize> = (0..8).filter(|lane| bits >> lane & 1 == 1).collect();
        for (next, &lane) in lanes.iter().enumerate() {
            assert_eq!((values[next], kept[next]), (a[lane], places[lane]));
        }
    }
}

/// Sixteen records of four numbers, wherever they lie, come out number by number.
#[inline(always)]
fn check_sixteen<L: Sixteen>() {
    let fours: [[f32; 4]; 16] = std::array::from_fn(|j| [0.0, 100.0, 200.0, 300.0].map(|x| x + j as f32));
    let mut scattered = [&fours[0]; 16];
    for j in 0..16 {
        scattered[j] = &fours[(j * 5) & 15];
    }
    let columns = L::of_fours(&scattered);
    assert_eq!(L::fours(&columns), scattered.map(|four| *four));
    for (i, column) in columns.into_iter().enumerate() {
        let column = column.store();
        for j in 0..16 {
            assert_eq!(column[j], fours[(j * 5) & 15][i], "number {i} of record {j}");
        }
    }
    // Row `i` has its least number at `i + turn`, the greatest one eight lanes farther; beside them stand numbers
    // that do not count, one of them none.
    for turn in 0..16 {
        let (mut rows, mut counted) = ([[0.0; 16]; 16], [0xffff; 16]);
        for i in 0..16 {
            let at = |lane: usize| (i + turn + lane) & 15;
            rows[i] = std::array::from_fn(|lane| (lane * 7 % 5) as f32);
            (rows[i][at(0)], rows[i][at(8)]) = (-10.0 - i as f32, 10.0 + i as f32);
            (rows[i][at(1)], rows[i][at(2)], rows[i][at(3)]) = (-99.0, 99.0, f32::NAN);
            counted[i] &= !(1 << at(1) | 1 << at(2) | 1 << at(3));
        }
        (counted[5], counted[9]) = (0, 1 << ((9 + turn) & 15));
        let mut least: [f32; 16] = std::array::from_fn(|i| -10.0 - i as f32);
        let mut greatest: [f32; 16] = std::array::from_fn(|i| 10.0 + i as f32);
        (least[5], greatest[5], greatest[9]) = (f32::INFINITY, f32::NEG_INFINITY, -19.0);
        assert_eq!(L::least_of_rows(&rows, &counted).store(), least);
        assert_eq!(L::greatest_of_rows(&rows, &counted).store(), greatest);
    }
    let scrambled: [[f32; 16]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|lane| ((16 * i + lane) * 29 % 64) as f32 - 20.0));
    let vectors = scrambled.each_ref().map(L::load);
    let four = |lane: usize| &scrambled[lane / 4][lane % 4 * 4..][..4];
    let least = std::array::from_fn(|lane| four(lane).iter().copied().fold(f32::INFINITY, f32::min));
    let greatest = std::array::from_fn(|lane| four(lane).iter().copied().fold(f32::NEG_INFINITY, f32::max));
    assert_eq!(L::least_of_fours(&vectors).store(), least);
    assert_eq!(L::greatest_of_fours(&vectors).store(), greatest);
    for bits in 0..256u32 {
        // Numbers beyond the lanes show that only the low bits count.
        let places: [i32; 16] = std::array::from_fn(|i| (bits.wrapping_mul(2654435761) >> i) as i32);
        let ids = L::ids_load(&places);
        let picked = places.map(|place| scrambled[1][(place & 15) as usize]);
        assert_eq!(vectors[1].pick(ids).store(), picked);
        assert_eq!(L::ids_store(L::ids_shift::<5>(ids)), places.map(|place| (place as u32 >> 5) as i32));
        let narrow = places.map(|place| place as u16);
        assert_eq!(L::ids_store(L::ids_widen(&narrow)), narrow.map(i32::from));
    }
    for part in 0..4 {
        let spread = std::array::from_fn(|lane| scrambled[0][4 * part + lane / 4]);
        assert_eq!(vectors[0].spread(part).store(), spread);
    }
    let half: &[f32; 8] = scrambled[2][3..].first_chunk().expect("there are as many");
    assert_eq!(L::of_half(L::Half::load(half)).store()[..8], half[..]);
    let side_by_side = L::side_by_side([1, 0, 3, 2].map(|i| &fours[i])).store();
    assert_eq!(side_by_side, std::array::from_fn(|lane| fours[(lane / 4) ^ 1][lane % 4]));
    let eight = [70, -3, 5, 9, 11, 2, 0, 40];
    let four = eight.first_chunk().expect("eight are more");
    assert_eq!(L::ids_store(L::ids_of_four(four)), std::array::from_fn(|lane| eight[lane % 4]));
    for part in 0..2 {
        let spread = L::ids_spread(L::Half::ids_load(&eight), part);
        assert_eq!(L::ids_store(spread), std::array::from_fn(|lane| eight[4 * part + lane / 4]));
    }
}

/// Rows here and there become columns, and what does not count is closed up.
#[inline(always)]
fn check_dense<const W: usize, L: Dense<W>>() {
    let rows: [[f32; 4]; W] = std::array::from_fn(|j| [0.0, 100.0, 200.0, 300.0].map(|x| x + j as f32));
    let scattered: [&[f32; 4]; W] = std::array::from_fn(|j| &rows[(j * 5 + 2) % W]);
    for (i, column) in L::columns(&scattered).into_iter().enumerate() {
        assert_eq!(column.store(), std::array::from_fn(|j| scattered[j][i]));
    }
    let (numbers, ids) =
        (std::array::from_fn(|i| i as f32 - 3.5), std::array::from_fn(|i| 70 - 9 * i as i32));
    for turn in 0..256u32 {
        let bits = turn.wrapping_mul(0x9e37_79b9) >> (32 - W);
        let (mut closed_up, mut closed_up_ids) = ([0.0; W], [0; W]);
        L::load(&numbers).close_up(bits, &mut closed_up);
        L::close_up_ids(L::ids_of(&ids), bits, &mut closed_up_ids);
        for (next, lane) in (0..W).filter(|lane| bits >> lane & 1 == 1).enumerate() {
            assert_eq!((closed_up[next], closed_up_ids[next]), (numbers[lane], ids[lane]), "{bits:b}");
        }
    }
}

struct CheckAll;

impl Task for CheckAll {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        check::<4, S::F4>();
        check::<8, S::F8>();
        check::<16, S::F16>();
        check_eight::<S::F8>();
        check_sixteen::<S::F16>();
        check_dense::<8, S::F8>();
        check_dense::<16, S::F16>();
    }
}

#[test]
fn every_instruction_set_computes_as_scalars_do() {
    check::<1, f32>();
    for isa in Isa::available() {
        Chosen::new(isa).expect("available").run(CheckAll);
    }
}

#[test]
fn what_is_detected_is_available() {
    assert!(Isa::available().contains(&Isa::detect()));
    assert!(Isa::available().contains(&Isa::Portable));
}

/// Says which instruction set it is compiled for.
struct Name;

impl Task for Name {
    type Output = &'static str;

    #[inline(always)]
    fn run<S: Simd>(self) -> &'static str {
        std::any::type_name::<S>()
    }
}

/// The same, and that of what it does apart.
struct NameApart;

impl Task for NameApart {
    type Output = [&'static str; 2];

    #[inline(always)]
    fn run<S: Simd>(self) -> [&'static str; 2] {
        [std::any::type_name::<S>(), S::apart(Name)]
    }
}

#[test]
fn what_is_done_apart_is_compiled_for_the_same_instruction_set() {
    for isa in Isa::available() {
        let [here, apart] = Chosen::new(isa).expect("available").run(NameApart);
        assert_eq!(here, apart, "{isa}");
        assert!(here.to_lowercase().ends_with(isa.name()), "{isa} is {here}");
    }
    assert_eq!(run_portable(NameApart)[0], run_portable(Name));
}
