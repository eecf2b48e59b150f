//! Configured values as source: made and checked on a computer, compiled into firmware bit for bit.
//!
//! A constructor such as [`crate::Controller::new`] checks its configuration, inverts a matrix, and in `f32` compares in
//! `f64`: a microcontroller without double precision pays for that in flash. Every configured value can instead describe
//! itself to a [`Describe`]; what that writes (Rust in a build script, a C header) is a constant expression, so that nothing
//! of the constructors is linked, nothing can fail at start, and the compiler sees the numbers. The crate `omni-config`
//! has both writers.

use core::fmt::Result;

/// A value that can describe itself, down to its numbers.
///
/// ```
/// use omni_core::constants::{Constant, Describe};
/// use omni_core::{AxisLimits, RateLimiter};
/// /// Adds up the numbers.
/// struct Sum(f64);
/// impl Describe for Sum {
///     fn real(&mut self, value: f64, _: bool) -> core::fmt::Result {
///         self.0 += value;
///         Ok(())
///     }
///     fn whole(&mut self, _: u32) -> core::fmt::Result {
///         Ok(())
///     }
///     fn flag(&mut self, _: bool) -> core::fmt::Result {
///         Ok(())
///     }
///     fn list(&mut self, items: &mut dyn Iterator<Item = &dyn Constant>) -> core::fmt::Result {
///         for item in items {
///             item.describe(self)?;
///         }
///         Ok(())
///     }
///     fn structure(&mut self, _: &'static str, fields: &[(&'static str, &dyn Constant)]) -> core::fmt::Result {
///         self.list(&mut fields.iter().map(|(_, field)| *field))
///     }
///     fn choice(&mut self, _: &'static str, _: &'static str) -> core::fmt::Result {
///         Ok(())
///     }
///     fn variant(&mut self, name: &'static str, _: &'static str, fields: &[(&'static str, &dyn Constant)]) -> core::fmt::Result {
///         self.structure(name, fields)
///     }
///     fn option(&mut self, value: Option<&dyn Constant>) -> core::fmt::Result {
///         value.map_or(Ok(()), |value| value.describe(self))
///     }
/// }
/// let mut sum = Sum(0.0);
/// RateLimiter::new(AxisLimits::symmetric(1.5, 2.0, 4.0, 64.0), 0.25)?.describe(&mut sum).expect("writes nothing");
/// // -1.5 and 1.5, velocity steps of 2 and 4 times 0.25 forward and in reverse, jerk steps of 64 times 0.25 squared.
/// assert_eq!(sum.0, 2.0 * (0.5 + 1.0) + 4.0);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
pub trait Constant {
    /// Tells `to` what the value is made of.
    ///
    /// # Errors
    /// Those of `to`.
    fn describe(&self, to: &mut dyn Describe) -> Result;
}

/// What a [`Constant`] is told to: a writer of source.
///
/// Errors are the writer's own.
pub trait Describe {
    /// A number, in `f32` where `single`: then `value` is exactly one.
    fn real(&mut self, value: f64, single: bool) -> Result;
    /// A count.
    fn whole(&mut self, value: u32) -> Result;
    /// A yes or no.
    fn flag(&mut self, value: bool) -> Result;
    /// An array.
    fn list(&mut self, items: &mut dyn Iterator<Item = &dyn Constant>) -> Result;
    /// A struct of that name with its fields, in the order of their declaration.
    fn structure(&mut self, name: &'static str, fields: &[(&'static str, &dyn Constant)]) -> Result;
    /// A variant of the enum of that name, none of whose variants has fields.
    fn choice(&mut self, name: &'static str, variant: &'static str) -> Result;
    /// A variant of the enum of that name, some of whose variants have fields.
    fn variant(
        &mut self,
        name: &'static str,
        variant: &'static str,
        fields: &[(&'static str, &dyn Constant)],
    ) -> Result;
    /// A value that may be missing.
    fn option(&mut self, value: Option<&dyn Constant>) -> Result;
}

impl Constant for f32 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.real(f64::from(*self), true)
    }
}

impl Constant for f64 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.real(*self, false)
    }
}

impl Constant for u16 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.whole(u32::from(*self))
    }
}

impl Constant for u32 {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.whole(*self)
    }
}

impl Constant for bool {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.flag(*self)
    }
}

impl<T: Constant, const N: usize> Constant for [T; N] {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.list(&mut self.iter().map(|item| item as &dyn Constant))
    }
}

impl<T: Constant> Constant for Option<T> {
    fn describe(&self, to: &mut dyn Describe) -> Result {
        to.option(self.as_ref().map(|value| value as &dyn Constant))
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
                to.structure(stringify!($name), &[$((stringify!($field), &self.$field)),+])
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
                to.choice(stringify!($name), variant)
            }
        }
    };
    ($name:ident<$r:ident> { $($variant:ident $({ $($field:ident),+ })?),+ $(,)? }) => {
        impl<$r: $crate::Real + $crate::constants::Constant> $crate::constants::Constant for $name<$r> {
            fn describe(&self, to: &mut dyn $crate::constants::Describe) -> core::fmt::Result {
                match self {
                    $(Self::$variant $({ $($field),+ })? => to.variant(
                        stringify!($name),
                        stringify!($variant),
                        &[$($((stringify!($field), $field as &dyn $crate::constants::Constant)),+)?],
                    ),)+
                }
            }
        }
    };
}

pub(crate) use {constant_enum, constant_struct};
