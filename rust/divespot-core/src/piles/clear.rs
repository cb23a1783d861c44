//! Crumbs that are not clear of the ground.
//!
//! What stands a little higher than the ground is known to be flat may be a wave of it, haze, or
//! what registration left. It is no pile unless more of it is there than may be nothing.

use super::object::Object;
use super::reason::Reason;
use super::settings::Settings;

/// A volume of fewer standard uncertainties may be nothing: u95 reaches down to it.
const DETECTED: f64 = 2.0;
/// The mean height of a pile is at least so many margins. A cone of this mean height is three times
/// as high, and at any angle of repose wide enough for its shape to be told.
const MARGINS: f64 = 1.5;

/// Gives the reason to every object that would be a pile but is not clear of the ground.
///
/// Above a base that was asked for, heights say nothing of the ground around.
pub(crate) fn mark(objects: &mut [Object], settings: &Settings) {
    let local = settings.base.is_none();
    for object in objects.iter_mut().filter(|o| local && o.reason.is_none()) {
        if !is_clear(object, settings.margin_m) {
            object.reason = Some(Reason::NotClear);
        }
    }
}

fn is_clear(object: &Object, margin_m: f64) -> bool {
    let volume_m3 = object.volume.net_m3();
    volume_m3 > DETECTED * object.budget.combined_m3()
        && volume_m3 > MARGINS * margin_m * object.footprint_m2
}

#[cfg(test)]
mod tests {
    use super::super::Reason;
    use super::super::tests::{exact, measured, settings};

    /// A cone with so many margins for its mean height.
    fn reason(margins: f64) -> Option<Reason> {
        let top = 3.0 * margins * settings().margin_m;
        let cone = move |x: f64, y: f64| (top * (1.0 - (x - 4.0).hypot(y - 3.0))).max(0.0);
        let objects = measured(&exact(cone), |x, y| cone(x, y) > settings().margin_m);
        assert_eq!(objects.len(), 1);
        objects[0].reason
    }

    #[test]
    fn a_crumb_is_no_pile_and_a_low_pile_is() {
        assert_eq!(reason(1.2), Some(Reason::NotClear));
        assert_eq!(reason(3.0), None);
    }
}
