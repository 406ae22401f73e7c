//! What a glTF file's URIs lead to: bytes in the URI itself, or a file in the model's folder.

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::path::{Component, Path, PathBuf};

/// The alphabet that URIs have, with or without `=` at the end.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// What a URI leads to.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// The bytes that it holds.
    Bytes(Vec<u8>),
    /// A regular file in the model's folder, or below it.
    File(PathBuf),
}

/// Follows a URI of a model in `folder`.
///
/// # Errors
/// There is no such file, it is elsewhere than in the folder, or the URI is none: what is wrong, as the end of a
/// sentence that begins with the URI.
pub(super) fn follow(uri: &str, folder: &Path) -> Result<Target, &'static str> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, data) = data.split_once(',').ok_or("is no data URI: it has no comma")?;
        if !kind.ends_with(";base64") {
            return Err("is a data URI that is not in base64");
        }
        return BASE64.decode(data).map(Target::Bytes).map_err(|_| "is a data URI with broken base64");
    }
    let text = percent_decode_str(uri).decode_utf8().map_err(|_| "is no UTF-8")?;
    // A backslash is a separator on Windows, where some tools write it.
    let text = text.replace('\\', "/");
    if text.contains(':') || text.contains('\0') {
        return Err("is neither a data URI nor a file in the model's folder");
    }
    let relative = Path::new(&text);
    if relative.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err("lies outside of the model's folder");
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(relative);
    // A link in the folder may lead out of it.
    let (Ok(real), Ok(real_folder)) = (path.canonicalize(), folder.canonicalize()) else {
        return Err("not found");
    };
    if !real.starts_with(real_folder) {
        return Err("lies outside of the model's folder");
    }
    // What is no regular file may have no end.
    if real.is_file() { Ok(Target::File(path)) } else { Err("is no file") }
}

/// A URI as messages show it: of data, the start alone.
pub(super) fn shown(uri: &str) -> String {
    let mut text: String = uri.chars().take(60).collect();
    if text.len() < uri.len() {
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_decoded() {
        let follow = |uri| follow(uri, Path::new("nowhere"));
        assert_eq!(follow("data:;base64,AAEC"), Ok(Target::Bytes(vec![0, 1, 2])));
        assert_eq!(follow("data:application/gltf-buffer;base64,AAE="), Ok(Target::Bytes(vec![0, 1])));
        assert_eq!(follow("data:image/png;base64,AAE"), Ok(Target::Bytes(vec![0, 1])));
        assert!(follow("data:;base64,A*EC").is_err());
        assert!(follow("data:,hello").is_err());
        assert!(follow("data:").is_err());
    }

    #[test]
    fn files_are_in_the_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let [inside, outside] = ["model", "other"].map(|name| folder.path().join(name));
        for path in [&inside, &outside] {
            std::fs::create_dir_all(path.join("maps")).expect("a folder");
            std::fs::write(path.join("maps/a b.bin"), "x").expect("written");
        }
        let follow = |uri: &str| follow(uri, &inside);
        let found = Ok(Target::File(inside.join("maps/a b.bin")));
        assert_eq!(follow("maps/a%20b.bin"), found);
        assert_eq!(follow("maps/a b.bin"), found);
        assert_eq!(follow("maps\\a b.bin"), found);
        assert_eq!(follow("maps/c.bin"), Err("not found"));
        assert_eq!(follow("maps"), Err("is no file"));
        assert_eq!(follow(""), Err("is no file"));
        let absolute = outside.join("maps/a b.bin");
        for uri in ["../other/maps/a b.bin", "maps/../maps/a b.bin", absolute.to_str().expect("UTF-8")] {
            assert!(follow(uri).is_err(), "{uri}");
        }
        for uri in ["http://example.com/a.bin", "file:///etc/passwd", "C:\\a.bin", "%00", "%ff"] {
            assert!(follow(uri).is_err(), "{uri}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outside.join("maps"), inside.join("link")).expect("a link");
            assert_eq!(follow("link/a b.bin"), Err("lies outside of the model's folder"));
        }
    }
}
