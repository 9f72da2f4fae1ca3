//! Explanations of the verdicts of a diagnosis.

use sinew_ident::diagnose::Verdict;

words! {
    Verdict:
    Consistent = "consistent":
        "The rig as written explains the recordings to within their noise. Nothing is missing \
         that these recordings could show.",
        "Use the rig. An effect that the recordings do not excite stays unseen: `sinew check \
         --rig` lists which.";
    Parameters = "parameters":
        "The rig explains the recordings once its free parameters are refitted. No physics is \
         missing.",
        "Write the refitted rig with --rig-out. A parameter without an interval is not \
         determined; look for it in the list.";
    MissingPhysics = "missing_physics":
        "The rig does not explain the recordings, and the named effects mend it on recordings \
         that chose nothing.",
        "Read confidence, rivals and `remainder`. Then write the corrected rig with --rig-out, \
         and confirm it with a new recording.";
    Unexplained = "unexplained":
        "The rig does not explain the recordings, and no effect of the vocabulary removes half \
         of the mismatch.",
        "Look at `location`: which component, and which quantity does the mismatch follow? Check \
         bare numbers, time stamps and unmeasured inputs, then record `next_experiment`.";
}
