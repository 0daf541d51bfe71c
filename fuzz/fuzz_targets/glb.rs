//! Binary glTF and VRM: any bytes are a rig or an error, and a rig can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(loaded) = ikiru_formats::read_glb(data, "fuzz.glb") {
        let written = ikiru_formats::write_posed_glb(&loaded, &loaded.rig.rest_pose());
        if let Ok(bytes) = written {
            let again = ikiru_formats::read_glb(&bytes, "again.glb").expect("what is written can be read");
            assert_eq!(again.rig.n_joints(), loaded.rig.n_joints());
        }
    }
});
