//! The picture of a wiring: the board with sensors on its left and actuators on its right.

use std::fmt::Write;

use crate::board::Board;
use crate::file::{ActuatorBy, SensorBy, Wiring};

/// Height of a pin's row, pixels.
const ROW: usize = 34;
/// First row's place.
const TOP: usize = 100;

/// One pin of the picture.
struct Row<'a> {
    pin: &'a str,
    words: String,
}

/// An SVG of the wiring, one pin a row.
pub fn picture(wiring: &Wiring, board: &Board) -> String {
    let left: Vec<Row<'_>> = wiring
        .sensors
        .iter()
        .flat_map(|wire| {
            let words = |of: &str| match &wire.by {
                SensorBy::Analogue { .. } => {
                    format!("{}, 0 to {} V", wire.column, board.full_scale_v)
                }
                SensorBy::Encoder { pins, .. } => {
                    let phase = if pins[0] == of { "A" } else { "B" };
                    format!("{}, encoder {phase}", wire.column)
                }
            };
            let pins = wire.pins().into_iter();
            pins.map(|pin| Row {
                pin,
                words: words(pin),
            })
            .collect::<Vec<_>>()
        })
        .collect();
    let mut right: Vec<Row<'_>> = wiring
        .actuators
        .iter()
        .flat_map(|wire| {
            let words = |of: &str| match &wire.by {
                ActuatorBy::Pwm { .. } => format!("{}, PWM", wire.input),
                ActuatorBy::Signed { pin, .. } if pin == of => format!("{}, PWM", wire.input),
                ActuatorBy::Signed { .. } => format!("{}, direction", wire.input),
                ActuatorBy::Servo { .. } => format!("{}, servo", wire.input),
            };
            let pins = wire.pins().into_iter();
            pins.map(|pin| Row {
                pin,
                words: words(pin),
            })
            .collect::<Vec<_>>()
        })
        .collect();
    let enable = board
        .taken
        .iter()
        .filter(|(_, purpose)| purpose.contains("ENABLE"));
    right.extend(enable.map(|(pin, _)| Row {
        pin,
        words: "ENABLE, high while armed".into(),
    }));

    let height = TOP + ROW * left.len().max(right.len()).max(1);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 800 {}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n\
         <title>{title}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"30\" y=\"34\" font-size=\"18\" font-weight=\"bold\">{title}</text>\n\
         <rect x=\"290\" y=\"60\" width=\"220\" height=\"{}\" rx=\"10\" fill=\"#eef3f8\" \
         stroke=\"#33506b\" stroke-width=\"2\"/>\n",
        height + 50,
        height - 60,
        title = board.title,
    );
    for (k, row) in left.iter().enumerate() {
        side(&mut svg, k, row, board, false);
    }
    for (k, row) in right.iter().enumerate() {
        side(&mut svg, k, row, board, true);
    }
    let _ = writeln!(
        svg,
        "<text x=\"30\" y=\"{}\" font-size=\"13\">One ground: board, sensors and power stages. \
         Pull ENABLE down with 10 kilohms.</text>\n</svg>",
        height + 30
    );
    svg
}

// Writing to a String cannot fail.
fn side(svg: &mut String, k: usize, row: &Row<'_>, board: &Board, right: bool) {
    let y = TOP + ROW * k;
    let place = board.pin(row.pin).map_or("", |pin| pin.place);
    let (colour, edge, out, inside, anchors) = if right {
        ("#b3541e", 510, 580, 498, ["start", "end"])
    } else {
        ("#2b7a4b", 290, 220, 302, ["end", "start"])
    };
    let words_at = if right { out + 8 } else { out - 8 };
    let words = escaped(&row.words);
    let _ = writeln!(
        svg,
        "<line x1=\"{out}\" y1=\"{y}\" x2=\"{edge}\" y2=\"{y}\" stroke=\"{colour}\" \
         stroke-width=\"3\"/>\n\
         <circle cx=\"{edge}\" cy=\"{y}\" r=\"5\" fill=\"{colour}\"/>\n\
         <text x=\"{inside}\" y=\"{text_y}\" text-anchor=\"{}\">{place}  {}</text>\n\
         <text x=\"{words_at}\" y=\"{text_y}\" text-anchor=\"{}\">{words}</text>",
        anchors[1],
        row.pin,
        anchors[0],
        text_y = y + 5,
    );
}

/// Text that may stand in an SVG.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
