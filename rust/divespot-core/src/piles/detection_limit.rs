//! The detection limit: objects too small to tell from an uneven floor are no piles.
//!
//! Undulations of the ground, flying pixels and registration errors look like low piles. An object
//! must have more volume than its expanded uncertainty, and more mean height than the margin within
//! which the ground lies.

use super::object::Object;
use super::reason::Reason;
use super::settings::Settings;

/// The smallest volume that is detected, in its own standard uncertainties: the coverage factor of
/// u95.
pub(super) const DETECTED: f64 = 2.0;
/// The smallest mean height of a pile, in margins. A cone of this mean height is three times as
/// high; at any angle of repose it is then wide enough for its shape to be told. Closed form for
/// the cone; the factor was chosen on the scenes of `divespot evaluate`.
const MARGINS: f64 = 1.5;

/// Gives the reason to every pile below the detection limit.
///
/// Only if the base is local: above a base that was asked for, heights say nothing about the ground
/// around the object.
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
    use super::super::tests::{exact, measured, settings};
    use super::super::{Budget, Reason};
    use super::*;

    /// The reason given to a cone whose mean height is `margins` times the margin.
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
        assert_eq!(reason(2.2), None);
    }

    #[test]
    fn a_volume_within_two_standard_uncertainties_may_be_nothing() {
        let cone = |x: f64, y: f64| (1.0 - (x - 4.0).hypot(y - 3.0)).max(0.0);
        let object = measured(&exact(cone), |x, y| cone(x, y) > 0.03).remove(0);
        let clear = |times: f64| {
            let filled_m3 = object.volume.net_m3() / times;
            let budget = Budget { filled_m3, ..Budget::default() };
            is_clear(&Object { budget, ..object.clone() }, 0.0)
        };
        assert!(clear(2.6) && !clear(1.5));
    }
}
