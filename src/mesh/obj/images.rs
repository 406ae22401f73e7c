//! The pictures that MTL files name: looked for, and never opened.

use crate::mesh::{Image, ImageSource, ReadReport};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Folders in which a picture is looked for whose path leads to somebody else's computer.
const USUAL_FOLDERS: [&str; 5] = ["textures", "texture", "maps", "images", "tex"];

/// The pictures of a model, each once, whatever it is called.
pub(super) struct Images {
    /// The model's folder, all links followed; `None` if there is no such folder.
    root: Option<PathBuf>,
    list: Vec<Image>,
    /// Places in `list`, by file, and by a MTL file's folder and the name written there.
    by_path: HashMap<PathBuf, u32>,
    by_name: HashMap<(PathBuf, String), u32>,
    missing: Vec<String>,
    outside: Vec<String>,
    /// What folders hold, by name in lower case.
    listings: HashMap<PathBuf, BTreeMap<String, PathBuf>>,
}

/// Why a name leads to no picture.
#[derive(Debug, PartialEq)]
enum Fault {
    /// It leads out of the model's folder: a model is not to have other files of its user read.
    Outside,
    /// There is no such file.
    NotFound,
}

impl Images {
    /// None yet, of a model in `folder`.
    pub fn new(folder: &Path) -> Self {
        Self {
            root: real(folder),
            list: Vec::new(),
            by_path: HashMap::new(),
            by_name: HashMap::new(),
            missing: Vec::new(),
            outside: Vec::new(),
            listings: HashMap::new(),
        }
    }

    /// The place in the list of a picture that a MTL file in `folder` calls `name`.
    pub fn place(&mut self, folder: &Path, name: &str) -> u32 {
        let key = (folder.to_owned(), name.to_owned());
        if let Some(&place) = self.by_name.get(&key) {
            return place;
        }
        let place = match self.find(folder, name) {
            Ok(path) => match self.by_path.get(&path) {
                Some(&place) => place,
                None => {
                    let place = self.add(name, ImageSource::File(path.clone()));
                    self.by_path.insert(path, place);
                    place
                }
            },
            Err(fault) => self.without(name, &fault),
        };
        self.by_name.insert(key, place);
        place
    }

    /// Adds a picture that is not there, once by name.
    fn without(&mut self, name: &str, fault: &Fault) -> u32 {
        let (names, why) = match fault {
            Fault::Outside => (&mut self.outside, "lies outside of the model's folder"),
            Fault::NotFound => (&mut self.missing, "not found"),
        };
        if names.iter().any(|known| known == name) {
            let same = |image: &Image| image.name == name && image.source == ImageSource::Missing(why.into());
            if let Some(place) = self.list.iter().position(same) {
                return place as u32;
            }
        }
        names.push(name.to_owned());
        self.add(name, ImageSource::Missing(why.into()))
    }

    fn add(&mut self, name: &str, source: ImageSource) -> u32 {
        self.list.push(Image { name: name.to_owned(), source });
        self.list.len() as u32 - 1
    }

    /// All of them; says which are missing.
    pub fn finish(self, report: &mut ReadReport) -> Vec<Image> {
        report.missing_textures.extend(self.missing);
        report.outside_textures.extend(self.outside);
        self.list
    }

    /// A regular file in the model's folder.
    ///
    /// Backslashes separate like slashes, and names are the same in whatever case if none is in the same. A path
    /// that begins at a root or a drive was written on another computer: what it ends in is looked for, the most of
    /// it first, then its file's name alone in the folders where pictures usually are.
    fn find(&mut self, folder: &Path, name: &str) -> Result<PathBuf, Fault> {
        let root = self.root.clone().ok_or(Fault::NotFound)?;
        let folder = real(folder).ok_or(Fault::NotFound)?;
        let base = folder.strip_prefix(&root).map_err(|_| Fault::Outside)?;
        let base: Vec<&str> =
            base.iter().map(|part| part.to_str()).collect::<Option<_>>().ok_or(Fault::NotFound)?;
        let slashed = name.replace('\\', "/");
        let parts: Vec<&str> = slashed.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
        let has_drive = parts.first().is_some_and(
            |part| matches!(part.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic()),
        );
        if !has_drive && !slashed.starts_with('/') {
            return self.descend(&root, &base, &parts);
        }
        let parts: Vec<&str> =
            parts.into_iter().filter(|part| *part != ".." && !part.ends_with(':')).collect();
        let endings = (0..parts.len()).map(|first| parts[first..].to_vec());
        let usual = USUAL_FOLDERS.into_iter().filter_map(|folder| Some(vec![folder, *parts.last()?]));
        let candidates: Vec<Vec<&str>> = endings.chain(usual).collect();
        candidates.iter().find_map(|parts| self.descend(&root, &base, parts).ok()).ok_or(Fault::NotFound)
    }

    /// The file that `parts` lead to from the folder `base` in `root`.
    fn descend(&mut self, root: &Path, base: &[&str], parts: &[&str]) -> Result<PathBuf, Fault> {
        let mut inside = base.to_vec();
        for part in parts {
            if *part == ".." {
                inside.pop().ok_or(Fault::Outside)?;
            } else {
                inside.push(part);
            }
        }
        let mut path = root.to_owned();
        for part in inside {
            let exact = path.join(part);
            path = if exact.exists() {
                exact
            } else {
                self.whatever_case(&path, part).ok_or(Fault::NotFound)?
            };
        }
        // Links may lead out where names do not.
        let path = path.canonicalize().map_err(|_| Fault::NotFound)?;
        match path.starts_with(root) {
            true if path.is_file() => Ok(path),
            true => Err(Fault::NotFound),
            false => Err(Fault::Outside),
        }
    }

    /// What a folder holds under a name in another case; of several, the first in the order of their names.
    fn whatever_case(&mut self, folder: &Path, name: &str) -> Option<PathBuf> {
        let listing = self.listings.entry(folder.to_owned()).or_insert_with(|| {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let mut names: Vec<_> = entries.map(|entry| entry.file_name()).collect();
            names.sort_unstable_by(|a, b| b.cmp(a));
            let lower = |name: &std::ffi::OsString| name.to_string_lossy().to_lowercase();
            names.iter().map(|name| (lower(name), folder.join(name))).collect()
        });
        listing.get(&name.to_lowercase()).cloned()
    }
}

/// A folder, all links followed.
fn real(folder: &Path) -> Option<PathBuf> {
    let here = folder.as_os_str().is_empty();
    if here { Path::new(".") } else { folder }.canonicalize().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use tempfile::TempDir;

    /// `outside.png`, and beside it the folder of a model with some pictures.
    fn model() -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let model = folder.path().join("model");
        for name in ["outside.png", "model/wood.png", "model/Textures/Brick Wall.PNG", "model/mtl/own.png"] {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, "").expect("written");
        }
        (folder, model)
    }

    #[test]
    fn pictures_are_found_as_they_are_named_on_any_system() {
        let (_folder, model) = model();
        let mut images = Images::new(&model);
        for (name, file) in [
            ("wood.png", "wood.png"),
            ("./WOOD.png", "wood.png"),
            ("Textures/Brick Wall.PNG", "Textures/Brick Wall.PNG"),
            ("textures\\brick wall.png", "Textures/Brick Wall.PNG"),
            ("textures/../wood.png", "wood.png"),
            ("D:\\work\\model\\Textures\\brick wall.png", "Textures/Brick Wall.PNG"),
            ("D:\\brick wall.png", "Textures/Brick Wall.PNG"),
            ("/somewhere/else/model/wood.png", "wood.png"),
            ("\\\\server\\share\\wood.png", "wood.png"),
        ] {
            let expected = model.join(file).canonicalize().expect("there");
            assert_eq!(images.find(&model, name), Ok(expected), "{name}");
        }
        let own = model.join("mtl/own.png").canonicalize().expect("there");
        assert_eq!(images.find(&model.join("mtl"), "own.png"), Ok(own));
        let wood = model.join("wood.png").canonicalize().expect("there");
        assert_eq!(images.find(&model.join("mtl"), "../wood.png"), Ok(wood));
    }

    #[test]
    fn nothing_outside_of_the_folder_is_a_picture() {
        let (folder, model) = model();
        let mut images = Images::new(&model);
        let absolute = folder.path().join("outside.png");
        for (name, fault) in [
            ("../outside.png", Fault::Outside),
            ("..\\outside.png", Fault::Outside),
            ("../nowhere.png", Fault::Outside),
            ("textures/../../model/../outside.png", Fault::Outside),
            (absolute.to_str().expect("UTF-8"), Fault::NotFound),
            ("no.png", Fault::NotFound),
            ("Textures", Fault::NotFound),
            ("wood.png/x", Fault::NotFound),
            ("a\0b", Fault::NotFound),
            ("/", Fault::NotFound),
            ("C:", Fault::NotFound),
        ] {
            assert_eq!(images.find(&model, name), Err(fault), "{name}");
        }
        assert_eq!(images.find(folder.path(), "outside.png"), Err(Fault::Outside), "a MTL file elsewhere");
    }

    #[test]
    #[cfg(unix)]
    fn links_do_not_lead_out() {
        let (folder, model) = model();
        std::os::unix::fs::symlink(folder.path(), model.join("up")).expect("a link");
        std::os::unix::fs::symlink(model.join("wood.png"), model.join("alias.png")).expect("a link");
        let mut images = Images::new(&model);
        assert_eq!(images.find(&model, "up/outside.png"), Err(Fault::Outside));
        assert_eq!(images.place(&model, "wood.png"), images.place(&model, "alias.png"), "one picture");
    }

    #[test]
    fn each_picture_is_there_once() {
        let (_folder, model) = model();
        let mut images = Images::new(&model);
        let names = ["wood.png", "no.png", "WOOD.PNG", "../x.png", "no.png", "/else/wood.png"];
        assert_eq!(names.map(|name| images.place(&model, name)), [0, 1, 0, 2, 1, 0]);
        assert_eq!(images.place(&model.join("mtl"), "no.png"), 1, "from another folder");
        let mut report = ReadReport::default();
        let list = images.finish(&mut report);
        assert_eq!(
            list.iter().map(|image| &*image.name).collect::<Vec<_>>(),
            ["wood.png", "no.png", "../x.png"]
        );
        assert_eq!(list[1].source, ImageSource::Missing("not found".into()));
        assert_eq!(report.missing_textures, ["no.png"]);
        assert_eq!(report.outside_textures, ["../x.png"]);
    }

    #[test]
    fn a_model_that_is_in_no_folder_has_no_pictures() {
        let nowhere = Path::new("no such folder");
        let mut images = Images::new(nowhere);
        assert_eq!(images.find(nowhere, "a.png"), Err(Fault::NotFound));
    }
}
