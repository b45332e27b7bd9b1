use nalgebra::Isometry2;
use robot_log::{Entry, EntryKind};

/// A log in which the robot was lifted and set down elsewhere: what it recorded from one stamp to another, in seconds, is
/// gone, and its wheels, which hung in the air, know nothing of it. A compass and the truth do.
///
/// ```
/// use robot_log::{Entry, EntryKind};
/// use simulator::{carried, nalgebra::Isometry2};
///
/// let at = |x: f64| EntryKind::Odometry { odom_from_robot: Isometry2::translation(x, 0.0) };
/// let log = (0..10).map(|k| Entry { stamp: f64::from(k), kind: at(f64::from(k)) });
/// let carried = carried(log, 2.5..6.5);
/// let odometry: Vec<_> = carried.iter().map(|entry| (entry.stamp, &entry.kind)).collect();
/// assert_eq!(odometry[2..5], [(2.0, &at(2.0)), (7.0, &at(2.0)), (8.0, &at(3.0))]);
/// ```
#[must_use]
pub fn carried(entries: impl IntoIterator<Item = Entry>, gone: std::ops::Range<f64>) -> Vec<Entry> {
    let (mut last, mut odom_from_wheels) = (None, None::<Isometry2<f64>>);
    let mut kept = Vec::new();
    for mut entry in entries.into_iter().filter(|entry| !gone.contains(&entry.stamp)) {
        let after = entry.stamp >= gone.end;
        if let EntryKind::Odometry { odom_from_robot: pose } | EntryKind::Scan { odom_from_robot: Some(pose), .. } =
            &mut entry.kind
        {
            if after {
                let here = last.unwrap_or(*pose);
                *pose = *odom_from_wheels.get_or_insert(here * pose.inverse()) * *pose;
            }
            last = Some(*pose);
        }
        kept.push(entry);
    }
    kept
}
