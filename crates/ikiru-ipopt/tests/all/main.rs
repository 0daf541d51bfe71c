//! Tests of Ipopt as a method in one program, which links once.

mod edges;
// The problems of the solver's own tests of constraints.
#[allow(dead_code, reason = "what other tests look at")]
#[path = "../../../ikiru-solve/tests/all/hard_cases.rs"]
mod hard_cases;
mod hard_peer;
mod method;
