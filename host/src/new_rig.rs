//! `sinew new`: a first rig file from a recording's columns.
