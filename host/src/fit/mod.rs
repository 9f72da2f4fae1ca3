//! Identification: the rig's free parameters from recordings (docs/identification.md).
