//! Pictures with effects: each against what theory says of it, all of them against changes of the machine's part.

mod command;
mod costs;
mod cut_outs;
mod invariance;
mod physics;
mod scenes;
mod unused;
