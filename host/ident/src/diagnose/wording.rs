//! Quantities and shares in sentences.

use crate::report::significant;

/// A quantity in a sentence: `the sign of velocity`, `no quantity that was recorded`.
pub(crate) fn with_article(quantity: &str) -> String {
    if quantity.starts_with("no ") || quantity.starts_with("the ") {
        quantity.to_owned()
    } else {
        format!("the {quantity}")
    }
}

/// `83 %`; a share that is not nothing is never said to be, nor one that is not all.
pub(crate) fn share_of(share: f64) -> String {
    match 100.0 * share {
        percent if percent < 0.95 => format!("{} %", significant(percent, 1)),
        percent if percent > 99.5 && percent < 100.0 => "over 99 %".into(),
        percent => format!("{percent:.0} %"),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_share_is_never_rounded_to_nothing_or_to_all() {
        let said = [0.0, 0.0004, 0.17, 0.994, 0.9999, 1.0].map(super::share_of);
        assert_eq!(
            said,
            ["0 %", "0.04 %", "17 %", "99 %", "over 99 %", "100 %"]
        );
    }

    #[test]
    fn a_force_that_follows_nothing_does_not_follow_the_no_quantity() {
        let follows = super::with_article;
        assert_eq!(
            follows("no quantity that was recorded"),
            "no quantity that was recorded"
        );
        assert_eq!(follows("sign of velocity"), "the sign of velocity");
    }
}
