//! Questions to a person in a terminal.

use std::io::BufRead;

use sinew_ident::error::{Error, Result};
use sinew_prefer::{Answer, Belief, Candidates, Choice, Winner, next};

/// End of a session.
#[derive(Clone, Debug)]
pub struct Asked {
    /// Answers of this person, those of earlier sessions first.
    pub answers: Vec<Answer>,
    /// The candidate that is preferred.
    pub winner: Winner,
    /// No further question was worth asking.
    pub settled: bool,
}

/// Asks up to `most` questions. `show` gets the pair before it is asked about, `told` every answer
/// with the winner after it. An end of the input or `q` ends the session.
///
/// # Errors
/// An input that cannot be read, or what `show` and `told` meet.
pub fn ask(
    candidates: &Candidates,
    mut answers: Vec<Answer>,
    (most, seed): (usize, u64),
    input: &mut dyn BufRead,
    show: &mut dyn FnMut(usize, usize, usize) -> Result<()>,
    told: &mut dyn FnMut(Answer, Winner) -> Result<()>,
) -> Result<Asked> {
    let learned = |answers: &[Answer]| {
        let seed = seed.wrapping_add(answers.len() as u64);
        Belief::after(candidates, answers, seed).map_err(|e| Error::failed(e.to_string()))
    };
    let mut belief = learned(&answers)?;
    let mut settled = false;
    for number in 1..=most {
        let question = next(&belief, &answers);
        let Some(question) = question.filter(|q| number == 1 || q.is_worth_asking()) else {
            settled = true;
            break;
        };
        show(number, question.first, question.second)?;
        let Some(choice) = choice(input)? else {
            break;
        };
        let answer = Answer {
            first: question.first,
            second: question.second,
            choice,
        };
        answers.push(answer);
        belief = learned(&answers)?;
        told(answer, belief.winner())?;
    }
    Ok(Asked {
        winner: belief.winner(),
        answers,
        settled,
    })
}

/// The next answer; `None` at the end.
fn choice(input: &mut dyn BufRead) -> Result<Option<Choice>> {
    loop {
        let mut line = String::new();
        let read = input.read_line(&mut line);
        let read = read.map_err(|e| Error::failed(format!("no answer can be read: {e}")))?;
        match line.trim().to_lowercase().as_str() {
            "a" => return Ok(Some(Choice::First)),
            "b" => return Ok(Some(Choice::Second)),
            "=" | "alike" => return Ok(Some(Choice::Alike)),
            "q" => return Ok(None),
            _ if read == 0 => return Ok(None),
            other => eprintln!("`{other}`: expected a, b, = (alike) or q (enough)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops() -> Candidates {
        let rows: Vec<Vec<f64>> = (0..12)
            .map(|i| vec![1.0 + f64::from(i), 12.0 / (1.0 + f64::from(i))])
            .collect();
        Candidates::new(&rows).unwrap()
    }

    fn session(text: &str, most: usize) -> (Asked, usize) {
        let mut shown = 0;
        let mut show = |_, _, _| {
            shown += 1;
            Ok(())
        };
        let asked = ask(
            &loops(),
            Vec::new(),
            (most, 1),
            &mut text.as_bytes(),
            &mut show,
            &mut |_, _| Ok(()),
        );
        (asked.unwrap(), shown)
    }

    #[test]
    fn words_that_are_no_answer_are_asked_again() {
        let (asked, shown) = session("left\n\nA\n=\nq\nb\n", 10);
        let choices: Vec<Choice> = asked.answers.iter().map(|a| a.choice).collect();
        assert_eq!(choices, [Choice::First, Choice::Alike]);
        assert_eq!(shown, 3);
        assert!(!asked.settled);
    }

    #[test]
    fn an_end_of_the_input_ends_the_session() {
        let (asked, shown) = session("", 10);
        assert_eq!((asked.answers.len(), shown), (0, 1));
    }

    #[test]
    fn questions_end_where_no_answer_would_change_the_winner() {
        // Always the first of the two, whatever it is: the counts are what is tested.
        let (asked, shown) = session(&"a\n".repeat(200), 200);
        assert!(asked.settled);
        assert_eq!(shown, asked.answers.len());
        assert!(shown < 40, "{shown} questions of 66 pairs");
    }
}
