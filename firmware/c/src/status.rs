//! What each function returns.

/// What became of a call. Nothing was done unless it is `OMNI_STATUS_OK`.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// It was done.
    Ok = 0,
    /// A pointer is null.
    NullPointer = 1,
    /// The state was not made ready by its `init`.
    NotReady = 2,
    /// A number is not finite, it is a deviation below 0, or a force that says nothing of where up is.
    NotFinite = 3,
}

impl From<Result<(), Status>> for Status {
    #[inline]
    fn from(done: Result<(), Status>) -> Self {
        match done {
            Ok(()) => Self::Ok,
            Err(status) => status,
        }
    }
}

/// What a pointer points to.
#[inline]
pub fn at<T>(pointer: Option<T>) -> Result<T, Status> {
    pointer.ok_or(Status::NullPointer)
}

/// Done, where every number is finite.
#[inline]
pub fn finite(good: bool) -> Result<(), Status> {
    if good { Ok(()) } else { Err(Status::NotFinite) }
}
