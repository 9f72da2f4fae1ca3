//! Signals of a controller, which a wiring has to connect.

/// One sensor or actuator of a controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Column of the recording, for instance `q_m`.
    pub name: String,
    /// Physical unit of the values in the firmware; `1` for none.
    pub unit: String,
    /// Smallest and largest value that a command may have; `None` for a sensor.
    pub range: Option<[f64; 2]>,
}

/// The signals of a controller, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Outputs that the board reads, then channels.
    pub sensors: Vec<Signal>,
    /// Inputs of the plant.
    pub actuators: Vec<Signal>,
    /// Control steps a second.
    pub rate_hz: f64,
}
