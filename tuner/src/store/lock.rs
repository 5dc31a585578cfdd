//! One writer per log, by an advisory lock of the operating system.
//!
//! The lock is held on a file beside the log, `name.lock`, for two reasons: the log itself is
//! replaced when it is compacted, and some systems let nobody read a file that is locked. The
//! system gives the lock back when the process ends, however it ends, so a lock file that is left
//! over blocks nobody. It is never deleted: between the deletion and the creation of a new one two
//! writers could hold locks on two files of one name.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;

use super::StoreError;

/// A held lock.
#[derive(Debug)]
pub(crate) struct Lock(File);

impl Lock {
    /// Takes the lock of the log at `path`, without waiting.
    pub(crate) fn take(path: &Path) -> Result<Lock, StoreError> {
        let beside = path.with_extension("lock");
        let mut options = OpenOptions::new();
        let opened = options.write(true).create(true).truncate(false);
        let file = opened.open(&beside).map_err(StoreError::io(&beside))?;
        match file.try_lock() {
            Ok(()) => Ok(Lock(file)),
            Err(TryLockError::WouldBlock) => Err(StoreError::InUse {
                path: path.to_owned(),
            }),
            Err(TryLockError::Error(source)) => Err(StoreError::Io {
                path: beside,
                source,
            }),
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing the file is not enough: a child process that is being started may share it for
        // a moment. If unlocking fails, closing is all there is.
        let _ = self.0.unlock();
    }
}
