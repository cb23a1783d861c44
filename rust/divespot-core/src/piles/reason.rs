//! Why an object is no pile, in words.

/// Why an object is no pile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It is nowhere three cells wide.
    Thin,
    /// Most of its rim is high, or it is tall and slender: steeper than bulk material lies.
    SteepSides,
    /// Its summit borders the shadow of something steep: flying pixels, or a partly occluded pile.
    Shadow,
    /// The surface was seen below it.
    Floating,
    /// Its surface cannot be reached from the ground without a step steeper than material stands.
    Apart,
    /// Too little of it was seen for a measured volume.
    TooLittleSeen,
    /// It runs out of the scan on most sides or is walled in, and no ground was seen around it.
    CutOff,
    /// Its volume is less than its expanded uncertainty, or its mean height is within the margin of
    /// the ground.
    NotClear,
}

impl Reason {
    /// The reason as reports have it.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Thin => "thin",
            Self::SteepSides => "steep sides",
            Self::Shadow => "beside a shadow",
            Self::Floating => "floating",
            Self::Apart => "apart from the ground",
            Self::TooLittleSeen => "too little seen",
            Self::CutOff => "cut off by the scan's edge",
            Self::NotClear => "not clear of the ground",
        }
    }
}
