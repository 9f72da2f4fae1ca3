//! The terminal of a watched run: its state redrawn in place at the top, and below it the orders as
//! they are typed. The lines below scroll by themselves, so nothing that is drawn comes in the way
//! of what is typed.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write};

use console::Term;
use sinew_device::protocol::Telemetry;

use super::Names;
use super::topics::mode_text;

/// Columns that are used.
const WIDTH: usize = 79;
/// Events that are kept in sight.
const EVENTS: usize = 3;
/// Rows for orders, below the state.
const ORDERS: usize = 3;
/// Orders in one line.
const HELP: &str = "orders: arm, disarm, stop (or Return), r VALUES, limit LOW HIGH RATE ..., quit";

/// A place to show a run.
pub struct Screen {
    out: Box<dyn Write + Send>,
    /// Rows of a terminal; none where lines are appended.
    rows: Option<usize>,
    /// Rows of the state, once it is drawn.
    drawn: Option<usize>,
    events: VecDeque<String>,
}

impl Screen {
    /// Standard output: in place on a terminal, line after line elsewhere.
    pub fn output() -> Self {
        let rows = Term::stdout().size_checked().map(|(rows, _)| rows.into());
        let rows = rows.filter(|_| std::io::stdout().is_terminal());
        Self::on(Box::new(std::io::stdout()), rows)
    }

    fn on(out: Box<dyn Write + Send>, rows: Option<usize>) -> Self {
        Self {
            out,
            rows,
            drawn: None,
            events: VecDeque::new(),
        }
    }

    /// An event: among the last ones in place, or a line.
    pub fn say(&mut self, text: &str) {
        if self.drawn.is_none() {
            self.put(&format!("{text}\n"));
        }
        self.events.push_back(text.to_owned());
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
    }

    /// A line was typed: the next one is asked for.
    pub fn typed(&mut self) {
        if self.drawn.is_some() {
            self.put("> ");
        }
    }

    /// The state of the run.
    pub fn draw(
        &mut self,
        seen: &Telemetry,
        names: &Names,
        limits: &[[f64; 2]],
        learned: Option<&[f64]>,
        lost: u64,
    ) {
        let mut lines = state(seen, names, limits, learned, lost);
        let Some(rows) = self
            .rows
            .filter(|rows| lines.len() + EVENTS + 2 + ORDERS <= *rows)
        else {
            // No room, or no terminal.
            let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
            return self.put(&text);
        };
        let events = self.events.iter().cloned();
        lines.extend(events.chain(std::iter::repeat(String::new())).take(EVENTS));
        lines.push(HELP.into());
        lines.push("-".repeat(WIDTH));
        let mut text = String::new();
        if self.drawn != Some(lines.len()) {
            // The rows below scroll alone from now on.
            let first = lines.len() + 1;
            let _ = write!(text, "\x1b[2J\x1b[{first};{rows}r\x1b[{first};1H> ");
            self.drawn = Some(lines.len());
        }
        // The cursor stays with what is typed.
        text += "\x1b7";
        for (row, line) in lines.iter().enumerate() {
            let line: String = line.chars().take(WIDTH).collect();
            // Writing to a String cannot fail, here and above.
            let _ = write!(text, "\x1b[{};1H{line}\x1b[K", row + 1);
        }
        text += "\x1b8";
        self.put(&text);
    }

    fn put(&mut self, text: &str) {
        // A closed terminal ends the program by itself.
        let _ = self.out.write_all(text.as_bytes());
        let _ = self.out.flush();
    }
}

impl Drop for Screen {
    /// Gives the terminal its rows back.
    fn drop(&mut self) {
        if self.drawn.is_some() {
            self.put("\x1b7\x1b[r\x1b8\n");
        }
    }
}

/// Lines of a tick.
fn state(
    seen: &Telemetry,
    names: &Names,
    limits: &[[f64; 2]],
    learned: Option<&[f64]>,
    lost: u64,
) -> Vec<String> {
    let mut lines = vec![
        format!(
            "{:9.3} s  {}, {:?}",
            seen.at_us as f64 * 1e-6,
            mode_text(seen.state),
            seen.state.cause,
        ),
        format!(
            "{:?}, {} iterations, {} ticks, {} late, {} dropped, {lost} lost",
            seen.status, seen.iterations, seen.ticks, seen.deadline_misses, seen.dropped
        ),
        format!(
            "{:16}{:>14}{:>14}{:>14}{:>14}",
            "output", "reference", "measured", "estimate", "disturbance"
        ),
    ];
    let number = |value: f32| {
        if value.is_nan() {
            format!("{:>14}", "-")
        } else {
            format!("{value:14.4e}")
        }
    };
    let short = |name: &str| name.chars().take(15).collect::<String>();
    for (i, name) in names.outputs.iter().enumerate() {
        let at = |values: &[f32]| number(values.get(i).copied().unwrap_or(f32::NAN));
        lines.push(format!(
            "{:16}{}{}{}{}",
            short(name),
            at(&seen.reference),
            at(&seen.y),
            at(&seen.estimate),
            at(&seen.disturbance)
        ));
    }
    lines.push(format!(
        "{:16}{:>14}{:>14}{:>14}",
        "input", "command", "lower limit", "upper limit"
    ));
    for (i, (name, u)) in names.inputs.iter().zip(&seen.u).enumerate() {
        let [lower, upper] = limits.get(i).copied().unwrap_or([f64::NAN; 2]);
        let (u, lower, upper) = (number(*u), number(lower as f32), number(upper as f32));
        lines.push(format!("{:16}{u}{lower}{upper}", short(name)));
    }
    let learned = learned.unwrap_or_default().chunks_exact(2);
    for (parameter, values) in names.learned.parameters().iter().zip(learned) {
        let (value, deviation) = (values[0], values[1]);
        let name: String = parameter.name.chars().take(29).collect();
        lines.push(format!("{name:30}{value:14.4e} ± {deviation:9.2e}"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::monitor::tests::tick;
    use std::sync::{Arc, Mutex};

    /// A terminal of a few sequences: place, save, restore, clear, region.
    struct Terminal {
        cells: Vec<Vec<char>>,
        at: (usize, usize),
        saved: (usize, usize),
        region: (usize, usize),
    }

    impl Terminal {
        fn new(rows: usize, columns: usize) -> Self {
            Self {
                cells: vec![vec![' '; columns]; rows],
                at: (0, 0),
                saved: (0, 0),
                region: (0, rows - 1),
            }
        }

        fn line(&self, row: usize) -> String {
            let line: String = self.cells[row].iter().collect();
            line.trim_end().to_owned()
        }

        fn down(&mut self) {
            if self.at.0 == self.region.1 {
                let blank = vec![' '; self.cells[0].len()];
                self.cells.remove(self.region.0);
                self.cells.insert(self.region.1, blank);
            } else {
                self.at.0 += 1;
            }
        }

        fn feed(&mut self, text: &str) {
            let mut letters = text.chars();
            while let Some(letter) = letters.next() {
                match letter {
                    '\n' => {
                        self.down();
                        self.at.1 = 0;
                    }
                    '\x1b' => match letters.next() {
                        Some('7') => self.saved = self.at,
                        Some('8') => self.at = self.saved,
                        Some('[') => {
                            let mut numbers = String::new();
                            let end = loop {
                                match letters.next().expect("a sequence ends") {
                                    digit @ ('0'..='9' | ';') => numbers.push(digit),
                                    end => break end,
                                }
                            };
                            let of = |i: usize| {
                                let number = numbers.split(';').nth(i);
                                number.and_then(|n| n.parse::<usize>().ok())
                            };
                            match end {
                                'H' => self.at = (of(0).unwrap_or(1) - 1, of(1).unwrap_or(1) - 1),
                                'K' => {
                                    let (row, column) = self.at;
                                    self.cells[row][column..].fill(' ');
                                }
                                'J' => self.cells.iter_mut().for_each(|row| row.fill(' ')),
                                'r' => {
                                    let last = self.cells.len();
                                    self.region =
                                        (of(0).unwrap_or(1) - 1, of(1).unwrap_or(last) - 1);
                                    self.at = (0, 0);
                                }
                                other => panic!("CSI {other}"),
                            }
                        }
                        other => panic!("ESC {other:?}"),
                    },
                    letter => {
                        let (row, column) = self.at;
                        assert!(column < self.cells[0].len(), "a line is too long: {letter}");
                        self.cells[row][column] = letter;
                        self.at.1 += 1;
                    }
                }
            }
        }
    }

    #[derive(Clone, Default)]
    struct Pipe(Arc<Mutex<Vec<u8>>>);

    impl Write for Pipe {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().expect("one thread").extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Pipe {
        fn take(&self) -> String {
            let bytes = std::mem::take(&mut *self.0.lock().expect("one thread"));
            String::from_utf8(bytes).expect("text")
        }
    }

    #[test]
    fn what_is_typed_stays_where_it_is_while_the_state_is_redrawn_at_80_columns() {
        let long = "a_rather_long_name_of_a_column_rad".to_owned();
        let names = Names::for_test(vec!["u_V".into(), long.clone()], vec![long, "q_m".into()]);
        let pipe = Pipe::default();
        let mut screen = Screen::on(Box::new(pipe.clone()), Some(24));
        let mut terminal = Terminal::new(24, 80);
        let limits = [[-1.0, 1.0]; 2];
        let mut seen = tick(2);
        seen.deadline_misses = u32::MAX;
        seen.dropped = u32::MAX;
        seen.ticks = u32::MAX;
        screen.draw(&seen, &names, &limits, None, 0);
        terminal.feed(&pipe.take());
        let prompt = (0..24)
            .find(|row| terminal.line(*row) == ">")
            .expect("a prompt");
        assert!(terminal.line(prompt - 2).starts_with("orders: arm"));
        // The terminal echoes; meanwhile the state is drawn again and something happens.
        terminal.feed("r 0.");
        seen.at_us = 7_000_000;
        screen.say("disarmed: LinkLost");
        screen.draw(&seen, &names, &limits, None, 0);
        terminal.feed(&pipe.take());
        assert!(
            terminal.line(0).contains("7.000 s"),
            "{:?}",
            terminal.line(0)
        );
        assert_eq!(terminal.line(prompt), "> r 0.");
        assert!((0..prompt).any(|row| terminal.line(row) == "disarmed: LinkLost"));
        terminal.feed("5\n");
        screen.typed();
        // More orders than rows: the state above stays.
        for k in 0..30 {
            terminal.feed(&pipe.take());
            terminal.feed(&format!("r {k}\n"));
            screen.typed();
        }
        terminal.feed(&pipe.take());
        assert!(terminal.line(0).contains("7.000 s"));
        assert_eq!(terminal.line(22), "> r 29");
        drop(screen);
        terminal.feed(&pipe.take());
        assert_eq!(terminal.region, (0, 23));
    }

    #[test]
    fn a_low_terminal_and_a_pipe_get_lines_without_sequences() {
        let names = Names::for_test(vec!["u_V".into()], vec!["q_m".into()]);
        for rows in [None, Some(8)] {
            let pipe = Pipe::default();
            let mut screen = Screen::on(Box::new(pipe.clone()), rows);
            screen.draw(&tick(1), &names, &[[-1.0, 1.0]], None, 0);
            screen.typed();
            drop(screen);
            let text = pipe.take();
            assert!(text.contains("q_m") && !text.contains('\x1b'), "{text}");
        }
    }
}
