#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: divespot_fuzz::outlines::Input| input.run());
