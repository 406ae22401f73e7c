//! Whether rays are a beam, and which: what each ray and each packet look like from the apex.

use super::beam::{Extent, Frame, NARROW, PACKETS, Spread, WIDEN};
use crate::simd::{Mask, Sixteen};
use crate::traverse::lanes::RayPacket;
use crate::traverse::range::{LEAST, LIMIT};
use crate::traverse::walk::Interval;

/// What rays of a beam have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// They part from the apex.
    From,
    /// They run toward the apex, and no farther.
    Toward,
    /// They are parallel.
    Along,
}

/// Rays toward an apex may pass it by as much, relative to the distance, and to the apex's coordinates:
/// their directions are rounded, and the apex is.
const STRAY: f32 = 1.0 / (1 << 20) as f32;
const STRAY_OF_PLACE: f32 = 1.0 / (1 << 22) as f32;

/// So many packets of a square may not belong to a beam: a tile at the edge of something, or where a light's rays turn from running
/// fastest along one axis to another, has some that point elsewhere. With more, rays are taken to have nothing in
/// common, which shows soon.
const MISFITS: u32 = 12;

/// The least squared sine of an angle between two rays that tells where they meet.
const NARROWEST: f64 = 1e-12;

/// The slopes of rays from a beam's apex, along the first of the frame's axes and along the second, packet by packet of
/// each of `K` squares. Those of lanes that do not belong to it may be anything.
///
/// They are the directions' own, as tests have them. Where the frame is turned, those that its window has are these turned.
#[repr(C, align(64))]
pub struct Slopes<const K: usize>([[[[f32; 16]; PACKETS]; 2]; K]);

impl<const K: usize> Slopes<K> {
    pub const fn new() -> Self {
        Self([[[[0.0; 16]; PACKETS]; 2]; K])
    }

    /// Those of a packet.
    #[inline(always)]
    pub fn of<L: Sixteen>(&self, square: usize, packet: usize) -> [L; 2] {
        let [first, second] = &self.0[square];
        [L::load(&first[packet]), L::load(&second[packet])]
    }
}

/// What the first two coordinates of rays are in the beam's window, and their depths.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Seen {
    /// The first coordinate of each packet's rays' places, then the other one.
    pub place: [[[f32; 16]; PACKETS]; 2],
    /// The depth at which `t` is 0.
    pub start: [[f32; 16]; PACKETS],
    /// By how much the depth grows with `t`: less than 0 for rays toward the apex.
    pub speed: [[f32; 16]; PACKETS],
    /// The depths between which each ray looks for hits.
    pub near: [[f32; 16]; PACKETS],
    pub far: [[f32; 16]; PACKETS],
}

impl Seen {
    pub const fn new() -> Self {
        const ROWS: [[f32; 16]; PACKETS] = [[0.0; 16]; PACKETS];
        Self { place: [ROWS; 2], start: ROWS, speed: ROWS, near: ROWS, far: ROWS }
    }
}

/// The first lane that counts of a packet.
#[inline(always)]
fn first_lane(active: &[u32], packet: usize) -> Option<usize> {
    (active[packet] != 0).then(|| active[packet].trailing_zeros() as usize & 15)
}

#[inline(always)]
fn origin<const W: usize>(rays: &RayPacket<W>, lane: usize) -> [f32; 3] {
    [rays.origin[0][lane], rays.origin[1][lane], rays.origin[2][lane]]
}

#[inline(always)]
fn direction<const W: usize>(rays: &RayPacket<W>, lane: usize) -> [f32; 3] {
    [rays.direction[0][lane], rays.direction[1][lane], rays.direction[2][lane]]
}

/// The form that rays have if they have any, and its frame, about the way that the packet in the middle goes.
#[inline(always)]
pub fn guess<const K: usize>(rays: &[RayPacket<16>], active: &[[u32; PACKETS]; K]) -> Option<(Form, Frame)> {
    let active = active.as_flattened();
    let first = (0..rays.len()).find(|&packet| active[packet] != 0)?;
    let last = (0..rays.len()).rfind(|&packet| active[packet] != 0)?;
    let (lane, other) = (first_lane(active, first)?, 31 - (active[last] & 0xffff).leading_zeros() as usize);
    let (o, d) = (origin(&rays[first], lane), direction(&rays[first], lane));
    let middle = (first + last) / 2 % (PACKETS * K);
    let middle = if active[middle] != 0 { middle } else { first };
    let way = direction(&rays[middle], first_lane(active, middle)?);
    if o == origin(&rays[last], other) {
        return Some((Form::From, Frame::new(o, way)));
    }
    if d == direction(&rays[last], other) {
        return Some((Form::Along, Frame::new(o, d)));
    }
    Some((Form::Toward, Frame::new(meeting(rays, active, first)?, way.map(|x| -x))))
}

/// Where rays meet, if they do: where the first comes nearest to that one of all packets' first rays
/// that parts from it most. In double precision: of a narrow beam, rays meet far away.
#[inline(always)]
fn meeting(rays: &[RayPacket<16>], active: &[u32], first: usize) -> Option<[f32; 3]> {
    let double = |v: [f32; 3]| glam::DVec3::from_array(v.map(f64::from));
    let lane = first_lane(active, first)?;
    let d = double(direction(&rays[first], lane));

    // The one that parts most, by the squared sine of the angle, a quotient, times the first direction's squared length.
    let (mut widest, mut square, mut place) = (0.0, 1.0, None);
    for packet in first + 1..rays.len() {
        let Some(lane) = first_lane(active, packet) else { continue };
        let e = double(direction(&rays[packet], lane));
        let (area, ee) = (d.cross(e).length_squared(), e.length_squared());
        if area * square > widest * ee {
            (widest, square, place) = (area, ee, Some((packet, lane)));
        }
    }
    let (packet, other) = place?;
    let (o, p) = (double(origin(&rays[first], lane)), double(origin(&rays[packet], other)));
    let (e, dd) = (double(direction(&rays[packet], other)), d.length_squared());
    if widest <= NARROWEST * dd * square {
        return None;
    }
    let way = p - o;
    let t = (square * way.dot(d) - d.dot(e) * way.dot(e)) / widest;
    (t > 0.0).then(|| (o + d * t).as_vec3().to_array())
}

/// The packets' extents, square by square, and their rays' slopes, if the rays are a beam from its apex. What does not belong to
/// it is taken out of `active`: rays that do not run fastest along the frame's axis, and whole packets in which another ray has
/// another origin, is not an ordinary one, or reaches behind its origin. `None` if there are more than [`MISFITS`] packets for
/// each square of which nothing belongs.
#[inline(always)]
pub fn from_apex<L: Sixteen, const K: usize>(
    frame: &Frame,
    rays: &[RayPacket<16>],
    active: &mut [[u32; PACKETS]; K],
    slopes: &mut Slopes<K>,
) -> Option<[Extent<L>; K]> {
    let mut extents = [Extent::none(); K];
    let mut misfits = 0;
    let squares = rays.chunks(PACKETS).zip(active).zip(&mut slopes.0);
    for (((rays, active), slopes), extent) in squares.zip(&mut extents) {
        *extent = square_from_apex(frame, rays, active, slopes, &mut misfits, MISFITS * K as u32)?;
    }
    Some(extents)
}

/// The same of one square; `None` as soon as there are more than `most` `misfits`.
#[inline(always)]
fn square_from_apex<L: Sixteen>(
    frame: &Frame,
    rays: &[RayPacket<16>],
    active: &mut [u32; PACKETS],
    slopes: &mut [[[f32; 16]; PACKETS]; 2],
    misfits: &mut u32,
    most: u32,
) -> Option<Extent<L>> {
    let (zero, endless) = (L::splat(0.0), L::splat(f32::INFINITY));
    let (mut nearest, mut farthest) = ([0.0; PACKETS], [f32::INFINITY; PACKETS]);
    for (packet, rays) in rays.iter().enumerate() {
        if active[packet] == 0 {
            continue;
        }
        let axis = frame.axes[2];
        let along = L::load(&rays.direction[axis]);
        let forward = along * L::splat(frame.sign);
        let (tnear, tfar) = (L::load(&rays.tnear), L::load(&rays.tfar));
        let mut fits = ordinary(forward, tnear, tfar);
        for axis in 0..3 {
            fits = fits & L::load(&rays.origin[axis]).eq(L::splat(frame.apex[axis]));
        }
        let slope = [
            L::load(&rays.direction[frame.axes[0]]) / along,
            L::load(&rays.direction[frame.axes[1]]) / along,
        ];
        let lanes = belonging(active[packet], fits.bits(), are_flat(&slope, 1.0).bits());
        active[packet] = lanes;
        if lanes == 0 {
            left_out(misfits, most)?;
            continue;
        }
        (slopes[0][packet], slopes[1][packet]) = (slope[0].store(), slope[1].store());
        // Rays from a camera mostly have no ends of their own.
        let endless = tnear.eq(zero) & tfar.eq(endless);
        if endless.bits() & lanes != lanes {
            (nearest[packet], farthest[packet]) = ends(lanes, tnear * forward, tfar * forward);
        }
    }
    for packet in 0..PACKETS {
        if active[packet] == 0 {
            (nearest[packet], farthest[packet]) = (f32::INFINITY, f32::NEG_INFINITY);
        }
    }
    let (mut low, mut high) = rectangles::<L>(slopes, active);
    if frame.sign < 0.0 {
        // Turning the divisor turns the quotient, and changes nothing else.
        (low, high) = ([zero - high[0], zero - high[1]], [zero - low[0], zero - low[1]]);
    }
    Some(extent(low, high, L::load(&nearest), L::load(&farthest), 0.0))
}

/// The packets' extents, what each ray looks like, and how far rays are off, if they are a beam of some
/// form. What does not belong to it is taken out of `active`, as by [`from_apex`]; `None` if there are more than [`MISFITS`]
/// packets of which nothing does.
#[inline(always)]
pub fn of_form<L: Sixteen>(
    form: Form,
    frame: &Frame,
    rays: &[RayPacket<16>],
    active: &mut [u32; PACKETS],
    seen: &mut Seen,
) -> Option<(Extent<L>, Spread)> {
    let zero = L::splat(0.0);
    let sign = L::splat(frame.sign);
    let along = [L::splat(frame.slopes[0]), L::splat(frame.slopes[1])];
    let place = frame.apex.iter().fold(0.0f32, |place, x| place.max(x.abs()));
    let mut range = zero;
    let mut first_direction = None;
    let mut misfits = 0;
    for (packet, rays) in rays.iter().enumerate() {
        let lanes = active[packet];
        if lanes == 0 {
            continue;
        }
        let [x, y, z] = frame.axes;
        let d =
            [L::load(&rays.direction[x]), L::load(&rays.direction[y]), L::load(&rays.direction[z]) * sign];
        let o = [
            L::load(&rays.origin[x]) - L::splat(frame.apex[x]),
            L::load(&rays.origin[y]) - L::splat(frame.apex[y]),
            (L::load(&rays.origin[z]) - L::splat(frame.apex[z])) * sign,
        ];
        let (tnear, tfar) = (L::load(&rays.tnear), L::load(&rays.tfar));
        let forward = if form == Form::Toward { zero - d[2] } else { d[2] };
        let mut fits = ordinary(forward, tnear, tfar);
        // One division in place of two: what is told from places allows for more than the rounding that this adds, and lanes
        // that run about as fast along another axis stay out.
        let rate = L::splat(1.0) / d[2];
        let slopes = if form == Form::Along { along } else { [d[0] * rate, d[1] * rate] };

        let (start, end) = (o[2] + d[2] * tnear, o[2] + d[2] * tfar);
        let crossing = [o[0] - slopes[0] * o[2], o[1] - slopes[1] * o[2]];
        let (near, far) = if form == Form::Toward { (end, start) } else { (start, end) };
        match form {
            Form::From => {
                fits = fits & o[0].eq(zero) & o[1].eq(zero) & o[2].eq(zero);
            }
            Form::Toward => {
                let stray = o[2] * L::splat(STRAY) + L::splat(place * STRAY_OF_PLACE);
                fits = fits & crossing[0].abs().le(stray) & crossing[1].abs().le(stray);
                fits = fits & (zero - stray).le(near);
            }
            Form::Along => {
                let lane = lanes.trailing_zeros() as usize & 15;
                let first = *first_direction.get_or_insert_with(|| direction(rays, lane));
                for axis in 0..3 {
                    fits = fits & L::load(&rays.direction[axis]).eq(L::splat(first[axis]));
                    // Nothing else asks where they start.
                    fits = fits & o[axis].abs().le(L::splat(f32::MAX));
                }
            }
        }
        // Parallel rays run fastest along the frame's axis as they are, or as fast along another one; of such axes the frame takes
        // the one that tests take.
        let flat = if form == Form::Along { lanes } else { are_flat(&slopes, NARROW).bits() };
        let lanes = belonging(lanes, fits.bits(), flat);
        active[packet] = lanes;
        if lanes == 0 {
            left_out(&mut misfits, MISFITS)?;
            continue;
        }
        let counts = L::mask_from_bits(lanes);
        range = range.max(L::select(counts, o[0].abs().max(o[1].abs()).max(o[2].abs()), zero));
        let places = if form == Form::Along { crossing } else { slopes };
        (seen.place[0][packet], seen.place[1][packet]) = (places[0].store(), places[1].store());
        seen.start[packet] = o[2].store();
        seen.speed[packet] = d[2].store();
        seen.near[packet] = near.store();
        seen.far[packet] = far.store();
    }
    let range = range.greatest();
    let stray = if form == Form::Toward { range * STRAY + place * STRAY_OF_PLACE } else { 0.0 };
    let (low, high) = rectangles::<L>(&seen.place, active);
    let nearest = L::least_of_rows(&seen.near, active);
    let farthest = L::greatest_of_rows(&seen.far, active);
    Some((extent(low, high, nearest, farthest, range), Spread { range, stray }))
}

/// The lanes of a packet that belong to a beam: those that run fastest along its axis, if all of these fit. (If one of them
/// does not, its packet's rays have less in common than it takes, and all of them stay out.)
#[inline(always)]
fn belonging(lanes: u32, fits: u32, flat: u32) -> u32 {
    let flat = lanes & flat;
    if flat & !fits == 0 { flat } else { 0 }
}

/// The lanes whose slopes are less than `limit`: with one of 1, those that run fastest along the axis that slopes are relative to.
#[inline(always)]
fn are_flat<L: Sixteen>(slopes: &[L; 2], limit: f32) -> L::Mask {
    slopes[0].abs().lt(L::splat(limit)) & slopes[1].abs().lt(L::splat(limit))
}

/// One more packet of which nothing belongs. `None` if there are more than `most`.
#[inline(always)]
fn left_out(misfits: &mut u32, most: u32) -> Option<()> {
    *misfits += 1;
    (*misfits <= most).then_some(())
}

/// The lanes whose rays are ordinary: their speed forward, which is the direction's greatest component,
/// is within what kernels compute with, and their interval begins at the origin or beyond. A NaN
/// anywhere fails.
#[inline(always)]
fn ordinary<L: Sixteen>(forward: L, tnear: L, tfar: L) -> L::Mask {
    L::splat(LEAST).le(forward)
        & forward.lt(L::splat(LIMIT))
        & L::splat(0.0).le(tnear)
        & tfar.le(L::splat(f32::INFINITY))
}

/// Where the first of some lanes looks for hits, and where the last does.
#[inline(always)]
fn ends<L: Sixteen>(lanes: u32, near: L, far: L) -> (f32, f32) {
    let counts = L::mask_from_bits(lanes);
    let nearest = L::select(counts, near, L::splat(f32::INFINITY)).least();
    (nearest, L::select(counts, far, L::splat(f32::NEG_INFINITY)).greatest())
}

/// The least and the greatest places of each packet.
#[inline(always)]
fn rectangles<L: Sixteen>(
    [first, second]: &[[[f32; 16]; PACKETS]; 2],
    active: &[u32; PACKETS],
) -> ([L; 2], [L; 2]) {
    (
        [L::least_of_rows(first, active), L::least_of_rows(second, active)],
        [L::greatest_of_rows(first, active), L::greatest_of_rows(second, active)],
    )
}

/// The extents of packets whose rays' origins are up to `range` away from the apex.
#[inline(always)]
fn extent<L: Sixteen>(low: [L; 2], high: [L; 2], nearest: L, farthest: L, range: f32) -> Extent<L> {
    // Outward by more than the roundings of depths, which are sums, and may have either sign.
    let more = L::splat(range * (WIDEN - 1.0));
    let tmin = (nearest * L::splat(NARROW)).min(nearest * L::splat(WIDEN)) - more;
    let tmax = (farthest * L::splat(WIDEN)).max(farthest * L::splat(NARROW)) + more;
    Extent { low, high, depths: Interval { tmin, tmax } }
}
