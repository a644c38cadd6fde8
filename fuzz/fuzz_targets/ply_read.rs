//! Any bytes as a PLY file that is read.
#![no_main]

libfuzzer_sys::fuzz_target!(|file: &[u8]| drop(laws::ply::read(file)));
