//! Progress on the terminal while work longer than a second goes on; silent when output is not a
//! terminal but for one line a stage.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// One stage of work, shown until it is dropped or finished.
pub struct Stage {
    bar: Option<ProgressBar>,
    title: String,
    began: Instant,
    quiet: bool,
}

impl Stage {
    /// Begins a stage; `quiet` shows nothing.
    pub fn begin(title: impl Into<String>, quiet: bool) -> Self {
        let title = title.into();
        let bar = (!quiet).then(|| {
            let bar = ProgressBar::new_spinner();
            // The template is a constant that indicatif accepts; a refusal would leave its default.
            if let Ok(style) =
                ProgressStyle::with_template("  {spinner} {prefix}  {msg} ({elapsed})")
            {
                bar.set_style(style);
            }
            bar.set_prefix(title.clone());
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        Self {
            bar,
            title,
            began: Instant::now(),
            quiet,
        }
    }

    /// Says how far it is.
    pub fn say(&self, message: impl Into<String>) {
        if let Some(bar) = &self.bar {
            bar.set_message(message.into());
        }
    }

    /// Says how far it is and how long it will take, from the share that is done.
    pub fn share(&self, done: usize, of: usize, what: &str) {
        let elapsed = self.began.elapsed().as_secs_f64();
        let left = elapsed * (of as f64 / done.max(1) as f64 - 1.0);
        self.say(format!("{done}/{of} {what}, about {left:.0} s left"));
    }

    /// Says what is being done and how much of it is, where nobody knows what comes after.
    pub fn count(&self, done: usize, of: usize, what: &str) {
        if of > 1 {
            self.say(format!("{what}, {done} of {of}"));
        } else {
            self.say(what);
        }
    }

    /// Ends the stage with its result.
    pub fn end(mut self, result: impl std::fmt::Display) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        if !self.quiet {
            super::colour::on_error(format!(
                "  {:<34} {result}  [{:.1} s]",
                self.title,
                self.began.elapsed().as_secs_f64()
            ));
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}
