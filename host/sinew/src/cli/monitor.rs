//! `sinew monitor`: watch and steer a board's own rig.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::Args;

use super::{LiveArguments, result};
use crate::live::monitor::{Outputs, Watched, is_mcap, monitor};
use crate::live::orders::lines;
use crate::live::screen::Screen;
use crate::live::serve::Server;
use crate::live::topics::Topics;
use sinew_ident::cli::interrupt::Interrupt;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::Result;

/// Port of `--serve`, the one that viewers try first.
const PORT: u16 = 8765;

/// Arguments of `sinew monitor`. While it runs, type: arm, disarm, stop (or Return: emergency
/// stop), r VALUES, limit LOWER UPPER RATE ..., quit.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew monitor --port /dev/ttyACM0 --model out/model --out run.csv\n  \
    sinew monitor --port /dev/ttyACM0 --model out/model --out run.mcap --serve\n  \
    sinew monitor --port /dev/ttyACM0 --model out/model --seconds 10 --quiet --json -")]
pub struct Arguments {
    #[command(flatten)]
    live: LiveArguments,
    /// File for what is seen: MCAP by the end of its name, otherwise CSV; `-` is standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Serve what is seen to Foxglove and PlotJuggler.
    ///
    /// A WebSocket at 127.0.0.1:8765, or at another port or address. Viewers steer nothing.
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        default_missing_value = "8765",
        value_parser = address
    )]
    serve: Option<SocketAddr>,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// File for losses and events as JSON (sinew-monitor/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    ///
    /// The state is not shown; events go to standard error.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A board that cannot be reached or is the wrong one; a file that cannot be written; an address
/// that is taken.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = arguments.out.as_deref();
    let json = arguments.json.as_deref();
    let none: [(&str, &std::path::Path); 0] = [];
    overwrite::refuse(none, [("--out", out), ("--json", json)])?;
    let writes = out.is_some() || arguments.serve.is_some();
    let names = arguments.live.names(writes)?;
    let said = Said::beside([out, json], arguments.quiet);
    let server = match arguments.serve {
        Some(address) => Some(Server::listen(address, &Topics::new(&names).all)?),
        None => None,
    };
    let (mut device, identity) = arguments.live.connect(&names)?;
    let mut screen = (!arguments.quiet && !said.is_aside()).then(Screen::output);
    if let Some(server) = &server {
        let line = format!("serving at ws://{}", server.address);
        match &mut screen {
            Some(screen) => screen.say(&line),
            None if !arguments.quiet => eprintln!("{line}"),
            None => {}
        }
    }
    let outputs = Outputs {
        file: arguments.out.clone(),
        server: server.as_ref(),
        screen,
    };
    let interrupt = Interrupt::saying("disarming and closing the files; Ctrl-C again ends at once");
    let watched = monitor(
        &mut device,
        &names,
        &identity,
        outputs,
        &lines(),
        arguments.seconds,
        &interrupt.stop,
    )?;
    let served = server.as_ref().map(|it| (it.address, it.served()));
    result::write(json, || watched.document(out, served))?;
    summary(said, &watched, served.map(|(_, served)| served.missed));
    if let Some(out) = out {
        said.wrote(out);
    }
    said.next(match out.filter(|out| !sinew_files::is_output(out)) {
        Some(out) if is_mcap(out) => format!("sinew convert {} --list", out.display()),
        Some(out) => format!("sinew check {}", out.display()),
        None => "sinew monitor --out run.csv, with the same flags, keeps what is seen".into(),
    });
    Ok(())
}

fn summary(said: Said, watched: &Watched, missed: Option<u64>) {
    let Watched { ticks, lost, .. } = watched;
    said.line(format!("{ticks} ticks seen, {lost} lost on the way"));
    if let Some(missed) = missed.filter(|missed| *missed > 0) {
        said.line(format!(
            "{missed} ticks left out for viewers that read too slowly"
        ));
    }
}

/// `PORT` of this computer alone, or `IP:PORT`.
fn address(text: &str) -> std::result::Result<SocketAddr, String> {
    if let Ok(port) = text.parse() {
        return Ok(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port));
    }
    let ip: std::result::Result<IpAddr, _> = text.parse();
    if let Ok(ip) = ip {
        return Ok(SocketAddr::new(ip, PORT));
    }
    (text.parse()).map_err(|_| "expected a port or an address, such as 8765 or 0.0.0.0:8765".into())
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse::<f64>().ok();
    let number = number.filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "expected a number of seconds above 0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        arguments: Arguments,
    }

    fn line(text: &str) -> Arguments {
        let words = std::iter::once("monitor").chain(text.split_whitespace());
        <Line as clap::Parser>::parse_from(words).arguments
    }

    #[test]
    fn a_watched_board_leaves_a_file_and_a_document() {
        let rig = sinew_sim::Rig::parse(crate::commission::tests::RIG, "rig.toml").unwrap();
        let setup = crate::commission::setup::Setup::new(rig, &[]).unwrap();
        let spec = setup.bare_model().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        sinew_model::store::save(&at("model"), &spec).unwrap();
        let period = std::time::Duration::from_millis(10);
        let read = |name: &str| std::fs::read(at(name)).unwrap();
        for (k, file) in ["run.csv", "run.mcap"].into_iter().enumerate() {
            let socket = at(&format!("port{k}"));
            crate::commission::simulated::listen(&spec, &setup.plant, &socket, period);
            let text = format!(
                "--port {} --model {} --out {} --json {} --seconds 1 --serve 0 --quiet",
                socket.display(),
                at("model").display(),
                at(file).display(),
                at("run.json").display()
            );
            run(&line(&text)).unwrap();
            let document: serde_json::Value = serde_json::from_slice(&read("run.json")).unwrap();
            let address = document["served"]["address"].as_str().unwrap();
            assert!(address.starts_with("127.0.0.1:"), "{document}");
            assert_eq!(document["lost"], 0, "{document}");
            assert_eq!(document["state"]["mode"], "disarmed", "{document}");
            let ticks = document["ticks"].as_u64().unwrap() as usize;
            assert!(ticks > 50, "{document}");
            let recording = sinew_ident::recording::Recording::read(at(file)).unwrap();
            assert_eq!(recording.len(), ticks, "{file}");
            let measured = recording.column("q2_rad").unwrap();
            assert!(measured.iter().all(|q| q.is_finite() && q.abs() < 0.1));
        }
        let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let port = taken.local_addr().unwrap().port();
        // Before anything is said to a board: there is none.
        let text = format!(
            "--port nowhere --model {} --serve {port}",
            at("model").display()
        );
        let error = run(&line(&text)).unwrap_err().to_string();
        assert!(error.contains("cannot listen at"), "{error}");
    }

    #[test]
    fn a_port_alone_is_served_to_this_computer_alone() {
        let of = |text: &str| address(text).map(|address| address.to_string());
        assert_eq!(of("8765").as_deref(), Ok("127.0.0.1:8765"));
        assert_eq!(of("0.0.0.0").as_deref(), Ok("0.0.0.0:8765"));
        assert_eq!(of("[::1]:99").as_deref(), Ok("[::1]:99"));
        for wrong in ["host:1", "70000", "", "-1", "1.2.3:4"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
        assert!(seconds("nan").is_err() && seconds("0").is_err() && seconds("0.5").is_ok());
    }
}
