//! Profiles: every tunable in one TOML file. (STUB, owned by render.)
