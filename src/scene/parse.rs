//! Cameras as text: the option's one-line form, and TOML files.

use super::{Camera, DEFAULT_FOV};
use crate::error::{Error, Result};
use glam::Vec3;
use std::path::Path;
use std::str::FromStr;

const FORM: &str = "eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG;aperture=D;focus=D";

impl Camera {
    /// Reads what `--camera` was given: the one-line form, or the path of a TOML file with the
    /// same keys (text without a `=` is taken to be a path).
    ///
    /// # Errors
    /// [`Error::Option`] or [`Error::Malformed`] saying which key is wrong; [`Error::Read`] for a
    /// file that cannot be read.
    pub fn parse(text: &str) -> Result<Self> {
        if text.contains('=') { text.parse() } else { Self::read(text) }
    }

    /// Reads a TOML file with the keys `eye`, `at` and, if wanted, `up`, `fov`, `aperture` and `focus`.
    ///
    /// # Errors
    /// The file cannot be read or does not describe a camera.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|source| {
            if source.kind() == std::io::ErrorKind::NotFound && path.extension().is_none() {
                let given = path.display();
                return Error::option("--camera", format!("\"{given}\" is neither {FORM} nor a TOML file"));
            }
            Error::Read { path: path.into(), source }
        })?;
        let camera: Self = toml::from_str(&text).map_err(|error| Error::toml(path, &text, &error))?;
        match camera.fault() {
            Some(fault) => Err(Error::malformed(path, fault)),
            None => Ok(camera),
        }
    }
}

impl FromStr for Camera {
    type Err = Error;

    /// The form `eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG;aperture=D;focus=D`, keys in any order, all but `eye` and `at`
    /// optional.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = |message: String| Error::option("--camera", message);
        let (mut eye, mut at, mut up, mut fov) = (None, None, None, None);
        let (mut aperture, mut focus) = (None, None);
        for part in text.split(';').map(str::trim).filter(|part| !part.is_empty()) {
            let Some((key, value)) = part.split_once('=') else {
                return Err(wrong(format!("\"{part}\" is not KEY=VALUE; the form is {FORM}")));
            };
            let again = match key.trim() {
                "eye" => eye.replace(vector(key, value)?).is_some(),
                "at" => at.replace(vector(key, value)?).is_some(),
                "up" => up.replace(vector(key, value)?).is_some(),
                "fov" => fov.replace(number(key, value)?).is_some(),
                "aperture" => aperture.replace(number(key, value)?).is_some(),
                "focus" => focus.replace(number(key, value)?).is_some(),
                other => return Err(wrong(format!("unknown key \"{other}\"; the form is {FORM}"))),
            };
            if again {
                return Err(wrong(format!("{key} is given twice")));
            }
        }
        let missing = |key: &str| wrong(format!("{key} is missing; the form is {FORM}"));
        let camera = Self {
            eye: eye.ok_or_else(|| missing("eye"))?,
            at: at.ok_or_else(|| missing("at"))?,
            up: up.unwrap_or(Vec3::Y),
            fov: fov.unwrap_or(DEFAULT_FOV),
            aperture: aperture.unwrap_or(0.0),
            focus,
        };
        camera.fault().map_or(Ok(camera), |fault| Err(wrong(fault)))
    }
}

fn number(key: &str, text: &str) -> Result<f32> {
    let text = text.trim();
    match text.parse::<f32>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(Error::option("--camera", format!("{key}: \"{text}\" is not a finite number"))),
    }
}

fn vector(key: &str, text: &str) -> Result<Vec3> {
    let numbers: Vec<f32> = text.split(',').map(|part| number(key, part)).collect::<Result<_>>()?;
    match numbers[..] {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(Error::option("--camera", format!("{key}={} is not three numbers x,y,z", text.trim()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn all_but_eye_and_at_have_defaults() {
        let camera = Camera::parse("at=0,0,0; eye=1,2.5,-3e2").expect("a camera");
        assert_eq!(camera, Camera::new(Vec3::new(1.0, 2.5, -300.0), Vec3::ZERO));
    }

    #[test]
    fn display_comes_back_bit_for_bit() {
        let camera = Camera {
            eye: Vec3::new(0.1, 1.0 / 3.0, 1e-30),
            at: Vec3::new(-123_456.79, f32::MIN_POSITIVE, 7.0),
            up: Vec3::new(0.0, -0.0, 1.0),
            fov: 33.333_332,
            aperture: 0.0,
            focus: None,
        };
        let lens = Camera { aperture: 0.012_345_67, ..camera };
        let focused = Camera { focus: Some(1.0 / 3.0), ..lens };
        for camera in [camera, lens, focused, Camera { aperture: 0.0, ..focused }] {
            assert_eq!(Camera::parse(&camera.to_string()).expect("a camera"), camera);
            let toml = toml::to_string(&camera).expect("a table");
            assert_eq!(toml::from_str::<Camera>(&toml).expect("a camera"), camera);
        }
    }

    #[test]
    fn a_pinhole_is_written_without_a_lens() {
        let camera = Camera::new(Vec3::ONE, Vec3::ZERO);
        assert_eq!(camera.to_string(), "eye=1,1,1;at=0,0,0;up=0,1,0;fov=45");
        assert!(!toml::to_string(&camera).expect("a table").contains("aperture"));
        let lens = Camera { aperture: 0.5, focus: Some(2.0), ..camera };
        assert_eq!(lens.to_string(), "eye=1,1,1;at=0,0,0;up=0,1,0;fov=45;aperture=0.5;focus=2");
    }

    #[test]
    fn a_file_says_the_same() {
        let mut file = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
        writeln!(file, "eye = [1, 2.5, 3]\nat = [0.0, 0.0, 0.0]\nfov = 60\naperture = 0.25\nfocus = 3")
            .expect("written");
        let camera = Camera::parse(file.path().to_str().expect("a path")).expect("a camera");
        assert_eq!(
            camera,
            Camera::parse("eye=1,2.5,3;at=0,0,0;fov=60;aperture=0.25;focus=3").expect("a camera")
        );
    }

    #[test]
    fn faults_are_told_in_one_line() {
        for (text, expected) in [
            ("eye=1,2,3", "at is missing"),
            ("eye=1,2;at=0,0,0", "eye=1,2 is not three numbers"),
            ("eye=1,2,x;at=0,0,0", "\"x\" is not a finite number"),
            ("eye=1,2,inf;at=0,0,0", "\"inf\" is not a finite number"),
            ("eye=1,2,3;at=0,0,0;roll=5", "unknown key \"roll\""),
            ("eye=1,2,3;at=0,0,0;eye=0,0,0", "eye is given twice"),
            ("eye=1,2,3;at=1,2,3", "the same point"),
            ("eye=1,2,3;at=0,0,0;up=0,0,0", "up is zero"),
            ("eye=1,2,3;at=0,0,0;fov=180", "fov=180"),
            ("eye=1,2,3;at=0,0,0;fov=-1", "fov=-1"),
            ("eye=1,2,3;at=0,0,0;aperture=-1", "aperture=-1 is not a diameter"),
            ("eye=1,2,3;at=0,0,0;aperture=inf", "\"inf\" is not a finite number"),
            ("eye=1,2,3;at=0,0,0;focus=0", "focus=0 is not a distance"),
            ("eye=1,2,3;at=0,0,0;aperture=1;focus=-2", "focus=-2 is not a distance"),
            ("eye=1,2,3;at=0,0,0;aperture=1;focus=1e-30", "too wide"),
            ("eye=1,2,3;at=0,0,0;focus=1;focus=1", "focus is given twice"),
            ("eye=1,2,3;nonsense", "\"nonsense\" is not KEY=VALUE"),
            ("nonsense", "neither eye="),
            ("no/such/file.toml", "cannot read no/such/file.toml"),
        ] {
            let message = Camera::parse(text).expect_err(text).to_string();
            assert!(message.contains(expected) && !message.contains('\n'), "{text}: {message}");
        }
    }

    #[test]
    fn faults_in_a_file_name_the_file_and_the_line() {
        for (text, expected) in [
            ("eye = [1, 2, 3]\nat = [0, 0, 0]\nroll = 1", "line 3: unknown field `roll`"),
            ("eye = [1, 2, 3]", "missing field `at`"),
            ("eye = [1, 2, 3]\nat = [0, 0, nan]", "at must be three finite numbers"),
            ("eye = [1, 2, 3]\nat = [0, 0, 0]\naperture = nan", "aperture=NaN is not a diameter"),
            ("eye = [1, 2, 3]\nat = [0, 0, 0]\nfocus = inf", "focus=inf is not a distance"),
        ] {
            let mut file = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
            file.write_all(text.as_bytes()).expect("written");
            let path = file.path().to_str().expect("a path");
            let message = Camera::parse(path).expect_err(text).to_string();
            assert!(message.contains(expected) && message.contains(path), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
    }
}
