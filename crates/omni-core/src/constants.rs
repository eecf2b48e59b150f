//! Configured values as source code: checked on a computer, compiled into firmware bit-identically.
//!
//! A constructor such as [`crate::loops::Controller::new`] checks its configuration, inverts a matrix, and
//! in `f32` compares in `f64`: a microcontroller without double precision pays for that in flash. Every
//! configured value can instead describe itself to a [`Describe`]; what that writes (Rust in a build
//! script, a C header) is a constant expression, so that nothing of the constructors is linked, nothing
//! can fail at start, and the compiler sees the numbers. The crate `omni-config` provides both writers.

use core::fmt::Result;

/// A value that can describe itself, down to its numbers.
///
/// ```
/// use omni_core::constants::{Constant, Describe, Piece};
/// use omni_core::shaping::{AxisLimits, RateLimiter};
/// /// Adds up the numbers.
/// struct Sum(f64);
/// impl Describe for Sum {
///     fn take(&mut self, piece: Piece<'_>) -> core::fmt::Result {
///         match piece {
///             Piece::Real { value, .. } => self.0 += value,
///             Piece::Struct { fields, .. } => fields.iter().try_for_each(|(_, field)| field.describe(self))?,
///             _ => {}
///         }
///         Ok(())
///     }
/// }
/// let mut sum = Sum(0.0);
/// RateLimiter::new(AxisLimits::symmetric(1.5, 2.0, 4.0, 64.0), 0.25)?.describe(&mut sum).expect("writes nothing");
/// // -1.5 and 1.5, velocity steps of 2 and 4 times 0.25 forward and in reverse, jerk steps of 64 times 0.25 squared.
/// assert_eq!(sum.0, 2.0 * (0.5 + 1.0) + 4.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
pub trait Constant {
    /// Gives the value to `to`, as one [`Piece`].
    ///
    /// # Errors
    /// Those of `to`.
    ///
    /// ```
    /// use omni_core::constants::{Constant, Describe, Piece};
    /// struct Last(f64);
    /// impl Describe for Last {
    ///     fn take(&mut self, piece: Piece<'_>) -> core::fmt::Result {
    ///         let Piece::Real { value, single: true } = piece else { return Err(core::fmt::Error) };
    ///         self.0 = value;
    ///         Ok(())
    ///     }
    /// }
    /// let mut last = Last(0.0);
    /// assert!(0.1_f32.describe(&mut last).is_ok() && 0.2_f64.describe(&mut last).is_err());
    /// assert_eq!(last.0, 0.1_f32 as f64);
    /// ```
    fn describe(&self, to: &mut dyn Describe) -> Result;
}

/// Receives the description of a [`Constant`]: a writer of source. See [`Constant`] for a whole one.
///
/// ```
/// use omni_core::constants::{Constant, Describe, Piece};
/// struct Count(usize);
/// impl Describe for Count {
///     fn take(&mut self, piece: Piece<'_>) -> core::fmt::Result {
///         if let Piece::List(items) = piece {
///             self.0 += items.count();
///         }
///         Ok(())
///     }
/// }
/// let mut count = Count(0);
/// [0.5_f32; 7].describe(&mut count).expect("writes nothing");
/// assert_eq!(count.0, 7);
/// ```
pub trait Describe {
    /// Writes one value, whose parts describe themselves.
    ///
    /// # Errors
    /// The writer's own.
    fn take(&mut self, piece: Piece<'_>) -> Result;
}

/// The fields of a struct or variant in the order of their declaration.
pub type Fields<'a> = &'a [(&'static str, &'a dyn Constant)];

/// A value, with its parts.
///
/// ```
/// use omni_core::constants::{Constant, Describe, Piece};
/// use omni_core::loops::Integral;
/// struct Variant(&'static str);
/// impl Describe for Variant {
///     fn take(&mut self, piece: Piece<'_>) -> core::fmt::Result {
///         if let Piece::Choice { name: "Integral", variant } = piece {
///             self.0 = variant;
///         }
///         Ok(())
///     }
/// }
/// let mut variant = Variant("");
/// Integral::Shared.describe(&mut variant).expect("writes nothing");
/// assert_eq!((variant.0, variant.0.len()), ("Shared", 6));
/// ```
// Not `non_exhaustive`: a writer that leaves out a kind of value writes source that is wrong.
pub enum Piece<'a> {
    /// A number, in `f32` where `single`: then `value` is exactly one.
    Real {
        /// The number.
        value: f64,
        /// It is an `f32`.
        single: bool,
    },
    /// A count.
    Whole(u32),
    /// A yes or no.
    Flag(bool),
    /// An array.
    List(&'a mut dyn Iterator<Item = &'a dyn Constant>),
    /// A struct.
    Struct {
        /// Its name.
        name: &'static str,
        /// Its fields.
        fields: Fields<'a>,
    },
    /// A variant of an enum none of whose variants has fields.
    Choice {
        /// The enum's name.
        name: &'static str,
        /// The variant's.
        variant: &'static str,
    },
    /// A variant of an enum some of whose variants have fields.
    Variant {
        /// The enum's name.
        name: &'static str,
        /// The variant's.
        variant: &'static str,
        /// The variant's fields, maybe none.
        fields: Fields<'a>,
    },
    /// A value that may be missing.
    Option(Option<&'a dyn Constant>),
}

impl Constant for f32 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Real {
            value: f64::from(*self),
            single: true,
        })
    }
}

impl Constant for f64 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Real {
            value: *self,
            single: false,
        })
    }
}

impl Constant for u16 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Whole(u32::from(*self)))
    }
}

impl Constant for u32 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Whole(*self))
    }
}

impl Constant for bool {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Flag(*self))
    }
}

impl<T: Constant, const N: usize> Constant for [T; N] {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::List(&mut self.iter().map(|item| item as &dyn Constant)))
    }
}

impl<T: Constant> Constant for Option<T> {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.take(Piece::Option(self.as_ref().map(|value| value as &dyn Constant)))
    }
}

/// Makes a struct [`Constant`], with the constructor that its source calls.
macro_rules! constant_struct {
    ($name:ident<R $(, const $n:ident)?> { $($field:ident: $ty:ty),+ $(,)? }) => {
        impl<R: Copy $(, const $n: usize)?> $name<R $(, $n)?> {
            #[doc(hidden)]
            #[must_use]
            pub const fn from_constants(($($field,)+): ($($ty,)+)) -> Self {
                Self { $($field),+ }
            }
        }

        impl<R: $crate::Real + $crate::constants::Constant $(, const $n: usize)?> $crate::constants::Constant
            for $name<R $(, $n)?>
        {
            fn describe(&self, to: &mut dyn $crate::constants::Describe) -> core::fmt::Result {
                to.take($crate::constants::Piece::Struct {
                    name: stringify!($name),
                    fields: &[$((stringify!($field), &self.$field)),+],
                })
            }
        }
    };
}

/// Makes an enum [`Constant`]; its variants are their own constructors.
macro_rules! constant_enum {
    ($name:ident { $($variant:ident),+ $(,)? }) => {
        impl $crate::constants::Constant for $name {
            fn describe(&self, to: &mut dyn $crate::constants::Describe) -> core::fmt::Result {
                let variant = match self {
                    $(Self::$variant => stringify!($variant),)+
                };
                to.take($crate::constants::Piece::Choice { name: stringify!($name), variant })
            }
        }
    };
    ($name:ident<$r:ident> { $($variant:ident $({ $($field:ident),+ })?),+ $(,)? }) => {
        impl<$r: $crate::Real + $crate::constants::Constant> $crate::constants::Constant for $name<$r> {
            fn describe(&self, to: &mut dyn $crate::constants::Describe) -> core::fmt::Result {
                match self {
                    $(Self::$variant $({ $($field),+ })? => to.take($crate::constants::Piece::Variant {
                        name: stringify!($name),
                        variant: stringify!($variant),
                        fields: &[$($((stringify!($field), $field as &dyn $crate::constants::Constant)),+)?],
                    }),)+
                }
            }
        }
    };
}

/// A body for each index below `n`, without a loop for the first eight: where a configuration is a
/// constant, so is all that the body looks up by its index. The body must not leave the loop.
macro_rules! each {
    ($i:ident of $n:ident $body:block) => {
        $crate::constants::each!(@ $i $n $body 0 1 2 3 4 5 6 7);
        if $n > 8 {
            for $i in 8..$n $body
        }
    };
    (@ $i:ident $n:ident $body:block $($k:literal)*) => {
        $(if $k < $n {
            let $i: usize = $k;
            $body
        })*
    };
}

pub(crate) use {constant_enum, constant_struct, each};
