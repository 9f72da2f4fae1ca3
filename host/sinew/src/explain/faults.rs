//! Explanations of the causes of an operating mode (docs/reference/faults.md).

use sinew_device::mode::Cause;

words! {
    Cause:
    Start = "Start":
        "Power came on or the reset button was pressed. Nobody has armed the board.",
        "Arm it when the plant is ready.";
    Watchdog = "Watchdog":
        "The firmware hung, and the watchdog restarted the chip with outputs off.",
        "Read the log of the board. Look for a driver that waits without a limit, then arm \
         again.";
    Fault = "Fault":
        "A fault or a panic restarted the chip with outputs off.",
        "Read the last lines of the log, which name the place. Report it if the code is not \
         yours.";
    BrownOut = "BrownOut":
        "The supply dropped below the chip's limit, and the chip restarted with outputs off.",
        "Check the supply under load; separate the supply of the power stages from the chip's.";
    Asked = "Asked":
        "The host asked for this mode.",
        "Nothing.";
    EmergencyStop = "EmergencyStop":
        "The host asked for an emergency stop. The safe command is applied at once, outputs are \
         off.",
        "Acknowledge it with Disarm, then arm again.";
    SamplesLost = "SamplesLost":
        "Too many samples were missing in a row, or a converter is at its end as with a broken \
         wire.",
        "Check the wire and the range of the sensor. `max_missing_samples` is the limit.";
    Diverged = "Diverged":
        "An output went far beyond the range of training and stayed there.",
        "Move the plant back by hand. Check signs and limits, or train on a wider range.";
    Stuck = "Stuck":
        "A sensor did not change in one bit while the command moved a quarter of its range.",
        "Check the sensor and that the power stage drives the plant.";
    NoPlan = "NoPlan":
        "Too many steps in a row gave no plan.",
        "Look at the status of the steps before: BadReference, BadSettings or NotFinite.";
    Late = "Late":
        "Too many steps in a row ended after their period.",
        "Lower the rate, the horizon or the iterations; `sinew size` shows the instructions of a \
         step.";
    LinkLost = "LinkLost":
        "The host was silent for 2 s.",
        "Check the cable and the program on the host, then arm again.";
    Starved = "Starved":
        "The rows of the excitation ran out before new ones came.",
        "Send the rows of an excitation earlier; `sinew record` does so by itself.";
}
