//! Progress bars: on standard error, and only if that is a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// Steps of a bar.
const STEPS: u64 = 1000;

/// How often a bar looks for progress.
const INTERVAL: Duration = Duration::from_millis(50);

/// A bar that shows a part of 1. It vanishes when dropped.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar for what `word` says, invisible where no one would see it.
    pub fn new(word: &str) -> Self {
        if !std::io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let style = ProgressStyle::with_template("{msg:10} {bar:40} {percent:>3} % {elapsed:>5}")
            .expect("the template is well-formed");
        Self(ProgressBar::new(STEPS).with_style(style).with_message(word.to_owned()))
    }

    /// Changes what it says.
    pub fn say(&self, words: &str) {
        self.0.set_message(words.to_owned());
    }

    /// Shows a part of 1.
    pub fn set(&self, fraction: f64) {
        self.0.set_position((fraction * STEPS as f64) as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Does `work` while a bar shows what `fraction` says of it.
pub fn watch<T>(word: &str, fraction: impl Fn() -> f64 + Sync, work: impl FnOnce() -> T) -> T {
    let bar = Bar::new(word);
    if bar.0.is_hidden() {
        return work();
    }
    thread::scope(|scope| {
        // Dropping the sender, even by a panic in `work`, ends the watch.
        let (working, done) = mpsc::channel::<()>();
        scope.spawn(|| {
            let done = done;
            while done.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                bar.set(fraction());
            }
        });
        let result = work();
        drop(working);
        result
    })
}
