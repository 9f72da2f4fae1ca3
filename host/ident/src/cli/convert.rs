//! `sinew convert`: a log of another program as a recording.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sinew_convert::{Contents, Join, Wanted, bases, columns};

use super::overwrite;
use super::said::Said;
use crate::error::{Error, Result};
use crate::recording::{Recording, foreign};

/// Arguments of `sinew convert`.
#[derive(Args)]
pub struct Arguments {
    /// The log: MATLAB (.mat), HDF5 (.h5), MCAP (.mcap) or JSON (.json).
    log: PathBuf,
    /// File for the recording (CSV); `-` is standard output.
    #[arg(long, value_name = "REC.csv", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Column and the signal in it, with a number from 1 where there are several; may be repeated.
    ///
    /// Without it every signal is a column under its own name, with its unit at the end.
    #[arg(long = "column", value_name = "NAME=PATH[:INDEX]", value_parser = named)]
    columns: Vec<(String, String)>,
    /// Times whose rows are taken: path, group or topic; by default those of most columns.
    #[arg(long, value_name = "PATH")]
    base: Option<String>,
    /// Rule for signals with other times: the last value before a row, or a straight line.
    #[arg(long, value_enum, default_value = "last")]
    join: Rule,
    /// List what the log holds, and write nothing.
    #[arg(long, conflicts_with = "out")]
    list: bool,
    /// File for contents and columns as JSON (sinew-convert/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Rules for signals of another base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Rule {
    /// The last value.
    Last,
    /// A straight line.
    Linear,
}

/// # Errors
/// A bad log or choice of columns, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [("the log", arguments.log.as_path())],
        [
            ("--out", arguments.out.as_deref()),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let json = arguments.json.as_deref();
    let contents = foreign::contents(&arguments.log)?;
    let Some(out) = arguments.out.as_deref() else {
        // The list is what the document says.
        if !json.is_some_and(sinew_files::is_output) {
            let said = Said::beside([], arguments.quiet);
            said.line(listed(&contents).trim_end());
            let log = arguments.log.display();
            said.next(format!("sinew convert {log} --out recording.csv"));
        }
        return write(json, &document(&arguments.log, &contents, None));
    };
    let wanted = Wanted {
        columns: arguments.columns.clone(),
        base: arguments.base.clone(),
        join: match arguments.join {
            Rule::Last => Join::Last,
            Rule::Linear => Join::Linear,
        },
    };
    let recording = foreign::recording(&contents, &wanted, &arguments.log)?;
    recording.write(out)?;
    write(
        json,
        &document(&arguments.log, &contents, Some((&recording, out))),
    )?;
    let said = Said::beside([Some(out), json], arguments.quiet);
    for note in recording.notes() {
        said.line(note);
    }
    let names: Vec<&str> = (recording.columns().iter())
        .map(|column| column.name.as_str())
        .collect();
    said.line(format!("columns: t, {}", names.join(", ")));
    said.wrote(out);
    if !sinew_files::is_output(out) {
        said.next(format!("sinew check {}", out.display()));
    }
    Ok(())
}

fn write(path: Option<&Path>, document: &Value) -> Result<()> {
    match path {
        Some(path) => Ok(sinew_files::write(path, format!("{document:#}\n"))?),
        None => Ok(()),
    }
}

/// The contents and the recording that was made of them, `sinew-convert/1`.
fn document(log: &Path, contents: &Contents, made: Option<(&Recording, &Path)>) -> Value {
    let bases = bases(contents);
    let with_times = bases.iter().map(|base| {
        let signals = base.members.iter().map(|place| {
            let array = &contents.arrays[*place];
            json!({
                "path": array.path,
                "rows": array.rows,
                "columns": array.columns,
                "unit": array.unit,
                "names": columns(contents, array, base.t.len()),
            })
        });
        json!({
            "path": base.path,
            "rows": base.t.len(),
            "from_s": base.t.first(),
            "to_s": base.t.last(),
            "signals": signals.collect::<Vec<Value>>(),
        })
    });
    let placed = |place: usize| {
        let path = &contents.arrays[place].path;
        (bases.iter()).any(|base| {
            base.members.contains(&place) || base.path == *path || base.same.contains(path)
        })
    };
    let arrays = contents.arrays.iter().enumerate();
    let loose = arrays
        .filter(|(place, _)| !placed(*place))
        .map(|(_, it)| json!({ "path": it.path, "rows": it.rows, "columns": it.columns }));
    let others = contents.others.iter();
    let others = others.map(|it| json!({ "path": it.path, "what": it.what }));
    let notes = made.map_or(&contents.notes[..], |(recording, _)| recording.notes());
    json!({
        "format": "sinew-convert/1",
        "log": log.display().to_string(),
        "kind": contents.format.map(sinew_convert::Format::name),
        "bases": with_times.collect::<Vec<Value>>(),
        "without_times": loose.collect::<Vec<Value>>(),
        "others": others.collect::<Vec<Value>>(),
        "notes": notes,
        "recording": made.map(|(recording, out)| json!({
            "file": out.display().to_string(),
            "rows": recording.len(),
            "columns": (recording.columns().iter())
                .map(|column| column.name.as_str())
                .collect::<Vec<&str>>(),
        })),
    })
}

/// The contents by their times: paths, shapes, units and the columns that they become.
fn listed(contents: &Contents) -> String {
    let format = contents.format.map_or("", sinew_convert::Format::name);
    let mut text = format!("{format}\n");
    for note in &contents.notes {
        text += &format!("{note}\n");
    }
    let bases = bases(contents);
    for base in &bases {
        let rate = base.rate();
        let (first, last) = (base.t[0], base.t[base.t.len() - 1]);
        text += &format!(
            "\ntimes {} ({} rows{rate}, {first:?} to {last:?} s)\n",
            base.path,
            base.t.len()
        );
        for &place in &base.members {
            let array = &contents.arrays[place];
            let unit = match array.unit.as_str() {
                "" => String::new(),
                unit => format!(", {unit}"),
            };
            text += &format!(
                "  {}  {} x {}{unit}  -> {}\n",
                array.path,
                array.rows,
                array.columns,
                columns(contents, array, base.t.len()).join(", ")
            );
        }
    }
    let placed = |place: usize| {
        let path = &contents.arrays[place].path;
        (bases.iter()).any(|base| {
            base.members.contains(&place) || base.path == *path || base.same.contains(path)
        })
    };
    let arrays = contents.arrays.iter().enumerate();
    let loose = arrays.filter(|(place, _)| !placed(*place));
    let loose = loose.map(|(_, array)| {
        let value = match array.values[..] {
            [value] => format!(" = {value:?}"),
            _ => String::new(),
        };
        format!(
            "  {}  {} x {}{value}\n",
            array.path, array.rows, array.columns
        )
    });
    let others = contents.others.iter();
    let others = others.map(|other| format!("  {}  {}\n", other.path, other.what));
    let rest: String = loose.chain(others).collect();
    if !rest.is_empty() {
        text += &format!("\nwithout times\n{rest}");
    }
    text
}

/// `NAME=PATH`.
fn named(text: &str) -> Result<(String, String)> {
    match text.split_once('=') {
        Some((name, path)) if !name.is_empty() && !path.is_empty() => {
            Ok((name.to_owned(), path.to_owned()))
        }
        _ => Err(Error::arguments(
            "expected a name and a path, such as q_rad=log/q or u_V=log/u:2",
        )),
    }
}
