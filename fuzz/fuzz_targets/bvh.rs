//! BVH: any bytes are a rig or an error, and a motion can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(loaded) = ikiru_formats::read_bvh(data, "fuzz.bvh", &ikiru_formats::BvhOptions::default()) {
        let written = match loaded.clips.first() {
            Some(clip) => ikiru_formats::write_bvh_clip(&loaded, clip),
            None => ikiru_formats::write_bvh_pose(&loaded, &loaded.rig.rest_pose()),
        };
        if let Ok(bytes) = written {
            let options = ikiru_formats::BvhOptions::default();
            ikiru_formats::read_bvh(&bytes, "again.bvh", &options).expect("what is written can be read");
        }
    }
});
