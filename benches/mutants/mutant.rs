//! The chosen constant is doubled or halved; each that is read is written down, once a process.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

static CHOSEN: AtomicUsize = AtomicUsize::new(0);
static READ: [AtomicBool; 2048] = [const { AtomicBool::new(false) }; 2048];

pub trait Number: Copy {
    fn changed(self, doubled: bool) -> Self;
}

macro_rules! floats {
    ($($t:ty)*) => { $(impl Number for $t {
        fn changed(self, doubled: bool) -> Self { if doubled { self * 2.0 } else { self * 0.5 } }
    })* };
}
macro_rules! integers {
    ($($t:ty)*) => { $(impl Number for $t {
        fn changed(self, doubled: bool) -> Self {
            if doubled { self.saturating_mul(2) } else { self - self / 2 }
        }
    })* };
}
floats!(f32 f64);
integers!(u8 u16 u32 u64 usize i32 i64 isize);

/// What the environment chooses: 0 before it was looked at, 1 for nothing, else the constant and
/// whether it is doubled.
fn chosen() -> usize {
    let known = CHOSEN.load(Ordering::Relaxed);
    if known != 0 {
        return known;
    }
    let given = std::env::var("DIVESPOT_MUTANT").ok();
    let parsed = given.and_then(|text| {
        Some(number(text[1..].parse().ok()?, text.starts_with('*')))
    });
    CHOSEN.store(parsed.unwrap_or(1), Ordering::Relaxed);
    parsed.unwrap_or(1)
}

const fn number(id: usize, doubled: bool) -> usize {
    2 + 2 * id + doubled as usize
}

#[cold]
fn write_down(id: usize) {
    if let Ok(path) = std::env::var("DIVESPOT_READ") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(format!("{id}\n").as_bytes()));
    }
}

/// Lets each constant be written down again, and the environment be looked at again.
pub fn forget() {
    CHOSEN.store(0, Ordering::Relaxed);
    READ.iter().for_each(|read| read.store(false, Ordering::Relaxed));
}

#[inline]
pub fn value<T: Number>(id: usize, value: T) -> T {
    if !READ[id].load(Ordering::Relaxed) && !READ[id].swap(true, Ordering::Relaxed) {
        write_down(id);
    }
    match chosen() {
        mutant if mutant == number(id, false) => value.changed(false),
        mutant if mutant == number(id, true) => value.changed(true),
        _ => value,
    }
}
