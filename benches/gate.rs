//! Runs one kernel once, on one thread, for `gate.py` to count its instructions.

use std::env;
use std::error::Error;

use divespot_benches::{JOBS, Job, Scan};

const COUNT: u32 = 30_000;

fn main() -> Result<(), Box<dyn Error>> {
    match env::args().nth(1) {
        None => JOBS.iter().for_each(|job| println!("{}", job.name)),
        Some(name) => {
            let job = JOBS.iter().find(|job| job.name == name);
            counted(job.ok_or_else(|| format!("no kernel is named {name}"))?, &Scan::new(COUNT)?)?;
        }
    }
    Ok(())
}

/// The instructions in here are counted: the name is given to callgrind.
#[inline(never)]
fn counted(job: &Job, scan: &Scan) -> divespot_core::Result<()> {
    (job.run)(scan, 1)
}
