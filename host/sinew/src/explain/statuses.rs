//! Explanations of the statuses of a control step.

use sinew_mpc::status::Status;

words! {
    Status:
    Converged = "Converged":
        "The plan is optimal as far as single precision can tell.",
        "Nothing.";
    IterationLimit = "IterationLimit":
        "The plan improved until the iterations were used up. This is the usual case.",
        "Nothing, while tracking is good. Otherwise allow more iterations, or shorten the \
         horizon.";
    NoDecrease = "NoDecrease":
        "A step was found that should lower the cost and did not. The better plan is kept.",
        "Nothing, where it is rare. Often: raise the move suppression, or check the model far \
         from its training range.";
    BadReference = "BadReference":
        "The reference holds a NaN or an infinity. The earlier plan is followed.",
        "Mend the source of the reference. After too many such steps the firmware disarms with \
         NoPlan.";
    BadSettings = "BadSettings":
        "The settings are not valid. The earlier plan is followed.",
        "Check weights and limits that were sent: weights are zero or more, limits in order and \
         inside those of the model.";
    NotFinite = "NotFinite":
        "The prediction is not finite. The earlier plan is followed.",
        "Check the measured values and the weights of the network. After too many such steps the \
         firmware disarms with NoPlan.";
    SignalLost = "SignalLost":
        "No sample yet, or too many are missing in a row. The command goes to the safe one.",
        "Check the sensor and the link. With hardware the firmware disarms with SamplesLost.";
    Disarmed = "Disarmed":
        "Nothing is armed. The command goes to the safe one within the rate.",
        "Arm the board; `sinew monitor` shows the cause of the last disarming.";
    OpenLoop = "OpenLoop":
        "The command is one that was asked for, inside the limits. Nothing was optimised.",
        "Nothing: this is an excitation or a manual command.";
    CutShort = "CutShort":
        "The plan improved until the budget of the step was used up, or an interrupt ended it.",
        "Nothing, while tracking is good. Otherwise raise `budget` of [control], or shorten the \
         horizon. With 0 iterations the budget holds none.";
}
