//! Exit codes. They are part of the interface: scripts and pipelines decide by them.

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Exit {
    /// All is well, and every criterion passed.
    Pass = 0,
    /// A criterion failed.
    Failed = 1,
    /// Wrong usage, or a bad file: an [`Error`](crate::error::Error) says where and what to do.
    BadInput = 2,
    /// The recordings do not decide it: a margin below what the sensor resolves, or effects that look the same; or a
    /// prediction leaves out what may turn its answer round.
    Undecided = 3,
    /// Nothing in the files that the command could work on.
    NothingToRun = 4,
    /// A recording of ours, replayed with nothing clamped and nothing put in, is not the same.
    Diverged = 5,
    /// A fault that was put in changed nothing.
    Idle = 6,
    /// A signal ended it before its end; what came until then is told and saved.
    Interrupted = 130,
}

impl Exit {
    /// The number that the shell sees. One more exists that no command returns: 101 after a bug.
    pub const fn code(self) -> u8 {
        self as u8
    }
}
