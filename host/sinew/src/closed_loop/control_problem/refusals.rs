//! Control problems that are refused before anything is trained.

use sinew_device::protocol::MAX_PREVIEW;
use sinew_sim::{Plant, Rig};
use sinew_train::{FirstLayer, Form};

use crate::closed_loop::reference::Reference;
use crate::rig_file::{self, ControlTable};
use sinew_ident::error::{Error, Result};

/// Refuses a rig without an output or an input, and one that recordings drive.
pub(super) fn controllable(rig: &Rig, plant: &Plant, outputs: &[usize]) -> Result<()> {
    if outputs.is_empty() {
        return Err(
            Error::file(&rig.file, "nothing to control: no sensor reads a position")
                .expected("`outputs` in [control], or a sensor that reads BODY.position"),
        );
    }
    if plant.inputs().is_empty() {
        let message = "nothing to control with: the rig has no actuator";
        return Err(Error::file(&rig.file, message).expected("an [[actuator]] with its `input`"));
    }
    if let Some(reason) = plant.only_recordings() {
        let message = format!("nothing to control: {reason}");
        return Err(
            Error::file(&rig.file, message).expected("a rig that its actuators alone drive")
        );
    }
    Ok(())
}

/// Refuses a reference that ends before a control step has looked ahead once.
pub(super) fn long_enough(asked: &Reference, preview: usize) -> Result<()> {
    if asked.steps() >= preview {
        return Ok(());
    }
    Err(Error::failed(format!(
        "the reference has {} steps, and a control step looks {preview} ahead",
        asked.steps()
    )))
}

/// Refuses a network whose cost-to-go is not computed.
pub(super) fn computable(rig: &Rig) -> Result<()> {
    let Some(table) = rig_file::network_table(rig)? else {
        return Ok(());
    };
    let reason = if table.form == Some(Form::State) {
        "`form = \"state\"`"
    } else if !table.channels.is_empty() {
        "`channels`"
    } else if matches!(table.first_layer, Some(FirstLayer::Gru | FirstLayer::Lstm)) {
        "a recurrent `first_layer`"
    } else {
        return Ok(());
    };
    let message = format!(
        "[network] has {reason}, and `terminal = \"value\"` of [control] is not computed for it"
    );
    Err(Error::file(&rig.file, message).at(table.line, 1).expected(
        "a network on past readings, as it is without `form`, `channels` and `first_layer`; \
             or no `terminal`",
    ))
}

/// Refuses what no firmware could carry.
pub(super) fn carried(
    rig: &Rig,
    period_s: f64,
    (steps, with_terminal): (usize, bool),
    outputs: usize,
) -> Result<()> {
    let refuse = |message: String, expected: &str| {
        let line = ControlTable::read(rig)?.map_or(1, |control| control.line);
        Err(Error::file(&rig.file, message)
            .at(line, 1)
            .expected(expected))
    };
    if !(1e-5..=1000.0).contains(&period_s) {
        return refuse(
            format!("[control] asks for {} steps a second", 1.0 / period_s),
            "`rate_hz` from 0.001 to 100000",
        );
    }
    let preview = steps * outputs;
    if preview > MAX_PREVIEW {
        let looked = if with_terminal {
            "`horizon` and `value_ahead` together,"
        } else {
            "`horizon`"
        };
        return refuse(
            format!("[control] asks for a reference preview of {preview} values"),
            &format!("{looked} times the number of outputs at most {MAX_PREVIEW}"),
        );
    }
    Ok(())
}
