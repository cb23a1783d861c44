//! Runs all targets on a stable toolchain: `drive SECONDS [FIRST]`.
//!
//! Inputs are decoded from bytes that their number draws, as a fuzzer's are; nothing is learned from
//! what was run. A panic, and an input that takes more than a few seconds, is told with its number;
//! `drive NAME NUMBER` runs that one alone.

use std::io::Write;
use std::panic::catch_unwind;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use arbitrary::{Arbitrary, Unstructured};

/// What one input may take.
const MOST: Duration = Duration::from_secs(2);

type Target = (&'static str, fn(&[u8]));

macro_rules! targets {
    ($($name:ident),*) => {
        [$((stringify!($name), (|data: &[u8]| {
            if let Ok(input) = divespot_fuzz::$name::Input::arbitrary_take_rest(Unstructured::new(data)) {
                input.run();
            }
        }) as fn(&[u8]))),*]
    };
}

const TARGETS: [Target; 8] =
    targets!(points, clustering, plane, heights, maps, surface, piles, outlines);

/// SplitMix64.
fn draw(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The bytes of an input: random ones, with runs of equal ones, which make equal numbers.
fn bytes(number: u64) -> Vec<u8> {
    let mut state = number;
    let length = [64, 400, 2000, 6000][(draw(&mut state) % 4) as usize];
    let mut data = Vec::with_capacity(length);
    let rough = draw(&mut state) % 4;
    while data.len() < length {
        let drawn = draw(&mut state).to_le_bytes();
        match draw(&mut state) % 8 {
            0 => data.extend([drawn[0]; 16]),
            1 if data.len() > 64 => {
                let from =
                    usize::from(u16::from_le_bytes([drawn[0], drawn[1]])) % (data.len() - 32);
                data.extend_from_within(from..from + 32);
            }
            2..=4 if rough > 0 => data.extend(drawn.map(|b| b & 0x3f)),
            _ => data.extend(drawn),
        }
    }
    data.truncate(length);
    data
}

/// Runs one input; whether it ended as it should.
fn runs(target: &Target, number: u64) -> bool {
    let data = bytes(number);
    let begin = Instant::now();
    let ended = catch_unwind(|| target.1(&data)).is_ok();
    let slow = begin.elapsed() > MOST;
    if !ended || slow {
        let what = if ended { format!("took {:.1?}", begin.elapsed()) } else { "panicked".into() };
        println!("{} {number} {what}", target.0);
    }
    ended && !slow
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<u64>().ok());
    if let Some(target) = TARGETS.iter().find(|t| arguments.first().is_some_and(|a| a == t.0)) {
        return if runs(target, number(1).unwrap_or(0)) {
            ExitCode::SUCCESS
        } else {
            ExitCode::FAILURE
        };
    }
    let (seconds, first) = (number(0).unwrap_or(60), number(1).unwrap_or(0));
    let (begin, mut next, mut wrong) = (Instant::now(), first, 0_u64);
    while begin.elapsed() < Duration::from_secs(seconds) {
        wrong += TARGETS.iter().filter(|target| !runs(target, next)).count() as u64;
        next += 1;
        let _ = std::io::stdout().flush();
    }
    let runs = (next - first) * TARGETS.len() as u64;
    println!(
        "{runs} executions of {} kernels' targets from {first} on, {wrong} wrong",
        TARGETS.len()
    );
    if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
