//! Why an object is no pile, in words.

/// Why an object is no pile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It is nowhere three cells wide.
    Thin,
    /// Most of its rim stands high, or it is high and slender: no bulk material lies so steep.
    SteepSides,
    /// Its summit borders the shadow of something steep: haze, or a pile that is half hidden.
    Shadow,
    /// The surface was seen below it.
    Floating,
    /// It hangs together with no surface that can be walked from the ground.
    Apart,
    /// Too little of it was seen for a volume that could be answered for.
    TooLittleSeen,
    /// It runs out of the scan on most sides, or is walled in, and no ground was seen around it.
    CutOff,
    /// Its volume is not clear of its own uncertainty, or its mean height not of the margin within
    /// which the ground lies.
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
