//! Explanations of the words for what recordings say of a parameter, an effect or a number.

use sinew_ident::diagnose::WRONG_NUMBER;
use sinew_ident::excite::reveal::Visibility;

words! {
    Visibility:
    Determined = "determined":
        "The effect would change the signals by ten standard deviations of their noise or more, \
         beyond what the rig could imitate. A diagnosis would name it.",
        "Nothing: these recordings are enough for this effect.";
    Weakly = "weakly":
        "The effect would change the signals by three to ten standard deviations of their noise, \
         or no parameter of the rig is known beside it. A diagnosis could only guess.",
        "Record the motion that `sinew explain` names for the effect, or more of it.";
    NotDetermined = "not_determined":
        "The recordings do not show the effect or the parameter. Such a parameter stays as the rig \
         says.",
        "Record the motion that shows it; `sinew excite` designs an experiment. Or measure the \
         parameter and write it as a bare number.";
}

/// Words that no type of the library lists.
pub(super) const OTHERS: &[(&str, &str, &str)] = &[(
    WRONG_NUMBER,
    "A bare number of the rig may be wrong: another value explains the recordings as an effect \
     does. Its full name stands as the component.",
    "Write the number as { value = ... } and fit again.",
)];
