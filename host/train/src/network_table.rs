//! `[network]` of a rig file: the network that its owner asks for.

use sinew_sim::effects::Sign;
use sinew_sim::rig::{TableReader, Tables};
use sinew_sim::{Error, Rig};

/// Form of the network's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The next output.
    Absolute,
    /// Added to the present output.
    Increment,
    /// The change of the state, which a filter on the chip estimates.
    State,
}

/// The first hidden layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstLayer {
    /// Dense, with tanh.
    Tanh,
    /// Dense, with the rectifier.
    Relu,
    /// A GRU.
    Gru,
    /// An LSTM.
    Lstm,
}

/// The `[network]` table; a key that is absent is `None`.
///
/// ```
/// use sinew_train::{FirstLayer, NetworkTable};
///
/// let rig = sinew_sim::Rig::parse(
///     "format = 'sinew-rig/1'\nname = 'x'\n[[body]]\nname = 'm'\nmotion = 'slide'\n\
///      inertia = 1.0\n[network]\nhidden = [8]\nfirst_layer = 'gru'\n",
///     "x.toml",
/// )?;
/// let network = NetworkTable::read(&rig, &[])?.expect("the rig has the table");
/// assert_eq!((network.hidden, network.first_layer), (Some(vec![8]), Some(FirstLayer::Gru)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkTable {
    /// Widths of the hidden layers.
    pub hidden: Option<Vec<usize>>,
    /// Kind of the first layer.
    pub first_layer: Option<FirstLayer>,
    /// Past inputs that it sees.
    pub past_inputs: Option<usize>,
    /// Past outputs that it sees.
    pub past_outputs: Option<usize>,
    /// Part of a measurement that enters the past that it sees, over 0 to 1; the rest is its own
    /// prediction.
    pub observer_gain: Option<f64>,
    /// Weight of the simulator's derivatives in what it is trained by.
    pub derivative_weight: Option<f64>,
    /// Form of its output.
    pub form: Option<Form>,
    /// Indices of the sensors that it sees beside the outputs, of which it has one reading and no
    /// past.
    pub channels: Vec<usize>,
    /// Line of the table, for errors about what it asks.
    pub line: usize,
}

/// Longest past and widest layer that a rig may ask for; far beyond what fits a small chip.
const MAX_STEPS: usize = 256;
const MAX_WIDTH: usize = 1024;
/// Largest weight of derivatives in a loss where errors have 1: with more, errors count for
/// nothing.
const MAX_DERIVATIVE_WEIGHT: f64 = 1000.0;

impl NetworkTable {
    /// The table of a rig, if there is one; `outputs` are the indices of the sensors that are
    /// controlled.
    ///
    /// # Errors
    /// The first thing in it that is wrong, with its line and column.
    pub fn read(rig: &Rig, outputs: &[usize]) -> Result<Option<Self>, Error> {
        rig.read_tables(|tables| read_network(tables, outputs))
    }
}

fn read_network(tables: &Tables, outputs: &[usize]) -> Result<Option<NetworkTable>, Error> {
    let Some(table) = tables.table("network")? else {
        return Ok(None);
    };
    table.allow(&[
        "hidden",
        "first_layer",
        "past_inputs",
        "past_outputs",
        "observer_gain",
        "derivative_weight",
        "form",
        "channels",
    ])?;
    let channels = tables.sensors(&table, "channels")?;
    let channels = channels.unwrap_or_default();
    if channels.iter().any(|channel| outputs.contains(channel)) {
        return Err(table.error_at(
            "channels",
            "`channels` of [network] names an output of [control]; expected sensors beside the outputs, whose past the \
             network sees already"

        ));
    }
    let forms = [
        ("absolute", Form::Absolute),
        ("increment", Form::Increment),
        ("state", Form::State),
    ];
    let first_layers = [
        ("tanh", FirstLayer::Tanh),
        ("relu", FirstLayer::Relu),
        ("gru", FirstLayer::Gru),
        ("lstm", FirstLayer::Lstm),
    ];
    let first_layer = table.word("first_layer", &first_layers)?;
    let hidden = hidden_widths(&table)?;
    if first_layer.is_some() && hidden.as_ref().is_some_and(Vec::is_empty) {
        return Err(table.error_at(
            "first_layer",
            "`first_layer` of [network] is about a hidden layer, and `hidden` has none; expected a width, or no \
             `first_layer`",
        ));
    }
    let observer_gain = table.number("observer_gain", Sign::Positive)?;
    // The firmware's numbers are of single precision: what is nothing there would be refused after
    // a training.
    let taken = |gain: &f64| *gain as f32 > 0.0 && *gain <= 1.0;
    if let Some(gain) = observer_gain.filter(|gain| !taken(gain)) {
        return Err(table.error_at(
            "observer_gain",
            format!(
                "`observer_gain` of [network]: expected more than 0 and at most 1, found {gain:?}"
            ),
        ));
    }
    let derivative_weight = table.number("derivative_weight", Sign::NonNegative)?;
    if let Some(weight) = derivative_weight.filter(|weight| *weight > MAX_DERIVATIVE_WEIGHT) {
        return Err(table.error_at(
            "derivative_weight",
            format!(
                "`derivative_weight` of [network]: expected 0 to {MAX_DERIVATIVE_WEIGHT}, found {weight:?}"
            ),
        ));
    }
    let form = table.word("form", &forms)?;
    if form == Some(Form::State) {
        refuse_beside_state(&table, hidden.as_deref(), first_layer)?;
    }
    Ok(Some(NetworkTable {
        hidden,
        first_layer,
        past_inputs: table.count("past_inputs", 1, MAX_STEPS)?,
        past_outputs: table.count("past_outputs", 1, MAX_STEPS)?,
        observer_gain,
        derivative_weight,
        form,
        channels,
        line: table.own_line(),
    }))
}

fn hidden_widths(table: &TableReader) -> Result<Option<Vec<usize>>, Error> {
    table
        .numbers("hidden", Sign::Positive)?
        .map(|widths| {
            widths
                .into_iter()
                .map(|width| {
                    let whole = width.fract() == 0.0 && width <= MAX_WIDTH as f64;
                    whole.then_some(width as usize).ok_or_else(|| {
                        table.error_at(
                            "hidden",
                            format!(
                                "`hidden` of [network]: expected whole numbers from 1 to \
                                 {MAX_WIDTH}, found {width}"
                            ),
                        )
                    })
                })
                .collect::<Result<Vec<usize>, Error>>()
        })
        .transpose()
}

/// Refuses what a network with a state has no use for.
fn refuse_beside_state(
    table: &TableReader,
    hidden: Option<&[usize]>,
    first_layer: Option<FirstLayer>,
) -> Result<(), Error> {
    for key in [
        "past_inputs",
        "past_outputs",
        "observer_gain",
        "derivative_weight",
    ] {
        if table.has(key) {
            return Err(table.error_at(
                key,
                format!("`{key}` of [network] is for a network on past readings; expected no `{key}` beside `form = \"state\"`"),
            ));
        }
    }
    let wide = hidden.is_some_and(|widths| widths.len() != 1);
    if wide || first_layer.is_some_and(|first| first != FirstLayer::Tanh) {
        return Err(table.error_at(
            "form",
            "`form = \"state\"` of [network] has one hidden layer of tanh; expected one width in `hidden`",
        ));
    }
    Ok(())
}
