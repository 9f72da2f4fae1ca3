//! `sinew-settle/1`: rests for programs.

use serde_json::{Map, Value, json};

use super::{Rests, Row};

/// Format of the document.
pub const FORMAT: &str = "sinew-settle/1";

/// Rests as JSON; readings and inputs in the units of their columns, states in SI.
pub fn json(rests: &Rests, rig: &str) -> Value {
    let sweep = rests.sweep.as_ref().map(|sweep| {
        json!({
            "input": rests.plant.inputs()[sweep.input].column,
            "from": sweep.ends[0],
            "to": sweep.ends[1],
            "count": sweep.count,
        })
    });
    json!({
        "format": FORMAT,
        "rig": rig,
        "sweep": sweep,
        "rests": rests.rows.iter().map(|row| entry(rests, row)).collect::<Vec<_>>(),
    })
}

fn entry(rests: &Rests, row: &Row) -> Value {
    let plant = &rests.plant;
    let inputs = || plant.inputs().iter().map(|input| input.column.clone());
    let signals = || plant.sensors().iter().map(|sensor| sensor.column.clone());
    let by_signal = |values: &[f64]| object(signals().zip(values.iter().map(|&v| json!(v))));
    let readings = (0..row.signals.len()).map(|sensor| {
        let interval = if row.intervals.is_empty() {
            Value::Null
        } else {
            json!(row.range(plant, sensor))
        };
        json!({
            "value": row.signals[sensor],
            "unit": plant.sensors()[sensor].unit,
            "interval": interval,
        })
    });
    let intervals = row.intervals.iter().map(|interval| {
        let ends = interval.ends.iter().map(|end| {
            end.as_ref()
                .map(|end| by_signal(&super::in_columns(plant, &end.signals)))
        });
        json!({
            "component": interval.component,
            "hold": interval.hold,
            "ends": ends.collect::<Vec<_>>(),
        })
    });
    let by_input = row.by_input.iter().map(|slopes| by_signal(slopes));
    let by_parameter = row
        .by_parameter
        .iter()
        .map(|(slot, slopes)| (plant.parameters()[*slot].name.clone(), by_signal(slopes)));
    let contraction = row.rest.contraction.map(
        |contraction| json!({ "rate": contraction.rate, "certified_steps": contraction.steps }),
    );
    let state = row.rest.state.iter().map(|&x| json!(x));
    json!({
        "inputs": object(inputs().zip(row.inputs.iter().map(|&u| json!(u)))),
        "signals": object(signals().zip(readings)),
        "state": object(plant.state_names().into_iter().zip(state)),
        "slack": row.rest.slack,
        "pressed": row.rest.pressed,
        "intervals": intervals.collect::<Vec<_>>(),
        "by_input": object(inputs().zip(by_input)),
        "by_parameter": object(by_parameter),
        "steps": row.rest.steps,
        "evaluations": row.rest.evaluations,
        "contraction": contraction,
        "fallback": row.rest.fallback,
    })
}

fn object(members: impl Iterator<Item = (String, Value)>) -> Value {
    Value::Object(members.collect::<Map<_, _>>())
}
