//! Files that are mapped, and which of them an address lies in.
//!
//! What no map can promise is that its file stays as it is. A program that reads where a file has been cut short
//! meanwhile, or where the disk fails, is sent a signal (SIGBUS on Unix), which ends it without a word. The library
//! installs no handler for that: signals belong to the program. A program that does (the command line does, on Linux)
//! asks [`with_name_at`] which file it was.

use memmap2::Mmap;
use std::fs::File;
use std::io;
use std::ops::Deref;
use std::path::Path;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};

/// A file's bytes, mapped to be read. As long as it lives, [`with_name_at`] knows of it.
#[derive(Debug)]
pub struct Map {
    map: Mmap,
    /// Its place in the list, and the name that stands there; none if the list was full.
    #[expect(clippy::box_collection, reason = "the name stays where it is when the map moves")]
    listed: Option<(usize, Box<String>)>,
}

impl Map {
    /// Opens a file and maps it.
    ///
    /// # Errors
    /// It is no file that can be read.
    pub fn open(path: &Path) -> io::Result<(File, Self)> {
        let file = File::open(path)?;
        if file.metadata()?.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        // SAFETY: the map is read-only. That no other process writes to the file meanwhile is what no map can
        // promise; raypack itself never does, it replaces files whole. Every type that is read from it has a value
        // for any bits, and what is read is checked where it is used, so that bytes changed behind our back give an
        // error, another model or picture, or a panic; for a file that is cut short, see above.
        let map = unsafe { Mmap::map(&file) }?;
        let name = path.display().to_string();
        // It is for a message of one line.
        let name = Box::new(name.split_whitespace().collect::<Vec<_>>().join(" "));
        let listed = Listed::add(&map, &name).map(|place| (place, name));
        Ok((file, Self { map, listed }))
    }
}

impl Deref for Map {
    type Target = Mmap;

    fn deref(&self) -> &Mmap {
        &self.map
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        // The bytes and the name go after this.
        if let Some((place, _)) = self.listed {
            LIST[place].clear();
        }
    }
}

/// A map in the list: atomics, because a handler of signals may wait for nobody.
struct Listed {
    is_taken: AtomicBool,
    start: AtomicUsize,
    /// Behind its last byte; 0 while it is nobody's, or not yet all here.
    end: AtomicUsize,
    name: AtomicPtr<String>,
}

/// Maps that are known at a time. Models have a few files, a scene one.
const PLACES: usize = 256;

static LIST: [Listed; PLACES] = [const { Listed::none() }; PLACES];

impl Listed {
    const fn none() -> Self {
        Self {
            is_taken: AtomicBool::new(false),
            start: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
            name: AtomicPtr::new(ptr::null_mut()),
        }
    }

    /// Lists bytes under a name, which does not move until the place is cleared; `None` if there is no place left.
    fn add(bytes: &[u8], name: &String) -> Option<usize> {
        let place = LIST.iter().position(|listed| !listed.is_taken.swap(true, Ordering::Acquire))?;
        let listed = &LIST[place];
        let range = bytes.as_ptr_range();
        listed.start.store(range.start.addr(), Ordering::Relaxed);
        listed.name.store(ptr::from_ref(name).cast_mut(), Ordering::Relaxed);
        listed.end.store(range.end.addr(), Ordering::Release);
        Some(place)
    }

    fn clear(&self) {
        self.end.store(0, Ordering::Relaxed);
        self.is_taken.store(false, Ordering::Release);
    }

    fn holds(&self, address: usize) -> bool {
        address < self.end.load(Ordering::Acquire) && address >= self.start.load(Ordering::Relaxed)
    }
}

/// Has `tell` know in what file, as it was named when it was opened, an address lies; `None` if in none that is mapped.
/// Waits for nobody and allocates nothing: handlers of signals may call it.
///
/// # Safety
/// The calling thread is reading at that address, as one is that was interrupted there: so the map that it lies in
/// is not dropped meanwhile.
pub unsafe fn with_name_at<R>(address: usize, tell: impl FnOnce(&str) -> R) -> Option<R> {
    let listed = LIST.iter().find(|listed| listed.holds(address))?;
    // SAFETY: a name is there, and stays, until its map is dropped, which it is not.
    let name = unsafe { &*listed.name.load(Ordering::Relaxed) };
    Some(tell(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn name_at(map: &Map, byte: usize) -> Option<String> {
        // SAFETY: the caller has the map.
        unsafe { with_name_at(map.as_ptr().addr() + byte, str::to_owned) }
    }

    #[test]
    fn addresses_are_those_of_their_files_until_these_are_closed() {
        let folder = tempfile::tempdir().expect("a folder");
        let [one, other] = ["one", "another\n one"].map(|name| {
            let path = folder.path().join(name);
            fs::write(&path, [7; 10_000]).expect("written");
            Map::open(&path).expect("mapped").1
        });
        for byte in [0, 1, 9999] {
            assert!(name_at(&one, byte).expect("listed").ends_with("one"));
            assert!(name_at(&other, byte).expect("listed").ends_with("another one"));
        }
        assert_eq!(name_at(&one, usize::MAX / 2), None);
        let address = one.as_ptr().addr();
        drop(one);
        // SAFETY: nothing is found there, and nothing is read.
        assert_eq!(unsafe { with_name_at(address, str::to_owned) }, None);
        assert!(name_at(&other, 5).is_some());
        assert!(Map::open(folder.path()).is_err());
    }

    #[test]
    fn maps_that_find_no_place_in_the_list_are_maps_all_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        fs::write(&path, b"bytes").expect("written");
        let maps: Vec<Map> = (0..PLACES + 3).map(|_| Map::open(&path).expect("mapped").1).collect();
        let known = maps.iter().filter(|map| name_at(map, 0).is_some()).count();
        assert!(known > PLACES / 2 && known <= PLACES, "{known}");
        assert!(maps.iter().all(|map| map[..] == b"bytes"[..]));
    }
}
