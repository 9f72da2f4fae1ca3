//! Suggestions for a misspelt name or file.

use std::path::Path;

/// The candidate nearest to `word`, if near enough to be a slip of the fingers.
///
/// Near, case aside: Damerau-Levenshtein distance at most a third of the longer word (at least
/// one), or the beginning of it (three letters at least).
///
/// ```
/// # use sinew_sim::suggest::nearest;
/// assert_eq!(nearest("q_mm", ["q_m", "u_V"]), Some("q_m"));
/// assert_eq!(nearest("force", ["q_m", "u_V"]), None);
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| {
            let distance =
                strsim::damerau_levenshtein(&word.to_lowercase(), &candidate.to_lowercase());
            (distance, candidate)
        })
        .filter(|&(distance, candidate)| {
            let longer = word.chars().count().max(candidate.chars().count());
            let begins = word.len() >= 3 && candidate.starts_with(word);
            begins || distance <= (longer / 3).max(1)
        })
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// The help line of a file that is not there, from the other files of its folder.
pub fn nearest_file(path: &Path) -> Option<String> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Some(format!("there is no folder {}", folder.display()));
    };
    let names: Vec<String> = (entries.flatten())
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    let meant = nearest(
        path.file_name()?.to_str()?,
        names.iter().map(String::as_str),
    )?;
    let meant = path.with_file_name(meant);
    Some(format!("did you mean {}?", meant.display()))
}

/// The help line of an unknown name: the nearest one if there is one, and the list of all.
pub(crate) fn help(word: &str, what: &str, candidates: &[&str]) -> String {
    let list = if candidates.is_empty() {
        format!("there is no {what}")
    } else {
        format!("{what}: {}", candidates.join(", "))
    };
    match nearest(word, candidates.iter().copied()) {
        Some(name) => format!("did you mean `{name}`? {list}"),
        None => list,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_mended_and_a_stranger_is_not() {
        let names = ["stiffness", "damping", "inertia"];
        assert_eq!(nearest("stifness", names), Some("stiffness"));
        assert_eq!(nearest("Damping", names), Some("damping"));
        assert_eq!(nearest("stiff", names), Some("stiffness"));
        assert_eq!(nearest("voltage", names), None);
    }

    #[test]
    fn the_nearest_of_two_near_ones_wins() {
        assert_eq!(nearest("load", ["lead", "load2", "road2"]), Some("lead"));
    }
}
