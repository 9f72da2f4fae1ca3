//! Names of columns from paths, and their units.

/// Last names that say nothing of a signal; the name before them does.
const GENERIC: [&str; 6] = ["data", "values", "value", "signals", "signal", "samples"];

/// Suffixes of columns by units as files write them.
const UNITS: [(&str, &[&str]); 22] = [
    ("m", &["m", "meter", "meters", "metre", "metres"]),
    ("mm", &["mm"]),
    ("cm", &["cm"]),
    ("um", &["um"]),
    ("rad", &["rad", "radian", "radians"]),
    ("mrad", &["mrad"]),
    ("deg", &["deg", "degree", "degrees", "°"]),
    ("m_s", &["m/s"]),
    ("mm_s", &["mm/s"]),
    ("rad_s", &["rad/s"]),
    ("deg_s", &["deg/s"]),
    ("rpm", &["rpm"]),
    ("N", &["n", "newton", "newtons"]),
    ("kN", &["kn"]),
    ("Nm", &["nm", "n m", "n*m", "n.m", "n·m"]),
    ("Nmm", &["nmm", "n mm", "n*mm"]),
    ("V", &["v", "volt", "volts"]),
    ("mV", &["mv"]),
    ("A", &["a", "ampere", "amperes", "amp", "amps"]),
    ("mA", &["ma"]),
    ("percent", &["percent", "%"]),
    ("degC", &["degc"]),
];

/// Suffix of a column in this unit; `None` for a unit that is not known.
pub fn suffix(unit: &str) -> Option<&'static str> {
    let unit = unit.trim();
    let lower = unit.to_lowercase();
    let found = UNITS
        .iter()
        .find(|(_, spellings)| spellings.contains(&lower.as_str()))?;
    Some(found.0)
}

/// Seconds in one of a unit of time, from the file's words or the end of a name.
pub fn seconds(unit: &str) -> Option<f64> {
    Some(match unit.trim().to_lowercase().as_str() {
        "s" | "sec" | "second" | "seconds" => 1.0,
        "ms" | "msec" | "millisecond" | "milliseconds" => 1e-3,
        "us" | "usec" | "microsecond" | "microseconds" => 1e-6,
        "ns" | "nsec" | "nanosecond" | "nanoseconds" => 1e-9,
        "min" | "minutes" => 60.0,
        _ => return None,
    })
}

/// Rank of a name among names of times, and its unit in seconds; `None`: it names no time.
pub fn time(name: &str) -> Option<(usize, f64)> {
    const NAMES: [&str; 7] = [
        "t",
        "time",
        "times",
        "timestamp",
        "timestamps",
        "tout",
        "stamp",
    ];
    let lower = name.to_lowercase();
    let (stem, scale) = match lower.rsplit_once('_') {
        Some((stem, unit)) => match seconds(unit) {
            Some(scale) => (stem, scale),
            None => (lower.as_str(), 1.0),
        },
        None => (lower.as_str(), 1.0),
    };
    let rank = NAMES.iter().position(|known| *known == stem)?;
    Some((rank, scale))
}

/// The last name of a path that says something, as a column may be called.
pub fn of_path(path: &str) -> String {
    let mut names = path.rsplit('/').filter(|name| !name.is_empty());
    let last = names.next().unwrap_or(path);
    let bare = |name: &str| {
        let name = name.split('[').next().unwrap_or(name);
        name.to_lowercase()
    };
    if !GENERIC.contains(&bare(last).as_str()) {
        return plain(last);
    }
    let telling = names.find(|name| !GENERIC.contains(&bare(name).as_str()));
    plain(telling.unwrap_or(last))
}

/// Letters, digits and underscores alone.
pub fn plain(name: &str) -> String {
    let mut plain = String::new();
    for character in name.chars() {
        if character.is_alphanumeric() {
            plain.push(character);
        } else if !plain.is_empty() && !plain.ends_with('_') {
            plain.push('_');
        }
    }
    let plain = plain.trim_end_matches('_');
    if plain.is_empty() {
        "x".into()
    } else {
        plain.into()
    }
}

/// A name with a unit at its end, unless it has one already.
pub fn with_unit(name: &str, unit: &str) -> String {
    let Some(suffix) = suffix(unit) else {
        return name.to_owned();
    };
    let has = UNITS.iter().any(|(known, _)| {
        name.strip_suffix(known)
            .is_some_and(|stem| stem.ends_with('_'))
    });
    if has {
        name.to_owned()
    } else {
        format!("{name}_{suffix}")
    }
}

/// A name with a number before its unit: `q_rad` and 2 are `q2_rad`.
pub fn numbered(name: &str, number: usize) -> String {
    let unit = UNITS.iter().map(|(suffix, _)| *suffix).filter(|suffix| {
        name.strip_suffix(suffix)
            .is_some_and(|stem| stem.ends_with('_') && stem.len() > 1)
    });
    match unit.max_by_key(|suffix| suffix.len()) {
        Some(suffix) => {
            let stem = &name[..name.len() - suffix.len() - 1];
            format!("{stem}{number}_{suffix}")
        }
        None => format!("{name}{number}"),
    }
}
