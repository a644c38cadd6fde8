//! Any cloud and any options.
#![no_main]

use arbitrary::{Result, Unstructured};
use laws::clouds::{Cloud, options};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // An error means that the bytes do not tell a whole cloud.
    let _ = run(&mut Unstructured::new(bytes));
});

fn run(u: &mut Unstructured) -> Result<()> {
    let most = *u.choose(&[10, 100, 2000])?;
    let options = options(u, most)?;
    let stop = u.arbitrary::<u16>()?;
    laws::estimates::check(&Cloud::of(u, most)?, &options, stop.into());
    Ok(())
}
