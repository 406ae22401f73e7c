//! What was learnt about one kind of question, and what is done with it: lists, or beams; wide ones, or squares; and which kernel for
//! each square.

use super::asked::{Asked, Question, count};
use super::choice::{Choice, cost_of};
use super::duel::{Duel, Turn};
use super::places::Costs;
use super::{
    BEAM, FRUGAL, LEAST_RAYS, LIST, LISTS, LISTS_OR_BEAMS, LOT, PACKETS, Place, Traced, WAYS, WIDE,
    leave_out_halves, recorded,
};
use crate::traverse::accel::Accel;
use crate::traverse::kernel::Kernel;
use crate::traverse::stopwatch::Stopwatch;
use std::time::Duration;

/// Where packets take no longer than that beside beams, as a logarithm (base 2), lists are tried: they share more than packets do, and
/// less than beams. (Chosen by replays, see `docs/coherent.md`.)
const NEAR: f32 = 0.5;

/// As many squares or lots tell what beams and packets are like, before lists are compared with them: while these are being found out, many
/// squares go a way that is slow for them, and once lists are the rule there are few to find it out by (`docs/coherent.md`).
pub const MATURE: u32 = 128;

/// What cannot be told from nothing where there is next to nothing, as a logarithm (base 2): of some hundred lots of sky a few end at
/// something that costs several times as much, and which way they happened to go says nothing of it. There beams are taken, which are what
/// comes next.
const ALIKE: f32 = 0.15;

/// What was learnt about one kind of question.
#[derive(Clone, Copy, Debug, Default)]
pub struct Learnt {
    pub lists: Choice<LISTS_OR_BEAMS>,
    pub beams: Beams,
    /// Whether any rays went as lists, and the logarithm of the least that a ray has taken then: but for the first lot, which finds
    /// nothing made ready, takes up to a hundred times as long as others, and would have all that is to come look cheap.
    pub have_gone_as_lists: bool,
    least_by_lists: Option<f32>,
}

/// The same about what is done where rays do not go as lists: wide beams beside squares, and what squares do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beams {
    pub wide: Duel,
    pub squares: Choice<{ WAYS.len() }>,
    /// All rays of that kind, those that went as lists among them.
    pub traced: Traced,
}

impl Learnt {
    /// Has packets traced, lot by lot, until what is left goes as one list, as far as one holds it. Longer lists are quicker, and what they
    /// work with, which nothing else does, is fetched for as many.
    pub fn field<Q: Question>(&mut self, accel: &Accel, mut field: Asked<'_, '_, Q::Answer>) {
        leave_out_halves(accel, &WAYS, &mut self.beams.squares);
        while !field.rays.is_empty() {
            let way = self.lists_or_beams::<Q>(accel, &field);
            let (next, rest) = field.split(if way == Some(LISTS) { LIST } else { LOT });
            field = rest;
            let count = next.count();
            let Self { lists, beams, .. } = self;
            match way {
                Some(LISTS) => {
                    beams.traced.add(Kernel::Filter, count);
                    let trace = || next.trace::<Q>(accel, Kernel::Filter);
                    if let Some(cost) = recorded(accel, lists, LISTS, count, trace) {
                        self.passed_as_lists(cost);
                    }
                }
                Some(way) if count >= LEAST_RAYS => {
                    let start = Stopwatch::start(accel);
                    let in_vain = beams.lot::<Q>(accel, next);
                    lists.record(way, count, start.elapsed(accel).saturating_sub(in_vain));
                }
                _ => {
                    beams.lot::<Q>(accel, next);
                    lists.pass(beams.squares.last());
                }
            }
        }
    }

    /// Which it is for what comes next, if there is a choice.
    fn lists_or_beams<Q: Question>(
        &mut self,
        accel: &Accel,
        field: &Asked<'_, '_, Q::Answer>,
    ) -> Option<usize> {
        let go_as_lists = self.go_as_lists();
        let Self { lists, beams: Beams { squares, .. }, least_by_lists, .. } = self;
        let is_known_well = field.is_chosen_for(accel, squares) && squares.has_seen(MATURE);
        if !Q::may_go_as_lists(accel) || !is_known_well {
            return None;
        }
        // Where beams are far quicker than packets, they are quicker than lists, unless it has turned out otherwise. And rays that run
        // through little are not worth a list's trouble, which costs something even where they meet nothing.
        let is_cheap =
            lists.quickest() != LISTS && least_by_lists.is_some_and(|least| squares.last() < least);
        let in_beams = squares.quickest() == BEAM && squares.lead() > NEAR;
        let is_settled = is_cheap || in_beams && !go_as_lists;
        let of_list = &field.active[..field.active.len().min(LIST)];
        (!is_settled && count(of_list) >= LEAST_RAYS).then(|| lists.next())
    }

    /// Takes note of what a ray took where lists did, logarithm of nanoseconds.
    fn passed_as_lists(&mut self, cost: f32) {
        self.beams.squares.pass(cost);
        if self.have_gone_as_lists {
            self.least_by_lists = Some(self.least_by_lists.map_or(cost, |least| least.min(cost)));
        }
        self.have_gone_as_lists = true;
    }

    /// Whether lists have turned out to be quicker for lots.
    pub fn go_as_lists(&self) -> bool {
        !self.lists.is_beginning() && self.lists.quickest() == LISTS
    }

    /// The kernel that is thought to be quickest at the moment.
    pub fn quickest(&self) -> Kernel {
        let Beams { wide, squares, .. } = &self.beams;
        match WAYS[if go_in_beams(squares) { BEAM } else { squares.quickest() }] {
            _ if self.go_as_lists() => Kernel::Filter,
            Kernel::Tile if !wide.is_beginning() && wide.quicker() == WIDE => Kernel::WideTile,
            kernel => kernel,
        }
    }
}

impl Beams {
    /// Has a lot traced, wide or square by square, or, to compare the two, both. Gives the time that the slower one of both took then.
    fn lot<Q: Question>(&mut self, accel: &Accel, mut lot: Asked<'_, '_, Q::Answer>) -> Duration {
        let Self { wide, squares, traced } = self;
        // Where packets are quicker than beams, wide ones are out of the question.
        let packets_were_quicker =
            |place: &Place<'_>| Q::costs(place).is_some_and(|costs| costs.is_slower(BEAM));
        let in_beams = go_in_beams(squares) && !lot.places.iter().any(packets_were_quicker);
        let count = lot.count();
        if !Q::HAS_WIDE_BEAMS || !lot.is_chosen_for(accel, squares) || !in_beams || count < LEAST_RAYS {
            by_squares::<Q>(squares, traced, accel, lot);
            return Duration::ZERO;
        }
        let mut trace = |way, lot: Asked<'_, '_, Q::Answer>| {
            let start = Stopwatch::start(accel);
            match way {
                WIDE => {
                    traced.add(Kernel::WideTile, count);
                    lot.trace::<Q>(accel, Kernel::WideTile);
                }
                _ => by_squares::<Q>(squares, traced, accel, lot),
            }
            start.elapsed(accel)
        };
        match wide.next() {
            Turn::One(WIDE) => {
                let spent = trace(WIDE, lot);
                squares.pass(cost_of(count, spent));
            }
            Turn::One(_) => by_squares::<Q>(squares, traced, accel, lot),
            Turn::Both(ways) => {
                let mut spent = [Duration::ZERO; 2];
                for way in ways {
                    spent[way] = trace(way, lot.again());
                }
                wide.record(spent);
                return spent[0].max(spent[1]);
            }
        }
        Duration::ZERO
    }
}

/// Has packets traced square by square, each by the kernel that is quickest at its place.
fn by_squares<Q: Question>(
    choice: &mut Choice<{ WAYS.len() }>,
    traced: &mut Traced,
    accel: &Accel,
    lot: Asked<'_, '_, Q::Answer>,
) {
    let (count_of_squares, count_of_rays) = (lot.rays.len().div_ceil(PACKETS), lot.count());
    let places = lot.places.iter().map(Q::costs);
    let may_go_together = lot.is_chosen_for(accel, choice) && count_of_rays >= LEAST_RAYS;
    let together = if may_go_together { way_of_all(choice, places.clone(), count_of_squares) } else { None };
    let trace = |kernel, (rays, active, answers): (&[_], &[_], &mut [_])| {
        Q::trace(kernel, accel, rays, active, answers);
    };
    if let Some(way) = together {
        traced.add(WAYS[way], count_of_rays);
        let trace_all = || lot.squares().for_each(|square| trace(WAYS[way], square));
        recorded(accel, choice, way, count_of_rays, trace_all);
        return;
    }
    for (square, place) in lot.squares().zip(places.chain(std::iter::repeat(None))) {
        let rays = count(square.1);
        timed(accel, choice, place, rays, |kernel| {
            traced.add(kernel, rays);
            trace(kernel, square);
        });
    }
}

/// Has a square's rays traced, so many, by the kernel that is quickest at its place, and takes note of how long that took.
#[inline(always)]
fn timed(
    accel: &Accel,
    choice: &mut Choice<{ WAYS.len() }>,
    place: Option<&Costs<{ WAYS.len() }>>,
    rays: usize,
    trace: impl FnOnce(Kernel),
) {
    if accel.cached().is_some_and(|cached| cached.is_short()) {
        return trace(WAYS[FRUGAL]);
    }
    if rays < LEAST_RAYS {
        return trace(WAYS[choice.quickest()]);
    }
    let way = match place {
        Some(costs) => choice.next_at(&costs.known()),
        None => choice.next(),
    };
    let cost = recorded(accel, choice, way, rays, || trace(WAYS[way]));
    if let (Some(costs), Some(cost)) = (place, cost) {
        costs.record(way, cost);
    }
}

/// How much slower beams may look than the quickest way and be taken all the same.
fn leeway(squares: &Choice<{ WAYS.len() }>) -> f32 {
    if squares.is_cheapest() { ALIKE } else { 0.0 }
}

/// Whether squares go in beams.
pub fn go_in_beams(squares: &Choice<{ WAYS.len() }>) -> bool {
    squares.behind(BEAM) <= leeway(squares)
}

/// The way that all of a lot's squares go, with nothing to be learnt of any by itself: as beams, or, where there is next to nothing,
/// whichever way.
fn way_of_all<'a>(
    choice: &mut Choice<{ WAYS.len() }>,
    places: impl Iterator<Item = Option<&'a Costs<{ WAYS.len() }>>> + Clone,
    squares: usize,
) -> Option<usize> {
    if places.clone().flatten().next().is_none() {
        let way = if choice.is_cheapest() && !go_in_beams(choice) { choice.quickest() } else { BEAM };
        return choice.settles_on(way, squares, leeway(choice)).then_some(way);
    }
    let go_best = |costs: &Costs<{ WAYS.len() }>| costs.known()[BEAM].is_some() && !costs.is_slower(BEAM);
    (places.flatten().all(go_best) && choice.settles_there()).then_some(BEAM)
}
