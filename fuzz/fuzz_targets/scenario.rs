//! Scenarios: any text is a problem or an error with a place. Rigs other than the built-in ones are not looked for.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data)
        && let Err(error) = ikiru_scenario::Scenario::parse(text, "fuzz.toml", "/nowhere")
    {
        assert!(!error.to_string().is_empty());
    }
});
