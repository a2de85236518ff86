//! What an error is made of, in words.

use crate::diagnosis::LimitedBy;

impl LimitedBy {
    /// Where an error comes from: behind "most of it".
    #[must_use]
    pub const fn cause(self) -> &'static str {
        match self {
            Self::GyroNoise => "noise of the gyro",
            Self::BiasWander => "a bias that wanders",
            Self::ReferenceNoise => "noise of the reference",
            Self::ReferenceBandwidth => "because the reference does not follow fast motion",
            Self::Timing => "from time stamps that scatter",
            Self::FoldedMotion => "from motion too fast for the log's rate",
            Self::RandomScale => "from a scale factor that wanders",
            Self::RateNoise => "from noise that grows with the rate",
            Self::ReversalSteps => "from steps at the reversals",
            Self::StartStopSteps => "from steps at starts and stops",
            Self::LostMotion => "from motion in holes of the log",
            Self::MissingEffect => "from an effect that is missing",
            Self::Unattributed => "from a cause that is not known",
        }
    }

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::GyroNoise => "gyro noise",
            Self::BiasWander => "bias wander",
            Self::ReferenceNoise => "reference noise",
            Self::ReferenceBandwidth => "reference bandwidth",
            Self::Timing => "timing",
            Self::FoldedMotion => "aliased motion",
            Self::RandomScale => "random scale",
            Self::RateNoise => "rate noise",
            Self::ReversalSteps => "reversal steps",
            Self::StartStopSteps => "start-stop steps",
            Self::LostMotion => "lost motion",
            Self::MissingEffect => "missing effect",
            Self::Unattributed => "unattributed",
        }
    }
}
