//! A candidate fitted to whole recordings.

use sinew_sim::SimulationSettings;

use crate::diagnose::candidate::Trial;
use crate::diagnose::case::Case;
use crate::diagnose::data::Starts;
use crate::diagnose::model::Point;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::segment::Segment;

/// The best candidate fitted to the whole of the recordings, integrated as a simulation is, from
/// where the search ended; and the recordings as that fit saw them.
pub(crate) fn whole(best: &Trial, case: &Case, steps: usize) -> Result<(Point, Vec<Segment>)> {
    let model = &best.model.integrated(SimulationSettings::default());
    let data = case.fit;
    let mut segments = data.segments(&model.plant, &data.cut(1))?;
    let values = best.point.values.clone();
    let found = Starts {
        data,
        intervals: &case.fit_intervals,
        states: &best.point.states,
    };
    let states = data.carried((&model.rig, &model.plant), &values, &segments, found)?;
    let from = DecisionVariables { values, states };
    let mut point = model
        .improve(data, &mut segments, from, steps, 1e-5)
        .unwrap_or_else(|| best.point.clone());
    crate::diagnose::canonical::settle(model, &best.terms, &mut point);
    Ok((point, segments))
}
