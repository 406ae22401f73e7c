//! Pictures with effects: each against what theory says of it, all of them against changes of the machine's part.

mod command;
mod cornell;
#[path = "../common/cornell.rs"]
mod cornell_box;
mod costs;
mod cut_outs;
mod invariance;
mod physics;
mod scenes;
mod unused;
