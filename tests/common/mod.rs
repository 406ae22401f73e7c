//! A folder to run the command in, and what every run of it promises.

#![allow(dead_code)] // Each suite uses a part of it.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Sends a process a signal: `INT`, `KILL`. Whether it could be sent.
pub fn signal(process: &Child, signal: &str) -> bool {
    let arguments = [format!("-{signal}"), process.id().to_string()];
    let sent = std::process::Command::new("kill").args(arguments).stderr(Stdio::null()).status();
    sent.expect("kill runs").success()
}

/// Only what hangs takes so long.
pub const LONG: Duration = Duration::from_secs(120);

/// Waits until something is there. One that takes [`LONG`] fails the test, and ends the process that it hangs with.
pub fn wait_for<T>(process: &mut Child, what: &str, mut look: impl FnMut(&mut Child) -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look(process) {
            return found;
        }
        if start.elapsed() > LONG {
            let _ = process.kill();
            panic!("{what}: still waited for after {LONG:?}");
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// Waits for the end of a process.
pub fn end_of(process: &mut Child) -> ExitStatus {
    wait_for(process, "the end of the process", |process| process.try_wait().expect("it is ours"))
}

/// A folder that is gone in the end.
pub struct Place {
    folder: TempDir,
}

impl Place {
    /// An empty one.
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    /// The folder's path.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts a file there.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        fs::write(self.path(name), contents).expect("written");
    }

    /// What is in a file.
    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect("written")
    }

    /// The JSON in a file.
    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).expect("JSON")
    }

    /// The names of the files and folders here, in order.
    pub fn files(&self) -> Vec<String> {
        self.contents().into_iter().map(|(name, _)| name).collect()
    }

    /// The files here and what they hold; of folders, only the names.
    fn contents(&self) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.folder()).expect("a folder");
        let mut files: Vec<_> = entries
            .map(|entry| entry.expect("an entry"))
            .map(|e| (e.file_name().to_string_lossy().into_owned(), fs::read(e.path()).unwrap_or_default()))
            .collect();
        files.sort();
        files
    }

    /// The command, about to run here.
    pub fn raypack(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("raypack").expect("it was built");
        command.current_dir(self.folder()).env_remove("RAYPACK_ISA").args(arguments.split_whitespace());
        command
    }

    /// The same as a process of its own, which goes on beside the test and says nothing.
    pub fn process(&self, arguments: &str) -> std::process::Command {
        let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("raypack"));
        command.current_dir(self.folder()).env_remove("RAYPACK_ISA").args(arguments.split_whitespace());
        command.stdout(Stdio::null());
        command
    }

    /// Runs it to success, with nothing on standard error, and returns what it printed.
    pub fn succeed(&self, arguments: &str) -> String {
        let output = self.raypack(arguments).assert().success().get_output().clone();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{arguments}");
        String::from_utf8(output.stdout).expect("text")
    }

    /// Runs it to failure: exit code 1, nothing on standard output, one line on standard error
    /// that holds all of `expected`, and every file as it was.
    pub fn fail(&self, arguments: &str, expected: &[&str]) {
        self.fail_with(self.raypack(arguments), arguments, expected);
    }

    /// The same with a command that was made ready before; `what` names it.
    pub fn fail_with(&self, mut command: Command, what: &str, expected: &[&str]) {
        let before = self.contents();
        let output = command.assert().code(1).stdout("").get_output().clone();
        let message = String::from_utf8(output.stderr).expect("text");
        assert!(message.starts_with("raypack: error: "), "{what}: {message}");
        assert_eq!(message.matches('\n').count(), 1, "{what}: {message}");
        for part in expected {
            assert!(message.contains(part), "{what}: \"{part}\" is not in: {message}");
        }
        assert!(self.contents() == before, "{what} changed a file");
    }
}
