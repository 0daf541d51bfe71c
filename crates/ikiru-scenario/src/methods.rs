//! The methods that scenarios and the command name.

use ikiru_solve::Method;

/// Every method of this build, with its default settings: those of [`Method::ALL`], and with the feature `ipopt` that of Ipopt.
pub fn methods() -> impl Iterator<Item = Method> {
    #[cfg(feature = "ipopt")]
    let outside = [ikiru_ipopt::IPOPT];
    #[cfg(not(feature = "ipopt"))]
    let outside: [Method; 0] = [];
    Method::ALL.iter().copied().chain(outside)
}

/// The method of that [name](Method::name); `None` where this build has none.
#[must_use]
pub fn method_named(name: &str) -> Option<Method> {
    methods().find(|method| method.name() == name)
}
