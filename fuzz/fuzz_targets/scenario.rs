//! Scenarios: any text is a problem or an error with a place, and what is a document comes back from the text that is written
//! of it. Rigs other than the built-in ones are not looked for.
#![no_main]

use ikiru_scenario::{Document, Scenario};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Err(error) = Scenario::parse(text, "fuzz.toml", "/nowhere") {
        assert!(!error.to_string().is_empty());
    }
    if let Ok(document) = Document::parse(text, "fuzz.toml") {
        let written = document.to_toml();
        let again = Document::parse(&written, "written.toml").expect("what is written can be read");
        assert_eq!(again, document);
    }
});
