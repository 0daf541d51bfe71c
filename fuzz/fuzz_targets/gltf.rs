//! glTF as JSON: any bytes are a rig or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = ikiru_formats::read_gltf(data, None, "fuzz.gltf");
});
