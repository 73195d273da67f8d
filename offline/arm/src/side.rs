//! Which arm, and which tool it carries.

/// One of the two arms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The left arm, message slots 0 to 7.
    Gold,
    /// The right arm, message slots 8 to 15.
    Green,
}

impl Side {
    /// Both arms in message order.
    pub const ALL: [Self; 2] = [Self::Gold, Self::Green];

    /// Index of the arm in a message: 0 gold, 1 green.
    pub const fn index(self) -> usize {
        match self {
            Self::Gold => 0,
            Self::Green => 1,
        }
    }

    /// Name as files and messages have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gold => "gold",
            Self::Green => "green",
        }
    }

    /// The arm called `gold`, `left`, `green` or `right`, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "gold" | "left" => Some(Self::Gold),
            "green" | "right" => Some(Self::Green),
            _ => None,
        }
    }
}

/// Tool on the arm: it sets the sign σ with which motor 3 reaches the tool motors, and the wrist coupling κ
/// (raven2-plant.md, section 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Tool {
    /// RAVEN grasper, the nominal tool of both arms.
    #[default]
    Raven,
    /// Square tool.
    Square,
    /// da Vinci large needle driver.
    LargeNeedle,
    /// da Vinci micro forceps.
    MicroForceps,
    /// da Vinci bipolar forceps.
    Bipolar,
    /// da Vinci Cadière forceps.
    Cardiere,
    /// da Vinci scissors.
    Scissors,
}

impl Tool {
    /// All tools.
    pub const ALL: [Self; 7] =
        [Self::Raven, Self::Square, Self::LargeNeedle, Self::MicroForceps, Self::Bipolar, Self::Cardiere, Self::Scissors];

    /// Name as the plant file has it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raven => "raven",
            Self::Square => "square",
            Self::LargeNeedle => "dv_large_needle",
            Self::MicroForceps => "dv_micro_forceps",
            Self::Bipolar => "dv_bipolar",
            Self::Cardiere => "dv_cardiere",
            Self::Scissors => "dv_scissors",
        }
    }

    /// The tool that the plant file calls `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tool| tool.name() == name)
    }
}
