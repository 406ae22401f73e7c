//! Models made by rule, of any size: a process plant to look at, and shapes to test with.
