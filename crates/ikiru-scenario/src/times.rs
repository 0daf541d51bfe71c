//! When an objective holds: `at`, or `from` and `to`.

use ikiru_solve::{TargetPath, Timeline, When};
use serde::Serialize;

use crate::at::At;
use crate::error::{Error, ErrorKind};
use crate::key::Key;
use crate::scene::needs_motion;
use crate::table::Table;

/// When an objective of a scenario with `[motion]` holds, in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Times {
    /// At one time.
    At {
        /// `at`
        at: f64,
    },
    /// All the time between two.
    Span {
        /// `from`
        from: f64,
        /// `to`
        to: f64,
    },
}

impl Times {
    pub(crate) const KEYS: [Key; 3] = [
        Key::new("at", "seconds", "The sample nearest to this time.")
            .or_as("the path's span, else the last sample"),
        Key::new("from", "seconds", "Every sample from here …").or_as("the same"),
        Key::new("to", "seconds", "… to here.").or_as("the same"),
    ];

    /// What is there of them.
    pub(crate) fn read_if_there(table: &Table<'_>) -> Result<Option<Self>, Error> {
        match Self::KEYS.map(|key| table.get(&key)) {
            [None, None, None] => Ok(None),
            [Some(at), None, None] => Ok(Some(Self::At { at: at.number()? })),
            [None, Some(from), Some(to)] => Ok(Some(Self::Span { from: from.number()?, to: to.number()? })),
            _ => Err(table.alternatives(&Self::KEYS, "'at', or both 'from' and 'to', in seconds")),
        }
    }

    /// The times on the timeline. `objective` is the table that has them.
    fn when(self, timeline: Option<&Timeline>, objective: &At<'_>) -> Result<When, Error> {
        let first = match self {
            Self::At { .. } => "at",
            Self::Span { .. } => "from",
        };
        let timeline = timeline.ok_or_else(|| needs_motion(&objective.key(first)))?;
        let on_line = |secs: f64, key: &str| {
            let wrong =
                |e| objective.key(key).error(ErrorKind::Motion(ikiru_solve::MotionError::Timeline(e)));
            timeline.sample_at(secs).map(|_| secs).map_err(wrong)
        };
        match self {
            Self::At { at } => Ok(When::At(on_line(at, "at")?)),
            Self::Span { from, to } => {
                let (from, to) = (on_line(from, "from")?, on_line(to, "to")?);
                if from > to {
                    let kind = ErrorKind::Order { what: "time of a span in seconds", min: from, max: to };
                    return Err(objective.key("to").error(kind));
                }
                Ok(When::Span { from, to })
            }
        }
    }
}

/// When an objective holds: as long as its path goes on, where it has one and no times are given; else at the last
/// sample.
pub(crate) fn when(
    times: Option<Times>,
    path: Option<&TargetPath>,
    timeline: Option<&Timeline>,
    objective: &At<'_>,
) -> Result<When, Error> {
    match (times, path) {
        (Some(times), _) => times.when(timeline, objective),
        (None, Some(path)) => {
            let (from, to) = path.span();
            Ok(When::Span { from, to })
        }
        (None, None) => Ok(When::End),
    }
}
