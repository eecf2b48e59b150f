//! States of the library in memory of the caller's: C knows their size and nothing else.

use core::mem::MaybeUninit;
use core::ptr;

use omni_core::DriveState;
use omni_core::drive::TractionDriveState;
use omni_core::estimate::EstimatorState;

use crate::status::Status;

/// Memory for one value, of as many words as build.rs counts.
pub trait Memory: Sized {
    /// What is kept in it.
    type Kept;

    /// Starts afresh with `start`.
    fn start(place: &mut MaybeUninit<Self>, start: Self::Kept);

    /// What is kept.
    fn open(&mut self) -> Result<&mut Self::Kept, Status>;

    /// The same, to be looked at.
    fn look(&self) -> Result<&Self::Kept, Status>;
}

/// State of a drive. Private.
#[repr(C)]
pub struct DriveMemory<const N: usize, const WORDS: usize> {
    ready: u32,
    memory: [u32; WORDS],
}

/// State of a drive with traction control. Private.
#[repr(C)]
pub struct TractionMemory<const N: usize, const WORDS: usize> {
    ready: u32,
    memory: [u32; WORDS],
}

/// State of an estimator. Private.
#[repr(C)]
pub struct EstimatorMemory<const N: usize, const WORDS: usize> {
    ready: u32,
    memory: [u32; WORDS],
}

/// `$memory` keeps a `$kept`. `$mark` marks one that was made ready: without it memory of the
/// caller's would be taken for a state.
macro_rules! keeps {
    ($memory:ident, $kept:ident, $mark:literal) => {
        impl<const N: usize, const WORDS: usize> $memory<N, WORDS> {
            const FITS: () = assert!(
                size_of::<$kept<f32, N>>() <= size_of::<[u32; WORDS]>()
                    && align_of::<$kept<f32, N>>() <= align_of::<u32>()
                    && size_of::<$kept<f32, N>>() + 32 > size_of::<[u32; WORDS]>()
            );
        }

        impl<const N: usize, const WORDS: usize> Memory for $memory<N, WORDS> {
            type Kept = $kept<f32, N>;

            #[inline]
            fn start(place: &mut MaybeUninit<Self>, start: Self::Kept) {
                let () = Self::FITS;
                let state = place.write(Self {
                    ready: $mark,
                    memory: [0; WORDS],
                });
                // SAFETY: the memory is as large and as aligned as `FITS` says; what was there needs no drop.
                unsafe {
                    ptr::from_mut(&mut state.memory)
                        .cast::<Self::Kept>()
                        .write(start)
                };
            }

            #[inline]
            fn open(&mut self) -> Result<&mut Self::Kept, Status> {
                let () = Self::FITS;
                if self.ready != $mark {
                    return Err(Status::NotReady);
                }
                // SAFETY: the mark says that `start` wrote one there, and only `open` and `look` give it away.
                Ok(unsafe { &mut *ptr::from_mut(&mut self.memory).cast::<Self::Kept>() })
            }

            #[inline]
            fn look(&self) -> Result<&Self::Kept, Status> {
                let () = Self::FITS;
                if self.ready != $mark {
                    return Err(Status::NotReady);
                }
                // SAFETY: as in `open`.
                Ok(unsafe { &*ptr::from_ref(&self.memory).cast::<Self::Kept>() })
            }
        }
    };
}

keeps!(DriveMemory, DriveState, 0x6f6d_6e69);
keeps!(TractionMemory, TractionDriveState, 0x6f6d_6e6a);
keeps!(EstimatorMemory, EstimatorState, 0x6f6d_6e6b);
