//! The chosen constant is doubled or halved; each that is read is written down, once a process.

use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static CHOSEN: OnceLock<Option<(usize, bool)>> = OnceLock::new();
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

fn chosen() -> Option<(usize, bool)> {
    let given = std::env::var("DIVESPOT_MUTANT").ok()?;
    Some((given[1..].parse().ok()?, given.starts_with('*')))
}

#[cold]
fn write_down(id: usize) {
    if let Ok(path) = std::env::var("DIVESPOT_READ") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(format!("{id}\n").as_bytes()));
    }
}

/// Lets each constant be written down again.
pub fn forget() {
    READ.iter().for_each(|read| read.store(false, Ordering::Relaxed));
}

#[inline]
pub fn value<T: Number>(id: usize, value: T) -> T {
    if !READ[id].load(Ordering::Relaxed) && !READ[id].swap(true, Ordering::Relaxed) {
        write_down(id);
    }
    match *CHOSEN.get_or_init(chosen) {
        Some((mutant, doubled)) if mutant == id => value.changed(doubled),
        _ => value,
    }
}
