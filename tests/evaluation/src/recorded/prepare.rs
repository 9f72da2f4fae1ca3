//! Preparation of a recording before it is diagnosed; every line that stays keeps its digits.

/// Selection from a recording.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// All of it, as it is.
    Whole,
    /// The first 60 % of its rows.
    Early,
    /// The rest.
    Late,
    /// The rows of the first 3.8 s: a swing-up, before the device is held at an unstable rest.
    SwingUp,
    /// All rows; the angle is missing where the servo's torque was off, since a motor without
    /// current is another device (its back-EMF does not brake).
    Powered,
}

impl Part {
    /// End of a prepared copy's name.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Whole => ".csv",
            Self::Early => "-early.csv",
            Self::Late => "-late.csv",
            Self::SwingUp => "-swing-up.csv",
            Self::Powered => "-powered.csv",
        }
    }
}

/// The prepared text; `None` where the recording is taken as it is.
pub fn prepare(text: &str, part: Part) -> Option<String> {
    let mut lines = text.lines();
    let header = lines.next()?;
    let rows: Vec<&str> = lines.collect();
    let cut = rows.len() * 6 / 10;
    let kept: Vec<String> = match part {
        Part::Whole => return None,
        Part::Early => rows[..cut].iter().map(|row| (*row).to_owned()).collect(),
        Part::Late => rows[cut..].iter().map(|row| (*row).to_owned()).collect(),
        Part::SwingUp => {
            let early = |row: &&&str| {
                let t = row
                    .split(',')
                    .next()
                    .and_then(|t| t.trim().parse::<f64>().ok());
                t.is_some_and(|t| t < 3.8)
            };
            rows.iter()
                .filter(early)
                .map(|row| (*row).to_owned())
                .collect()
        }
        Part::Powered => {
            let at = |name: &str| header.split(',').position(|column| column == name);
            let (angle, torque) = (at("q_rad")?, at("torque_on")?);
            rows.iter().map(|row| powered(row, angle, torque)).collect()
        }
    };
    Some(format!("{header}\n{}\n", kept.join("\n")))
}

fn powered(row: &str, angle: usize, torque: usize) -> String {
    let mut fields: Vec<&str> = row.split(',').collect();
    if fields.get(torque).is_some_and(|on| on.trim() != "1") {
        fields[angle] = "";
    }
    fields.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_split_by_time_and_none_is_lost() {
        let text = "t,q\n0,1\n1,2\n2,3\n3,4\n4,5\n";
        assert_eq!(prepare(text, Part::Whole), None);
        assert_eq!(
            prepare(text, Part::Early).as_deref(),
            Some("t,q\n0,1\n1,2\n2,3\n")
        );
        assert_eq!(
            prepare(text, Part::Late).as_deref(),
            Some("t,q\n3,4\n4,5\n")
        );
    }

    #[test]
    fn a_swing_up_ends_where_the_device_is_held() {
        let text = "t,q\n0,1\n3.795,2\n3.8,3\n4,4\n";
        let expected = "t,q\n0,1\n3.795,2\n";
        assert_eq!(prepare(text, Part::SwingUp).as_deref(), Some(expected));
    }

    #[test]
    fn an_angle_without_torque_is_missing() {
        let text = "t,q_rad,pwm_percent,torque_on\n0,0.5,3,1\n1,0.6,0,0\n";
        let expected = "t,q_rad,pwm_percent,torque_on\n0,0.5,3,1\n1,,0,0\n";
        assert_eq!(prepare(text, Part::Powered).as_deref(), Some(expected));
    }
}
