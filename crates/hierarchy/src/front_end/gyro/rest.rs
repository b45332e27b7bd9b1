/// What a gyro read since the wheels came to rest, besides the drift that was expected of it.
///
/// Gyros are calibrated and drift by hundredths of a degree a second, or they are not and drift by degrees; some calibrate
/// themselves on the way. One normal distribution is no fair account of both: so wide a one takes slipping wheels and
/// rounded readings for drift. So a gyro that turns at rest by what neither the noise of its readings nor the doubt of its
/// drift explains is one whose drift is unknown anew.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Rest {
    /// Seconds of rest after the wheels were first said to stand, and the unexpected turn in them.
    pub(crate) so_far: Option<(f64, f64)>,
    /// Seconds driven since the drift was last seen to be right.
    pub(crate) driven: f64,
}

/// A drift that is not what it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surprise {
    /// By how much it is more than was believed, in radians per second, as far as this rest tells.
    pub(super) rate: f64,
    /// Seconds of this rest.
    pub(super) rested: f64,
    /// Seconds driven since the drift was last seen to be right.
    pub(super) driven: f64,
}

/// Standard deviations by which a turn at rest must differ from what was expected: by chance, in one of 15,000 rests.
const SURPRISING: f64 = 4.0;
/// A rest of so many seconds that surprises nobody shows that the drift is right.
const REASSURING: f64 = 2.0;

impl Rest {
    /// The wheels turned for so many seconds.
    pub(super) fn ends(&mut self, seconds: f64) {
        self.so_far = None;
        self.driven += seconds;
    }

    /// The wheels rested for so many seconds more, while the gyro turned by `unexplained` besides its drift.
    ///
    /// `noise` is the variance of a difference of two readings, `drift_variance` that of the drift in (rad/s)².
    /// The first readings after a turn may still lag behind it and count for nothing.
    pub(super) fn goes_on(
        &mut self,
        seconds: f64,
        unexplained: f64,
        noise: f64,
        drift_variance: f64,
    ) -> Option<Surprise> {
        let Some((rested, turned)) = &mut self.so_far else {
            self.so_far = Some((0.0, 0.0));
            return None;
        };
        *rested += seconds;
        *turned += unexplained;
        let (rested, turned) = (*rested, *turned);
        if turned.abs() > SURPRISING * (noise + drift_variance * rested * rested).sqrt() {
            let surprise = Surprise { rate: turned / rested, rested, driven: self.driven };
            *self = Self { so_far: Some((0.0, 0.0)), driven: 0.0 };
            return Some(surprise);
        }
        if rested >= REASSURING {
            self.driven = 0.0;
        }
        None
    }
}
