//! Threads that read blocks for others, and what they leave to these.

use super::blocks::Blocks;
use super::requests::{Request, Requests};
use super::sync::Arc;
use super::sync::thread::{self, JoinHandle};

/// The loaders, which end when this is dropped. There may be none: then who needs a block reads it.
#[derive(Debug, Default)]
pub struct Loaders {
    requests: Option<Arc<Requests>>,
    threads: Vec<JoinHandle<()>>,
}

impl Loaders {
    /// So many threads, of which up to `ahead` read ahead of need at a time.
    ///
    /// # Errors
    /// The system starts no threads; those that it has started have ended.
    pub fn new(blocks: &Arc<Blocks>, count: usize, ahead: usize) -> std::io::Result<Self> {
        let mut loaders = Self::default();
        if count > 0 {
            let requests = Arc::new(Requests::new(count, ahead));
            loaders.requests = Some(Arc::clone(&requests));
            for number in 0..count {
                let (blocks, requests) = (Arc::clone(blocks), Arc::clone(&requests));
                let loader = thread::Builder::new().name(format!("loader-{number}"));
                loaders.threads.push(loader.spawn(move || serve(&blocks, &requests))?);
            }
        }
        Ok(loaders)
    }

    /// Whether there are any.
    pub fn are_there(&self) -> bool {
        self.requests.is_some()
    }

    /// Whether who needs a block is to read it himself, in whose place others go on: until what is returned is dropped.
    /// `None` if it has to be asked for.
    pub fn own(&self) -> Option<Own<'_>> {
        self.requests.as_deref().filter(|requests| requests.try_own()).map(Own)
    }

    /// Asks for a block that the directory has said is absent, and waits while very many are asked for; whether there
    /// is anybody to ask.
    pub fn need(&self, block: u32) -> bool {
        self.requests.as_ref().map(|requests| requests.need(block)).is_some()
    }

    /// Asks for blocks ahead of need; never waits.
    pub fn ahead(&self, blocks: &[u32]) {
        if let Some(requests) = &self.requests {
            requests.ahead(blocks);
        }
    }

    /// Asks for as much of what nobody has asked for as [may come](Blocks::allow_rest); never waits.
    pub fn rest(&self) {
        if let Some(requests) = &self.requests {
            requests.rest();
        }
    }

    /// Waits until all that was asked for ahead of need has come, or has not.
    #[cfg(test)]
    pub fn wait_ahead(&self) {
        if let Some(requests) = &self.requests {
            requests.wait_ahead();
        }
    }

    /// Forgets what was asked for ahead of need; nothing of it is being read afterwards.
    pub fn forget_ahead(&self) {
        if let Some(requests) = &self.requests {
            requests.forget_ahead();
        }
    }
}

impl Drop for Loaders {
    fn drop(&mut self) {
        if let Some(requests) = self.requests.take() {
            requests.close();
        }
        for loader in self.threads.drain(..) {
            // It ends with its last request; had it panicked, who waits for its block would wait forever.
            loader.join().expect("loaders do not panic");
        }
    }
}

/// A read by who needs the block.
#[derive(Debug)]
pub struct Own<'a>(&'a Requests);

impl Drop for Own<'_> {
    fn drop(&mut self) {
        self.0.done_own();
    }
}

/// What a loader does.
fn serve(blocks: &Blocks, requests: &Requests) {
    while let Some(request) = requests.next() {
        match request {
            Request::Needed(block) => blocks.load_with_others(block),
            Request::Ahead(block) => blocks.load_ahead(block),
            Request::Rest => {
                if !blocks.load_rest_of_frame() {
                    requests.rest_has_come();
                }
            }
        }
        requests.done(request);
    }
}
