//! Holds only integration tests; see `it/`.
