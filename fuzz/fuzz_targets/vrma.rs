//! VRM animations: any bytes are a motion or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = ikiru_formats::read_vrma(data, "fuzz.vrma");
});
