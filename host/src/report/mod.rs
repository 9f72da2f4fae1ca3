//! Reports: one self-contained HTML file with plots, readable offline, in light and in dark.
