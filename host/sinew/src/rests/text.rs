//! Rests for a terminal, and as a table of numbers.

use sinew_ident::report::{Table, count, exact, quantity, significant};

use super::{Rests, Row, setting};

/// One rest: readings, derivatives, coordinates, and what is slack, pressed or held by friction.
pub fn table(rests: &Rests, row: &Row) -> Table {
    let plant = &rests.plant;
    let by = plant
        .inputs()
        .iter()
        .map(|input| format!("#by {}", input.column));
    let mut titles = vec!["signal".to_owned(), "#reading".to_owned()];
    if !row.intervals.is_empty() {
        titles.extend(["#lowest".to_owned(), "#highest".to_owned()]);
    }
    titles.extend(by);
    let caption = match setting(plant, &row.inputs) {
        at if at.is_empty() => "at rest".to_owned(),
        at => format!("at rest under {at}"),
    };
    let mut table = Table::new(caption, titles.iter().map(String::as_str));
    for (sensor, channel) in plant.sensors().iter().enumerate() {
        let with_unit = |value: f64| quantity(value, &channel.unit);
        let mut cells = vec![channel.column.clone(), with_unit(row.signals[sensor])];
        if !row.intervals.is_empty() {
            cells.extend(row.range(plant, sensor).map(with_unit));
        }
        let slopes = row
            .by_input
            .iter()
            .map(|slopes| significant(slopes[sensor], 4));
        cells.extend(slopes);
        table = table.row(cells);
    }
    table
}

/// Lines below the table of one rest.
pub fn remarks(rests: &Rests, row: &Row) -> Vec<String> {
    let plant = &rests.plant;
    let bodies = plant.bodies();
    let names = plant.state_names();
    let places = names[..bodies].iter().zip(&row.rest.state);
    let places = places.map(|(name, q)| format!("{name} {}", significant(*q, 6)));
    let mut lines = vec![format!(
        "coordinates (SI): {}",
        places.collect::<Vec<_>>().join(", ")
    )];
    if !row.rest.slack.is_empty() {
        lines.push(format!("slack: {}", row.rest.slack.join(", ")));
    }
    if !row.rest.pressed.is_empty() {
        lines.push(format!("pressed: {}", row.rest.pressed.join(", ")));
    }
    for interval in &row.intervals {
        let [forward, backward] = interval.hold.map(|hold| significant(hold, 4));
        let open = interval.ends.iter().any(Option::is_none);
        lines.push(format!(
            "{} holds up to {forward} forward and {backward} backward{}",
            interval.component,
            if open {
                "; an end of its interval has no balance"
            } else {
                ""
            }
        ));
    }
    let search = format!(
        "{}, {} of the forces",
        count(row.rest.steps, "step"),
        count(row.rest.evaluations, "evaluation")
    );
    lines.push(match row.rest.contraction {
        Some(contraction) => format!(
            "the only rest ({search}; a contraction of rate {} needs {} at most)",
            significant(contraction.rate, 3),
            count(contraction.steps, "step")
        ),
        None => format!("a stable rest ({search}); others are not excluded"),
    });
    lines
}

/// All rests as CSV: inputs, readings, and the ends of their intervals where there are some.
pub fn csv(rests: &Rests) -> String {
    let plant = &rests.plant;
    let with_ends = rests.rows.iter().any(|row| !row.intervals.is_empty());
    let mut titles: Vec<String> = plant
        .inputs()
        .iter()
        .map(|input| input.column.clone())
        .collect();
    for sensor in plant.sensors() {
        titles.push(sensor.column.clone());
        if with_ends {
            titles.extend(["lowest", "highest"].map(|end| format!("{}_{end}", sensor.column)));
        }
    }
    let mut text = titles.join(",") + "\n";
    for row in &rests.rows {
        let mut cells: Vec<String> = row.inputs.iter().map(|u| exact(*u)).collect();
        for (sensor, signal) in row.signals.iter().enumerate() {
            cells.push(exact(*signal));
            if with_ends {
                cells.extend(row.range(plant, sensor).map(exact));
            }
        }
        text += &(cells.join(",") + "\n");
    }
    text
}
