//! Explanations of the faults of recordings (docs/reference/checks.md).

/// Name, meaning and next step.
pub(super) const WORDS: &[(&str, &str, &str)] = &[
    (
        "clipped",
        "A sensor stays at an end of its range while the device moves on.",
        "Record within the range of the sensor, or write empty fields for the clipped samples.",
    ),
    (
        "coarse_sampling",
        "A period or time constant of the rig has fewer than four rows.",
        "Record at least ten rows a period. What moves between two rows is not seen.",
    ),
    (
        "dead_channel",
        "A sensor is constant under a changing input, shows no motion where the rig moves it, \
         falls silent, or has under 20 values.",
        "Check the cable and the name of the column. Leave the sensor out of the rig until it \
         measures.",
    ),
    (
        "degrees_for_radians",
        "An angle is recorded in degrees, and the rig takes it for radians.",
        "Write unit = \"deg\" in the sensor, or name the column with its unit.",
    ),
    (
        "different_devices",
        "Two recordings exclude each other's parameters: the device, its load or its state \
         differs.",
        "Diagnose one device at a time, or free the parameter for each recording with per = \
         \"recording\".",
    ),
    (
        "few_rows",
        "A recording has 20 rows or fewer. The first 20 show where a run starts, and none is left \
         to judge it by.",
        "Record longer.",
    ),
    (
        "gap",
        "Rows are missing: at one place, or one by one all over the recording.",
        "Cut the recording at a long gap. A simulation across it would not know the input.",
    ),
    (
        "input_lags",
        "An input is written some rows after it acted.",
        "Shift the column with --late, for example --late u_N=1. If the device has a dead time, \
         add input_delay to the rig instead.",
    ),
    (
        "input_leads",
        "An input is written one to four rows before it acts, or the device or its sensors are \
         that late.",
        "Where the logger did it, shift the column with --late u_N=-1. Otherwise add input_delay \
         to the rig.",
    ),
    (
        "input_not_held",
        "Inputs run straight from row to row where the rig has them step, or the other way round. As \
         they were, the rig leaves noise alone.",
        "Write hold = \"linear\" (or \"zero\") in the actuators of the rig.",
    ),
    (
        "irregular_sampling",
        "Rows lie unevenly in time.",
        "Record with the time stamps of the device, not of the computer that receives them.",
    ),
    (
        "jittering_delay",
        "A position scatters more the faster it moves: samples are taken early or late under even \
         time stamps, or commands arrive so.",
        "Sample by a timer, or record the time at which each sample was taken. What it adds to the \
         noise no model explains.",
    ),
    (
        "millimetres_for_metres",
        "A position is recorded in millimetres, and the rig takes it for metres.",
        "Write unit = \"mm\" in the sensor, or name the column with its unit.",
    ),
    (
        "no_excitation",
        "Every sensor shows noise alone. Such rows determine no parameter.",
        "Drive the device. `sinew excite RIG --out experiment.csv` designs an experiment within \
         its limits.",
    ),
    (
        "quantised",
        "A sensor has 40 levels or fewer over its motion.",
        "Record more digits, or a larger motion. Effects smaller than one level cannot be named.",
    ),
    (
        "same_recording",
        "A file holds the same rows as another, to fit or to test.",
        "Give each recording one role. A test recording that was fitted proves nothing.",
    ),
    (
        "sensor_drift",
        "A reading wanders at a steady rate: without that the rig leaves noise alone.",
        "Let the sensor warm up, or take the drift out of the column before the fit.",
    ),
    (
        "sensor_gain",
        "A sensor reads more or less than the rig says, beside another: with its gain free the \
         rig leaves noise alone.",
        "Write gain = { value = 1.0 } in the sensor that you trust least, and fit.",
    ),
    (
        "sensor_lags",
        "One of several sensors is written some rows after the others.",
        "Shift its column with --late, for example --late q_m=2. If the sensor itself is slow, \
         add sensor_lag to the rig instead.",
    ),
    (
        "sensor_offset",
        "A sensor is off by a constant: with its offset free the rig leaves noise alone.",
        "Write offset = { value = 0.0 } in the sensor, and fit. A constant load or the rest of a \
         spring may look the same.",
    ),
    (
        "sentinel",
        "A number stands for a missing value, such as -9999, or 0 in a sensor that moves.",
        "Name it with --missing, for example --missing -9999 or --missing q_m=0, or write empty \
         fields.",
    ),
    (
        "spike",
        "Single samples jump away and back.",
        "Write empty fields for them; a missing sample costs less than a wrong one.",
    ),
    (
        "stuck_channel",
        "A sensor froze while the device moved.",
        "Write empty fields for the frozen samples, and look for the cause in the driver of the \
         sensor.",
    ),
    (
        "swapped_columns",
        "Two sensors, two inputs, or an input and a sensor stand under each other's names: \
         exchanged, the rig explains them.",
        "Exchange the two names in the header of the recording, or in the rig.",
    ),
    (
        "time_in_hours",
        "Times are in hours where seconds are expected: the rig moves as it says once they are \
         seconds.",
        "Pass --time-unit h, or multiply the column t.",
    ),
    (
        "time_in_microseconds",
        "Times are in microseconds where seconds are expected.",
        "Pass --time-unit us, or divide the column t.",
    ),
    (
        "time_in_milliseconds",
        "Times are in milliseconds where seconds are expected.",
        "Pass --time-unit ms, or divide the column t.",
    ),
    (
        "time_in_minutes",
        "Times are in minutes where seconds are expected: the rig moves as it says once they are \
         seconds.",
        "Pass --time-unit min, or multiply the column t.",
    ),
    (
        "time_in_nanoseconds",
        "Times are in nanoseconds where seconds are expected.",
        "Pass --time-unit ns, or divide the column t.",
    ),
    (
        "time_in_other_unit",
        "Times are a power of ten too large, such as hundredths of a second. The rig moves as it \
         says with smaller ones.",
        "Divide the column t by what is said.",
    ),
    (
        "unanswered_input",
        "The inputs would move the rig as it is written, and the sensors do not answer to them.",
        "Check that the drive was on, and that the column is the command that it got.",
    ),
    (
        "wrapped_counter",
        "A counter or angle begins anew at the end of its range.",
        "Join the turns with --unwrap, for example --unwrap q_rad=6.283.",
    ),
    (
        "wrong_sign",
        "A sensor or an actuator counts against the direction of the rig.",
        "Write gain = -1.0 in the sensor, or negate the gain of the actuator.",
    ),
];
