//! Any bytes as a PLY file that is written again with normals.
#![no_main]

libfuzzer_sys::fuzz_target!(|file: &[u8]| laws::ply::rewrite(file));
